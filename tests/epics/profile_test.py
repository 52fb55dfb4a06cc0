#!/usr/bin/env python3
"""Profile moves: what may be built, where motors are at which time, and what is told of build, execution and readback."""

import dataclasses
import math
import unittest

from bench import REST
from bushd_epics import events, profile
from bushd_epics.events import End
from bushd_epics.profile import ABORT, FAILURE, SUCCESS, UNDEFINED, BadProfile, Profile
from bushd_epics.record import Putter
from bushd_epics.scale import Scale

MINOR, MAJOR, INVALID = 1, 2, 3


class Bench:
    def __init__(self):
        self.profile = Profile("LAB:pm1:", ["theta", "phi"])
        self.seen = {"theta": REST, "phi": dataclasses.replace(REST, scale=Scale(0.01, negative=True, offset=3.0))}
        self.posts = []
        self.asks = []
        self.answers = {}
        self._tokens = 0

    def where(self, motor):
        if motor not in self.seen:
            raise BadProfile(f"{motor}: no such motor")
        return self.seen[motor]

    def __getitem__(self, field):
        return self.profile.values[field]

    def put(self, field, value):
        self._tokens += 1
        self.profile.put(field, value, Putter(who="me:pc", token=self._tokens), self.where)
        self.collect()
        return self._tokens

    def collect(self):
        for event in self.profile.take():
            match event:
                case events.Post():
                    self.posts.append((event.field, event.value))
                case events.Done():
                    # A put is answered behind all that was told before.
                    self.answers[event.token] = event.error
                    self.posts.append(("answer", event.token))
                case _:
                    self.asks.append(event)

    def told(self, function, *what):
        function(*what)
        self.collect()

    def ask(self):
        (ask,), self.asks = self.asks, []
        return ask

    def make(self, theta=(0.0, 1.0, 2.0), phi=None, ramp=0.0, **puts):
        """The ask for the check."""
        self.put("NumPoints", len(theta))
        self.put("M1UseAxis", 1)
        self.put("M1Positions", tuple(theta))
        if phi is not None:
            self.put("M2UseAxis", 1)
            self.put("M2Positions", tuple(phi))
        self.put("Acceleration", ramp)
        for field, value in puts.items():
            self.put(field, value)
        self.token = self.put("Build", 1)
        return self.ask()

    def build(self, *arguments, **puts):
        ask = self.make(*arguments, **puts)
        self.told(self.profile.checked)
        return ask

    def fails(self, **puts):
        """Why it cannot be built."""
        for field, value in puts.items():
            self.put(field, value)
        token = self.put("Build", 1)
        self.case = (self["Build"], self["BuildState"], self["BuildStatus"], self.asks)
        assert self.answers[token].endswith(self["BuildMessage"]) and self["BuildMessage"], self.answers
        return self["BuildMessage"]


class Build(unittest.TestCase):
    def test_times_are_those_between_points(self):
        bench = Bench()
        ask = bench.make(phi=(5.0, 5.0, 4.0), TimeMode=1, Times=(0.5, 2.0, 99.0))
        made = ask.trajectory
        self.assertEqual((ask.who, made.motors), ("me:pc", ("theta", "phi")))
        self.assertEqual(made.time_s, (0.0, 0.5, 2.5))
        self.assertEqual(made.rows, ((0.0, 5.0), (1.0, 5.0), (2.0, 4.0)))
        self.assertEqual((bench["BuildState"], bench["BuildStatus"], bench["Build"], bench.answers.get(bench.token)), (1, UNDEFINED, 1, None))

    def test_a_fixed_time_is_that_of_each_point(self):
        self.assertEqual(Bench().make(FixedTime=0.25).trajectory.time_s, (0.0, 0.25, 0.5))

    def test_more_positions_than_points_do_not_count(self):
        bench = Bench()
        self.assertEqual(bench.make((0.0, 1.0, 2.0, 9.0), NumPoints=3).trajectory.rows, ((0.0,), (1.0,), (2.0,)))

    def test_the_end_is_told_in_order_and_the_put_is_answered_behind_it(self):
        bench = Bench()
        bench.make()
        bench.posts.clear()
        bench.told(bench.profile.checked)
        self.assertEqual(bench.posts, [("BuildStatus", SUCCESS), ("BuildState", 0), ("Build", 0), ("answer", bench.token)])
        self.assertEqual(bench.answers[bench.token], "")

    def test_what_the_daemon_refuses_has_its_reason(self):
        bench = Bench()
        bench.make()
        bench.told(bench.profile.checked, "row 2: theta is too fast")
        self.assertEqual((bench["BuildStatus"], bench["BuildMessage"]), (FAILURE, "row 2: theta is too fast"))
        self.assertIn("theta is too fast", bench.answers[bench.token])
        # And cannot be executed.
        token = bench.put("Execute", 1)
        self.assertIn("no profile is built", bench.answers[token])
        self.assertEqual((bench["ExecuteStatus"], bench["Execute"], bench.asks), (FAILURE, 0, []))

    def test_what_is_not_complete_fails_and_says_why(self):
        bench = Bench()
        bench.put("NumPoints", 3)
        self.assertIn("no axis is used", bench.fails())
        self.assertIn("M1Positions: 0 values, 3 are needed", bench.fails(M1UseAxis=1))
        self.assertIn("M1Positions: 2 values", bench.fails(M1Positions=(0.0, 1.0)))
        self.assertIn("Times: 1 values, 2 are needed", bench.fails(M1Positions=(0.0, 1.0, 2.0), TimeMode=1, Times=(1.0,)))
        self.assertIn("0 s from point 2", bench.fails(Times=(1.0, 0.0)))
        self.assertIn("NumPulses is 7", bench.fails(TimeMode=0, NumPulses=7))
        del bench.seen["theta"]
        self.assertIn("no such motor", bench.fails(NumPulses=0))
        self.assertEqual(bench.case, (0, 0, FAILURE, []))

    def test_values_that_none_can_have_are_refused(self):
        bench = Bench()
        for field, value in (
            ("NumPoints", 1), ("NumPoints", profile.MOST_POINTS + 1), ("FixedTime", 0.0), ("FixedTime", math.nan), ("Acceleration", -1.0),
            ("M1Positions", (1.0, math.inf)), ("Times", (math.nan,)), ("NumAxes", 3), ("CurrentPoint", 1), ("BuildStatus", 1),
        ):  # fmt: skip
            with self.subTest(field=field, value=value):
                was = bench[field]
                self.assertNotEqual(bench.answers[bench.put(field, value)], "")
                self.assertEqual(bench[field], was)


class Runs(unittest.TestCase):
    """The runs before the first point and behind the last one, beside the motion that they are to be."""

    def test_they_are_a_parabola_and_points_are_passed_at_their_times(self):
        made = Bench().make((1.0, 3.0, 5.0), FixedTime=0.5, ramp=0.8).trajectory
        v, a = 4.0, 4.0 / 0.8
        rows = list(zip(made.time_s, (row[0] for row in made.rows)))
        self.assertEqual([dict(rows)[at] for at in made.points_s], [1.0, 3.0, 5.0])
        self.assertAlmostEqual(made.points_s[1] - made.points_s[0], 0.5)
        before = [(at, to) for at, to in rows if at < made.points_s[0]]
        self.assertEqual((before[0][0], len(before)), (0.0, 9))
        for at, to in before:
            self.assertAlmostEqual(to - before[0][1], a * at**2 / 2)
        self.assertAlmostEqual(before[-1][0], 0.8)
        # From there it goes with v.
        self.assertAlmostEqual((1.0 - before[-1][1]) / (made.points_s[0] - before[-1][0]), v)
        behind = [(made.time_s[-1] - at, to) for at, to in rows if at > made.points_s[-1]]
        self.assertEqual(len(behind), 9)
        for left, to in behind:
            self.assertAlmostEqual(behind[-1][1] - to, a * left**2 / 2)
        self.assertTrue(all(b > a for a, b in zip(made.time_s, made.time_s[1:])))

    def test_where_nothing_moves_at_an_end_there_is_none(self):
        made = Bench().make((1.0, 1.0, 2.0), ramp=0.5).trajectory
        self.assertEqual((made.time_s[0], made.points_s[0], made.rows[0]), (0.0, 0.0, (1.0,)))
        self.assertGreater(made.time_s[-1], made.points_s[-1])


class Execute(unittest.TestCase):
    def fly(self, bench):
        token = bench.put("Execute", 1)
        ask = bench.ask()
        self.assertIsInstance(ask, profile.Fly)
        self.assertEqual((bench["ExecuteState"], bench["ExecuteStatus"], bench["Execute"]), (1, UNDEFINED, 1))
        bench.told(bench.profile.flying)
        self.assertEqual(bench["ExecuteState"], 2)
        return token, ask

    def test_what_was_built_is_flown(self):
        bench = Bench()
        checked = bench.build(ramp=0.5)
        bench.put("M1Positions", (7.0, 8.0, 9.0))
        token, ask = self.fly(bench)
        self.assertEqual(ask.trajectory, checked.trajectory)
        bench.told(bench.profile.passed, ask.trajectory.points_s[1])
        self.assertEqual(bench["CurrentPoint"], 2)
        bench.posts.clear()
        bench.told(bench.profile.over, End.REACHED, "")
        self.assertEqual(bench.posts, [
            ("CurrentPoint", 3), ("ExecuteStatus", SUCCESS), ("ExecuteState", 0), ("Execute", 0), ("answer", token)])  # fmt: skip

    def test_how_it_ends_is_told(self):
        for end, reason, status in ((End.STOPPED, "stopped by me", ABORT), (End.LIMIT, "", FAILURE), (End.LINK, "lost", FAILURE)):
            with self.subTest(end):
                bench = Bench()
                bench.build()
                token, _ = self.fly(bench)
                bench.told(bench.profile.over, end, reason)
                self.assertEqual((bench["ExecuteStatus"], bench["ExecuteMessage"], bench["Execute"]), (status, reason or end, 0))
                self.assertIn(reason or end, bench.answers[token])

    def test_relative_to_where_it_stands_then(self):
        bench = Bench()
        checked = bench.build((0.0, 1.0), MoveMode=1)
        self.assertEqual(checked.trajectory.rows, ((0.0,), (1.0,)))
        bench.seen["theta"] = dataclasses.replace(REST, user=10.0)
        _, ask = self.fly(bench)
        self.assertEqual(ask.trajectory.rows, ((10.0,), (11.0,)))
        bench.told(bench.profile.over, End.REACHED, "")
        for change in ({"user": None}, {"moving": True}, {"busy": True}):
            bench.seen["theta"] = dataclasses.replace(REST, **change)
            self.assertIn("relative", bench.answers[bench.put("Execute", 1)])
            self.assertEqual(bench.asks, [])

    def test_one_thing_at_a_time(self):
        bench = Bench()
        bench.make()
        for field in ("Build", "Execute", "Readback"):
            self.assertIn("being built", bench.answers[bench.put(field, 1)])
        bench.told(bench.profile.checked)
        self.fly(bench)
        for field in ("Build", "Execute", "Readback"):
            self.assertIn("being executed", bench.answers[bench.put(field, 1)])
        self.assertEqual((bench["ExecuteState"], bench["BuildStatus"]), (2, SUCCESS))

    def test_abort_asks_for_a_stop_while_it_is_executed_and_is_nothing_else(self):
        bench = Bench()
        self.assertEqual((bench.answers[bench.put("Abort", 1)], bench.asks), ("", []))
        bench.build()
        self.fly(bench)
        token = bench.put("Abort", 1)
        ask = bench.ask()
        self.assertNotIn(token, bench.answers)
        bench.told(bench.profile.aborted, ask.by, "nobody answers")
        self.assertEqual(bench.answers[token], "nobody answers")


class Readback(unittest.TestCase):
    def test_positions_are_those_of_the_nearest_step(self):
        bench = Bench()
        bench.build((0.0, 0.014, 0.02), phi=(3.0, 3.026, 2.9))
        Execute.fly(self, bench)
        bench.told(bench.profile.over, End.REACHED, "")
        token = bench.put("Readback", 1)
        self.assertEqual((bench.answers[token], bench["ReadbackStatus"], bench["NumReadbacks"]), ("", SUCCESS, 3))
        for field, expected in (
            ("M1Readbacks", (0.0, 0.01, 0.02)), ("M1FollowingErrors", (0.0, -0.004, 0.0)),
            ("M2Readbacks", (3.0, 3.03, 2.9)), ("M2FollowingErrors", (0.0, 0.004, 0.0)),
        ):  # fmt: skip
            for value, right in zip(bench[field], expected, strict=True):
                self.assertAlmostEqual(value, right, msg=field)
        # The next flight begins without them.
        bench.put("Execute", 1)
        self.assertEqual((bench["M1Readbacks"], bench["NumReadbacks"], bench["ReadbackStatus"]), ((), 0, UNDEFINED))

    def test_of_what_was_not_flown_to_its_end_nothing_is_known(self):
        bench = Bench()
        bench.build()
        self.assertIn("no profile was flown", bench.answers[bench.put("Readback", 1)])
        Execute.fly(self, bench)
        bench.told(bench.profile.over, End.STOPPED, "")
        bench.put("Readback", 1)
        self.assertEqual((bench["ReadbackStatus"], bench["M1Readbacks"]), (FAILURE, ()))


class Severities(unittest.TestCase):
    def test_they_are_those_of_the_motor_module(self):
        self.assertEqual([profile.severity("BuildState", value) for value in (0, 1)], [0, MINOR])
        self.assertEqual([profile.severity("ExecuteStatus", value) for value in range(5)], [INVALID, 0, MAJOR, MAJOR, MAJOR])
        self.assertEqual(profile.severity("Build", 1), 0)


if __name__ == "__main__":
    unittest.main()
