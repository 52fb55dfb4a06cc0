#!/usr/bin/env python3
"""bushtab tui on a pty, as a user sees it. The program is $BUSHTAB."""

import json
import os
import pathlib
import signal
import subprocess
import tempfile
import termios
import unittest

from terminal import Terminal

TABLE = '# mine\nname = "t"\ntime_unit_ns = 1000\naccel = [90, 70, 50] # fast\n'
RIGHT, UP, PAGE_DOWN, END = "\x1bOC", "\x1bOA", "\x1b[6~", "\x1bOF"


class Tui(unittest.TestCase):
    def setUp(self):
        directory = tempfile.TemporaryDirectory()
        self.addCleanup(directory.cleanup)
        self.path = pathlib.Path(directory.name)
        self.file = self.path / "t.toml"
        self.file.write_text(TABLE)

    def bushtab(self, *arguments):
        return subprocess.run(
            [os.environ["BUSHTAB"], "--dir", self.path, *arguments], capture_output=True, text=True, stdin=subprocess.DEVNULL
        )

    def tui(self, table, *arguments, rows=30, columns=100, **environment):
        environment = {"TERM": "xterm", "LC_ALL": "C.UTF-8", "NO_COLOR": "", **environment}
        terminal = Terminal([os.environ["BUSHTAB"], *self.places(table), "tui", table, *arguments], rows, columns, **environment)
        self.addCleanup(terminal.__exit__)
        return terminal

    def places(self, table):
        return [] if isinstance(table, pathlib.Path) else ["--dir", self.path]

    def opened(self, *arguments, **environment):
        tui = self.tui("t", *arguments, **environment)
        tui.wait_for("accel[0]  code 90", "q quit")
        return tui

    def change_second_code(self, tui, code=65):
        tui.send(RIGHT)
        tui.wait_for("accel[1]  code 70")
        tui.send(f"{code}\r")
        tui.wait_for(f"accel[1]  code {code}", ", changed")

    def assert_left_as_found(self, tui):
        """The terminal: its first screen, and its settings."""
        self.assertFalse(tui.screen.alternate)
        self.assertEqual(termios.tcgetattr(tui.fd), tui.settings)

    def test_changes_are_undone_redone_and_saved_as_a_revision(self):
        tui = self.opened()
        self.change_second_code(tui)
        tui.send("u")
        tui.wait_for("accel[1]  code 70", "undo: accel[1]")
        tui.send("r")
        tui.wait_for("accel[1]  code 65", "redo: accel[1]")
        tui.send("s")
        tui.wait_for("saved as revision 2")
        self.assertNotIn("changed", tui.screen.text())
        text = TABLE.replace("70", "65").replace('"t"\n', '"t"\nrevision = 2\n')
        self.assertEqual(self.file.read_text(), text)
        tui.send(UP + "\x13")  # what was saved is what the next change is made from
        tui.wait_for("saved as revision 3")
        tui.send("q")
        self.assertEqual(tui.end(), 0)
        self.assert_left_as_found(tui)
        log = json.loads(self.bushtab("log", "t", "--json").stdout)
        self.assertEqual([entry["note"] for entry in log], ["tui: accel[1]", "tui: accel[1]", "found"])
        self.assertEqual(self.file.read_text(), text.replace("65", "64").replace("= 2\n", "= 3\n"))

    def test_range_is_marked_and_dragged(self):
        tui = self.opened("--steps", "5")
        tui.wait_for("5 steps 0.370 ms")
        tui.send(" " + RIGHT)
        tui.wait_for("2 codes marked")
        tui.send("+")
        tui.wait_for("accel[0] to accel[1]: codes +1", "5 steps 0.374 ms")
        tui.send("%10\r")
        tui.wait_for("speed +10 %", "   83    65    50")

    def test_leaving_without_saving_changes_nothing(self):
        tui = self.opened()
        self.change_second_code(tui)
        tui.send("q")
        tui.wait_for("Changes are not saved.")
        tui.send("x")
        tui.wait(lambda screen: "Changes are not saved." not in screen)
        tui.send("\x03")  # Ctrl-C asks like q
        tui.wait_for("Changes are not saved.")
        tui.send("d")
        self.assertEqual(tui.end(), 0)
        self.assert_left_as_found(tui)
        self.assertEqual(self.file.read_text(), TABLE)
        self.assertEqual(os.listdir(self.path), ["t.toml"])

    def test_change_by_someone_else_is_not_written_over_and_nothing_is_lost(self):
        tui = self.opened()
        self.change_second_code(tui)
        self.assertEqual(self.bushtab("set", "t", "2", "45").returncode, 0)
        theirs = self.file.read_text()
        tui.send("s")
        tui.wait_for("was changed by someone else meanwhile; nothing was written", "w saves them as")
        tui.wait_for("accel[1]  code 65", ", changed")
        self.assertEqual(self.file.read_text(), theirs)
        tui.send("wt\r")  # that is there too
        tui.wait_for("is there already")
        tui.send("wmine\r")
        tui.wait_for("saved as revision 1")
        self.assertIn("accel = [90, 65, 50] # fast\n", (self.path / "mine.toml").read_text())
        self.assertIn('name = "mine"\n', (self.path / "mine.toml").read_text())
        self.assertEqual(self.file.read_text(), theirs)
        tui.send(UP + "qs")  # from then on it is the other table that is edited
        self.assertEqual(tui.end(), 0)
        self.assertIn("accel = [90, 64, 50] # fast\n", (self.path / "mine.toml").read_text())
        self.assertEqual(self.file.read_text(), theirs)

    def test_table_given_as_a_path_is_saved_beside_it(self):
        tui = self.tui(self.file)
        tui.wait_for("accel[0]  code 90")
        self.change_second_code(tui)
        tui.send("wmine\r")
        tui.wait_for("saved as revision 1")
        self.assertIn("accel = [90, 65, 50] # fast\n", (self.path / "mine.toml").read_text())

    def test_check_goes_along_with_the_codes(self):
        tui = self.opened("--max", "20100Hz")
        tui.wait_for("check: nothing found")
        tui.send("g2\r49\r")
        tui.wait_for("error: max_speed: ")

    def test_window_of_any_size_and_back(self):
        tui = self.opened()
        for rows, columns in ((1, 1), (2, 7), (5, 30), (3, 200), (12, 40), (60, 180)):
            tui.resize(rows, columns)
            tui.send(RIGHT + PAGE_DOWN)
        tui.wait_for("decel[2]  code 90", "steps/s", "q quit")
        tui.resize(24, 80)
        tui.send("g0\r")
        tui.wait_for("accel[0]  code 90", "step 1 of 7", "q quit")
        tui.send("q")
        self.assertEqual(tui.end(), 0)

    def test_colours_only_where_they_are_wanted_and_known(self):
        for environment, coloured in (({}, True), ({"NO_COLOR": "1"}, False), ({"TERM": "vt100"}, False)):
            with self.subTest(environment):
                tui = self.opened(**environment)
                tui.send("q")
                self.assertEqual(tui.end(), 0)
                self.assertEqual(tui.screen.seen_colour, coloured)

    def test_locale_without_unicode_gets_ascii(self):
        tui = self.opened(LC_ALL="C")
        tui.wait_for("+- step 1 -", "*")
        self.assertTrue(tui.raw.isascii())

    def test_end_by_signal_restores_the_terminal_and_keeps_changes_aside(self):
        for number in (signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT):
            with self.subTest(number):
                tui = self.opened()
                self.change_second_code(tui)
                os.kill(tui.pid, number)
                self.assertEqual(tui.end(), 1)
                self.assert_left_as_found(tui)
                aside = self.path / ".t.edited.toml"
                self.assertIn(f"what it would be is in {aside}", tui.raw.decode())
                self.assertEqual(aside.read_text(), TABLE.replace("70", "65"))
                self.assertEqual(self.file.read_text(), TABLE)
                aside.unlink()

    def test_told_twice_to_end_it_still_keeps_changes_and_says_where(self):
        tui = self.opened()
        self.change_second_code(tui)
        for number in (signal.SIGSTOP, signal.SIGHUP, signal.SIGTERM, signal.SIGQUIT, signal.SIGCONT):
            os.kill(tui.pid, number)  # the last lets all come at once
        self.assertEqual(tui.end(), 1)
        aside = self.path / ".t.edited.toml"
        self.assertIn(f"what it would be is in {aside}", tui.raw.decode())
        self.assertEqual(aside.read_text(), TABLE.replace("70", "65"))

    def test_window_of_a_shell_that_is_closed_loses_nothing(self):
        for shell in (["sh"], ["bash", "--norc", "--noprofile"]):
            with self.subTest(shell):
                ended, alive = os.pipe()  # its end comes when the shell and all it started are gone
                os.set_inheritable(alive, True)
                environment = {"TERM": "xterm", "LC_ALL": "C.UTF-8", "NO_COLOR": "", "PS1": "ready> "}
                tui = Terminal([*shell, "-i"], 30, 100, **environment)
                self.addCleanup(tui.__exit__)
                os.close(alive)
                tui.wait_for("ready>")
                tui.send(f"'{os.environ['BUSHTAB']}' --dir '{self.path}' tui t\r")
                tui.wait_for("accel[0]  code 90", "q quit")
                self.change_second_code(tui)
                tui.close()
                self.assertEqual(os.read(ended, 1), b"")
                os.close(ended)
                tui.wait_status()
                aside = self.path / ".t.edited.toml"
                self.assertEqual(aside.read_text(), TABLE.replace("70", "65"))
                aside.unlink()

    def test_what_was_kept_before_is_told_and_not_written_over(self):
        kept = self.path / ".t.edited.toml"
        kept.write_text("my evening's work\n")
        tui = self.tui("t")
        tui.wait_for("accel[0]  code 90", "q quit")
        self.assertIn(f"a text of this table that was never saved is in {kept}", tui.raw.decode())
        self.change_second_code(tui)
        os.kill(tui.pid, signal.SIGTERM)
        self.assertEqual(tui.end(), 1)
        self.assertEqual(kept.read_text(), "my evening's work\n")
        second = self.path / ".t.edited-2.toml"
        self.assertIn(f"what it would be is in {second}", tui.raw.decode())
        self.assertEqual(second.read_text(), TABLE.replace("70", "65"))

    def test_terminal_that_is_closed_ends_it(self):
        tui = self.opened()
        self.change_second_code(tui)
        tui.close()
        self.assertEqual(tui.wait_status(), 1)
        self.assertEqual((self.path / ".t.edited.toml").read_text(), TABLE.replace("70", "65"))

    def test_no_terminal_is_refused(self):
        done = self.bushtab("tui", "t")
        self.assertEqual((done.returncode, done.stdout), (1, ""))
        self.assertIn("tui needs a terminal", done.stderr)

    def test_terminals_that_cannot_be_drawn_on_are_refused(self):
        for name in ("dumb", "no-such-terminal", ""):
            with self.subTest(name):
                tui = self.tui("t", TERM=name)
                self.assertEqual(tui.end(), 1)
                self.assertIn(f'tui cannot draw on a terminal of type "{name}"', tui.raw.decode())
                self.assert_left_as_found(tui)

    def test_what_is_no_table_is_refused_with_its_place(self):
        self.file.write_text(TABLE.replace("70", "95"))
        tui = self.tui("t")
        self.assertEqual(tui.end(), 1)
        self.assertIn("t.toml:4:14: accel[1]: is 95 after 90", tui.raw.decode())
        self.assertNotIn(b"\x1b", tui.raw)


if __name__ == "__main__":
    unittest.main()
