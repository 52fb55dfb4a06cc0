#!/usr/bin/env python3
"""Each statement of the report of 1985 has a row in docs/camac.md, whose tests exist.

$BUSHD_SOURCE_DIR is the source tree."""
import os
import pathlib
import re
import unittest

SOURCE = pathlib.Path(os.environ["BUSHD_SOURCE_DIR"])
NOT_TESTED = {"S23"}  # of which material the line is


class Statements(unittest.TestCase):
    def test_each_has_tests(self):
        rows = dict(re.findall(r"^\| (S\d+) \| .* \| (.*) \|$", (SOURCE / "docs/camac.md").read_text(), re.MULTILINE))
        self.assertEqual(list(rows), [f"S{number}" for number in range(1, 35)])
        tests = set()
        for source in sorted((SOURCE / "tests").glob("*/**/*camac*.cpp")) + sorted((SOURCE / "tests/heritage/camac").glob("*.cpp")):
            tests |= {f"{suite}.{name}" for suite, name in re.findall(r"^TEST(?:_[FP])?\((\w+), (\w+)\)", source.read_text(), re.MULTILINE)}
        for statement, cell in rows.items():
            named = re.findall(r"`(\w+\.\w+)`", cell)
            with self.subTest(statement=statement):
                self.assertEqual(bool(named), statement not in NOT_TESTED)
                self.assertLessEqual(set(named), tests)


if __name__ == "__main__":
    unittest.main()
