"""Jogs by bushctl, by its keys and without, and pauses."""

import json
import os
import signal
import sys
import termios
import unittest

from rig import FAR, TOP, EndToEndTest, program

sys.path.insert(0, str(TOP / "tests/tools/bushtab"))
from terminal import Terminal

UP, DOWN, RIGHT, LEFT = "\x1b[A", "\x1b[B", "\x1b[C", "\x1b[D"
REPEATS = 500  # 20 s of a held key
WIDE = 200  # a result is one line


class Jogs(EndToEndTest):
    def rests(self, name):
        self.wait_until(f"{name} to rest", lambda: self.motors()[name]["activity"] == "rest")

    def start_jog(self, *arguments):
        jog = self.start_bushctl("jog", *arguments)
        self.wait_until("the jog to be accepted", lambda: "accepted" in jog.said() or not jog.lives())
        self.assertTrue(jog.lives(), jog.said())
        return jog

    def test_goes_on_until_ctrl_c(self):
        self.bring_up()
        for more in ((), ("--lcm",)):
            self.survey()
            jog = self.start_jog("a0", "-400", *more)
            self.wait_until_travelled(800, "a0")  # longer than its keepalive time
            self.assertEqual(jog.end(signal.SIGINT), 0, jog.said())
            self.assertRegex(jog.said(), r"a0: done, stands at -\d+")
            self.rests("a0")
        # Renewals are not in the log of moves, what moves is.
        asked = [event for event in self.logged() if event["event"] == "request" and event["request"] == "jog"]
        self.assertEqual(len(asked), 4)
        self.assertEqual(self.bushd.end(), 0)
        self.assert_one_result_each()

    def test_ends_with_its_client(self):
        self.bring_up()
        for more in ((), ("--lcm",)):
            jog = self.start_jog("a0", "400", *more)
            self.wait_until("a0 to move", lambda: self.motors()["a0"]["moving"])
            jog.end(signal.SIGKILL)
            self.rests("a0")
            self.assertEqual(self.motors()["a0"]["trust"], self.motors()["a1"]["trust"])
        jog = self.start_jog("a0", "400")
        self.command("jog", "a0", "0")
        self.assertEqual(jog.process.wait(), 1)
        self.assertIn("ended by command", jog.said())
        refused = self.bushctl("jog", "a0", "0.0000001")
        self.assertEqual(refused.returncode, 1)
        self.assertIn("allowed: up to an hour a step", refused.stderr)
        self.assertEqual(self.bushctl("jog", "a0").returncode, 2)

    def test_a_paused_move_goes_on(self):
        self.bring_up()
        self.survey()
        move = self.start_move("a0", "3000", "b0", "-3000")
        self.wait_until_travelled(300, "a0", "b0")
        self.command("pause", "group0")
        motors = self.motors()
        self.assertTrue(motors["a0"]["paused"] and motors["b0"]["paused"])
        self.command("hold", "a0")
        refused = self.bushctl("resume")
        self.assertEqual(refused.returncode, 1)
        self.assertIn("a0: it is held", refused.stderr)
        self.assertEqual(self.positions()["a0"], motors["a0"]["position_steps"])
        self.command("release")
        self.command("resume")
        self.assertEqual(move.process.wait(), 0)
        self.assertEqual((self.positions()["a0"], self.positions()["b0"]), (3000, -3000))
        self.start_move("a0", FAR)
        self.wait_until_travelled(3300, "a0")
        self.command("pause")
        self.command("stop")
        self.rests("a0")


class Keys(EndToEndTest):
    """`bushctl jog NAME` on a terminal."""

    def open(self, *arguments):
        self.bring_up()
        self.survey()
        panel = self.enterContext(Terminal([program("BUSHCTL"), "jog", "a0", *arguments], columns=WIDE))
        panel.wait_for("q or Ctrl-C ends", "a0 0, at rest")
        return panel

    def rests(self):
        self.wait_until("a0 to rest", lambda: self.motors()["a0"]["activity"] == "rest")

    def moves_on(self, steps=1):
        from_steps = self.positions()["a0"]
        self.wait_until("a0 to move", lambda: abs(self.positions()["a0"] - from_steps) >= steps)

    def asked(self, request):
        return sum(event["event"] == "request" and event["request"] == request for event in self.logged())

    def assert_made_what_is_counted(self):
        """The steps of the trace are those of the last result. Ends all programs."""
        position = self.positions()["a0"]
        self.assertEqual(self.bushd.end(), 0)
        self.assertEqual(self.bushsim.end(), 0)
        self.assertEqual(self.traced_positions()["a0"], position)
        return position

    def test_jog_and_make_steps(self):
        panel = self.open("--speed", "300", "--step", "7")
        panel.wait_for("speed 300 steps/s, step 7 | ", " | no soft limits")
        panel.send(UP)
        panel.wait_for("a0: reached, stands at 7 ")
        panel.send(LEFT)
        self.moves_on(300)
        panel.send(" ")
        panel.wait_for("a0: done, stands at -", "ended by its client")
        panel.send(DOWN)
        panel.wait(lambda screen: screen.count("a0: reached") == 2)
        panel.send("q")
        self.assertEqual(panel.end(), 0)
        self.assertLess(self.assert_made_what_is_counted(), -293)

    def test_a_stop_waits_for_no_key(self):
        panel = self.open("--speed", "300")
        panel.send(RIGHT)
        self.moves_on(30)
        before = self.positions()["a0"]
        panel.send(REPEATS * RIGHT + " " + REPEATS * RIGHT)
        panel.wait_for("a0: done, stands at ")
        # One after the other, at ten keys a second, they would take 50 s: 15000 steps. A tenth of that is 5 s, for a
        # machine that is slow in reading the position and the keys.
        self.assertLess(self.positions()["a0"] - before, 1500)
        self.assertEqual(self.asked("jog"), 2, "its begin and its end, and nothing for repeated keys")
        panel.send("q")
        self.assertEqual(panel.end(), 0)
        self.assert_made_what_is_counted()

    def test_steps_do_not_wait_for_each_other(self):
        panel = self.open("--speed", "300", "--step", "200")
        panel.send(REPEATS * UP)
        panel.wait_for("a0: reached, stands at 200 ")
        panel.send(UP)
        self.moves_on()
        panel.send(REPEATS * UP + "x")
        panel.wait_for("a0: stopped, stands at ")
        self.assertEqual(self.asked("move"), 2)
        panel.send("q")
        self.assertEqual(panel.end(), 0)
        self.assertLess(self.assert_made_what_is_counted(), 400)

    def test_letting_go_stops(self):
        panel = self.open("--speed", "300", "--lcm")
        panel.send(RIGHT)
        self.moves_on()
        panel.send(RIGHT)  # the terminal has begun to repeat, and does so no more
        panel.wait_for("a0: done, stands at ", "ended by its client")
        self.rests()
        # A daemon that stands still says nothing, and what is shown would be old.
        self.bushd.send(signal.SIGSTOP)
        panel.wait_for("a0 no state from bushd")
        self.bushd.send(signal.SIGCONT)
        panel.wait(lambda screen: "no state from bushd" not in screen)

    def test_begins_slowly_by_the_table(self):
        panel = self.open()
        tables = json.loads(self.command("table", "list", "--json").stdout)["tables"]
        name = self.motors()["a0"]["table"]["name"]
        start = next(table["start_steps_per_s"] for table in tables if table["name"] == name)
        panel.wait_for(f"speed {start:.4g} steps/s, step 10")
        panel.send("+")
        panel.wait_for(f"speed {2 * start:.4g} steps/s, step 10")
        panel.send("-/")
        panel.wait_for(f"speed {start:.4g} steps/s, step 5")
        panel.send(RIGHT)
        self.moves_on(5)
        self.assertLessEqual(self.motors()["a0"]["velocity_steps_per_s"], start * 1.001)  # of rounded figures
        panel.send("+")
        self.wait_until("a0 to be faster", lambda: self.motors()["a0"]["velocity_steps_per_s"] > start * 1.5)
        panel.send("q")
        self.assertEqual(panel.end(), 0)
        self.rests()

    def test_says_who_has_ended_it(self):
        panel = self.open("--speed", "300")
        panel.send(RIGHT)
        self.moves_on()
        self.command("stop", "a0")
        panel.wait_for("a0: stopped, stands at ", "asked for by command", "bushctl@")
        self.assertEqual(self.bushd.end(signal.SIGKILL), -signal.SIGKILL)
        panel.wait_for("the daemon has ended")
        self.assertEqual(panel.end(), 1)

    def test_a_panel_that_is_suspended_jogs_no_more(self):
        panel = self.open("--speed", "300", "--step", "7")
        panel.send(RIGHT)
        self.moves_on()
        os.kill(panel.pid, signal.SIGSTOP)
        self.rests()
        stood = self.positions()["a0"]
        panel.send(REPEATS * RIGHT)
        os.kill(panel.pid, signal.SIGCONT)
        panel.wait_for("a0: stopped, stands at ", "has not renewed it within")
        panel.send(UP)
        panel.wait_for(f"a0: reached, stands at {stood + 7} ")
        panel.send(LEFT)
        self.moves_on()
        panel.send("\x1a")  # Ctrl-Z stops it, and there is no shell that could continue it
        panel.wait_for("a0: done, stands at ")

    def test_ends_with_ctrl_c_or_its_terminal(self):
        panel = self.open("--speed", "300")
        panel.send(RIGHT)
        self.moves_on()
        panel.send("\x03")
        panel.wait_for("a0: done, stands at ")
        self.assertEqual(panel.end(), 0)
        self.rests()
        for ends in (lambda panel: panel.close(), lambda panel: os.kill(panel.pid, signal.SIGHUP),
                     lambda panel: os.kill(panel.pid, signal.SIGTERM)):
            panel = self.enterContext(Terminal([program("BUSHCTL"), "jog", "a0", "--speed", "300"], columns=WIDE))
            panel.wait_for("q or Ctrl-C ends", "at rest")
            raw = termios.tcgetattr(panel.fd)
            self.assertFalse(raw[3] & termios.ICANON)
            panel.send(LEFT)
            self.moves_on()
            ends(panel)
            if panel.fd is not None:
                panel.wait_for("a0: done, stands at ")
                self.assertEqual(panel.end(), 0)
            else:
                panel.wait_status()
            self.rests()
        self.assertEqual(self.asked("jog"), 8, "each jog is ended by the panel, and not by its absence")


if __name__ == "__main__":
    unittest.main()
