#!/usr/bin/env python3
"""Jogs whose client does not answer any more: its program is frozen, or the network to its PC is cut."""

import signal
import subprocess
import sys
import unittest

from lab import ADDRESS, LabTest

BRIDGE_PC, CLIENT_PC = "10.213.7.1", "10.213.7.2"
# Puts 1 again and again, as a client that jogs for long does, while it reads lines.
JOGS = """
import epics, sys
jog = epics.PV("LAB:theta.JOGF")
jog.wait_for_connection(20)
jog.put(1, wait=True)
print("jogs", flush=True)
while True:
    epics.ca.poll(evt=0.2)
    jog.put(1)
"""


class Jogs(LabTest):
    def assert_it_has_ended(self, why):
        """At the right place, without an alarm; the log says why."""
        self.wait_for("theta.DMOV", lambda dmov: dmov == 1)
        self.assertEqual([self.get(f"theta.{field}") for field in ("JOGF", "MOVN", "SEVR")], [0, 0, 0])
        self.assertIn(why, self.bridge.said())
        stands = self.get("theta.RBV")
        self.end_all()
        self.assertEqual(self.steps_made("theta"), round(stands * 100))
        self.assertLess(stands, 500.0, "it is the soft limit that has ended it")

    def wait_for_jog(self, client, beyond):
        """It jogs until it is that far."""
        self.wait_until("the client to jog", lambda: "jogs" in client.said() or not client.lives())
        self.assertTrue(client.lives(), client.said())
        self.wait_for("theta.RBV", lambda rbv: rbv > beyond)
        self.assertEqual(self.get("theta.JOGF"), 1)

    def test_a_frozen_client_puts_1_no_more_so_its_jog_ends(self):
        self.bring_up_lab(bridge=["--longest-jog-s", "2"])
        self.put("theta.JVEL", 2.0)
        client = self.start([sys.executable, "-B", "-c", JOGS], "client.log")
        self.wait_for_jog(client, 6.0)  # 3 s: longer than a jog that nobody keeps up
        client.send(signal.SIGSTOP)
        self.assert_it_has_ended("nobody has put it to 1 again for 2 s")

    def test_a_client_whose_network_is_cut_acknowledges_nothing_so_its_jog_ends(self):
        self.bring_up_lab()
        self.bridge.end()
        client_pc = self.start(["unshare", "--net", "sh", "-c", "echo there; exec sleep 3600"], "client-pc.log")
        self.wait_until("a network for the client", lambda: "there" in client_pc.said())
        inside = ["nsenter", f"--net=/proc/{client_pc.process.pid}/ns/net"]
        run("ip", "link", "add", "to-client", "type", "veth", "peer", "name", "to-bridge", "netns", str(client_pc.process.pid))
        self.addCleanup(subprocess.run, ["ip", "link", "delete", "to-client"], check=False)
        run("ip", "address", "add", f"{BRIDGE_PC}/24", "dev", "to-client")
        run("ip", "link", "set", "to-client", "up")
        run(*inside, "ip", "address", "add", f"{CLIENT_PC}/24", "dev", "to-bridge")
        run(*inside, "ip", "link", "set", "to-bridge", "up")
        self.file("names.toml").write_text(f'[allow]\nhosts = ["{ADDRESS}", "{CLIENT_PC}"]\n')
        self.bridge = self.start_bridge("--names", self.file("names.toml"), "--interface", ADDRESS, "--interface", BRIDGE_PC)
        self.put("theta.JVEL", 2.0)
        client = self.start([*inside, "env", f"EPICS_CA_ADDR_LIST={BRIDGE_PC}", sys.executable, "-B", "-c", JOGS], "client.log")
        self.wait_for_jog(client, 1.0)
        run("ip", "link", "set", "to-client", "down")
        self.assert_it_has_ended("its client has taken nothing for 1 s")


def run(*command):
    subprocess.run(command, check=True, timeout=20)


if __name__ == "__main__":
    unittest.main()
