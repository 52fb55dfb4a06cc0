#!/usr/bin/env python3
"""Standard output that does not take what is written: a full disk, a reader that went away. The program is $BUSHTAB."""

import os
import subprocess
import tempfile
import unittest

TABLE = 'name = "t"\ntime_unit_ns = 1000\naccel = [90, 70, 50]\n'
NEW = ["new", "u", "--law", "constant", "--start", "100Hz", "--max", "1kHz", "--acceleration", "5kHz/s"]
COMMANDS = [
    ["--help"],
    ["show", "--help"],
    ["show", "t"],
    ["show", "t", "--json"],
    ["show", "t", "--steps"],
    ["show", "bushd2-constant", "--steps", "--converter", "2500:250"],
    ["check", "t"],
    ["list"],
    ["time", "t", "--steps", "5"],
    ["plot", "t"],
    ["diff", "t", "bushd2-constant"],
    ["expand", "--table", "t", "--steps", "9", "--tick-us", "2560", "--format", "fine"],
    [*NEW, "--print"],
    NEW,
    ["set", "t", "1", "71"],
    ["log", "t"],
    ["tag", "t", "good"],
    ["copy", "t", "v"],
]


class Output(unittest.TestCase):
    def setUp(self):
        directory = tempfile.TemporaryDirectory()
        self.addCleanup(directory.cleanup)
        self.directory = directory.name
        with open(os.path.join(self.directory, "t.toml"), "w") as file:
            file.write(TABLE)

    def run_to(self, command, output):
        return subprocess.run(
            [os.environ["BUSHTAB"], *command, "--dir", self.directory], stdout=output, stderr=subprocess.PIPE, text=True
        )

    def test_full_disk_is_an_error_that_is_told(self):
        for command in COMMANDS:
            with self.subTest(command), open("/dev/full", "w") as full:
                done = self.run_to(command, full)
                self.assertEqual(done.returncode, 1)
                self.assertEqual(done.stderr.count("cannot write to standard output: "), 1, done.stderr)

    def test_closed_pipe_is_an_error_and_no_signal(self):
        for command in COMMANDS:
            with self.subTest(command):
                reader, writer = os.pipe()
                os.close(reader)
                done = self.run_to(command, writer)
                os.close(writer)
                self.assertEqual((done.returncode, done.stderr), (1, ""))


if __name__ == "__main__":
    unittest.main()
