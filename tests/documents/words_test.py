#!/usr/bin/env python3
"""One word has one meaning: what words.toml forbids stands nowhere in the files that keep to it.

$BUSHD_SOURCE_DIR is the source tree."""

import os
import pathlib
import re
import tomllib
import unittest

SOURCE = pathlib.Path(os.environ["BUSHD_SOURCE_DIR"])
WORDS = pathlib.Path(__file__).with_name("words.toml")
ROOMS = ("CHANGELOG.md", "CONTRIBUTING.md", "README.md", "daemon", "debian", "docs", "firmware", "lib", "tables", "tests", "tools")
TEXTS = {"", ".S", ".c", ".cmake", ".cpp", ".csv", ".h", ".in", ".inc", ".lcm", ".md", ".patch", ".py", ".sh", ".toml", ".ts", ".txt"}
KEYS = {"pattern", "instead", "wrong", "right", "where", "but"}


def is_in(name, places):
    return any(name == place or name.startswith(f"{place}/") for place in places)


def read(path):
    """A text; nothing of other files."""
    try:
        return path.read_text()
    except UnicodeDecodeError:
        return ""


def texts():
    """(name, text) of all texts of the tree but those about the words themselves."""
    for room in ROOMS:
        top = SOURCE / room
        for path in [top] if top.is_file() else sorted(top.rglob("*")):
            name = path.relative_to(SOURCE).as_posix()
            hidden = "__pycache__" in path.parts or "corpus" in path.parts
            if path.is_file() and path.suffix in TEXTS and not hidden and path.name not in (WORDS.name, pathlib.Path(__file__).name):
                yield name, read(path)


class Words(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.words = tomllib.loads(WORDS.read_text())["word"]

    def test_examples_are_told_apart(self):
        for word in self.words:
            with self.subTest(pattern=word["pattern"]):
                self.assertEqual(set(word) - KEYS, set(), "unknown keys")
                self.assertTrue(word["wrong"], "without an example nobody knows that it matches anything")
                for example in word["wrong"]:
                    self.assertRegex(example, word["pattern"])
                for example in word.get("right", []):
                    self.assertNotRegex(example, word["pattern"])

    def test_places_are_there(self):
        for word in self.words:
            for place in word.get("where", []) + word.get("but", []):
                with self.subTest(pattern=word["pattern"], place=place):
                    self.assertTrue((SOURCE / place).exists(), "there is no such file or folder")

    def test_no_forbidden_word_is_written(self):
        rules = [(re.compile(word["pattern"], re.MULTILINE), word["instead"], word.get("where", ROOMS), word.get("but", [])) for word in self.words]
        found = []
        for name, text in texts():
            for pattern, instead, where, but in rules:
                if is_in(name, where) and not is_in(name, but):
                    found += [f"{name}:{text.count(chr(10), 0, match.end()) + 1}: {match[0].strip()!r}: write {instead}"
                              for match in pattern.finditer(text)]
        self.assertEqual(found, [], "\n" + "\n".join(found))


if __name__ == "__main__":
    unittest.main()
