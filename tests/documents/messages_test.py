#!/usr/bin/env python3
"""docs/lcm.md lists every channel with the type that travels on it, as the .lcm files say.

$BUSHD_SOURCE_DIR is the source tree."""

import os
import pathlib
import re
import unittest

SOURCE = pathlib.Path(os.environ["BUSHD_SOURCE_DIR"])


def of_types():
    """Channel without its prefix: type, by the first comment of each .lcm file."""
    channels = {}
    for path in (SOURCE / "lib/lcm/types").glob("*.lcm"):
        if match := re.search(r"^// Channel <prefix>_([A-Z_]+)\b", path.read_text(), re.MULTILINE):
            channels[match[1]] = path.stem
    return channels


def of_page():
    """The same by the table of the page. A row may have several of both, in the same order."""
    channels = {}
    for line in (SOURCE / "docs/lcm.md").read_text().splitlines():
        row = line.split("|")
        if len(row) > 3 and row[3].strip() in ("clients", "daemon"):
            cells = [re.findall(r"`(\w+)`", cell) for cell in row[1:3]]
            if len(cells[0]) != len(cells[1]):
                raise AssertionError(f"so many channels, so many types: {line}")
            channels |= zip(*cells)
    return channels


class Messages(unittest.TestCase):
    def test_the_page_has_every_channel_and_its_type(self):
        self.assertGreater(len(of_types()), 40)
        self.assertEqual(of_page(), of_types())


if __name__ == "__main__":
    unittest.main()
