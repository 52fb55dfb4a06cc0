#!/usr/bin/env python3
"""ophyd's EpicsMotor, pyepics' Motor and bluesky's plans as they are, against the real programs."""

import logging
import unittest

from lab import LabTest

logging.getLogger("ophyd").setLevel(logging.CRITICAL)


class Ophyd(LabTest):
    def engine(self):
        from bluesky import RunEngine

        documents = []
        engine = RunEngine({})
        engine.subscribe(lambda kind, document: documents.append((kind, document)))
        return engine, documents

    def test_moves_succeed_and_stops_do_not(self):
        self.bring_up_lab()
        theta = self.epics_motor("theta")
        self.assertEqual((theta.limits, theta.egu), ((-500.0, 500.0), "deg"))
        self.assertTrue(theta.move(2.0, wait=True, timeout=60).success)
        self.assertEqual(theta.position, 2.0)
        self.assertTrue(theta.move(2.0, wait=True, timeout=60).success)
        status = theta.move(300.0, wait=False)
        self.wait_until("theta to be under way", lambda: theta.position > 5)
        theta.motor_stop.put(1)
        self.wait_until("the stop", lambda: status.done)
        self.assertFalse(status.success)
        self.command("hold", "theta")
        status = theta.move(1.0, wait=False)
        self.wait_until("the refusal", lambda: status.done)
        self.assertFalse(status.success)
        self.command("release", "theta")
        self.assertTrue(theta.move(1.0, wait=True, timeout=60).success)
        self.end_all()
        self.assertEqual(self.steps_made("theta"), 100)

    def test_position_and_limits_are_set(self):
        self.bring_up_lab()
        theta = self.epics_motor("theta")
        theta.set_current_position(10.0)
        self.wait_until("the position", lambda: theta.position == 10.0)
        self.assertEqual(self.get("theta.OFF"), 10.0)
        heard = self.watch("theta.LLM", "theta.HLM")
        theta.set_lim(-5, 15)
        self.wait_until("the limits", lambda: (heard.values("LLM"), heard.values("HLM")) == ([-5.0], [15.0]))
        control = theta.user_setpoint._read_pv.get_ctrlvars()
        self.assertEqual((control["lower_ctrl_limit"], control["upper_ctrl_limit"]), (-5.0, 15.0))
        with self.assertRaises(Exception):
            theta.move(16.0)
        self.end_all()
        self.assertEqual(self.steps_made("theta"), 0)

    def test_scans_come_to_every_point(self):
        import bluesky.plans as bp

        self.bring_up_lab()
        theta, phi = self.epics_motor("theta"), self.epics_motor("phi")
        engine, documents = self.engine()
        engine(bp.grid_scan([], theta, 0, 1, 5, phi, -1, 1, 3, snake_axes=True))
        points = [(round(document["data"]["theta"], 6), round(document["data"]["phi"], 6)) for kind, document in documents if kind == "event"]
        phis = (-1.0, 0.0, 1.0)
        wanted = [(0.25 * row, at) for row in range(5) for at in (phis if row % 2 == 0 else phis[::-1])]
        self.assertEqual(points, wanted)
        self.assertEqual([self.get(f"{name}.SEVR") for name in ("theta", "phi")], [0, 0])
        self.end_all()
        self.assertEqual((self.steps_made("theta"), self.steps_made("phi")), (100, 100))

    def test_pyepics_moves_and_sets(self):
        import epics

        self.bring_up_lab()
        motor = epics.Motor("LAB:theta")
        self.assertEqual(motor.disabled, 0)
        self.assertEqual(motor.move(3.0, wait=True, timeout=60), 0)
        self.assertEqual(motor.get_position(readback=True), 3.0)
        motor.set_position(100.0)
        self.wait_until("the position", lambda: motor.get_position(readback=True) == 100.0)
        self.assertEqual(motor.offset, 97.0)
        self.end_all()
        self.assertEqual(self.steps_made("theta"), 300)


if __name__ == "__main__":
    unittest.main()
