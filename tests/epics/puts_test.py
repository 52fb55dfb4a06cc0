#!/usr/bin/env python3
"""Puts that are no targets: SPMG, jogs, homing, speeds, SET, limits, offset, and what is refused."""

import unittest

from bench import Bench
from bushd_epics import events
from bushd_epics.events import End
from bushd_epics.fields import FIELDS
from bushd_epics.record import Putter, Record
from bushd_epics.scale import Scale


class Spmg(unittest.TestCase):
    STOP, PAUSE, MOVE, GO = range(4)

    def test_a_pause_keeps_the_target_and_dmov_at_0(self):
        bench = Bench()
        token = bench.put("VAL", 20.0)
        ask = bench.ask(events.Move)
        bench.accept(ask)
        bench.put("SPMG", self.PAUSE)
        pause = bench.ask(events.Pause)
        self.assertEqual(bench["SPMG"], self.GO)
        bench.end(pause, End.REACHED)
        self.assertEqual((bench["SPMG"], bench["LSPG"]), (self.PAUSE, self.GO))
        bench.at(5.0, busy=True)
        self.assertEqual((bench["DMOV"], bench["VAL"]), (0, 20.0))
        bench.put("SPMG", self.GO)
        bench.end(bench.ask(events.Resume), End.REACHED)
        self.assertEqual(bench["SPMG"], self.GO)
        bench.at(20.0)
        bench.end(ask, End.REACHED)
        self.assertEqual((bench.values("DMOV"), bench.answers[token]), ([0, 1], ""))

    def test_a_pause_that_is_refused_leaves_spmg_as_it_was(self):
        bench = Bench()
        bench.put("VAL", 20.0)
        bench.accept(bench.ask(events.Move))
        token = bench.put("SPMG", self.PAUSE)
        pause = bench.ask(events.Pause)
        self.assertNotIn(token, bench.answers)
        meanwhile = bench.put("VAL", 10.0)
        self.assertEqual(bench.asks(), [])
        bench.refuse(pause, "theta follows a trajectory")
        self.assertEqual((bench["SPMG"], bench.answers), (self.GO, {token: "theta follows a trajectory"}))
        self.assertEqual(bench.ask(events.Move).to, 10.0)
        self.assertNotIn(meanwhile, bench.answers)

    def test_an_older_word_that_is_answered_later_does_not_count(self):
        bench = Bench()
        bench.put("VAL", 20.0)
        bench.accept(bench.ask(events.Move))
        first = bench.put("SPMG", self.PAUSE)
        pause = bench.ask(events.Pause)
        bench.put("SPMG", self.STOP)
        bench.ask(events.Stop)
        bench.end(pause, End.REACHED)
        self.assertEqual((bench["SPMG"], bench.answers), (self.STOP, {first: ""}))

    def test_a_target_that_is_put_in_a_pause_waits(self):
        bench = Bench()
        bench.put("SPMG", self.PAUSE)
        token = bench.put("VAL", 20.0)
        self.assertEqual((bench.asks(), bench["DMOV"]), ([], 0))
        bench.put("SPMG", self.GO)
        self.assertEqual(bench.ask(events.Move).to, 20.0)
        self.assertNotIn(token, bench.answers)

    def test_stop_ends_a_target_that_waits(self):
        bench = Bench()
        bench.put("SPMG", self.PAUSE)
        token = bench.put("VAL", 20.0)
        bench.put("STOP", 1)
        self.assertEqual((bench["DMOV"], bench["VAL"], bench.severity), (1, 0.0, "MAJOR"))
        self.assertNotEqual(bench.answers[token], "")

    def test_nothing_moves_while_it_is_stop(self):
        bench = Bench()
        bench.put("SPMG", self.STOP)
        token = bench.put("VAL", 20.0)
        self.assertEqual((bench.asks(), bench.answers[token], bench.values("DMOV")), ([], "SPMG is Stop", [0, 1]))

    def test_move_is_for_one_move(self):
        bench = Bench()
        bench.put("SPMG", self.PAUSE)
        bench.put("SPMG", self.MOVE)
        bench.put("VAL", 2.0)
        ask = bench.ask(events.Move)
        bench.accept(ask)
        bench.at(2.0)
        bench.end(ask, End.REACHED)
        self.assertEqual(bench["SPMG"], self.PAUSE)


class Jogs(unittest.TestCase):
    def begin(self, bench):
        token = bench.put("JOGR", 1, circuit="mine")
        ask = bench.ask(events.Jog)
        self.assertEqual((ask.speed, bench["DMOV"], bench["TDIR"]), (-25.0, 0, 0))
        bench.accept(ask)
        self.assertEqual(bench.answers[token], "")
        bench.at(-3.0, moving=True, busy=True)
        return ask

    def test_it_ends_at_0(self):
        bench = Bench()
        ask = self.begin(bench)
        bench.put("JOGF", 0)  # the other direction
        self.assertEqual(bench.asks(), [])
        bench.put("JOGR", 0)
        self.assertEqual(bench.ask(events.EndJog).jog, ask.number)
        bench.at(-4.0)
        bench.end(ask, End.REACHED)
        self.assertEqual((bench.values("DMOV"), bench["JOGR"], bench["VAL"], bench.severity), ([0, 1], 0, -4.0, "NO_ALARM"))

    def test_it_ends_with_its_client_and_no_other(self):
        bench = Bench()
        ask = self.begin(bench)
        bench.gone("another")
        self.assertEqual(bench.asks(), [])
        bench.gone("mine")
        self.assertEqual(bench.ask(events.EndJog).jog, ask.number)

    def test_a_limit_is_an_alarm_and_jogr_falls(self):
        bench = Bench()
        ask = self.begin(bench)
        bench.at(-50.0)
        bench.end(ask, End.LIMIT, "its soft limit")
        self.assertEqual((bench["JOGR"], bench["LVIO"], bench.severity, bench["DMOV"]), (0, 1, "MAJOR", 1))

    def test_a_motor_that_moves_does_not_jog(self):
        bench = Bench()
        bench.put("VAL", 3.0)
        bench.asks()
        token = bench.put("JOGF", 1)
        self.assertEqual((bench.asks(), bench.answers[token], bench["JOGF"]), ([], "it moves", 0))


class Homing(unittest.TestCase):
    def test_it_falls_at_the_put_and_rises_at_the_end(self):
        bench = Bench()
        token = bench.put("HOMR", 1)
        ask = bench.ask(events.Home)
        bench.accept(ask)
        self.assertEqual((bench["DMOV"], bench["MIP"]), (0, 0x10))
        bench.at(0.0)
        bench.end(ask, End.REACHED)
        self.assertEqual((bench.values("DMOV"), bench.answers[token], bench["HOMR"]), ([0, 1], "", 0))


class Speeds(unittest.TestCase):
    def test_beyond_vmax_it_is_vmax_and_done_at_once(self):
        bench = Bench()
        token = bench.put("VELO", 1000.0)
        self.assertEqual((bench["VELO"], bench["VMAX"], bench.answers[token]), (25.0, 25.0, ""))
        bench.put("VAL", 1.0)
        self.assertIsNone(bench.ask(events.Move).speed)

    def test_a_lower_one_is_asked_for(self):
        bench = Bench()
        bench.put("VELO", 4.0)
        bench.put("VAL", 1.0)
        self.assertEqual(bench.ask(events.Move).speed, 4.0)

    def test_slower_than_a_step_an_hour_is_refused_and_the_log_says_who_puts(self):
        bench = Bench()
        bench.hear()
        token = bench.put("VELO", 0.01 / 3601)
        self.assertEqual(bench["VELO"], 25.0)
        self.assertRegex(bench.answers[token], "^a speed of .* 2.77778e-06$")
        (log,) = [event.text for event in bench.hear() if isinstance(event, events.Log)]
        self.assertIn("a put to VELO by me:pc is refused", log)
        self.assertEqual(bench.answers[bench.put("VELO", 0.01 / 3600)], "")

    def test_none_is_refused(self):
        for value in (0.0, -1.0):
            bench = Bench()
            token = bench.put("VELO", value)
            self.assertEqual(bench["VELO"], 25.0)
            self.assertNotEqual(bench.answers[token], "")


class Set(unittest.TestCase):
    def test_the_offset_follows_or_the_position_is_loaded(self):
        for frozen, field, value, expected in (
            (0, "VAL", 7.0, (7.0, False)), (1, "VAL", 7.0, (7.0, True)), (0, "DVAL", 7.0, (7.0, True)), (0, "RVAL", 700, (7.0, True)),
        ):  # fmt: skip
            with self.subTest(frozen=frozen, field=field):
                bench = Bench()
                bench.put("FOFF", frozen)
                bench.put("SET", 1)
                token = bench.put(field, value)
                ask = bench.ask(events.SetPosition)
                self.assertEqual((ask.to, ask.dial), expected)
                self.assertEqual((bench.values("DMOV"), token in bench.answers), ([], False))
                bench.end(ask, End.REACHED)
                self.assertEqual(bench.answers[token], "")

    def test_two_programs_one_after_the_other_set_and_nothing_moves(self):
        bench = Bench()
        bench.put("SET", 1, circuit="first")
        bench.gone("first")
        bench.put("VAL", 42.0, circuit="second")
        self.assertEqual(bench.ask(events.SetPosition).to, 42.0)
        bench.gone("second")
        self.assertEqual(bench["SET"], 1)

    def test_it_times_out(self):
        bench = Bench()
        bench.put("SET", 1)
        bench.wait(29.9)
        self.assertEqual(bench["SET"], 1)
        bench.wait(0.2)
        self.assertEqual(bench["SET"], 0)

    def lapsed(self):
        bench = Bench()
        bench.put("SET", 1)
        bench.wait(31)
        bench.hear()
        return bench

    def test_a_target_after_the_time_out_is_refused_once(self):
        for field in ("VAL", "DVAL", "RVAL", "RLV", "TWF"):
            with self.subTest(field=field):
                bench = self.lapsed()
                bench.wait(599 - 1)
                token = bench.put(field, 1)
                self.assertEqual((bench.asks(), bench.values("DMOV")), ([], [0, 1]))
                self.assertRegex(bench.answers[token], "^SET has ended .* put SET 1 again or put the target once more$")
                bench.put(field, 1)
                bench.ask(events.Move)

    def test_it_is_forgotten_after_ten_minutes_or_when_set_is_put(self):
        bench = self.lapsed()
        bench.wait(600)
        bench.put("VAL", 1.0)
        bench.ask(events.Move)
        bench = self.lapsed()
        bench.put("SET", 0)
        bench.put("VAL", 1.0)
        bench.ask(events.Move)
        bench = self.lapsed()
        bench.put("SET", 1)
        bench.put("VAL", 1.0)
        bench.ask(events.SetPosition)


class Limits(unittest.TestCase):
    def test_they_are_on_the_dial_and_two_puts_make_one_pair(self):
        bench = Bench(scale=Scale(0.01, True, 10.0), user=10.0, low=-40.0, high=60.0)
        bench.put("LLM", 0.0)
        self.assertEqual(dict(bench.ask(events.Configure).changes), {"soft_limits": (-50.0, 10.0)})
        bench.put("HLM", 20.0)
        self.assertEqual(dict(bench.ask(events.Configure).changes), {"soft_limits": (-10.0, 10.0)})

    def test_both_at_0_are_none(self):
        bench = Bench()
        bench.put("DLLM", 0.0)
        bench.put("DHLM", 0.0)
        self.assertEqual(dict(bench.asks()[-1].changes), {"soft_limits": None})

    def test_the_wrong_way_round_is_refused(self):
        bench = Bench()
        token = bench.put("LLM", 60.0)
        self.assertEqual((bench.asks(), bench["LLM"]), ([], -50.0))
        self.assertNotEqual(bench.answers[token], "")


class Refused(unittest.TestCase):
    def test_what_cannot_be_put_says_why_and_stays(self):
        for field, spec in FIELDS.items():
            if spec.settable:
                continue
            with self.subTest(field=field):
                bench = Bench()
                before = bench[field]
                token = bench.put(field, before)
                self.assertEqual(bench.answers[token], spec.why_not)
                self.assertGreater(len(spec.why_not), 10)
                self.assertTrue(any(isinstance(event, events.Log) for event in bench.hear()))

    def test_every_field_that_can_be_put_is_answered_or_asked_for(self):
        for field, spec in FIELDS.items():
            if not spec.settable:
                continue
            with self.subTest(field=field):
                bench = Bench()
                token = bench.put(field, 1 if spec.kind.value != "double" else 1.0)
                self.assertTrue(token in bench.answers or bench.asks())

    def test_a_pseudo_axis_is_not_set(self):
        record = Record("LAB:gap", is_axis=True)
        record.put("SET", 1, Putter(token="it"), 0.0)
        self.assertEqual([event.error != "" for event in record.take() if isinstance(event, events.Done)], [True])
        self.assertEqual(record.values["SET"], 0)


if __name__ == "__main__":
    unittest.main()
