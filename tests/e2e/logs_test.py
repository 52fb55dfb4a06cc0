"""What ends up in the logs when somebody floods them, takes them away, or sends signals that mean nothing."""

import contextlib
import json
import os
import resource
import shutil
import signal
import struct
import unittest

from hostile_test import Wire, text
from rig import TOP, EndToEndTest

STOP_CHANNEL = b"BUSHD_STOP"
MANY = 1500
BATCH = 50


class Logs(EndToEndTest):
    def stop_of(self, stop, client, number):
        """The payload of another client's stop of all motors: fingerprint, utime_us, session, client_id, number, count."""
        return stop[:8] + struct.pack(">qq", 0, 0) + text(client) + struct.pack(">qi", number, 0)

    def test_stops_of_made_up_clients_do_not_fill_the_log_of_moves(self):
        self.bring_up()
        wire = self.enterContext(contextlib.closing(Wire()))
        self.command("stop", "--lcm")
        stop = wire.next(STOP_CHANNEL)
        for i in range(MANY):
            wire.send(self.stop_of(stop, b"evil-%d" % i, 1), STOP_CHANNEL)
            if i % BATCH == 0:
                self.assertIsNotNone(self.status())  # it has carried out those before
        self.assertIsNotNone(self.status())
        self.assertEqual(self.bushd.end(), 0)
        lines = [event for event in self.logged() if event["event"] == "request"]
        self.assertLess(len(lines), 110)
        told = [event for event in self.logged() if event["event"] == "requests"]
        self.assertGreater(sum(event["left_out"] for event in told), MANY // 2)
        self.assertEqual(told[0]["request"], "stop")
        self.assertLess(len(self.bushd.said().splitlines()), 150)

    def test_a_log_of_moves_that_is_a_fifo_is_refused_at_once(self):
        self.write_config()
        os.mkfifo(self.file("moves.jsonl"))
        bushd = self.start_bushd()
        self.assertEqual(bushd.process.wait(20), 1)
        self.assertIn("must be a regular file", bushd.said())

    def test_paths_that_are_no_utf8(self):
        """Names of files are bytes: the daemon lives, and its logs and answers name them as well as they can."""
        self.write_config()
        folder = self.file(os.fsdecode(b"h\xe4ll"))
        folder.mkdir()
        config = self.file("bushd.toml").read_text().replace('"bushd2-constant"', '"ramp"')
        (folder / "bushd.toml").write_text(config)
        shutil.copy(TOP / "tables/bushd2-constant.toml", folder / "ramp.toml")
        self.bushsim = self.start_bushsim()
        self.bushd = self.start_bushd(config=folder / "bushd.toml")
        self.wait_until_ready()
        self.command("move", "--wait", "a0", "5")
        self.assertIn("h\ufffdll/ramp.toml", self.moves()[0]["table_file"])
        for what in ("status", "where", "health", "doctor"):
            self.assertIn(json.loads(self.bushctl(what, "--json").stdout).__class__, (dict, list))
        self.command("table", "list")
        self.assertEqual(self.bushd.end(), 0)

    def test_a_log_of_moves_that_was_removed_is_begun_anew(self):
        self.bring_up()
        self.command("move", "--wait", "a0", "5")
        self.file("moves.jsonl").unlink()
        self.command("move", "--wait", "a0", "5")
        self.assertEqual([event["event"] for event in self.moves()], ["move", "result"])
        self.assertEqual(self.logged()[0]["event"], "request")
        self.assertIn("was removed or renamed", self.bushd.said())

    def test_a_full_disk_is_told_once_and_when_it_is_over(self):
        """A limit of the size of files is like a full disk: what is to be written beyond it is not."""
        full = 10_000
        self.write_config()
        self.file("moves.jsonl").write_text("\n" * full)
        self.bushsim = self.start_bushsim()
        self.bushd = self.start_bushd()
        self.wait_until_ready()
        resource.prlimit(self.bushd.process.pid, resource.RLIMIT_FSIZE, (full, resource.RLIM_INFINITY))
        for _ in range(30):
            self.command("move", "--wait", "a0", "5")
        self.assertEqual(self.bushd.said().count("a line was lost"), 1, self.bushd.said())
        unlimited = (resource.RLIM_INFINITY, resource.RLIM_INFINITY)
        resource.prlimit(self.bushd.process.pid, resource.RLIMIT_FSIZE, unlimited)
        self.command("move", "--wait", "a0", "5")
        self.assertRegex(self.bushd.said(), "is written again; 90 lines were lost")
        text = self.file("moves.jsonl").read_text()
        self.assertTrue(text.endswith("\n"))
        lines = [json.loads(line) for line in text.splitlines() if line]
        self.assertEqual([line["event"] for line in lines[-3:]], ["request", "move", "result"])

    def test_signals_without_a_meaning_are_ignored(self):
        self.bring_up()
        self.bushd.send(signal.SIGUSR1)
        self.bushd.send(signal.SIGUSR2)
        self.wait_until("both to be told", lambda: "SIGUSR1: ignored" in self.bushd.said()
                        and "SIGUSR2: ignored" in self.bushd.said())
        self.command("move", "--wait", "a0", "5")


if __name__ == "__main__":
    unittest.main()
