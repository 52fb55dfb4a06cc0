#!/usr/bin/env python3
"""Moves that wait for a trigger, armed by pyepics against the real programs."""

import signal
import unittest

from lab import PLACES, STEPS, LabTest, pyepics
from rig import Trace

IDLE, ARMED = 0, 2
DISTANCE = 1.0


class Trigger(LabTest):
    def arm(self, name="theta", distance=DISTANCE):
        self.put(f"{name}_trgDistance", distance)
        self.put(f"{name}_trgArm", 1, wait=False)
        self.wait_for(f"{name}_trgState", lambda state: state == ARMED)

    def edge(self):
        """One that makes the trigger inputs of all MCUs active, or inactive again."""
        self.bushsim.send(signal.SIGRTMIN)

    def message(self, name="theta"):
        return self.get(f"{name}_trgMessage", as_string=True)

    def test_a_move_begins_at_the_edge_and_the_put_is_over_when_it_is(self):
        self.bring_up_lab()
        self.put("theta_trgDelay", 700.0)
        heard = self.watch("theta.DMOV", "theta.RBV", "theta_trgArm", "theta_trgState")
        self.put("theta_trgDistance", DISTANCE)
        ended = []
        epics = pyepics()
        armed = epics.PV("LAB:theta_trgArm")
        self.assertTrue(armed.wait_for_connection(timeout=20))
        armed.put(1, callback=lambda **_: ended.append(list(heard.values("theta_trgArm"))))
        self.wait_for("theta_trgState", lambda state: state == ARMED)
        self.assertEqual((self.motors()["theta"]["activity"], self.get("theta.DMOV"), ended), ("armed", 1, []))
        self.assertIn("epics:", self.motors()["theta"]["armed_by"])
        self.assertTrue(self.put_fails("theta.VAL", 5.0))
        self.wait_until("the edges of the put that is refused", lambda: heard.values("DMOV") == [0, 1])
        heard.clear()
        self.edge()
        self.wait_until("the put to be answered", lambda: ended)
        self.assertEqual(ended, [[0]])
        self.assertEqual((heard.values("DMOV"), heard.values("theta_trgState")[-1]), ([0, 1], IDLE))
        self.assertEqual((self.get("theta.RBV"), self.get("theta.VAL"), self.message()), (DISTANCE, DISTANCE, ""))
        self.end_all()
        edges = Trace(self.file("trace.vcd")).edges[PLACES["theta"]]
        self.assertEqual(self.steps_made("theta"), DISTANCE * STEPS)
        self.assertGreaterEqual(edges[0].time_ns - self.trigger_ns(), 700_000)

    def trigger_ns(self):
        """When the input of an MCU has become active: a reader of its own, of the dump."""
        codes, now = set(), 0
        for line in self.file("trace.vcd").read_text().splitlines():
            words = line.split()
            if line.startswith("$var") and "trigger" in words:
                codes.add(words[3])
            elif line.startswith("#"):
                now = int(line[1:])
            elif line[:1] == "1" and line[1:] in codes and now > 0:
                return now
        self.fail("no trigger in the trace")

    def test_a_falling_edge_on_the_users_scale(self):
        self.bring_up_lab(theta='direction = "negative"')
        self.edge()
        self.put("theta_trgEdge", "Falling")
        at = self.get("theta.RBV")
        self.arm()
        self.edge()
        self.wait_for("theta_trgArm", lambda armed: armed == 0)
        self.assertEqual((self.message(), round(self.get("theta.RBV") - at, 9)), ("", DISTANCE))
        self.end_all()
        self.assertEqual(self.steps_made("theta"), -DISTANCE * STEPS)

    def test_every_stop_disarms(self):
        self.bring_up_lab()
        for name, value in (("theta_trgArm", 0), ("theta.STOP", 1), ("theta.SPMG", 0), ("allstop", 1)):
            with self.subTest(name=name):
                self.arm()
                self.put(name, value)
                self.wait_for("theta_trgArm", lambda armed: armed == 0)
                self.assertEqual(self.get("theta_trgState"), IDLE)
                self.assertNotEqual(self.message(), "")
                self.edge()
                self.edge()
                self.put("theta.SPMG", 3)
        self.assertEqual(self.get("theta.RBV"), 0.0)
        self.end_all()
        self.assertEqual(self.steps_made("theta"), 0)

    def test_what_the_daemon_refuses_fails_the_put_with_its_reason(self):
        self.bring_up_lab()
        self.put("theta_trgDistance", 501.0)
        self.assertTrue(self.put_fails("theta_trgArm", 1))
        self.assertIn("theta", self.message())
        self.arm("theta")
        self.put("phi_trgDistance", 1.0)
        self.assertTrue(self.put_fails("phi_trgArm", 1))  # both are of one MCU
        self.assertIn("trigger", self.message("phi"))
        self.arm("chi")
        self.edge()
        for name in ("theta", "chi"):
            self.wait_for(f"{name}_trgArm", lambda armed: armed == 0)
            self.assertEqual((self.get(f"{name}.RBV"), self.message(name)), (DISTANCE, ""))
        self.assertEqual(self.get("phi.RBV"), 0.0)

    def test_a_bridge_that_is_killed_disarms_and_knows_of_nothing_when_it_is_back(self):
        self.bring_up_lab()
        self.arm()
        self.bridge.end(signal.SIGKILL)
        self.wait_until("the motor to be disarmed", lambda: self.motors()["theta"]["activity"] == "rest")
        self.edge()
        self.edge()
        self.bridge = self.start_bridge()
        self.assertEqual([self.get_anew(name) for name in ("theta_trgArm", "theta_trgState", "theta.RBV")], [b"Done", b"Idle", 0.0])
        self.end_all()
        self.assertEqual(self.steps_made("theta"), 0)

    def test_a_daemon_that_is_killed_leaves_nothing_armed_and_the_put_fails(self):
        self.bring_up_lab()
        self.put("theta_trgDistance", DISTANCE)
        self.arm()
        self.bushd.end(signal.SIGKILL)
        self.wait_for("theta_trgArm", lambda armed: armed == 0)
        self.assertNotEqual(self.message(), "")
        self.bushd = self.start_bushd("moves-after.jsonl")
        self.wait_until_ready()
        self.edge()
        self.edge()
        self.wait_for("theta.SEVR", lambda severity: severity < 3)
        self.assertEqual((self.get("theta.RBV"), self.motors()["theta"]["activity"]), (0.0, "rest"))
        self.end_all()
        self.assertEqual(self.steps_made("theta"), 0)


if __name__ == "__main__":
    unittest.main()
