"""The control socket: clients of all kinds at it, while motors move."""

import grp
import os
import resource
import socket
import time
import unittest

from rig import FAR, EndToEndTest, program


class ControlSocket(EndToEndTest):
    def connect(self):
        client = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        client.connect(str(self.file("control")))
        self.addCleanup(client.close)
        return client

    def dropped(self):
        return self.status()["dropped_messages"]

    def assert_undisturbed(self):
        """The move under way goes on, and no MCU had to run a motor down by itself."""
        self.assertTrue(self.bushd.lives())
        self.assertTrue(self.motors()["a0"]["moving"])
        self.command("stop", "--wait")
        results = [event["result"] for event in self.moves() if event["event"] == "result"]
        self.assertEqual(results, ["stopped"])
        self.assertEqual(self.bushd.end(), 0)

    def hangs_up(self, client):
        client.settimeout(60)
        try:
            while client.recv(65536):
                pass
        except ConnectionResetError:
            pass
        return True

    def test_status_needs_no_network_and_no_patience(self):
        self.bring_up()
        times = []
        for _ in range(9):
            began = time.monotonic()
            self.command("status", "--socket", self.file("control"))
            times.append(time.monotonic() - began)
        # The state of MCUs at rest is published twice a second: who waited for it would need 250 ms on the average.
        self.assertLess(sorted(times)[len(times) // 2], 0.15, times)

    def test_rights_are_those_of_the_file(self):
        self.bring_up()
        self.assertEqual(os.stat(self.file("control")).st_mode & 0o777, 0o660)
        self.assertEqual(self.bushd.end(), 0)
        self.assertFalse(self.file("control").exists())

    def test_the_log_of_moves_names_the_process(self):
        self.bring_up()
        self.command("move", "--wait", "a0", 5)
        self.command("move", "--wait", "--lcm", "a0", 5)
        local, network = [event for event in self.logged() if event["event"] == "request"]
        self.assertEqual((local["by"], local["uid"], local["motors"]), ("socket", os.getuid(), ["a0"]))
        self.assertEqual(network["by"], "lcm")
        self.assertNotIn("uid", network)
        for event in (local, network):
            self.assertEqual((event["program"], event["host"]), ("bushctl", socket.gethostname()))

    def test_who_has_no_right_is_told_before_lcm_is_used(self):
        self.bring_up()
        os.chmod(self.folder, 0o755)
        command = ["setpriv", "--reuid=65534", "--regid=65534", "--clear-groups", program("BUSHCTL")]
        if self.run_program(*command, "--version").returncode != 0:
            self.skipTest("only root can be another user too")
        seen = self.run_program(*command, "status")
        self.assertEqual(seen.returncode, 0, seen.stderr)
        # As root started this daemon, the socket is for the group root.
        self.assertRegex(seen.stderr, r"^bushctl: \S+/control: this user has no right to the control socket: it is for root only. "
                                      r"Set \[control\] group in bushd.toml, and restart bushd; LCM is used meanwhile\n$")
        os.chown(self.file("control"), -1, grp.getgrnam("dialout").gr_gid)
        seen = self.run_program(*command, "status")
        self.assertIn("it is for the group dialout. Run 'sudo usermod -aG dialout USER', then log in again; LCM", seen.stderr)
        # Without a way for LCM the socket is all that matters.
        seen = self.run_program("unshare", "--net", *command, "status")
        self.assertEqual(seen.returncode, 1)
        self.assertRegex(seen.stderr, r"^bushctl: \S+/control: this user has no right to the control socket: it is for the group dialout\. [^\n]*\n$")
        self.assertNotIn("LCM", seen.stderr)
        refused = self.run_program(*command, "--socket", self.file("control"), "status")
        self.assertEqual(refused.returncode, 1)
        self.assertIn("no right to the control socket", refused.stderr)

    def test_a_second_daemon_does_not_take_it(self):
        self.bring_up()
        config = self.file("bushd.toml").read_text()
        self.file("second.toml").write_text(config.replace('"BUSHD"', '"SECOND"'))
        second = self.start_bushd("moves-second.jsonl", "second.toml")
        self.assertEqual(second.process.wait(60), 1)
        self.assertIn("another daemon has this control socket", second.said())
        self.command("status", "--socket", self.file("control"))

    def test_what_a_killed_daemon_has_left_is_replaced(self):
        self.bring_up()
        self.bushd.end(9)
        for command in ("status", "move a0 5", "stop", "estop"):
            told = self.bushctl(*command.split())
            self.assertEqual((told.returncode, told.stdout), (1, ""), command)
            self.assertRegex(told.stderr, rf"^bushctl: nobody listens at the control socket {self.file('control')}: bushd has ended\. "
                                          r"Start it with 'sudo systemctl start bushd', or .*\n$")
        self.bushd = self.start_bushd()
        self.wait_until_ready()
        self.command("status", "--socket", self.file("control"))

    def test_bad_packets_are_counted_and_end_the_connection(self):
        self.bring_up()
        self.start_move("a0", FAR)
        before = self.dropped()
        client = self.connect()
        for packet in (b"junk", b"\0", b"MOVE\0", b"MOVE\0" + bytes(100), b"NOTHING\0" + bytes(10)):
            client.send(packet)
        self.wait_until("them to be counted", lambda: self.dropped() == before + 5)
        client.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 400_000)
        client.send(bytes(150_000))
        for _ in range(10):
            client.send(b"junk")
        self.assertTrue(self.hangs_up(client))
        self.wait_until("the connection to be counted too", lambda: self.dropped() == before + 17)
        self.assert_undisturbed()

    def test_a_thousand_connections(self):
        soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
        if hard < 2200:
            self.skipTest("too few descriptors allowed here")
        resource.setrlimit(resource.RLIMIT_NOFILE, (min(hard, 4096), hard))
        self.addCleanup(resource.setrlimit, resource.RLIMIT_NOFILE, (soft, hard))
        self.bring_up()
        self.start_move("a0", FAR)
        clients = [self.connect() for _ in range(1000)]
        for client in clients:
            try:
                client.send(b"junk")
            except OSError:  # one process may not have so many: its place was another's
                pass
        self.wait_until("all of them to be read, or closed", lambda: self.dropped() >= 1000 - 32)
        self.assert_undisturbed()
        self.assertIn("has 256 connections, as many as one process may have", self.bushd.said())

    def test_a_deleted_socket_comes_back(self):
        self.bring_up()
        client = self.connect()
        self.file("control").unlink()
        self.wait_until("the file to be there again", self.file("control").exists)
        self.command("status", "--socket", self.file("control"))
        client.send(b"junk")
        self.wait_until("the one before to be read", lambda: self.dropped() == 1)

    def test_a_daemon_that_is_not_running(self):
        self.write_config()
        bushd = self.start_bushd()
        self.wait_until("bushd to offer its socket", self.file("control").exists)
        self.assertEqual(bushd.end(), 0)
        for command in ("status", "move a0 5", "stop", "estop"):
            told = self.bushctl(*command.split())
            self.assertEqual((told.returncode, told.stdout), (1, ""), command)
            self.assertRegex(told.stderr, rf"^bushctl: no control socket at {self.file('control')}: bushd is not running\. "
                                          r"Start it with 'sudo systemctl start bushd', or .*\n$")

    def test_without_a_network_the_socket_serves(self):
        self.write_config()
        config = self.file("bushd.toml")
        config.write_text(config.read_text().replace("239.255.76.67", "239.255.76.999"))
        self.start_bushsim()
        self.bushd = self.start_bushd()
        self.wait_until("bushd to offer its socket", self.file("control").exists)
        self.wait_until_ready()
        self.command("move", "--wait", "a0", 5)
        self.assertIn("only clients of the control socket are served", self.bushd.said())

    def test_without_commands_lcm_only_publishes(self):
        self.bring_up(lcm_lines=["commands = false"])
        refused = self.bushctl("move", "--lcm", "a0", 5)
        self.assertEqual(refused.returncode, 1)
        self.assertIn("bushd sends its state but has not answered for 3 s; nothing was asked of it", refused.stderr)
        self.assertIn("with [lcm] commands = false it hears the control socket only; else", self.bushctl("stop", "--lcm").stderr)
        self.command("status", "--lcm")
        self.command("move", "--wait", "a0", 5)
        self.assertEqual(self.positions()["a0"], 5)


if __name__ == "__main__":
    unittest.main()
