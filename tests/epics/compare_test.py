#!/usr/bin/env python3
"""Position compare of a motor: what is asked of the daemon, and what is told of it."""

import math
import unittest

from bushd_epics import events
from bushd_epics.compare import Compare
from bushd_epics.record import Putter


class PositionCompare(unittest.TestCase):
    def setUp(self):
        self.compare = Compare("LAB:theta")
        self.answers = {}
        self.asks = []
        self.tokens = 0

    def put(self, field, value):
        self.tokens += 1
        self.compare.put(field, value, Putter(who="me:pc", token=self.tokens))
        self.collect()
        return self.tokens

    def collect(self):
        for event in self.compare.take():
            if isinstance(event, events.Done):
                self.answers[event.token] = event.error
            elif not isinstance(event, events.Post):
                self.asks.append(event)

    def enabled(self):
        return self.compare.values["PCOEnable"], self.compare.values["PCOEnable_RBV"]

    def enable(self):
        token = self.put("PCOEnable", 1)
        (ask,), self.asks = self.asks, []
        return token, ask

    def test_it_is_on_when_the_daemon_has_said_so(self):
        self.put("PCOStartPosition", 2.5)
        self.put("PCOPulseWidth", 20.0)
        self.assertEqual(self.compare.values["PCOStartPosition_RBV"], 2.5)
        token, ask = self.enable()
        self.assertEqual((ask.on, ask.position, ask.width_us, self.enabled()), (True, 2.5, 20, (1, 0)))
        self.assertNotIn(token, self.answers)
        self.compare.answered(ask)
        self.collect()
        self.assertEqual((self.enabled(), self.answers[token]), ((1, 1), ""))
        self.put("PCOEnable", 0)
        (ask,) = self.asks
        self.assertFalse(ask.on)
        self.compare.answered(ask)
        self.assertEqual(self.enabled(), (0, 0))

    def test_what_the_daemon_refuses_is_not_on(self):
        token, ask = self.enable()
        self.compare.answered(ask, "its MCU has no such output")
        self.collect()
        self.assertEqual((self.enabled(), self.answers[token]), ((0, 0), "its MCU has no such output"))

    def test_several_positions_are_refused(self):
        self.put("PCOEndPosition", 10.0)
        self.put("PCOIncrement", 1.0)
        self.assertIn("one position", self.answers[self.put("PCOEnable", 1)])
        self.assertEqual((self.enabled(), self.asks), ((0, 0), []))
        self.put("PCOIncrement", 0.0)
        self.enable()

    def test_who_is_not_on_takes_nothing_back(self):
        """That would be the pulses of another motor of the MCU."""
        self.assertEqual((self.answers[self.put("PCOEnable", 0)], self.asks), ("", []))

    def test_another_motor_of_the_mcu_takes_its_place(self):
        _, ask = self.enable()
        self.compare.answered(ask)
        self.compare.replaced()
        self.assertEqual(self.enabled(), (0, 0))

    def test_values_that_none_can_have_are_refused(self):
        for field, value in (("PCOPulseWidth", 0.0), ("PCOPulseWidth", 1.5), ("PCOPulseWidth", 1e6 + 1), ("PCOStartPosition", math.nan), ("PCOEnable_RBV", 1)):
            with self.subTest(field=field, value=value):
                was = self.compare.values[field]
                self.assertNotEqual(self.answers[self.put(field, value)], "")
                self.assertEqual(self.compare.values[field], was)


if __name__ == "__main__":
    unittest.main()
