#!/usr/bin/env python3
"""A move that waits for a trigger: what is asked of the daemon, and what is told of it."""

import dataclasses
import math
import unittest

from bench import REST
from bushd_epics import events, trigger
from bushd_epics.events import End
from bushd_epics.record import Putter
from bushd_epics.trigger import ARMED, ARMING, IDLE, MOVING, Trigger


class Triggers(unittest.TestCase):
    def setUp(self):
        self.trigger = Trigger("LAB:theta")
        self.answers, self.asks, self.posts = {}, [], []
        self.tokens = 0

    def put(self, field, value):
        self.tokens += 1
        self.trigger.put(field, value, Putter(who="me:pc", token=self.tokens))
        self.collect()
        return self.tokens

    def see(self, **changes):
        self.trigger.see(dataclasses.replace(REST, **changes))
        self.collect()

    def over(self, end, reason=""):
        self.trigger.over(end, reason)
        self.collect()

    def collect(self):
        for event in self.trigger.take():
            if isinstance(event, events.Done):
                self.answers[event.token] = event.error
            elif isinstance(event, events.Post):
                self.posts.append((event.field, event.value))
            else:
                self.asks.append(event)

    def state(self):
        values = self.trigger.values
        return values["_trgArm"], values["_trgState"], values["_trgMessage"]

    def test_it_is_armed_when_its_mcu_says_so_and_busy_until_the_move_has_ended(self):
        for field, value in (("_trgDistance", -2.5), ("_trgEdge", 1), ("_trgDelay", 700.0)):
            self.put(field, value)
        token = self.put("_trgArm", 1)
        self.assertEqual(self.asks, [trigger.Arm("me:pc", -2.5, True, 700)])
        self.see()
        self.assertEqual(self.state(), (1, ARMING, ""))
        self.see(armed=True)
        self.assertEqual(self.state(), (1, ARMED, ""))
        self.see(moving=True, busy=True)
        self.assertEqual((self.state(), token in self.answers), ((1, MOVING, ""), False))
        self.posts.clear()
        self.over(End.REACHED)
        self.assertEqual((self.state(), self.answers[token]), ((0, IDLE, ""), ""))
        self.assertEqual(self.posts, [("_trgState", IDLE), ("_trgArm", 0)])

    def test_what_the_motor_does_otherwise_is_no_trigger(self):
        for changes in ({"moving": True, "busy": True}, {"armed": True}):
            self.see(**changes)
            self.assertEqual((self.state(), self.posts), ((0, IDLE, ""), []))

    def test_a_refusal_and_a_stop_say_why(self):
        for end, reason in ((End.FAULT, "a group of moves waits for the trigger of MCU hall:1 already"), (End.STOPPED, "disarmed before the trigger came")):
            token = self.put("_trgArm", 1)
            self.over(end, reason)
            self.assertEqual((self.state(), self.answers[token]), ((0, IDLE, reason), reason))
        self.put("_trgArm", 1)
        self.assertEqual(self.state(), (1, ARMING, ""))

    def test_who_is_armed_is_not_armed_again(self):
        first = self.put("_trgArm", 1)
        self.assertIn("armed already", self.answers[self.put("_trgArm", 1)])
        self.assertEqual((len(self.asks), first in self.answers), (1, False))

    def test_it_is_taken_back_by_a_stop(self):
        self.assertEqual((self.answers[self.put("_trgArm", 0)], self.asks), ("", []))
        self.put("_trgArm", 1)
        token = self.put("_trgArm", 0)
        disarm = self.asks[-1]
        self.assertIsInstance(disarm, trigger.Disarm)
        self.assertEqual((self.state()[:2], token in self.answers), ((1, ARMING), False))
        self.trigger.aborted(disarm.by)
        self.collect()
        self.assertEqual(self.answers[token], "")

    def test_values_that_none_can_have_are_refused(self):
        for field, value in (
            ("_trgDelay", 49.0), ("_trgDelay", 1650001.0), ("_trgDelay", 60.5), ("_trgDelay", math.nan), ("_trgDistance", math.inf),
            ("_trgState", ARMED), ("_trgMessage", "all is well"),
        ):  # fmt: skip
            with self.subTest(field=field, value=value):
                was = self.trigger.values[field]
                self.assertNotEqual(self.answers[self.put(field, value)], "")
                self.assertEqual(self.trigger.values[field], was)


if __name__ == "__main__":
    unittest.main()
