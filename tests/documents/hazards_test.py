#!/usr/bin/env python3
"""docs/hazards.md answers every guideword for every source of motion and way of stopping, and each row has tests that exist.

$BUSHD_SOURCE_DIR is the source tree."""

import os
import pathlib
import re
import unittest

SOURCE = pathlib.Path(os.environ["BUSHD_SOURCE_DIR"])
PAGE = SOURCE / "docs/hazards.md"

OF_STOPS = ["not given", "twice", "too early", "too late", "ended too soon", "wrong motor", "answered wrongly"]
OF_MOTION = [*OF_STOPS, "unasked"]
OPEN = "(open)"


def names_of_tests():
    names = set()
    for path in (SOURCE / "tests").rglob("*.cpp"):
        text = path.read_text(errors="replace")
        names |= {
            ".".join(pair)
            for pair in re.findall(r"^(?:TEST|TEST_F|TEST_P|RC_GTEST_(?:FIXTURE_)?PROP)\(\s*(\w+),\s*(\w+)", text, re.M)
        }
    for path in (SOURCE / "tests").rglob("*_test.py"):
        names |= {f"{path.name}: {name}" for name in re.findall(r"^    def (test_\w+)\(", path.read_text(), re.M)}
    return names


def kinds(text, title):
    """Names in the table whose head begins with this word."""
    table = re.search(rf"^\| {title} \| is \|\n\|.*\n((?:\|.*\n)+)", text, re.M)
    return re.findall(r"^\| ([A-Z]+) \|", table[1], re.M)


def definitions(text, letter):
    return set(re.findall(rf"^\| ({letter}\d+) \|", text, re.M))


def guidewords(cell):
    """Those that it names, and what is left of it."""
    found = [word for word in OF_MOTION if re.search(rf"\b{word}\b", cell)]
    for word in found:
        cell = re.sub(rf"\b{word}\b", "", cell)
    return found, cell.strip()


def complaints(text, tests):
    """What is missing or wrong on the page, in words."""
    sources, ways = kinds(text, "source"), kinds(text, "way")
    hazards, measures = definitions(text, "H"), definitions(text, "A")
    wrong, seen, rows = [], set(), []
    for line in re.findall(r"^\| [A-Z]+-\d+ \|.*$", text, re.M):
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        row = cells[0]
        if len(cells) != 7:
            wrong.append(f"{row} has {len(cells)} cells, not 7")
            continue
        if row in rows:
            wrong.append(f"{row} is there twice")
        rows.append(row)
        words, rest = guidewords(cells[2])
        if rest or not words:
            wrong.append(f"{row}: no guideword: '{rest}'")
        for kind in cells[1].split():
            if kind not in sources + ways:
                wrong.append(f"{row}: neither a source of motion nor a way of stopping: {kind}")
            seen |= {(kind, word) for word in words}
        for named, known in (("H", hazards), ("A", measures)):
            for reference in re.findall(rf"\b{named}\d+\b", " ".join(cells[3:6])):
                if reference not in known:
                    wrong.append(f"{row}: {reference} is not defined")
        if not re.search(r"\bH\d", cells[3]):
            wrong.append(f"{row} names no hazard")
        shown_by = re.findall(r"`([^`]+)`", cells[6])
        if OPEN in cells[6]:
            wrong.append(f"{row} is open")
        elif not shown_by:
            wrong.append(f"{row} has no test")
        wrong += [f"{row}: there is no test {test}" for test in shown_by if test not in tests]
    for kinds_of, words in ((sources, OF_MOTION), (ways, OF_STOPS)):
        wrong += [f"no row answers {kind} {word}" for kind in kinds_of for word in words if (kind, word) not in seen]
    return wrong


class Hazards(unittest.TestCase):
    def setUp(self):
        self.text = PAGE.read_text()
        self.tests = names_of_tests()

    def test_every_source_and_way_has_every_guideword_and_a_test_that_exists(self):
        self.assertEqual(complaints(self.text, self.tests), [])

    def test_what_is_missing_is_found(self):
        before = len(complaints(self.text, self.tests))
        for what, without in {
            "a row": re.sub(r"^\| TW-3 \|.*\n", "", self.text, flags=re.M),
            "a test": self.text.replace("`Jogs.OfAnotherClientTakeOver`", "`Jogs.NobodyHasWrittenThis`"),
            "tests of a row": re.sub(r"^(\| TW-3 \|.*\|) [^|]* \|$", r"\1 |  |", self.text, flags=re.M),
            "a guideword": self.text.replace("| ESTOP | too early |", "| ESTOP | too late |"),
            "a new source": self.text.replace("| MOVE | a move", "| DANCE | a dance |\n| MOVE | a move"),
        }.items():
            with self.subTest(what):
                self.assertNotEqual(without, self.text)
                self.assertGreater(len(complaints(without, self.tests)), before)


if __name__ == "__main__":
    unittest.main()
