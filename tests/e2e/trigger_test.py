"""Moves that a trigger starts, and the position compare pulse, as a user has them."""

import signal
import unittest

from rig import GIVE_UP_S, TABLE_RUNS, EndToEndTest


class Trigger(EndToEndTest):
    def start_armed(self, *arguments):
        """bushctl arm --wait, until the motors wait for the trigger."""
        names = [name for name in arguments if str(name)[0].isalpha()]
        armed = self.start_bushctl("arm", "--wait", "--delay-us", 700, *arguments)
        self.wait_until("the motors to be armed", lambda: all(self.motors()[name]["activity"] == "armed" for name in names))
        return armed

    def pull_trigger(self, armed):
        """The exit code of what waited for it."""
        self.bushsim.send(signal.SIGRTMIN)
        return armed.process.wait(GIVE_UP_S)

    def check_trigger(self, displacement_format="fine", bus_lines=()):
        self.bring_up(displacement_format, bus_lines)
        self.command("compare", "a1", 200, "--delay-us", 100)
        first = self.start_armed("a0", 600, "a1", 400, "b1", -500)
        self.assertFalse(self.motors()["a0"]["moving"])
        self.assertEqual(self.pull_trigger(first), 0, first.said())
        self.assertEqual([self.positions()[name] for name in ("a0", "a1", "b1")], [600, 400, -500])

        # Disarmed, it may come: nobody moves.
        second = self.start_armed("a0", 600)
        self.command("disarm", "a0")
        self.assertEqual(second.process.wait(), 1)
        self.assertIn("disarmed before the trigger came", second.said())
        self.bushsim.send(signal.SIGRTMIN)
        self.bushsim.send(signal.SIGRTMIN)

        third = self.start_armed("a0", -600)
        self.bushsim.send(signal.SIGRTMIN)
        self.assertEqual(self.pull_trigger(third), 0, third.said())

        # Motors of both MCUs, which have one table, along a line.
        line = self.start_armed("--line", "a1", -300, "b1", 300)
        self.bushsim.send(signal.SIGRTMIN)
        self.assertEqual(self.pull_trigger(line), 0, line.said())
        self.assertIn("the line was limited by", line.said())
        status = self.status()
        self.assertEqual([self.positions()[name] for name in ("a0", "a1", "b1")], [0, 100, -200])
        self.assertEqual(self.bushd.end(), 0)
        self.assertEqual(self.bushsim.end(), 0)
        self.assert_one_result_each()
        self.assert_trace_is_right(status)
        self.assertEqual(len([event for event in self.moves() if event["event"] in ("move", "result")]), 12)
        self.assertTrue(any("late_ns" in event for event in self.moves()))

    def test_a_killed_client_disarms_where_it_has_asked_for_that(self):
        self.bring_up()
        stays = self.start_bushctl("arm", "--delay-us", 700, "a0", 600)
        self.assertEqual(stays.process.wait(GIVE_UP_S), 0)
        killed = self.start_bushctl("arm", "--while-connected", "--delay-us", 700, "b0", 600)
        self.wait_until("both to be armed", lambda: [self.motors()[name]["activity"] for name in ("a0", "b0")] == ["armed"] * 2)
        self.assertRegex(self.motors()["b0"]["armed_by"], rf"^command 1 of bushctl@.*pid {killed.process.pid}")
        self.assertIn("armed by command 1 of bushctl@", self.command("status").stdout)
        killed.end(signal.SIGKILL)
        self.wait_until("it to be disarmed", lambda: self.motors()["b0"]["activity"] == "rest")
        self.assertEqual(self.motors()["a0"]["activity"], "armed")
        self.bushsim.send(signal.SIGRTMIN)
        self.wait_until("the other one to arrive", lambda: self.positions()["a0"] == 600)
        self.assertEqual(self.positions()["b0"], 0)

    def test_starts_moves_exactly_and_once(self):
        self.check_trigger()

    def test_starts_moves_exactly_and_once_in_coarse_ticks(self):
        self.check_trigger("coarse")

    def test_starts_moves_exactly_and_once_among_table_runs(self):
        self.check_trigger(bus_lines=TABLE_RUNS)


if __name__ == "__main__":
    unittest.main()
