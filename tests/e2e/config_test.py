"""Good and bad configurations, told by --check-config and at the start alike."""

import re
import unittest

from rig import EndToEndTest, configuration, program

# What is changed in a good file, and what the message says after "FILE:LINE: ".
BAD = {
    "unknown_key": ("baud = 500000", "baud = 500000\nparity = 1", r"bus\[0\]\.parity: "),
    "missing_key": ("baud = 500000\n", "", r"bus\[0\]\.baud: "),
    "wrong_rate": ("baud = 500000", "baud = 500001", r"bus\[0\]\.baud: "),
    "wrong_type": ("tick_us = 2560", 'tick_us = "2560"', r"bus\[0\]\.tick_us: "),
    "wrong_format": ('format = "fine"', 'format = "finest"', r"bus\[0\]\.format: .*coarse"),
    "output_twice": ("output = 1\n", "output = 0\n", r"motor\[1\]\.output: "),
    "name_twice": ('name = "a1"', 'name = "a0"', r"motor\[1\]\.name: "),
    "unknown_mcu": ('mcu = "hall:1"\noutput = 2', 'mcu = "hall:9"\noutput = 2', r"motor\[2\]\.mcu: "),
    "unknown_group": ('output = 3\ngroup = "group3"', 'output = 3\ngroup = "group9"', r"motor\[3\]\.group: "),
    "unknown_table": ('table = "bushd2-scurve"', 'table = "bushd2-none"', r"group\[1\]\.table: "),
    "line_too_slow": ("baud = 500000", "baud = 9600", r"bus\[0\]\."),
    "no_toml": ("[lcm]", "[lcm", r""),
}


class Configuration(EndToEndTest):
    def check(self, text):
        self.file("bushd.toml").write_text(text)
        return self.run_program(program("BUSHD"), "--check-config", self.file("bushd.toml"))

    def test_good_file(self):
        ran = self.check(configuration(self.file("port")))
        self.assertEqual((ran.returncode, ran.stderr), (0, ""))
        self.assertIn("good: 8 motors on 2 MCUs and 1 bus\n", ran.stdout)

    def test_the_example_is_good_and_so_is_all_that_it_suggests(self):
        example = self.run_program(program("BUSHD"), "--example-config")
        self.assertEqual(example.returncode, 0, example.stderr)
        suggested = re.sub(r"^#(?=\w)", "", example.stdout, flags=re.MULTILINE)
        self.assertNotEqual(suggested, example.stdout)
        for text in (example.stdout, suggested):
            ran = self.check(text)
            self.assertEqual((ran.returncode, ran.stderr), (0, ""))
            self.assertIn("good: 1 motor on 1 MCU and 1 bus\n", ran.stdout)

    def test_bad_files_name_line_and_key_and_are_refused_at_the_start(self):
        good = configuration(self.file("port"))
        for name, (old, new, message) in BAD.items():
            with self.subTest(name):
                self.assertIn(old, good)
                text = good.replace(old, new, 1)
                ran = self.check(text)
                self.assertEqual((ran.returncode, ran.stdout), (1, ""))
                found = re.match(rf"{re.escape(str(self.file('bushd.toml')))}:(\d+)(?::\d+)?: {message}", ran.stderr)
                self.assertIsNotNone(found, ran.stderr)
                changed = self.first_difference(good, text)
                # At the line itself, or at the head of its section if a key is missing or several lines conflict.
                self.assertTrue(changed - 5 <= int(found[1]) <= changed + 1, f"line {changed} is bad: {ran.stderr}")
                started = self.run_program(program("BUSHD"), "--config", self.file("bushd.toml"))
                self.assertEqual((started.returncode, started.stderr), (1, ran.stderr))

    def test_what_this_pc_does_not_have_is_refused_at_the_start_too(self):
        good = configuration(self.file("port"), control=self.file("control"))
        slow = good.replace('name = "a0"', 'name = "a0"\nmax_speed = 1e-9', 1)
        for text, message in [
            (good.replace("[control]", '[control]\ngroup = "no-such-group"', 1), r"control\.group: is \"no-such-group\""),
            (good.replace(f'port = "{self.file("port")}"', 'port = "/dev/tty"', 1), r"bus\[0\]\.port: \"/dev/tty\" is a console"),
            (slow, r"motor\[0\]\.max_speed: 1e-09 steps/s would take"),
        ]:
            with self.subTest(message):
                ran = self.check(text)
                self.assertEqual((ran.returncode, ran.stdout), (1, ""))
                self.assertRegex(ran.stderr, rf"bushd\.toml:\d+:\d+: {message}.*allowed: ")
                started = self.run_program(program("BUSHD"), "--config", self.file("bushd.toml"))
                self.assertEqual((started.returncode, started.stderr), (1, ran.stderr))

    @staticmethod
    def first_difference(good, bad):
        lines = zip(good.splitlines(), bad.splitlines())
        return next(number for number, (a, b) in enumerate(lines, 1) if a != b)

    def test_wrong_usage_has_an_exit_code_of_its_own(self):
        for arguments in ([], ["--konfig", "bushd.toml"], ["--config"], ["--config", "a", "--check-config", "b"]):
            with self.subTest(arguments):
                ran = self.run_program(program("BUSHD"), *arguments)
                self.assertEqual((ran.returncode, ran.stdout), (2, ""))
                self.assertNotEqual(ran.stderr, "")

    def test_missing_file(self):
        ran = self.run_program(program("BUSHD"), "--check-config", self.file("none.toml"))
        self.assertEqual(ran.returncode, 1)
        self.assertIn(str(self.file("none.toml")), ran.stderr)

    def test_bad_table_is_named_with_its_own_file_and_line(self):
        self.file("tables").mkdir()
        table = self.file("tables") / "own.toml"
        table.write_text('name = "own"\ntime_unit_ns = 40000\naccel = [250, 260, 10]\n')
        ran = self.check(configuration(self.file("port")).replace("bushd2-scurve", "own"))
        self.assertEqual(ran.returncode, 1)
        self.assertIn(f"{table}:3:", ran.stderr)


if __name__ == "__main__":
    unittest.main()
