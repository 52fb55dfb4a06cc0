#!/usr/bin/env python3
"""docs/epics.md lists the fields that motor records have, once each, and says of those that may be put that they may.

$BUSHD_SOURCE_DIR is the source tree; bushd_epics is found by $PYTHONPATH."""

import os
import pathlib
import re
import unittest

from bushd_epics.fields import FIELDS

PAGE = pathlib.Path(os.environ["BUSHD_SOURCE_DIR"]) / "docs/epics.md"
NOTHING = {"-"}


class Fields(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        table = re.search(r"^## Fields\n.*?^\|.*?\n\n", PAGE.read_text(), re.DOTALL | re.MULTILINE)[0]
        cls.rows = []  # (fields, what they are, what a put does)
        for row in re.findall(r"^\| (`.*) \|$", table, re.MULTILINE):
            names, *cells = row.split(" | ")
            cls.rows.append((re.findall(r"`(\w+)`", names), *cells))

    def test_each_is_listed_once(self):
        listed = [name for names, *_ in self.rows for name in names]
        self.assertEqual(sorted(listed), sorted(set(listed)), "twice")
        self.assertEqual(set(FIELDS) - set(listed), set(), "the page does not have them")
        self.assertEqual(set(listed) - set(FIELDS), set(), "no record has them")

    def test_what_may_be_put_is_said_to(self):
        for names, _, put in self.rows:
            for name in names:
                with self.subTest(name):
                    self.assertEqual(FIELDS[name].settable, put not in NOTHING)


if __name__ == "__main__":
    unittest.main()
