#!/usr/bin/env python3
"""The bridge, the daemon and the link go, at rest and on the way: no move is done that is not, and no put is lost without an error."""

import signal
import unittest

from lab import LabTest


class Faults(LabTest):
    def test_the_bridge_is_killed_and_comes_back(self):
        self.bring_up_lab()
        self.put("theta.VAL", 400.0, wait=False)
        self.wait_for("theta.RBV", lambda rbv: rbv > 2)
        self.bridge.send(signal.SIGKILL)
        self.bridge.process.wait()
        self.bridge = self.start_bridge()
        # The daemon has gone on with the move: it is shown as one that goes on.
        self.assertEqual(self.get("theta.DMOV"), 0)
        self.wait_for("theta.DMOV", lambda dmov: dmov == 1)
        self.assertEqual((self.get("theta.RBV"), self.get("theta.VAL"), self.get("theta.SEVR")), (400.0, 400.0, 0))
        self.put("theta.VAL", 401.0)
        self.end_all()
        self.assertEqual(self.steps_made("theta"), 40100)

    def test_the_daemon_is_killed_at_rest(self):
        self.bring_up_lab()
        self.put("theta.VAL", 1.0)
        heard = self.watch("theta.DMOV", "theta.SEVR")
        self.bushd.send(signal.SIGKILL)
        self.bushd.process.wait()
        self.wait_for("theta.SEVR", lambda severity: severity == 3)
        self.assertEqual(heard.values("DMOV"), [])
        self.assertTrue(self.put_fails("theta.VAL", 2.0))
        self.wait_until("DMOV, which comes by another connection", lambda: heard.values("DMOV") == [0, 1])
        heard.take()
        self.bushd = self.start_bushd()
        self.wait_for("theta.SEVR", lambda severity: severity in (0, 2))
        self.wait_until_ready()
        self.assertEqual((heard.values("DMOV"), self.get("theta.RBV")), ([], 1.0))
        self.wait_until("a move to succeed", lambda: not self.put_fails("theta.VAL", 3.0))
        self.assertEqual(self.get("theta.RBV"), 3.0)
        self.end_all()
        self.assertEqual(self.steps_made("theta"), 300)

    def test_the_daemon_is_killed_on_the_way(self):
        self.bring_up_lab()
        heard = self.watch("theta.DMOV", "theta.RBV")
        self.put("theta.VAL", 300.0, wait=False)
        self.wait_for("theta.RBV", lambda rbv: rbv > 2)
        self.bushd.send(signal.SIGKILL)
        self.bushd.process.wait()
        self.bushd = self.start_bushd()
        self.wait_for("theta.DMOV", lambda dmov: dmov == 1)
        told = heard.take()
        self.assertEqual([value for field, value, _ in told if field == "DMOV"], [0, 1])
        self.assertGreaterEqual([severity for field, _, severity in told if field == "RBV"][-1], 2)
        self.wait_until_ready()
        self.wait_for("theta.SEVR", lambda severity: severity < 3)
        stands = self.get("theta.RBV")
        self.end_all()
        self.assertEqual(self.steps_made("theta"), round(stands * 100))

    def test_the_adapter_is_unplugged_on_the_way(self):
        self.bring_up_lab()
        heard = self.watch("theta.DMOV", "theta.RBV")
        self.put("theta.VAL", 300.0, wait=False)
        self.wait_for("theta.RBV", lambda rbv: rbv > 2)
        self.bushsim.send(signal.SIGUSR1)
        self.wait_for("theta.SEVR", lambda severity: severity == 3)
        self.bushsim.send(signal.SIGUSR2)
        self.wait_for("theta.SEVR", lambda severity: severity < 3)
        self.wait_for("theta.DMOV", lambda dmov: dmov == 1)
        self.assertEqual([value for field, value, _ in heard.take() if field == "DMOV"], [0, 1])
        stands = self.get("theta.RBV")
        self.end_all()
        self.assertEqual(self.steps_made("theta"), round(stands * 100))

    def test_a_daemon_that_is_stopped_for_a_while_is_invalid_meanwhile(self):
        self.bring_up_lab()
        heard = self.watch("theta.DMOV", "theta.SEVR")
        self.bushd.send(signal.SIGSTOP)
        self.wait_for("theta.SEVR", lambda severity: severity == 3)
        self.bushd.send(signal.SIGCONT)
        self.wait_for("theta.SEVR", lambda severity: severity < 3)
        self.assertEqual(heard.values("DMOV"), [])


if __name__ == "__main__":
    unittest.main()
