#!/usr/bin/env python3
"""Motions that do not reach their target: refused, stopped, ended by a limit, by lost steps, by a link or a daemon that is gone."""

import unittest

from bench import Bench, is_nan
from bushd_epics import events
from bushd_epics.events import End


def under_way(bench, to=20.0):
    token = bench.put("VAL", to)
    ask = bench.ask(events.Move)
    bench.accept(ask)
    bench.at(to / 4, moving=True, busy=True)
    return token, ask


class Failures(unittest.TestCase):
    def test_a_refused_move_fails_as_a_put_and_at_dmov(self):
        bench = Bench()
        token = bench.put("VAL", 5.0)
        bench.refuse(bench.ask(events.Move), "theta: it is held")
        self.assertEqual(bench.answers, {token: "theta: it is held"})
        self.assertEqual((bench["VAL"], bench.severity, bench["AMSG"]), (0.0, "MAJOR", "theta: it is held"))
        self.assertEqual(bench.order("DMOV", "RBV")[-3:], [("RBV", 0.0), ("DMOV", 1), "answer"])

    def test_an_end_short_of_the_target_leaves_rbv_in_alarm_before_dmov_rises(self):
        for outcome, status in ((End.STOPPED, "STATE"), (End.LIMIT, "HWLIMIT"), (End.FAULT, "STATE")):
            with self.subTest(outcome=outcome):
                bench = Bench()
                token, ask = under_way(bench)
                limits = {"plus_limit": outcome == End.LIMIT}
                bench.at(9.0, **limits)
                bench.end(ask, outcome, "the reason")
                self.assertEqual((bench.answers[token], bench["VAL"], bench["STAT"]), ("the reason", 9.0, status))
                told = bench.order("DMOV", "RBV", "HLS", "TDIR")
                self.assertEqual(told[-4:], [("alarm", "MAJOR"), ("RBV", 9.0), ("DMOV", 1), "answer"])
                self.assertLess(told.index(("TDIR", 1)), told.index(("DMOV", 1)))
                if outcome == End.LIMIT:
                    self.assertLess(told.index(("HLS", 1)), told.index(("DMOV", 1)))
                self.assertEqual(bool(bench["MSTA"] & 1 << 6), outcome == End.FAULT)
                bench.hear()
                under_way(bench, 10.0)
                self.assertEqual((bench.severity, bench["MSTA"] & (1 << 6 | 1 << 9)), ("NO_ALARM", 0))

    def test_a_stop_at_rest_is_nothing(self):
        bench = Bench()
        before = dict(bench.record.values)
        token = bench.put("STOP", 1)
        self.assertEqual((bench.asks(), bench.severity, bench.answers), ([], "NO_ALARM", {token: ""}))
        self.assertEqual([event for event in bench.hear() if isinstance(event, events.Post)], [])
        self.assertEqual(bench.record.values, before)

    def test_a_stop_on_the_way_asks_the_daemon_once(self):
        bench = Bench()
        under_way(bench)
        bench.put("STOP", 1)
        bench.ask(events.Stop)
        self.assertTrue(bench["MIP"] & 0x200)

    def test_a_stop_is_answered_when_the_daemon_has_answered(self):
        for field, value in (("STOP", 1), ("SPMG", 0)):
            with self.subTest(field=field):
                bench = Bench()
                under_way(bench)
                token = bench.put(field, value)
                stop = bench.ask(events.Stop)
                self.assertNotIn(token, bench.answers)
                bench.end(stop, End.REACHED)
                self.assertEqual(bench.answers[token], "")
                token = bench.put(field, value)
                bench.refuse(bench.ask(events.Stop), "no control socket")
                self.assertEqual(bench.answers[token], "no control socket")

    def test_a_stop_that_nobody_hears_has_failed_at_once(self):
        bench = Bench()
        _, ask = under_way(bench)
        bench.silent("bushd has ended")
        token = bench.put("STOP", 1)
        bench.ask(events.Stop)
        self.assertEqual(bench.answers[token], "bushd has ended")
        bench.lose(ask, "bushd has ended")
        token = bench.put("STOP", 1)
        bench.ask(events.Stop)
        self.assertEqual(bench.answers[token], "bushd has ended")


class Links(unittest.TestCase):
    def test_a_link_that_is_lost_fails_the_put_at_once_and_dmov_waits_for_the_motor(self):
        bench = Bench()
        token, ask = under_way(bench)
        bench.at(5.0, live=False, moving=False)
        bench.end(ask, End.LINK, "the link is lost")
        self.assertEqual((bench.answers[token], bench["DMOV"], bench.severity), ("the link is lost", 0, "INVALID"))
        bench.at(6.0, moving=True, busy=True)
        self.assertEqual(bench["DMOV"], 0)
        bench.at(7.0)
        self.assertEqual((bench.values("DMOV"), bench["VAL"], bench.severity), ([0, 1], 7.0, "MAJOR"))

    def test_a_motor_that_is_not_heard_again_is_done_when_it_must_stand(self):
        bench = Bench()
        _, ask = under_way(bench)
        bench.lose(ask, "the daemon has ended")
        bench.silent("the daemon has ended")
        bench.wait(3.39)
        self.assertEqual(bench["DMOV"], 0)
        bench.wait(0.02)  # 3 s and twice its ramp
        self.assertEqual((bench.values("DMOV"), bench.severity), ([0, 1], "INVALID"))

    def test_silence_at_rest_makes_no_edge(self):
        bench = Bench()
        bench.silent("bushd has ended")
        self.assertEqual((bench.severity, bench["AMSG"], bench.values("DMOV")), ("INVALID", "bushd has ended", []))
        self.assertTrue(bench["MSTA"] & 1 << 12)
        bench.at(0.0)
        self.assertEqual((bench.severity, bench.values("DMOV"), bench["MSTA"] & 1 << 12), ("NO_ALARM", [], 0))

    def test_a_put_while_nobody_is_there_fails_with_an_edge(self):
        bench = Bench()
        bench.silent("bushd has ended")
        token = bench.put("VAL", 3.0)
        self.assertEqual((bench.asks(), bench.answers[token]), ([], "bushd has ended"))
        self.assertEqual((bench.values("DMOV"), bench.severity), ([0, 1], "INVALID"))
        for field in ("JOGF", "HOMF"):
            token = bench.put(field, 1)
            self.assertEqual((bench.asks(), bench.answers[token]), ([], "bushd has ended"))

    def test_a_motor_that_is_seen_moving_after_a_loss_is_not_done_at_the_deadline(self):
        bench = Bench()
        token, ask = under_way(bench)
        bench.lose(ask, "the connection has ended")
        bench.at(6.0, moving=True, busy=True)
        bench.wait(60)
        self.assertEqual((bench["DMOV"], bench["MIP"], bench.answers[token]), (0, 0x8000, "the connection has ended"))
        bench.at(20.0)
        self.assertEqual((bench.values("DMOV"), bench.severity, bench["STAT"]), ([0, 1], "MAJOR", "COMM"))

    def test_it_is_not_done_where_the_last_state_says_that_it_moves(self):
        bench = Bench()
        _, ask = under_way(bench)
        bench.lose(ask, "the connection has ended")
        bench.wait(60)
        self.assertEqual(bench["DMOV"], 0)
        bench.at(20.0)
        self.assertEqual(bench.values("DMOV"), [0, 1])


class Trust(unittest.TestCase):
    def test_a_position_that_nobody_knows_is_no_number(self):
        bench = Bench()
        bench.see(user=None, dial=None, steps=None, live=False)
        self.assertTrue(is_nan(bench["RBV"]) and is_nan(bench["DRBV"]))
        self.assertEqual((bench["UDF"], bench["STAT"], bench.severity), (1, "UDF", "INVALID"))

    def test_a_stale_one_is_invalid_and_an_uncertain_one_major_with_the_reason(self):
        bench = Bench()
        bench.at(3.0, live=False)
        self.assertEqual((bench["RBV"], bench["STAT"], bench.severity), (3.0, "COMM", "INVALID"))
        bench.at(3.0, uncertain="MCU hall:1 restarted while it moved")
        self.assertEqual(bench.severity, "MAJOR")
        self.assertIn("restarted while it moved", bench["AMSG"])
        self.assertEqual(bench["MSTA"] & 1 << 14, 0)


if __name__ == "__main__":
    unittest.main()
