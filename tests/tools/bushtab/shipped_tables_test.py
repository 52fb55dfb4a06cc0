#!/usr/bin/env python3
"""The files in tables/ are what tables/make makes. The program is $BUSHTAB."""

import os
import pathlib
import subprocess
import tempfile
import unittest

TABLES = pathlib.Path(os.environ["BUSHD_SOURCE_DIR"]) / "tables"


def contents(directory):
    return {path.name: path.read_text() for path in directory.glob("*.toml")}


class ShippedTables(unittest.TestCase):
    def test_are_what_the_script_makes(self):
        with tempfile.TemporaryDirectory() as directory:
            subprocess.run([TABLES / "make", directory], check=True)
            made = contents(pathlib.Path(directory))
        shipped = contents(TABLES)
        self.assertGreaterEqual(len(shipped), 12)
        self.assertEqual(set(shipped), set(made), "files that tables/make does not make, or that are missing")
        for name, text in made.items():
            self.assertEqual(shipped[name], text, f"{name}: run tables/make")

    def test_each_has_a_comment_and_a_description(self):
        for name, text in contents(TABLES).items():
            self.assertTrue(text.startswith("# "), name)
            self.assertIn("\ndescription = ", text, name)

    def test_checks_find_nothing(self):
        done = subprocess.run(
            [os.environ["BUSHTAB"], "check", "--strict", "--tick-us", "2560", *sorted(TABLES.glob("*.toml"))],
            capture_output=True,
            text=True,
        )
        self.assertEqual((done.returncode, done.stderr), (0, ""), done.stdout)


if __name__ == "__main__":
    unittest.main()
