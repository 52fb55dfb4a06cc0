#!/usr/bin/env python3
"""--json of bushtab's commands: always one JSON value on stdout. The program is $BUSHTAB."""

import json
import os
import pathlib
import re
import subprocess
import tempfile
import unittest
from fractions import Fraction

TABLE = 'name = "t"\ntime_unit_ns = 1000\naccel = [90, 70, 50]\n'
WITHOUT_DATA = {"plot", "tui", "wizard"}  # what they print is for people


class Json(unittest.TestCase):
    def setUp(self):
        directory = tempfile.TemporaryDirectory()
        self.addCleanup(directory.cleanup)
        self.path = pathlib.Path(directory.name)
        (self.path / "t.toml").write_text(TABLE)

    def bushtab(self, *arguments, **environment):
        return subprocess.run(
            [os.environ["BUSHTAB"], *map(str, arguments), "--dir", self.path],
            capture_output=True,
            text=True,
            env=dict(os.environ, **environment),
        )

    def json(self, *arguments, **environment):
        done = self.bushtab(*arguments, "--json", **environment)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        return json.loads(done.stdout)

    def test_every_command_that_prints_data_has_it(self):
        listed = self.bushtab("--help").stdout.split("Subcommands:\n")[1].split("\n\n")[0]
        commands = set(re.findall(r"^  ([a-z-]+)", listed, re.MULTILINE))
        without = {name for name in commands if "--json" not in self.bushtab(name, "--help").stdout}
        self.assertEqual(without, WITHOUT_DATA)

    def test_new_tells_what_was_made(self):
        made = self.json("new", "n", "--law", "constant", "--start", "200Hz", "--max", "4kHz", "--time", "50ms")
        self.assertEqual((made["name"], made["revision"]), ("n", 1))
        self.assertEqual(made["path"], str(self.path / "n.toml"))
        self.assertEqual(made, self.json("show", "n"))
        self.assertEqual(self.bushtab("new", "p", "--print", "--json").returncode, 2)

    def test_changes_tell_what_the_table_is_now(self):
        self.assertEqual(self.json("set", "t", "1", "71")["revision"], 2)
        self.assertEqual(self.json("insert", "t", "2", "60")["accel"]["codes"], 4)
        self.assertEqual(self.json("delete", "t", "2")["accel"]["codes"], 3)
        self.assertEqual(self.json("set", "t", "1", "71")["revision"], 4)  # nothing to change
        self.assertEqual(self.json("scale", "t", "--speed", "0.5")["accel"]["fastest_code"], 100)
        self.assertEqual(self.json("resample", "t", "--time-unit", "2us")["time_unit_ns"], 2000)
        self.assertEqual(self.json("reverse", "t"), self.json("show", "t"))
        self.assertEqual(self.json("edit", "t", EDITOR="sed -i s/90/80/", VISUAL="")["path"], str(self.path / "t.toml"))
        self.assertEqual(self.json("copy", "t", "other")["name"], "other")
        self.assertEqual(self.json("tag", "t", "good", "2"), {"name": "t", "revision": 2, "tag": "good"})
        self.assertEqual(self.json("revert", "t", "good")["accel"]["slowest_code"], 90)
        self.assertEqual(self.json("log", "t")[-2]["tags"], ["good"])

    def test_codes_of_a_converter_are_the_largest_that_are_not_too_fast(self):
        for max_hz, max_code in ((2500, 250), (2500, 255), (9999, 1), (2500, 7)):
            per_code = Fraction(max_hz, max_code)
            shown = self.json("show", "bushd2-constant", "--steps", "--converter", f"{max_hz}:{max_code}")
            for step in shown["steps"]:
                speed = Fraction(10**9, step["delay_ns"])
                code = step["converter_code"]
                self.assertLessEqual(code * per_code, speed)
                self.assertTrue(code == max_code or (code + 1) * per_code > speed)
        self.assertNotIn("converter_code", self.json("show", "t", "--steps")["steps"][0])

    def test_converter_that_no_board_has_is_refused(self):
        for converter, said in (
            ("2500:256", "allowed is a MAX_CODE of 1..255"),
            ("2500:0", "allowed is a MAX_CODE of 1..255"),
            ("400:201", "a MAX_HZ of 2 times it to 10000"),
            ("10001:250", "a MAX_HZ of 2 times it to 10000"),
            ("2499:250", "the table has steps 400000 ns apart"),
        ):
            done = self.bushtab("show", "bushd2-constant", "--steps", "--converter", converter)
            self.assertEqual((done.returncode, done.stdout), (1, ""))
            self.assertIn(said, done.stderr)
        self.assertEqual(self.bushtab("show", "t", "--converter", "2500:250").returncode, 2)
        for bad in ("2500", "2500:", ":250", "2500:250x", "-1:2", "2500:99999999999"):
            done = self.bushtab("show", "t", "--steps", "--converter", bad)
            self.assertEqual(done.returncode, 2, bad)
            self.assertIn("is not MAX_HZ:MAX_CODE, such as 2500:250", done.stderr)

    def test_refusal_prints_no_data(self):
        done = self.bushtab("set", "t", "1", "95", "--json")
        self.assertEqual((done.returncode, done.stdout), (1, ""))
        self.assertIn("accel[1]: is 95 after 90", done.stderr)

    def test_expand_has_the_displacements_of_the_csv(self):
        move = ["expand", "--table", "bushd2-constant", "--steps", "5000", "--tick-us", "2560", "--format", "fine"]
        table = self.bushtab(*move).stdout.split()[1:]
        told = self.json(*move)
        self.assertEqual((told["tick_us"], told["format"]), (2560, "fine"))
        self.assertEqual([f"{tick},{value}" for tick, value in enumerate(told["displacements"])], table)
        self.assertEqual(self.json(*move[:4], "0", *move[5:])["displacements"], [])

    def test_images(self):
        image = self.path / "image"
        sent = self.json("export-bushd", "t", image, "--steps", "90", "--resample", "--positions", "ab" * 16)
        self.assertEqual((sent["page"], sent["steps"], sent["positions"]), (0, 90, "ab" * 16))
        self.assertGreaterEqual(sent["resampled"]["worst_speed_error"], 0)
        back = self.json("import-bushd", image, "back", "--start", f"{sent['start_hz']}Hz")
        self.assertEqual((back["steps"], back["positions"], back["revision"]), (90, "ab" * 16, 1))
        travel = self.json("export-bushd", "t", image, "--steps", "6", "--bushd1", "--reactor-delay", "7")
        self.assertEqual((travel["steps"], travel["reactor_delay_code"]), (6, 7))

    def test_looks(self):
        self.assertEqual(self.json("time", "t", "--steps", "5")[0]["time_ns"], 370000)
        self.assertTrue(self.json("diff", "t", "t")["same_content"])
        self.assertIn("t", [table["name"] for table in self.json("list")])
        self.assertTrue(self.json("check", "t")[0]["good"])


if __name__ == "__main__":
    unittest.main()
