#!/usr/bin/env python3
"""Moves of a motor record: DMOV falls and rises once, and what is told before it rises."""

import unittest

from bench import Bench
from bushd_epics import events
from bushd_epics.deferred import Deferred
from bushd_epics.events import End
from bushd_epics.scale import Scale


class Edges(unittest.TestCase):
    def move(self, bench, to, field="VAL", value=None):
        token = bench.put(field, to if value is None else value)
        ask = bench.ask(events.Move)
        bench.accept(ask)
        bench.at(to / 2, moving=True, busy=True)
        bench.at(to)
        bench.end(ask, End.REACHED)
        return token, ask

    def test_a_move_makes_dmov_fall_and_rise_once(self):
        bench = Bench()
        token, ask = self.move(bench, 2.0)
        self.assertEqual((ask.to, ask.speed, ask.who), (2.0, None, "me:pc"))
        self.assertEqual(bench.values("DMOV"), [0, 1])
        self.assertEqual(bench.answers, {token: ""})

    def test_dmov_falls_before_all_else_and_the_answer_comes_last(self):
        bench = Bench()
        self.move(bench, 2.0)
        told = bench.order("DMOV", "RBV", "VAL", "TDIR", "HLS")
        self.assertEqual(told[0], ("DMOV", 0))
        self.assertEqual(told[-2:], [("DMOV", 1), "answer"])
        self.assertEqual([one for one in told if one[0] == "RBV"][-1], ("RBV", 2.0))

    def test_each_field_that_tells_a_target_makes_it_fall_also_for_where_it_stands(self):
        for field, value, to in (
            ("VAL", 0.0, 0.0), ("DVAL", 0.0, 0.0), ("RVAL", 0, 0.0), ("RLV", 0.0, 0.0), ("VAL", 3.0, 3.0), ("DVAL", 3.0, 3.0),
            ("RVAL", 300, 3.0), ("RLV", 3.0, 3.0), ("TWF", 1, 1.0), ("TWR", 1, -1.0),
        ):  # fmt: skip
            with self.subTest(field=field, value=value):
                bench = Bench()
                bench.put(field, value)
                self.assertEqual(bench.values("DMOV"), [0])
                ask = bench.ask(events.Move)
                self.assertAlmostEqual(ask.to, to)
                bench.accept(ask)
                bench.at(to)
                bench.end(ask, End.REACHED)
                self.assertEqual(bench.values("DMOV"), [0, 1])
                self.assertEqual([bench["RLV"], bench["TWF"], bench["TWR"]], [0, 0, 0])

    def test_a_field_that_nobody_looks_at_is_right_and_not_told(self):
        bench = Bench()
        bench.record.shown = {"RBV", "DMOV"}
        self.move(bench, 2.0)
        self.assertEqual({event.field for event in bench.said if isinstance(event, events.Post)}, {"RBV", "DMOV"})
        self.assertEqual((bench["RRBV"], bench["DRBV"], bench["VAL"]), (200, 2.0, 2.0))

    def test_the_user_scale_may_run_against_the_dial(self):
        scale = Scale(0.01, negative=True, offset=10.0)
        bench = Bench(scale=scale, user=10.0, dial=0.0, plus_limit=True, low=-40.0, high=60.0)
        self.assertEqual((bench["DIR"], bench["HLS"], bench["LLS"], bench["RHLS"]), (1, 0, 1, 1))
        self.assertEqual((bench["DLLM"], bench["DHLM"]), (-50.0, 50.0))
        bench.put("DVAL", -2.0)
        self.assertEqual(bench.ask(events.Move).to, 12.0)
        self.assertEqual((bench["VAL"], bench["RVAL"], bench["TDIR"], bench["MSTA"] & 1), (12.0, -200, 1, 0))

    def test_a_new_target_on_the_way_is_one_move_with_one_rise(self):
        bench = Bench()
        first = bench.put("VAL", 20.0)
        one = bench.ask(events.Move)
        bench.accept(one)
        bench.at(4.0, moving=True, busy=True)
        second = bench.put("VAL", -3.0)
        two = bench.ask(events.Move)
        bench.end(one, End.STOPPED, "given a new target")
        self.assertIn("new target", bench.answers[first])
        bench.accept(two)
        bench.at(-3.0)
        bench.end(two, End.REACHED)
        self.assertEqual(bench.values("DMOV"), [0, 1])
        self.assertEqual((bench.answers[second], bench.severity), ("", "NO_ALARM"))

    def test_a_new_target_that_is_refused_leaves_the_move_as_it_is(self):
        bench = Bench()
        first = bench.put("VAL", 20.0)
        one = bench.ask(events.Move)
        bench.accept(one)
        bench.at(4.0, moving=True, busy=True)
        second = bench.put("VAL", 70.0)
        bench.refuse(bench.ask(events.Move), "beyond its soft limit")
        self.assertEqual((bench.answers, bench["VAL"], bench["DMOV"], bench.severity), ({second: "beyond its soft limit"}, 20.0, 0, "NO_ALARM"))
        bench.at(20.0)
        bench.end(one, End.REACHED)
        self.assertEqual((bench.values("DMOV"), bench.answers[first]), ([0, 1], ""))

    def test_a_state_from_before_the_end_is_not_shown_after_it(self):
        bench = Bench()
        self.move(bench, 2.0)
        bench.at(1.9, moving=True, busy=True)
        self.assertEqual((bench["RBV"], bench.values("DMOV")), (2.0, [0, 1]))
        bench.at(2.0)
        bench.at(2.1, moving=True, busy=True)  # now somebody else moves it
        self.assertEqual((bench["RBV"], bench["DMOV"]), (2.1, 0))

    def test_a_move_of_others_is_shown_and_its_end_is_no_failure(self):
        bench = Bench()
        bench.at(3.0, moving=True, busy=True)
        self.assertEqual((bench["DMOV"], bench["MIP"], bench["MOVN"]), (0, 0x8000, 1))
        bench.at(5.0)
        self.assertEqual((bench.values("DMOV"), bench["VAL"], bench.severity), ([0, 1], 5.0, "NO_ALARM"))

    def test_no_number_no_move(self):
        bench = Bench()
        for value in (float("nan"), float("inf")):
            token = bench.put("VAL", value)
            self.assertEqual(bench.asks(), [])
            self.assertNotEqual(bench.answers[token], "")


class Delay(unittest.TestCase):
    def begin(self, bench):
        bench.put("DLY", 2.0)
        token = bench.put("VAL", 1.0)
        ask = bench.ask(events.Move)
        bench.accept(ask)
        bench.at(1.0)
        bench.end(ask, End.REACHED)
        return token

    def test_dmov_rises_when_the_motor_has_settled(self):
        bench = Bench()
        token = self.begin(bench)
        bench.wait(1.99)
        self.assertEqual((bench["DMOV"], token in bench.answers), (0, False))
        bench.wait(0.02)
        self.assertEqual((bench.values("DMOV"), bench.answers[token]), ([0, 1], ""))

    def test_stop_ends_the_delay(self):
        bench = Bench()
        token = self.begin(bench)
        bench.put("STOP", 1)
        self.assertEqual((bench.values("DMOV"), bench.answers[token], bench.severity), ([0, 1], "", "NO_ALARM"))
        bench.wait(5)
        self.assertEqual(bench.values("DMOV"), [0, 1])

    def test_a_move_of_others_in_the_delay_keeps_dmov_at_0(self):
        bench = Bench()
        token = self.begin(bench)
        bench.at(1.5, moving=True, busy=True)
        bench.wait(5)
        self.assertEqual((bench["DMOV"], bench["MIP"], bench.answers[token]), (0, 0x8000, ""))
        bench.at(4.0)
        self.assertEqual((bench.values("DMOV"), bench["VAL"], bench.severity), ([0, 1], 4.0, "NO_ALARM"))


class DeferredMoves(unittest.TestCase):
    def gather(self, *places):
        deferred, benches = Deferred(), []
        for number, (to, velo) in enumerate(places):
            bench = Bench()
            bench.put("VELO", velo)
            token = bench.put("VAL", to, circuit=f"client {number}")
            ask = bench.ask(events.Move)
            self.assertIsNone(deferred.take(bench.record, ask))
            benches.append((bench, token, ask))
        return deferred, benches

    def test_those_of_one_speed_are_one_request(self):
        deferred, (one, two, three) = self.gather((2.0, 25.0), (3.0, 4.0), (4.0, 25.0))
        groups = [[ask for _, ask in group] for group in deferred.let_go()]
        self.assertEqual(groups, [[one[2], three[2]], [two[2]]])
        self.assertEqual(deferred.let_go(), [])

    def test_a_target_is_dropped_with_its_client_in_silence_and_by_a_stop(self):
        for what in (
            lambda bench: bench.gone("client 0"),
            lambda bench: bench.silent("bushd has ended"),
            lambda bench: bench.put("STOP", 1),
            lambda bench: bench.put("SPMG", 0),
        ):
            deferred, ((bench, token, _), (_, _, other)) = self.gather((2.0, 25.0), (3.0, 25.0))
            bench.gone("client 1")
            self.assertEqual(bench["DMOV"], 0)
            what(bench)
            self.assertEqual((bench.asks(), bench.values("DMOV"), bench["VAL"]), ([], [0, 1], 0.0))
            self.assertNotEqual(bench.answers[token], "")
            self.assertEqual([[ask for _, ask in group] for group in deferred.let_go()], [[other]])

    def test_once_let_go_it_outlives_its_client(self):
        deferred, ((bench, _, _),) = self.gather((2.0, 25.0))
        deferred.let_go()
        bench.gone("client 0")
        self.assertEqual((bench["DMOV"], bench.asks()), (0, []))


class Backlash(unittest.TestCase):
    def legs(self, start, to, backlash=0.5):
        """Where the motor is sent, one after the other."""
        bench = Bench(user=start, dial=start, steps=round(start * 100))
        bench.put("BDST", backlash)
        bench.put("BVEL", 2.0)
        bench.put("VAL", to)
        went = []
        while asked := bench.asks():
            (ask,) = asked
            went.append((round(ask.to, 9), ask.speed))
            self.assertEqual(bench["DMOV"], 0)
            bench.accept(ask)
            bench.at(ask.to)
            bench.end(ask, End.REACHED)
        self.assertEqual(bench.values("DMOV"), [0, 1])
        return went

    def test_against_its_sign_or_farther_than_it_the_approach_is_a_leg_of_its_own(self):
        self.assertEqual(self.legs(0.0, -3.0), [(-3.5, None), (-3.0, 2.0)])
        self.assertEqual(self.legs(0.0, 3.0), [(2.5, None), (3.0, 2.0)])
        self.assertEqual(self.legs(0.0, 3.0, backlash=-0.5), [(3.5, None), (3.0, 2.0)])

    def test_a_short_way_with_its_sign_is_straight(self):
        self.assertEqual(self.legs(0.0, 0.3), [(0.3, 2.0)])

    def test_a_start_of_the_approach_beyond_the_limits_is_refused(self):
        bench = Bench()
        bench.put("BDST", 0.5)
        token = bench.put("VAL", -49.8)
        self.assertEqual((bench.asks(), bench["LVIO"], bench.severity), ([], 1, "MAJOR"))
        self.assertIn("-50.3", bench.answers[token])

    def test_after_a_stop_it_is_made_up_for_and_the_move_has_failed_nevertheless(self):
        bench, token, move = self.against()
        bench.put("STOP", 1)
        bench.end(bench.ask(events.Stop), End.REACHED)
        bench.at(-10.0)
        bench.end(move, End.STOPPED, "stopped on request")
        went = []
        for _ in range(2):
            leg = bench.ask(events.Move)
            went.append(leg.to)
            bench.accept(leg)
            bench.at(leg.to)
            self.assertEqual((bench["DMOV"], token in bench.answers), (0, False))
            bench.end(leg, End.REACHED)
        self.assertEqual(went, [-10.5, -10.0])
        self.assertEqual((bench.values("DMOV"), bench.answers[token], bench.severity), ([0, 1], "stopped on request", "MAJOR"))

    def test_a_stop_on_the_side_of_the_approach_needs_nothing(self):
        bench = Bench()
        bench.put("BDST", 0.5)
        bench.put("VAL", 30.0)
        move = bench.ask(events.Move)
        bench.accept(move)
        bench.put("STOP", 1)
        bench.asks()
        bench.at(10.0)
        bench.end(move, End.STOPPED, "stopped on request")
        self.assertEqual((bench.asks(), bench["DMOV"]), ([], 1))

    def against(self):
        bench = Bench()
        bench.put("BDST", 0.5)
        token = bench.put("VAL", -30.0)
        move = bench.ask(events.Move)
        bench.accept(move)
        bench.at(-8.0, moving=True, busy=True)
        return bench, token, move

    def test_nothing_is_made_up_for_while_spmg_is_stop(self):
        bench, token, move = self.against()
        bench.put("SPMG", 0)
        bench.end(bench.ask(events.Stop), End.REACHED)
        bench.at(-10.0)
        bench.end(move, End.STOPPED, "stopped on request")
        self.assertEqual((bench.asks(), bench.values("DMOV"), bench.answers[token]), ([], [0, 1], "stopped on request"))

    def test_nothing_is_made_up_for_while_spmg_is_pause(self):
        bench, _, move = self.against()
        bench.put("SPMG", 1)
        bench.end(bench.ask(events.Pause), End.REACHED)
        bench.at(-10.0, busy=True)
        bench.put("STOP", 1)
        bench.end(bench.ask(events.Stop), End.REACHED)
        bench.at(-10.0)
        bench.end(move, End.STOPPED, "stopped on request")
        self.assertEqual((bench.asks(), bench.values("DMOV")), ([], [0, 1]))

    def test_the_approach_waits_for_go(self):
        bench, _, move = self.against()
        bench.put("SPMG", 1)
        bench.end(bench.ask(events.Pause), End.REACHED)
        bench.at(-30.5)
        bench.end(move, End.REACHED)
        self.assertEqual((bench.asks(), bench["DMOV"]), ([], 0))
        bench.put("SPMG", 3)
        self.assertEqual(bench.ask(events.Move).to, -30.0)

    def test_a_stop_when_the_first_leg_just_ends_is_a_stop(self):
        bench = Bench()
        bench.put("BDST", 0.5)
        token = bench.put("VAL", 30.0)
        move = bench.ask(events.Move)
        bench.accept(move)
        bench.put("STOP", 1)
        bench.asks()
        bench.at(29.5)
        bench.end(move, End.REACHED)
        self.assertEqual((bench.asks(), bench["DMOV"], bench.severity), ([], 1, "MAJOR"))
        self.assertEqual((bench.answers[token], bench["AMSG"]), ("stopped before its target",) * 2)


if __name__ == "__main__":
    unittest.main()
