#!/usr/bin/env python3
"""docs/man/bushtab.1 and bushtab --help tell of the same commands and options. The program is $BUSHTAB."""

import os
import pathlib
import re
import subprocess
import unittest

PAGE = pathlib.Path(os.environ["BUSHD_SOURCE_DIR"]) / "docs/man/bushtab.1"


def bushtab_help(*command):
    return subprocess.run(
        [os.environ["BUSHTAB"], *command, "--help"], capture_output=True, text=True, check=True
    ).stdout


def options_in_help(*command):
    found = set(re.findall(r"^ +(?:-h,)?(--[a-z][a-z0-9-]*)", bushtab_help(*command), re.MULTILINE))
    return found - {"--help"} if command else found


def commands_in_help():
    listed = bushtab_help().split("Subcommands:\n")[1].split("\n\n")[0]
    return set(re.findall(r"^  ([a-z0-9-]+)", listed, re.MULTILINE))


def options_in(section):
    heads = re.findall(r"^\.TP\n(.*)$", section, re.MULTILINE)
    return {option for head in heads for option in re.findall(r"--[a-z][a-z0-9-]*", head)}


TYPE = re.compile(r"(?:(?!Needs|Excludes)\S+(?: in \[-?\d+ - \d+\])?(?: \.\.\.)?(?: REQUIRED)?)?(?: ?(?:Needs|Excludes): \S+)?")


def entries_in_help(*command):
    """Each option with its type and description."""
    text = bushtab_help(*command).split("Options:\n", 1)[1]
    entries = re.findall(r"^ +(--[a-z][a-z0-9-]*)\b(.*(?:\n {20,}.*)?)", text, re.MULTILINE)
    return {name: " ".join(rest.split()) for name, rest in entries}


def descriptions_in(section):
    entries = [entry.split("\n", 1) for entry in section.split(".TP\n")[1:]]
    found = {}
    for head, body in entries:
        if names := re.findall(r"--[a-z][a-z0-9-]*", head):
            body = re.split(r"^\.(?:PP|SS|TS)", body, maxsplit=1, flags=re.MULTILINE)[0]
            body = re.sub(r"^\.[A-Z]+ ?", "", re.sub(r"\\f.", "", body).replace(r"\(aq", "'"), flags=re.MULTILINE)
            found[names[0]] = " ".join(body.split())
    return found


class ManPage(unittest.TestCase):
    def setUp(self):
        text = PAGE.read_text().replace(r"\-", "-")
        self.options = text.split(".SH OPTIONS\n")[1].split("\n.SH ")[0]
        sections = text.split(".SH COMMANDS\n")[1].split("\n.SH ")[0].split(".SS ")[1:]
        self.commands = {section.split("\n")[0]: section for section in sections}

    def test_commands_are_the_same(self):
        self.assertEqual(set(self.commands), commands_in_help())

    def test_options_are_the_same(self):
        self.assertEqual(options_in(self.options), options_in_help())
        for name, section in self.commands.items():
            with self.subTest(name):
                self.assertEqual(options_in(section), options_in_help(name))

    def test_descriptions_defaults_and_units_are_the_same(self):
        for name, section in self.commands.items():
            described = descriptions_in(section)
            for option, entry in entries_in_help(name).items():
                with self.subTest(f"{name} {option}"):
                    self.assertTrue(entry.endswith(described[option]), f"{entry}\n{described[option]}")
                    self.assertRegex(entry.removesuffix(described[option]).strip(), rf"\A{TYPE.pattern}\Z")

    def test_operands_are_the_same(self):
        for name, section in self.commands.items():
            with self.subTest(name):
                usage = re.search(r"^Usage: .* \[OPTIONS\](.*)$", bushtab_help(name), re.MULTILINE)
                operands = re.search(r"^\\fB.*?\\fR(.*)$", section, re.MULTILINE).group(1)
                self.assertEqual(re.findall("[A-Z]+", re.sub(r"\\f.", "", operands)), re.findall("[A-Z]+", usage.group(1)))


if __name__ == "__main__":
    unittest.main()
