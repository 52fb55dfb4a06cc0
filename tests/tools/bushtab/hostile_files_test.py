#!/usr/bin/env python3
"""Table files that nobody means well: every command refuses them with their place, within a second of processor
time, and leaves them as they are. The program is $BUSHTAB."""

import os
import pathlib
import re
import resource
import subprocess
import tempfile
import unittest

# A file is this with one thing changed.
GOOD = 'name = "h"\ntime_unit_ns = 1000\naccel = [9, 7, 5]\n'
CODES = "[9, 7, 5]"
SECONDS = 1
BUILT_WITH_SANITIZERS = "LSAN_OPTIONS" in os.environ and b"__asan_init" in pathlib.Path(os.environ["BUSHTAB"]).read_bytes()


def accel(text):
    return GOOD.replace(CODES, text).encode()


# What it is called: the file, and where and why it is refused.
HOSTILE = {
    "not a number": (accel("[9, nan]"), r":3:13: accel\[1\]: is the floating-point number nan"),
    "minus not a number": (accel("[9, -nan]"), r":3:13: accel\[1\]: is the floating-point number"),
    "infinite": (accel("[9, inf]"), r":3:13: accel\[1\]: is the floating-point number inf"),
    "fraction": (accel("[9, 7.0]"), r":3:13: accel\[1\]: is the floating-point number 7"),
    "power of ten": (accel("[9, 1e9]"), r":3:13: accel\[1\]: is the floating-point number"),
    "negative": (accel("[9, -5]"), r":3:13: accel\[1\]: is -5"),
    "zero": (accel("[9, 0]"), r":3:13: accel\[1\]: is 0"),
    "beyond 16 bits": (accel("[1000000000, 9]"), r":3:10: accel\[0\]: is 1000000000"),
    "beyond 64 bits": (accel("[99999999999999999999, 9]"), r":3:\d+: not TOML"),
    "text": (accel('[9, "7"]'), r":3:13: accel\[1\]: is the string"),
    "date": (accel("[9, 2026-01-01]"), r":3:13: accel\[1\]: is a date"),
    "truth": (accel("[true]"), r":3:10: accel\[0\]: is true"),
    "array in it": (accel("[9, [7]]"), r":3:13: accel\[1\]: is an array"),
    "table in it": (accel("[9, {a = 7}]"), r":3:13: accel\[1\]: is a table"),
    "no array": (accel("9"), r":3:9: accel: is 9; allowed: an array"),
    "nothing in it": (accel("[]"), r":3:9: accel: is empty"),
    "not closed": (accel("[9, 7"), r":\d+:\d+: not TOML"),
    "twice": (accel(CODES + "\naccel = [9]"), r":4:9: not TOML: .*cannot redefine"),
    "unit is text": (GOOD.replace("1000", '"1ms"').encode(), r":2:16: time_unit_ns: is the string"),
    "unit is negative": (GOOD.replace("1000", "-1").encode(), r":2:16: time_unit_ns: is -1"),
    "unit is huge": (GOOD.replace("1000", "1000000001").encode(), r":2:16: time_unit_ns: is 1000000001"),
    "name is a number": (GOOD.replace('"h"', "5").encode(), r":1:8: name: is 5"),
    "name has control characters": (GOOD.replace('"h"', r'"\u001b[2J"').encode(), r":1:8: name: "),
    "decel is a table": (accel(CODES + "\n[decel]\na = 1"), r":4:1: decel: is a table"),
    "unknown key": (accel(CODES + "\nspeed = 1"), r":4:1: speed: unknown key"),
    "not UTF-8": (accel(CODES) + b"# \xff\n", r":4:3: byte 0xff is not text; allowed: UTF-8"),
    "not UTF-8 in a name": (GOOD.encode().replace(b'"h"', b'"\xc3\x28"'), r":1:9: byte 0xc3 is not text"),
    "UTF-16": (GOOD.encode("utf-16"), r":1:1: byte 0xff is not text"),
    "zero bytes": (accel("[9, \0]"), r":3:13: byte 0x00 is not text"),
    "deep arrays": (accel("[" * 100_000), r":3:\d+: not TOML: "),
    "deep tables": (accel("{a=" * 100_000), r":3:\d+: not TOML: "),
    "deep keys": (accel(CODES + "\n" + "a." * 100_000 + "a = 1"), r":4:32: a key of more than 16 parts"),
    "a hundred thousand codes": (accel("[" + "1," * 100_000 + "]"), r":3:9: accel: makes 100000 codes in all"),
    "longer than all time": (accel("[" + "65535," * 40_000 + "]"), r":3:\d+: accel\[\d+\]: the delays between rest"),
}

COMMANDS = (
    ["check", "h"],
    ["show", "h", "--steps"],
    ["list"],
    ["time", "h", "--steps", "5"],
    ["diff", "h", "bushd2-constant"],
    ["plot", "h"],
    ["expand", "--table", "h", "--steps", "5", "--tick-us", "2560", "--format", "fine"],
    ["set", "h", "0", "9"],
    ["scale", "h", "--speed", "0.5"],
    ["copy", "h", "other"],
    ["export-bushd", "h", "image", "--steps", "5"],
)


class HostileFiles(unittest.TestCase):
    def setUp(self):
        directory = tempfile.TemporaryDirectory()
        self.addCleanup(directory.cleanup)
        self.path = pathlib.Path(directory.name)
        self.file = self.path / "h.toml"

    def bushtab(self, *arguments):
        def limit():
            if not BUILT_WITH_SANITIZERS:
                resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS))

        return subprocess.run(
            [os.environ["BUSHTAB"], "--dir", self.path, *arguments],
            capture_output=True,
            cwd=self.path,
            preexec_fn=limit,
        )

    def assert_refused(self, place, *arguments):
        done = self.bushtab(*arguments)
        self.assertEqual(done.returncode, 1, done.stderr[:300])
        self.assertTrue(re.search(rb"h\.toml" + place.encode(), done.stderr), done.stderr[:300])
        # One line of a length that can be read, without what would move the cursor.
        self.assertEqual(done.stderr.count(b"\n"), 1)
        self.assertLess(len(done.stderr), 1000)
        self.assertNotIn(b"\x1b", done.stderr)

    def test_each_is_refused_with_line_and_column(self):
        for name, (content, place) in HOSTILE.items():
            with self.subTest(name):
                self.file.write_bytes(content)
                self.assert_refused(place, "check", "h")

    def test_every_command_refuses_and_leaves_all_as_it_is(self):
        for name in ("not a number", "not UTF-8", "deep arrays", "a hundred thousand codes"):
            content, place = HOSTILE[name]
            self.file.write_bytes(content)
            for command in COMMANDS:
                with self.subTest(name, command=command[0]):
                    self.assert_refused(place, *command)
                    self.assertEqual(self.file.read_bytes(), content)
                    self.assertEqual(os.listdir(self.path), ["h.toml"])

    def test_a_thousand_million_entries_are_not_even_read(self):
        with self.file.open("wb") as file:
            file.write(accel("[" + "1," * 1000))
            file.seek(2_000_000_000)
            file.write(b"1]\n")
        self.assert_refused(r": cannot be read: larger than 2097152 bytes", "check", "h")

    def test_endless_files_are_refused(self):
        os.symlink("/dev/zero", self.file)
        self.assert_refused(r": cannot be read: not a regular file", "check", "h")

    def test_texts_do_not_steer_the_terminal(self):
        self.file.write_text(GOOD + 'description = "\\u001b[2Jgone"\n')
        for command in (["show", "h"], ["list"]):
            with self.subTest(command[0]):
                done = self.bushtab(*command)
                self.assertEqual(done.returncode, 0, done.stderr)
                self.assertIn(rb"\x1b[2Jgone", done.stdout)

    def test_a_negative_index_is_told_as_it_was_given(self):
        self.file.write_text(GOOD)
        done = self.bushtab("set", "h", "--", "-1", "5")
        self.assertNotEqual(done.returncode, 0)
        self.assertIn(b"-1", done.stderr)
        self.assertEqual(self.file.read_text(), GOOD)

    def test_torque_curves_too(self):
        self.file.write_text(GOOD)
        for content, place in (
            (b"speed_hz,torque_nm\n1,nan\n", b"m.csv:2: is not a point"),
            (b"speed_hz,torque_nm\n-1,2\n", b"m.csv:2: is not a point"),
            (b"speed_hz,torque_nm\n1,1e999\n", b"m.csv:2: is not a point"),
            (b"\xff\xfe\n", b"m.csv:1: is no header"),
            (b"speed_hz,torque_nm\n" + b"1," * 1_000_000, b"m.csv:2: is not a point"),
        ):
            with self.subTest(content[:30]):
                (self.path / "m.csv").write_bytes(content)
                done = self.bushtab("check", "h", "--torque", "m.csv", "--inertia", "38gcm2")
                self.assertEqual(done.returncode, 1)
                self.assertIn(place, done.stderr)

    def test_what_steers_a_terminal_is_shown_escaped(self):
        hostile = "e\x1b[2J\x7f\x9b31m\u202edcba\u2066"
        shown = r"e\x1b[2J\x7f\u009b31m\u202edcba\u2066"
        path = self.path / f"{hostile}.toml"
        path.write_text(GOOD + 'description = "\u202eback"\n')
        for arguments, code in (
            (["show", path], 0),
            (["check", path], 0),
            (["plot", path], 0),
            (["set", path, "0", "1"], 1),
            (["set", path, "0", "89"], 0),
            (["tag", path, "good\u202e"], 0),
            (["log", path], 0),
            (["list"], 0),
            (["show", path, "--json"], 0),
            (["show", hostile], 1),
            (["check", path.parent / f"no-{hostile}.toml"], 1),
            (["show", path, f"--{hostile}"], 2),
        ):
            with self.subTest(arguments):
                done = self.bushtab(*arguments)
                self.assertEqual(done.returncode, code, done.stderr)
                said = (done.stdout + done.stderr).decode()
                self.assertFalse(set(said) & set("\x1b\x7f\x9b\u202e\u2066"), said)
                if "--json" not in arguments and arguments[0] not in ("log", "tag") and code != 1 or arguments[0] == "check":
                    self.assertIn(shown, said)


if __name__ == "__main__":
    unittest.main()
