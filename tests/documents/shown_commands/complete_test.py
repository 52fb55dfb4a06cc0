#!/usr/bin/env python3
"""Every command that a page shows is run in the page's world (worlds/), or stands in not_run.toml; and nothing there is out of date.

Prints how many there are. $BUSHD_SOURCE_DIR and $BUSHD_BUILD_DIR are the trees."""

import pathlib
import re
import sys
import unittest

from listed import Listed
from shown import all_pages, help_of, programs, shown_on, what_is_missing
from world import HERE, read_world, world_file


class ShownCommands(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.listed = Listed()
        cls.shown = {page: shown_on(page)[0] for page in all_pages()}

    def test_each_is_run_or_listed_with_a_reason(self):
        counts = {"run": 0, "named": 0, "listed": 0}
        for page, shown_here in self.shown.items():
            for shown in shown_here:
                world = read_world(page)
                if self.listed.reason(shown):
                    counts["listed"] += 1
                elif shown.is_mention or shown.text in (world or {}).get("mentions", []):
                    counts["named"] += 1
                    with self.subTest(str(shown)):
                        self.assertEqual(what_is_missing(shown.text), "")
                else:
                    counts["run"] += 1
                    with self.subTest(str(shown)):
                        self.assertIsNotNone(world, f"nobody runs it: neither worlds/{world_file(page).name} nor not_run.toml")
        print(f"{sum(counts.values())} commands on {len(self.shown)} pages:", counts, file=sys.stderr)
        self.assertGreater(counts["run"], 200)
        self.assertEqual(self.listed.unused(), [], "not_run.toml lists what no page shows")
        self.assertEqual([*self.listed.not_there()], [])

    def test_each_world_is_that_of_a_page(self):
        worlds = {world_file(page).name for page in self.shown}
        self.assertEqual({file.name for file in HERE.glob("worlds/*")} - worlds, set())
        self.assertEqual(len(worlds), len(self.shown), "two pages have one world")

    def test_help_says_a_default_once(self):
        for command in programs():
            for line in re.sub(r"\n {20,}", " ", help_of(*command)).splitlines():
                if re.match(r" +\S*--[a-z-]+ [A-Z][A-Za-z:{},]*=\S", line):
                    with self.subTest(" ".join([pathlib.Path(command[0]).name, *command[1:]])):
                        self.assertNotRegex(line, r"\(default:? ")


if __name__ == "__main__":
    unittest.main()
