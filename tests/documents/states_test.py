#!/usr/bin/env python3
"""docs/states.md has the states of the code, and names the function that makes each transition.

$BUSHD_SOURCE_DIR is the source tree."""

import unittest

import states


class States(unittest.TestCase):
    def setUp(self):
        self.page = (states.SOURCE / states.PAGE).read_text(encoding="utf-8")

    def complaints(self, page):
        return [text for machine in states.MACHINES for text in states.complaints(machine, page)]

    def test_the_tables_are_those_of_the_code(self):
        self.assertEqual(self.complaints(self.page), [])

    def test_the_pictures_are_those_of_the_tables(self):
        self.assertEqual(states.with_pictures(self.page), self.page, "tests/documents/states.py --write")

    def test_the_code_is_read(self):
        for machine in states.MACHINES:
            with self.subTest(machine.heading):
                changes, names = {"Phases of an MCU": (4, 3)}.get(machine.heading, (9, 4))
                self.assertGreaterEqual(len(states.changing(machine)), changes)
                self.assertGreaterEqual(len(states.names_of(machine)), names)

    def test_what_is_missing_is_found(self):
        for what, old, new in (
            ("a state", "| `HOMING` |", "| `SEARCH` |"),
            ("a state of a transition", "| `QUEUE` | `VELOCITY` |", "| `QUEUE` | `LOOP` |"),
            ("a function", "| `bushd_mcu_steer` |", "| `bushd_mcu_nobody_has_written_this` |"),
            ("a file", "(../firmware/core/velocity.c)", "(../firmware/core/homing.c)"),
            ("a way to a state", "| `QUEUE` | `HOMING` |", "| `QUEUE` | `TRAVEL` |"),
            ("what a picture does not take", "| the edge comes |", "| edge: it comes |"),
        ):
            with self.subTest(what):
                self.assertIn(old, self.page)
                self.assertNotEqual(self.complaints(self.page.replace(old, new)), [])

    def test_a_row_that_is_missing_is_found(self):
        for machine in states.MACHINES:
            for name, _ in states.changing(machine):
                kept = [line for line in self.page.splitlines(keepends=True) if f"| `{name}` |" not in line]
                with self.subTest(name):
                    self.assertNotEqual(self.complaints("".join(kept)), [])


if __name__ == "__main__":
    unittest.main()
