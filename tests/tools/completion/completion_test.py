#!/usr/bin/env python3
"""Completion of the programs in $BUSHD_BIN, asked as bash, zsh and fish ask it."""

import os
import pathlib
import subprocess
import tempfile
import unittest

SCRIPTS = pathlib.Path(os.environ["BUSHD_SOURCE_DIR"]) / "tools/completion"
BIN = pathlib.Path(os.environ["BUSHD_BIN"])
BASH = """
source "$1"; shift
COMP_WORDS=("$@") COMP_CWORD=$(($# - 1))
_bushd_complete 2>/dev/null
printf '%s\\n' "${COMPREPLY[@]}"
"""
ZSH = """
compadd() { shift; print -l -- "$@" }
_files() { if [[ $1 = -g ]]; then print -l -- ${~2}(N); else print -l -- *(N); fi }
script=$1; shift
words=("$@") CURRENT=$#
source $script
"""


def complete_in_bash(program, *words, directory=None):
    done = subprocess.run(
        ["bash", "-c", BASH, "bash", SCRIPTS / "completion.bash", BIN / program, *words],
        capture_output=True,
        text=True,
        check=True,
        cwd=directory,
    )
    return set(done.stdout.split())


class Bushtab(unittest.TestCase):
    def complete(self, *words, directory=None):
        return complete_in_bash("bushtab", *words, directory=directory)

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
            self.assertEqual(self.complete("new", "t", "--torque", "mo", directory=directory), {"more.csv"})


class Others(unittest.TestCase):
    def test_bushctl(self):
        self.assertEqual(complete_in_bash("bushctl", "mov"), {"move"})
        self.assertEqual(complete_in_bash("bushctl", "doc"), {"doctor"})
        self.assertEqual(complete_in_bash("bushctl", "setup", "--dry"), {"--dry-run"})
        self.assertEqual(complete_in_bash("bushctl", "table", ""), {"list", "show", "use", "reload"})
        self.assertEqual(complete_in_bash("bushctl", "arm", "--edge", ""), {"rising", "falling"})
        self.assertEqual(complete_in_bash("bushctl", "move", "--dry"), {"--dry-run"})
        self.assertEqual(complete_in_bash("bushctl", "move", "theta", ""), {"--to"})
        self.assertEqual(complete_in_bash("bushctl", "move", "theta", "--t"), {"--to"})
        self.assertEqual(complete_in_bash("bushctl", "--socket", "/nowhere", "move", "theta", "5", ""), set())
        self.assertIn("offset=", complete_in_bash("bushctl", "config", "theta", "o"))
        self.assertEqual(complete_in_bash("bushctl", "--socket", "/nowhere", "config", "o"), set())
        self.assertEqual(complete_in_bash("bushctl", "--socket", "/nowhere", "stop", ""), set())

    def test_tokens_by_name(self):
        with tempfile.TemporaryDirectory() as directory:
            tokens = pathlib.Path(directory) / "tokens"
            tokens.write_text(f"{'a' * 64} tablet 2 1 anna\n{'b' * 64} otto 2 1 anna\n")
            self.assertEqual(complete_in_bash("bushctl", "web-token", "--file", tokens, "--revoke", ""), {"otto", "tablet"})
            self.assertEqual(complete_in_bash("bushctl", "web-token", "--file", tokens, "--revoke", "t"), {"tablet"})
            self.assertEqual(complete_in_bash("bushctl", "web-token", "--file", tokens, "t"), set())
            self.assertEqual(complete_in_bash("bushctl", "web-token", "--file", "to", directory=directory), {"tokens"})

    def test_daemon_and_simulator(self):
        self.assertEqual(complete_in_bash("bushd", "--check"), {"--check-config"})
        self.assertEqual(complete_in_bash("bushsim", "--tr"), {"--trace"})
        with tempfile.TemporaryDirectory() as directory:
            (pathlib.Path(directory) / "bushd.toml").write_text("")
            self.assertEqual(complete_in_bash("bushd", "--config", "bu", directory=directory), {"bushd.toml"})


class OtherShells(unittest.TestCase):
    def zsh(self, program, *words, directory=None):
        command = ["zsh", "-f", "-c", ZSH, "zsh", SCRIPTS / "_bushd", BIN / program, *words]
        return set(subprocess.run(command, capture_output=True, text=True, check=True, cwd=directory).stdout.split())

    def test_zsh(self):
        self.assertEqual(self.zsh("bushctl", "table", ""), {"list", "show", "use", "reload"})
        self.assertEqual(self.zsh("bushtab", "new", "t", "--law", "p"), {"pto", "piecewise"})
        self.assertEqual(self.zsh("bushctl", "--socket", "/nowhere", "stop", ""), set())
        with tempfile.TemporaryDirectory() as directory:
            (pathlib.Path(directory) / "mine.toml").write_text("")
            (pathlib.Path(directory) / "more.csv").write_text("")
            shown = self.zsh("bushtab", "show", "", directory=directory)
            self.assertLessEqual({"mine.toml", "bushd2-constant"}, shown)
            self.assertNotIn("more.csv", shown)

    def test_fish(self):
        with tempfile.TemporaryDirectory() as home:
            environment = {**os.environ, "HOME": home, "PATH": f"{BIN}:{os.environ['PATH']}"}

            def fish(line):
                script = f"source {SCRIPTS}/completion.fish; complete -C '{line}'"
                command = ["fish", "--no-config", "-c", script]
                done = subprocess.run(command, capture_output=True, text=True, check=True, env=environment)
                return set(done.stdout.split())

            self.assertEqual(fish("bushctl table "), {"list", "show", "use", "reload"})
            self.assertEqual(fish("bushctl arm --edge "), {"rising", "falling"})
            self.assertEqual(fish("bushtab plot bushd2-c"), {"bushd2-constant"})


if __name__ == "__main__":
    unittest.main()
