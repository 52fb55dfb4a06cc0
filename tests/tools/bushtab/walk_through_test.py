#!/usr/bin/env python3
"""The walk-through of docs/tables.md, command by command. The programs are $BUSHTAB and $BUSHD."""

import os
import pathlib
import re
import subprocess
import tempfile
import unittest

DOCS = pathlib.Path(os.environ["BUSHD_SOURCE_DIR"]) / "docs"
HEADING = "## From a data sheet to a table in service\n"


def walk_through():
    """Yields ("file", name, text) and ("command", line, output) in the order of the page."""
    section = (DOCS / "tables.md").read_text().split(HEADING)[1].split("\n## ")[0]
    for before, language, body in re.findall(r"([^\n]*)\n\n```([a-z]+)\n(.*?)```\n", section, re.DOTALL):
        if language != "console":
            yield "file", re.search(r"`([^`]+)`:$", before)[1], body
            continue
        for command in re.split(r"^\$ ", body, flags=re.MULTILINE)[1:]:
            line, output = command.split("\n", 1)
            yield "command", line, output


class WalkThrough(unittest.TestCase):
    def setUp(self):
        directory = tempfile.TemporaryDirectory()
        self.addCleanup(directory.cleanup)
        self.directory = pathlib.Path(directory.name)

    def run_all(self):
        """Yields (command, output in the page, output). One shell runs them all, as a user's does."""
        environment = dict(os.environ, LC_ALL="C.UTF-8")
        environment["PATH"] = ":".join(
            [*(str(pathlib.Path(os.environ[name]).parent) for name in ("BUSHTAB", "BUSHD")), os.environ["PATH"]]
        )
        shell = subprocess.Popen(
            ["bash"],
            cwd=self.directory,
            env=environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        with shell:
            for kind, what, text in walk_through():
                if kind == "file":
                    (self.directory / what).write_text(text)
                    continue
                shell.stdin.write(f"{what}\necho done $?\n")
                shell.stdin.flush()
                output = ""
                while not (end := re.search(r"^done (\d+)\n\Z", output, re.MULTILINE)):
                    line = shell.stdout.readline()
                    self.assertTrue(line, f"the shell ended in {what}")
                    output += line
                self.assertEqual(end[1], "0", f"{what}\n{output}")
                yield what, text.rstrip("\n"), output[: end.start()].rstrip("\n")
            shell.stdin.close()

    def test_commands_print_what_the_page_says(self):
        section = (DOCS / "tables.md").read_text().split(HEADING)[1].split("\n## ")[0]
        ran = 0
        for command, documented, output in self.run_all():
            with self.subTest(command):
                self.assertEqual(output, documented)
            ran += 1
        self.assertEqual(ran, len(re.findall(r"^\$ ", section, re.MULTILINE)), "commands of the page were passed over")

    def test_picture_is_the_one_that_the_commands_make(self):
        for _ in self.run_all():
            pass
        self.assertEqual((self.directory / "stage.svg").read_text(), (DOCS / "pictures" / "stage.svg").read_text())


if __name__ == "__main__":
    unittest.main()
