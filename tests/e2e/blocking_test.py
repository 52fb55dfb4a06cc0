"""The daemon's loop, which feeds motors, waits for no terminal, journal, disk or driver.

`blocking_calls.c`, which the daemon is given to load first, writes down each call of the loop's thread that might.
"""

import fcntl
import os
import signal
import subprocess
import unittest

from rig import FAR, GIVE_UP_S, EndToEndTest, Running, program

PIPE_BYTES = 4096


class Blocking(EndToEndTest):
    def start_watched(self, *options, fsync_ms=0, stderr=None):
        """bushd with blocking_calls."""
        log = self.file("bushd.log")
        environment = dict(os.environ, LD_PRELOAD=program("BLOCKING_CALLS"), BUSHD_FSYNC_MS=str(fsync_ms))
        environment["BUSHD_BLOCKING_CALLS"] = str(self.file("blocking.txt"))
        command = [program("BUSHD"), "--config", self.file("bushd.toml"), "--move-log", self.file("moves.jsonl")]
        bushd = Running([*command, *options], log, True, env=environment, stderr=stderr)
        self.programs.append(bushd)
        return bushd

    def assert_nothing_blocked(self):
        report = self.file("blocking.txt")
        self.assertEqual(report.read_text() if report.exists() else "", "")

    def test_nothing_that_the_loop_calls_may_wait(self):
        self.write_config(state=self.file("state"))
        with self.file("bushd.toml").open("a") as config:  # of the last motor
            config.write('unit = "mm"\nsteps_per_unit = 100\n')
        self.file("state").mkdir()
        self.bushsim = self.start_bushsim()
        self.bushd = self.start_watched("--in-service", self.file("in-service.json"))
        self.wait_until_ready()
        self.survey()
        watch = self.start_bushctl("watch")
        over_lcm = self.start_bushctl("--lcm", "watch")
        self.command("config", "b3", "offset=5")
        self.command("config", "b3", "offset=0")
        self.command("table", "use", "group1", "bushd2-constant")
        self.command("table", "list")
        self.command("move", "--dry-run", "a0", "5")
        self.command("move", "--wait", "--line", "a0", "300", "b0", "200")
        move = self.start_move("a0", FAR, "a1", -FAR, "b1", FAR)
        self.wait_until_travelled(200, "a0", "a1", "b1")
        self.file("moves.jsonl").rename(self.file("moves.jsonl.1"))
        self.bushd.send(signal.SIGHUP)
        self.bushd.send(signal.SIGUSR1)
        self.command("pause", "a1")
        self.command("resume", "a1")
        self.command("move", "--wait", "a2", "100")
        self.command("history", "a2")
        self.command("health")
        self.bushctl("move", "nobody", "5")
        self.bushctl("--lcm", "move", "--wait", "b2", "50")
        self.command("estop")
        self.command("clear")
        self.command("stop")
        self.assertEqual(move.process.wait(GIVE_UP_S), 1)
        # Its port goes and comes back.
        self.assertEqual(self.bushsim.end(), 0)
        self.wait_until("the port to be lost", lambda: "OFFLINE" in (self.mcu_states() or []))
        self.bushsim = self.start_bushsim(trace="again.vcd")
        self.wait_until_ready()
        for client in (watch, over_lcm):
            self.assertTrue(client.lives(), client.said())
        self.assert_nothing_blocked()
        self.assertEqual(self.bushd.end(), 0)

    def test_a_disk_that_takes_long_stops_no_motor(self):
        """The old file of the log of moves is brought to it, while motors move."""
        self.write_config()
        self.bushsim = self.start_bushsim()
        self.bushd = self.start_watched(fsync_ms=1500)
        self.wait_until_ready()
        move = self.start_move("a0", 6000, "a1", -FAR)
        self.wait_until_travelled(100, "a0", "a1")
        self.file("moves.jsonl").rename(self.file("moves.jsonl.1"))
        self.command("move", "--wait", "b0", "5")
        self.command("stop", "a1")
        self.assertEqual(move.process.wait(GIVE_UP_S), 1)
        self.assertIn("a0: reached", move.said())
        self.assertIn("a1: stopped", move.said())
        self.wait_until("the new file", lambda: self.file("moves.jsonl").exists())
        self.assert_nothing_blocked()
        self.assertEqual(self.bushd.end(), 0)

    def test_a_terminal_that_is_stopped_stops_no_motor(self):
        """Its place is taken by a pipe that is full, and that nobody reads."""
        self.write_config()
        self.bushsim = self.start_bushsim()
        reader, writer = os.pipe()
        fcntl.fcntl(writer, fcntl.F_SETPIPE_SZ, PIPE_BYTES)
        os.set_blocking(writer, False)
        self.bushd = self.start_watched(stderr=writer)
        self.wait_until_ready()
        filled = 0
        try:
            while True:
                filled += os.write(writer, b"x")
        except BlockingIOError:
            os.set_blocking(writer, True)
        move = self.start_move("a0", FAR)
        self.wait_until_travelled(200, "a0")
        for _ in range(20):
            self.bushd.send(signal.SIGUSR1)
            self.command("status")
        self.command("stop", "--wait", "a0")
        self.assertEqual(move.process.wait(GIVE_UP_S), 1)
        self.assertIn("a0: stopped", move.said())
        self.assert_nothing_blocked()
        self.assertEqual(self.bushd.end(), 0)
        os.close(writer)
        with os.fdopen(reader, "rb") as said:
            self.assertIn(b"x" * min(filled, 100), said.read())


if __name__ == "__main__":
    unittest.main()
