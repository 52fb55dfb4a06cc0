"""The daemon as a service of systemd: what it tells the service manager."""

import os
import socket
import unittest

from rig import GIVE_UP_S, EndToEndTest

WATCHDOG_US = 400_000


class Service(EndToEndTest):
    def setUp(self):
        self.manager = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.addCleanup(self.manager.close)
        self.manager.settimeout(GIVE_UP_S)
        self.manager.bind(str(self.file("notify")))
        self.tell("NOTIFY_SOCKET", str(self.file("notify")))

    def tell(self, name, value):
        os.environ[name] = value
        self.addCleanup(os.environ.pop, name)

    def wait_for(self, word):
        """What comes before it."""
        before = []
        while True:
            said = self.manager.recv(4096).decode().splitlines()
            if word in said:
                return before
            before += said

    def test_says_when_it_is_ready_alive_and_stopping(self):
        self.tell("WATCHDOG_USEC", str(WATCHDOG_US))
        self.bring_up()
        self.assertNotIn("STOPPING=1", self.wait_for("READY=1"))
        for _ in range(3):
            self.wait_for("WATCHDOG=1")
        self.assertEqual(self.bushd.end(), 0)
        self.wait_for("STOPPING=1")

    def test_says_how_many_mcus_are_offline(self):
        # With no watchdog to feed: nobody reads here meanwhile, and the socket keeps ten messages.
        self.bring_up()
        before = self.wait_for("STATUS=1 bus, 8 motors, all MCUs online")
        self.assertIn("STATUS=1 bus, 8 motors, 2 MCUs offline", before)
        self.assertIn("READY=1", before)


if __name__ == "__main__":
    unittest.main()
