#!/usr/bin/env python3
"""A source has at most 500 lines, so that it can be read at one sitting. Files that programs write do not count.

$BUSHD_SOURCE_DIR is the source tree."""

import os
import pathlib
import unittest

SOURCE = pathlib.Path(os.environ["BUSHD_SOURCE_DIR"])
MOST_LINES = 500
FOLDERS = ("daemon", "firmware", "lib", "tests", "tools")
KINDS = {".c", ".cpp", ".css", ".h", ".html", ".js", ".mjs", ".py", ".sh", ".S", ".ts", ".txt", ".cmake"}
# What npm installs, and what it writes of that.
WRITTEN_BY_PROGRAMS = {"node_modules", "package-lock.json"}


def is_program(path):
    """A file without an ending that begins with #!."""
    with path.open("rb") as file:
        return not path.suffix and file.read(2) == b"#!"


def sources():
    for folder in FOLDERS:
        for path in (SOURCE / folder).rglob("*"):
            written = WRITTEN_BY_PROGRAMS.intersection(path.parts)
            if path.is_file() and not written and (path.suffix in KINDS or is_program(path)):
                yield path


class Sizes(unittest.TestCase):
    def test_a_source_has_at_most_500_lines(self):
        lines = {str(path.relative_to(SOURCE)): len(path.read_bytes().splitlines()) for path in sources()}
        self.assertGreater(len(lines), 1500)
        self.assertEqual({path: count for path, count in lines.items() if count > MOST_LINES}, {})


if __name__ == "__main__":
    unittest.main()
