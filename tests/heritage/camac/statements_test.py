#!/usr/bin/env python3
"""Each statement of the report of 1985 has a row in docs/camac.md, whose tests exist; each reading of this project is marked
where it is told.

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
        folder = SOURCE / "tests"
        sources = [*folder.glob("*/**/*camac*.cpp"), *(folder / "heritage/camac").glob("*.cpp"), *folder.glob("*/**/commutator_test.cpp")]
        for source in sources:
            tests |= {f"{suite}.{name}" for suite, name in re.findall(r"^TEST(?:_[FP])?\((\w+), (\w+)\)", source.read_text(), re.MULTILINE)}
        for statement, cell in rows.items():
            named = re.findall(r"`(\w+\.\w+)`", cell)
            with self.subTest(statement=statement):
                self.assertEqual(bool(named), statement not in NOT_TESTED)
                self.assertLessEqual(set(named), tests)

    def test_each_reading_is_marked(self):
        told, readings = (SOURCE / "docs/camac.md").read_text().split("\n## Readings\n")
        numbers = re.findall(r"^\| U(\d+) \|", readings, re.MULTILINE)
        self.assertEqual(numbers, [str(number) for number in range(1, len(numbers) + 1)])
        self.assertIn(f"is marked U1 to U{len(numbers)} ", told)
        # The sentence that says so marks none.
        marked = set(re.findall(r"\bU(\d+)\b", re.sub(r"is marked U1 to U\d+ ", "", told)))
        self.assertEqual(marked, set(numbers))


if __name__ == "__main__":
    unittest.main()
