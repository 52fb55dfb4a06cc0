"""tools/examples/sardana/BushdCtrl.py in the pool of Sardana, against the real daemon.

The pool is Sardana's own, with its motions and states, within this process: no Tango database and no Tango server are needed, and none of
what they add (attributes, events, macros) is tested here. It needs the environment that tools/setup --lab-clients makes;
$BUSHD_SARDANA_PYTHON is the Python of another one. Without one the tests are skipped."""

import logging
import os
import pathlib
import signal
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "e2e"))
from rig import TOP, EndToEndTest

PYTHON = pathlib.Path(os.environ.get("BUSHD_SARDANA_PYTHON", TOP / "build/sardana/bin/python"))
WITHOUT = "no Sardana: run tools/setup --lab-clients, or name the Python of another environment in $BUSHD_SARDANA_PYTHON"
NAMES = ("a0", "b1", "a3")
FAR = 3000


def sardana_is_there():
    try:
        import sardana
        import tango
    except ImportError:
        return False
    return True


@unittest.skipUnless(sardana_is_there(), WITHOUT)
class Controller(EndToEndTest):
    def bring_up_pool(self):
        from sardana.pool.test import FakePool, createCtrlConf, createElemConf, createPoolController, createPoolMotor

        self.bring_up()
        self.survey()
        self.pool = FakePool([str(TOP / "tools/examples/sardana")], logging.CRITICAL)
        self.addCleanup(self.pool.cleanup)
        properties = {"Motors": ", ".join(NAMES), "Socket": str(self.file("control"))}
        self.controller = createPoolController(self.pool, createCtrlConf(self.pool, "bushd", "BushdMotorController", "BushdCtrl.py", properties))
        self.pool.add_element(self.controller)
        motors = []
        for axis, name in enumerate(NAMES, 1):
            motor = createPoolMotor(self.pool, self.controller, createElemConf(self.pool, axis, name))
            self.controller.add_element(motor)
            self.pool.add_element(motor)
            motors.append(motor)
        self.addCleanup(lambda: self.controller.ctrl._client and self.controller.ctrl._client.close())
        return motors

    def group_of(self, *motors):
        from sardana.pool.test import createPoolMotorGroup

        identity = self.pool.get_free_id()
        configuration = {"id": identity, "name": "group", "full_name": "group"}
        group = createPoolMotorGroup(self.pool, configuration, [motor.id for motor in motors])
        self.pool.add_element(group)
        return group

    def rests(self, element):
        from sardana import State

        self.wait_until("the motion to end", lambda: not element.is_in_operation() and element.get_state(cache=False) is not State.Moving)

    def requests(self, what):
        return [event["motors"] for event in self.logged() if event["event"] == "request" and event["request"] == what]

    def position(self, motor):
        return motor.get_position(cache=False).value

    def test_a_motor_moves_and_tells_where_it_is(self):
        from sardana import State

        a0, b1, a3 = self.bring_up_pool()
        a0.start_move(120)
        self.rests(a0)
        self.assertEqual((self.position(a0), a0.get_state(cache=False)), (120, State.On))
        self.assertEqual(self.position(b1), 0)
        self.assertEqual(self.controller.ctrl.GetAxisExtraPar(1, "Trust"), "known")
        # Its table: 100 to 2500 steps/s in 238 steps and 197 ms.
        self.assertEqual(a0.base_rate, 100)
        self.assertEqual(a0.velocity, 2500)
        self.assertAlmostEqual(a0.acceleration, 0.197, places=3)
        a0.velocity = 500
        self.assertEqual(a0.get_velocity(cache=False), 500)
        with self.assertRaisesRegex(ValueError, "a0: base_rate is that of its table"):
            self.controller.ctrl.SetAxisPar(1, "base_rate", 50)
        self.assertEqual(self.bushd.end(), 0)
        self.assertEqual(self.bushsim.end(), 0)
        self.assertEqual(self.traced_positions()["a0"], 120)

    def test_a_group_is_one_request_and_one_start(self):
        motors = self.bring_up_pool()
        group = self.group_of(*motors)
        group.start_move([300, -200, 100])
        self.rests(group)
        self.assertEqual([self.position(motor) for motor in motors], [300, -200, 100])
        self.assertEqual([sorted(names) for names in self.requests("move")], [sorted(NAMES)])
        starts = {event["start_tick"] for event in self.moves() if event["event"] == "move"}
        self.assertEqual(len(starts), 1)
        self.assertEqual(self.bushd.end(), 0)
        self.assertEqual(self.bushsim.end(), 0)
        traced = self.traced_positions()
        self.assertEqual([traced[name] for name in NAMES], [300, -200, 100])

    def test_a_stop_ramps_down_and_is_no_alarm(self):
        from sardana import State

        a0, *_ = self.bring_up_pool()
        a0.start_move(100 * FAR)
        self.wait_until_travelled(300, "a0")
        self.assertIs(a0.get_state(cache=False), State.Moving)
        a0.stop()
        self.rests(a0)
        self.assertIs(a0.get_state(cache=False), State.On)
        self.assertEqual(self.position(a0), self.positions()["a0"])
        self.assertLess(self.position(a0), 100 * FAR)

    def test_a_stop_by_others_is_an_alarm_until_the_next_start(self):
        from sardana import State

        a0, *_ = self.bring_up_pool()
        a0.start_move(100 * FAR)
        self.wait_until_travelled(300, "a0")
        self.command("stop", "a0")
        self.rests(a0)
        self.assertIs(a0.get_state(cache=False), State.Alarm)
        self.assertIn("stopped on request, asked for by", a0.get_status(cache=False))
        a0.start_move(self.positions()["a0"] + 10)
        self.rests(a0)
        self.assertIs(a0.get_state(cache=False), State.On)

    def test_a_refusal_fails_the_start(self):
        a0, b1, a3 = self.bring_up_pool()
        self.command("hold", "b1")
        with self.assertRaisesRegex(Exception, "b1"):
            self.controller.ctrl.PreStartAll()
            self.controller.ctrl.StartOne(1, 10)
            self.controller.ctrl.StartOne(2, 10)
            self.controller.ctrl.StartAll()
        self.assertEqual(set(self.positions().values()), {0})

    def test_a_position_is_defined_and_one_that_is_not_known_is_not_read(self):
        from sardana import State

        a0, b1, a3 = self.bring_up_pool()
        self.bushd.end(signal.SIGKILL)
        self.assertIs(a0.get_state(cache=False), State.Fault)
        self.bushd = self.start_bushd("moves-after.jsonl")
        self.wait_until_ready()
        self.assertIs(a0.get_state(cache=False), State.Alarm)
        self.assertIn("a0: its position is uncertain", a0.get_status(cache=False))
        self.assertTrue(a0.get_position(cache=False).error)
        a0.define_position(50)
        self.assertEqual(self.position(a0), 50)
        self.assertIs(a0.get_state(cache=False), State.On)
        self.assertEqual(self.motors()["a0"]["trust"], "known")


if __name__ == "__main__":
    if PYTHON.exists() and os.path.realpath(sys.prefix) != os.path.realpath(PYTHON.parents[1]):
        os.execv(PYTHON, [str(PYTHON), "-B", *sys.argv])
    unittest.main()
