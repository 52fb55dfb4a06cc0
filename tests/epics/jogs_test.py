#!/usr/bin/env python3
"""How long a jog may go on without its client."""

import unittest

from bench import Bench
from bushd_epics import events
from bushd_epics.jogs import Jogs


class Ends(unittest.TestCase):
    def setUp(self):
        self.bench = Bench()
        self.jogs = Jogs(longest_s=60.0)
        self.waiting = 0  # bytes that its client has not taken
        self.bench.put("JOGF", 1, circuit="its")
        self.bench.accept(self.bench.ask(events.Jog))

    def look(self, now):
        """Why it is to end; None: it goes on."""
        ends = self.jogs.look([self.bench.record], lambda circuit: self.waiting, now)
        for _, circuit, _ in ends:
            self.assertEqual(circuit, "its")
        return ends[0][2] if ends else None

    def test_it_ends_a_time_after_it_was_asked_for_last(self):
        self.assertIsNone(self.look(100.0))
        self.assertIsNone(self.look(159.9))
        self.assertTrue(self.jogs.renew(self.bench.record, "JOGF", "its", 159.9))
        self.assertIsNone(self.look(219.8))
        self.assertIn("--longest-jog-s", self.look(220.0))

    def test_others_do_not_renew_it(self):
        self.assertFalse(self.jogs.renew(self.bench.record, "JOGF", "another", 100.0))
        self.assertFalse(self.jogs.renew(self.bench.record, "JOGR", "its", 100.0))

    def test_it_ends_when_its_client_takes_nothing_for_a_second(self):
        self.waiting = 16
        self.assertIsNone(self.look(100.0))
        self.assertIsNone(self.look(101.0))
        self.assertIn("has taken nothing", self.look(101.25))

    def test_what_was_taken_in_between_counts(self):
        self.waiting = 16
        self.assertIsNone(self.look(100.0))
        self.waiting = 0
        self.assertIsNone(self.look(100.5))
        self.waiting = 16
        self.assertIsNone(self.look(101.25))

    def test_it_is_ended_once(self):
        self.assertIsNone(self.look(100.0))
        self.assertIsNotNone(self.look(160.0))
        self.bench.gone("its")
        self.bench.ask(events.EndJog)
        self.assertIsNone(self.look(161.0))


if __name__ == "__main__":
    unittest.main()
