#!/usr/bin/env python3
"""bash completion of bushtab, asked as bash asks it. The program is $BUSHTAB."""

import os
import pathlib
import subprocess
import tempfile
import unittest

SCRIPT = pathlib.Path(os.environ["BUSHD_SOURCE_DIR"]) / "tools/bushtab/bushtab.bash"
COMPLETE = """
source "$1"; shift
COMP_WORDS=("$@") COMP_CWORD=$(($# - 1))
_bushtab 2>/dev/null
printf '%s\\n' "${COMPREPLY[@]}"
"""


class Completion(unittest.TestCase):
    def complete(self, *words, directory=None):
        done = subprocess.run(
            ["bash", "-c", COMPLETE, "bash", SCRIPT, os.environ["BUSHTAB"], *words],
            capture_output=True,
            text=True,
            check=True,
            cwd=directory,
        )
        return set(done.stdout.split())

    def test_commands(self):
        self.assertEqual(self.complete("re"), {"resample", "reverse", "revert"})
        self.assertIn("new", self.complete(""))
        self.assertEqual(self.complete("--dir", "somewhere", "export"), {"export-bushd"})

    def test_options_of_the_command_and_those_of_all(self):
        self.assertEqual(self.complete("show", "--s"), {"--steps"})
        self.assertEqual(self.complete("plot", "--"), {"--help", "--version", "--svg", "--png", "--dir", "--history"})
        self.assertEqual(self.complete("scale", "t", "--ac"), {"--acceleration"})

    def test_values_that_an_option_allows(self):
        self.assertEqual(self.complete("new", "t", "--law", "p"), {"pto", "piecewise"})
        self.assertEqual(self.complete("new", "t", "--decel-law", "v"), {"v64"})
        self.assertEqual(self.complete("new", "t", "--start", ""), set())

    def test_tables_by_name_and_file(self):
        with tempfile.TemporaryDirectory() as directory:
            text = 'name = "mine"\ntime_unit_ns = 1000\naccel = [90, 70]\n'
            (pathlib.Path(directory) / "mine.toml").write_text(text)
            (pathlib.Path(directory) / "more.csv").write_text("")
            self.assertEqual(self.complete("show", "m", directory=directory) & {"mine.toml", "more.csv"}, {"mine.toml"})
            self.assertIn("mine", self.complete("--dir", directory, "show", "m"))
            self.assertEqual(self.complete("plot", "bushd2-c"), {"bushd2-constant"})
            self.assertEqual(self.complete("expand", "--table", "bushd2-c"), {"bushd2-constant"})
            self.assertEqual(
                self.complete("new", "t", "--torque", "mo", directory=directory), {"more.csv"}
            )


if __name__ == "__main__":
    unittest.main()
