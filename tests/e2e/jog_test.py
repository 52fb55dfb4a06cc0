"""Jogs by bushctl, by its keys and without, and pauses."""

import contextlib
import os
import pty
import select
import signal
import subprocess
import unittest

from rig import FAR, EndToEndTest, program


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
        refused = self.bushctl("jog", "a0", "0.0001")
        self.assertEqual(refused.returncode, 1)
        self.assertIn("time units a step", refused.stderr)
        self.assertEqual(self.bushctl("jog", "a0").returncode, 2)

    def test_keys(self):
        self.bring_up()
        self.survey()
        main, terminal = pty.openpty()
        panel = subprocess.Popen([program("BUSHCTL"), "jog", "a0", "--speed", "300", "--step", "7"],
                                 stdin=terminal, stdout=terminal, stderr=terminal)
        os.close(terminal)
        try:
            said = self.said_by(main, "any other key stops")
            os.write(main, b"\x1b[A")
            said += self.said_by(main, "a0: reached, stands at 7 ")
            os.write(main, b"\x1b[D")
            self.wait_until("a0 to be jogged", lambda: self.positions()["a0"] < -300)
            os.write(main, b" ")
            said += self.said_by(main, "a0: done, stands at -")
            self.rests("a0")
            os.write(main, b"\x1b[C")
            self.wait_until("a0 to be jogged", lambda: self.motors()["a0"]["moving"])
        finally:
            os.close(main)  # the terminal is gone
        self.assertIsNotNone(panel.wait(60))
        self.rests("a0")

    def said_by(self, terminal, text):
        said = ""

        def holds():
            nonlocal said
            if select.select([terminal], [], [], 0)[0]:
                with contextlib.suppress(OSError):
                    said += os.read(terminal, 4096).decode()
            return text in said

        self.wait_until(f"{text!r} to be said", holds)
        return said

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


if __name__ == "__main__":
    unittest.main()
