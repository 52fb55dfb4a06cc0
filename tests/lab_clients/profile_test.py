#!/usr/bin/env python3
"""Profile moves and position compare as clients of the motor module have them, by pyepics against the real programs."""

import re
import signal
import threading
import unittest

from lab import PLACES, STEPS, LabTest, caproto_client, pyepics
from rig import GIVE_UP_S, Trace

NAMES = '[profiles]\npm1 = ["theta", "phi"]\n'
SUCCESS, FAILURE, ABORT = 1, 2, 3
POINTS = 11
PERIOD_S = 0.2
SPEED = 5.0  # of theta, in degrees a second
SLOT_NS = 20_000


class ProfileTest(LabTest):
    def bring_up_profile(self, *options):
        self.file("names.toml").write_text(NAMES)
        self.bring_up_lab(bridge=["--names", self.file("names.toml"), *options])

    def text(self, name):
        return self.get(f"pm1:{name}", as_string=True)

    def prepare(self, theta, phi=None, period_s=PERIOD_S, ramp_s=0.5):
        self.put("pm1:NumPoints", len(theta))
        self.put("pm1:FixedTime", period_s)
        self.put("pm1:Acceleration", ramp_s)
        for axis, positions in ((1, theta), (2, phi)):
            self.put(f"pm1:M{axis}UseAxis", int(positions is not None))
            if positions is not None:
                self.put(f"pm1:M{axis}Positions", positions)
                self.put(f"pm1:M{axis}Positions.PROC", 1)
        self.put("pm1:Build", 1)

    def ends(self, what):
        return self.get(f"pm1:{what}Status"), self.get(f"pm1:{what}State"), self.get(f"pm1:{what}")

    def arrivals(self, name):
        """When the last step upwards to each position, in steps, was made."""
        at, arrivals = 0, {}
        for edge in Trace(self.file("trace.vcd")).edges[PLACES[name]]:
            at += 1 if edge.direction else -1
            if edge.direction:
                arrivals[at] = edge.time_ns
        return arrivals


class Profiles(ProfileTest):
    def test_positions_are_passed_at_their_times(self):
        self.bring_up_profile()
        self.assertEqual((self.get("pm1:NumAxes"), self.get("pm1:BuildStatus", as_string=True)), (2, "Undefined"))
        heard = self.watch("theta.DMOV", "phi.DMOV", "pm1:ExecuteStatus")
        theta = [SPEED * PERIOD_S * number for number in range(POINTS)]
        phi = [0.1 * number + 0.02 * number**2 for number in range(POINTS)]
        self.prepare(theta, phi)
        self.assertEqual(self.ends("Build"), (SUCCESS, 0, 0), self.text("BuildMessage"))
        self.put("pm1:Execute", 1)
        self.assertEqual(self.ends("Execute"), (SUCCESS, 0, 0), self.text("ExecuteMessage"))
        self.assertEqual(heard.values("pm1:ExecuteStatus"), [SUCCESS])
        self.wait_until("the motors to be done", lambda: heard.values("DMOV")[-2:] == [1, 1])
        self.assertEqual(self.get("pm1:CurrentPoint"), POINTS)
        self.put("pm1:Readback", 1)
        self.assertEqual(self.ends("Readback"), (SUCCESS, 0, 0))
        read = [list(self.get(f"pm1:M{axis}Readbacks")) for axis in (1, 2)]
        for asked, found, axis in ((theta, read[0], 1), (phi, read[1], 2)):
            for one, other, error in zip(asked, found, self.get(f"pm1:M{axis}FollowingErrors"), strict=True):
                self.assertLessEqual(abs(one - other), 0.5 / STEPS + 1e-9)
                self.assertAlmostEqual(other - one, error)
        self.assertIn("epics:", self.command("history", "theta").stdout)
        ends = self.status()
        self.end_all()
        self.assert_trace_is_right(ends)
        self.check_times(read)

    def check_times(self, read):
        """By the trace: theta goes at one speed from the first point to the last one, and phi stands at each point where it was read."""
        theta, phi = self.arrivals("theta"), self.arrivals("phi")
        last = round(SPEED * PERIOD_S * (POINTS - 1) * STEPS)
        step_ns = 1e9 / (SPEED * STEPS)
        begin_ns = theta[1] - step_ns / 2
        for step in range(1, last + 1):
            self.assertAlmostEqual(theta[step], begin_ns + (step - 0.5) * step_ns, delta=SLOT_NS, msg=step)
        for number, position in enumerate(read[1]):
            at_ns = begin_ns + number * PERIOD_S * 1e9
            made = max(step for step, time_ns in phi.items() if time_ns <= at_ns + SLOT_NS)
            self.assertEqual(made, round(position * STEPS), number)

    def test_what_cannot_be_flown_fails_with_its_reason(self):
        self.bring_up_profile()
        self.prepare([0.0, 10.0, 20.0], period_s=0.1)
        self.assertEqual(self.ends("Build")[0], FAILURE)
        self.assertIn("theta", self.text("BuildMessage"))
        self.assertTrue(self.put_fails("pm1:Build", 1))
        self.assertTrue(self.put_fails("pm1:Execute", 1))
        self.assertEqual((self.ends("Execute")[0], self.text("ExecuteMessage").startswith("no profile is built")), (FAILURE, True))
        self.prepare([0.0, 400.0, 501.0], period_s=60.0)
        self.assertEqual(self.ends("Build")[0], FAILURE)
        self.prepare([0.0, 1.0, 2.0])
        self.assertEqual(self.ends("Build")[0], SUCCESS, self.text("BuildMessage"))
        self.command("hold", "theta")
        self.assertTrue(self.put_fails("pm1:Execute", 1))
        self.assertEqual(self.ends("Execute"), (FAILURE, 0, 0))
        self.assertRegex(self.text("ExecuteMessage"), "held")
        self.end_all()
        self.assertEqual(self.steps_made("theta"), 0)

    def test_abort_and_every_stop_end_a_flight(self):
        self.bring_up_profile()
        stops = (("pm1:Abort", 1), ("theta.STOP", 1), ("allstop", 1), ("phi.SPMG", 0))
        for name, value in stops:
            self.prepare([0.0, 100.0], [0.0, 50.0], period_s=50.0)
            self.assertEqual(self.ends("Build")[0], SUCCESS, self.text("BuildMessage"))
            self.put("pm1:Execute", 1, wait=False)
            self.wait_for("pm1:ExecuteState", lambda state: state == 2)
            self.put(name, value)
            self.wait_for("pm1:Execute", lambda executes: executes == 0)
            self.assertEqual(self.ends("Execute"), (ABORT, 0, 0), name)
            for motor in ("theta", "phi"):
                self.wait_for(f"{motor}.DMOV", lambda done: done == 1)
            self.assertTrue(self.put_fails("pm1:Readback", 1))
        self.end_all()

    def test_a_plan_of_bluesky_flies_it(self):
        from bluesky import RunEngine
        from bluesky.plan_stubs import mv
        from ophyd import Component, Device, EpicsSignal

        def variable(name):
            return Component(EpicsSignal, name, put_complete=True)

        class ProfileMove(Device):
            num_points = variable("NumPoints")
            times = variable("Times")
            time_mode = variable("TimeMode")
            positions = variable("M1Positions")
            use = variable("M1UseAxis")
            build = variable("Build")
            execute = variable("Execute")

        self.bring_up_profile()
        move = ProfileMove("LAB:pm1:", name="move")
        move.wait_for_connection(timeout=20)

        def plan():
            yield from mv(move.num_points, 3, move.times, [0.5, 1.0], move.time_mode, "Array", move.use, "Yes", move.positions, [0.0, 1.0, 2.0])
            yield from mv(move.build, 1)
            yield from mv(move.execute, 1)

        RunEngine({})(plan())
        self.assertEqual((self.ends("Build"), self.ends("Execute")), ((SUCCESS, 0, 0), (SUCCESS, 0, 0)))
        # Behind the last point it slows down from 1 degree a second, in 0.5 s.
        self.assertAlmostEqual(self.get("theta.RBV"), 2.0 + 0.25 + 0.5 / 64, delta=1 / STEPS)

    def test_puts_take_the_rights_of_all_others(self):
        self.bring_up_profile("--read-only")
        for name in ("pm1:Execute", "pm1:M1Positions", "thetaPCOEnable"):
            variable = pyepics().PV(f"LAB:{name}")
            self.assertTrue(variable.wait_for_connection(timeout=20))
            self.assertEqual((variable.read_access, variable.write_access), (True, False), name)


class ProfileFaults(ProfileTest):
    """Far from its end something fails. The put is caproto's, which tells how it was answered, or that it never will be."""

    def begin_flight(self):
        self.bring_up_profile()
        self.prepare([0.0, 20.0, 40.0], [0.0, 5.0, 20.0], period_s=4.0)
        self.assertEqual(self.ends("Build")[0], SUCCESS, self.text("BuildMessage"))
        self.came = []  # of the put
        self.putting = threading.Thread(target=self.execute)
        self.putting.start()
        self.wait_until_travelled(600, "theta")

    def execute(self):
        try:
            response = caproto_client.write("LAB:pm1:Execute", 1, notify=True, timeout=GIVE_UP_S, repeater=False)
            self.came.append(response.status.name)
        except Exception as error:
            self.came.append(type(error).__name__)

    def wait_for_rest(self):
        self.wait_until("the motors to rest", lambda: not any(motor["moving"] for motor in self.motors().values()))

    def assert_steps(self, stand):
        """By the trace, all motors stand where the daemon has said."""
        self.end_all()
        self.assertEqual({name: self.steps_made(name) for name in stand}, stand)

    def test_the_bridge_is_killed_and_the_flight_goes_on(self):
        self.begin_flight()
        self.bridge.end(signal.SIGKILL)
        self.putting.join()
        self.assertNotEqual(self.came, ["ECA_NORMAL"])
        self.bridge = self.start_bridge("--names", self.file("names.toml"))
        # It does not know how that flight goes, nor how it ends.
        words = ("Execute", "ExecuteState", "ExecuteStatus", "ReadbackStatus")
        self.assertEqual([self.get_anew(f"pm1:{name}") for name in words], [b"Done", b"Done", b"Undefined", b"Undefined"])
        self.assertEqual(self.get_anew("theta.DMOV"), 0)
        self.wait_for_rest()
        self.wait_until("theta to be done", lambda: self.get_anew("theta.DMOV") == 1)
        run_s = 0.25 + 0.5 / 64  # behind the last point, by its speed
        stand = self.positions()
        self.assertEqual((stand["theta"], stand["phi"]), (round((40 + 5 * run_s) * STEPS), round((20 + 3.75 * run_s) * STEPS)))
        self.assertEqual(self.get_anew("theta.SEVR"), b"NO_ALARM")
        self.assertEqual(caproto_client.write("LAB:pm1:Readback", 1, notify=True, repeater=False).status.name, "ECA_PUTFAIL")
        self.assert_steps(stand)

    def test_the_daemon_is_killed_and_the_motors_run_down(self):
        self.begin_flight()
        self.bushd.end(signal.SIGKILL)
        self.putting.join()
        self.assertEqual(self.came, ["ECA_PUTFAIL"])
        self.assertEqual(self.ends("Execute"), (FAILURE, 0, 0))
        self.assertIn("the daemon has ended", self.text("ExecuteMessage"))
        self.bushd = self.start_bushd("moves-after.jsonl")
        self.wait_until_ready()
        self.wait_for_rest()
        for name in ("theta", "phi"):
            self.wait_for(f"{name}.DMOV", lambda done: done == 1)
            self.wait_for(f"{name}.SEVR", lambda severity: severity == 2)  # nobody has seen how it came to rest
        self.assertTrue(self.put_fails("pm1:Readback", 1))
        stand = self.positions()
        self.assertLess(stand["theta"], 4000)
        self.assertEqual([round(self.get(f"{name}.RBV") * STEPS) for name in stand], list(stand.values()))
        self.assert_steps(stand)


class PositionCompare(LabTest):
    def pulses_ns(self, address):
        """When the output of this MCU has risen: a reader of its own, of the dump."""
        scope, code, now, rises = [], None, 0, []
        for line in self.file("trace.vcd").read_text().splitlines():
            if found := re.match(r"\$scope \w+ (\S+)", line):
                scope.append(found[1])
            elif line.startswith("$upscope"):
                scope.pop()
            elif (found := re.match(r"\$var \w+ 1 (\S+) position_compare ", line)) and re.search(rf"(^|\D){address}$", scope[-1]):
                code = found[1]
            elif line.startswith("#"):
                now = int(line[1:])
            elif code is not None and line == f"1{code}":
                rises.append(now)
        self.assertIsNotNone(code)
        return rises

    def test_a_pulse_at_each_arrival(self):
        self.bring_up_lab()
        self.put("thetaPCOStartPosition", 2.0)
        self.put("thetaPCOPulseWidth", 50.0)
        self.put("thetaPCOEnable", 1)
        self.assertEqual(self.get("thetaPCOEnable_RBV"), 1)
        self.put("theta.VAL", 3.0)
        self.put("phiPCOStartPosition", 1.0)
        self.put("phiPCOEnable", 1)
        self.wait_for("thetaPCOEnable_RBV", lambda on: on == 0)  # both are of one MCU
        self.put("theta.VAL", 0.0)
        self.put("phi.VAL", 2.0)
        self.put("phiPCOEnable", 0)
        self.put("phi.VAL", 0.0)
        self.end_all()
        edges = Trace(self.file("trace.vcd")).edges
        expected = [edges[PLACES["theta"]][2 * STEPS - 1].time_ns, edges[PLACES["phi"]][STEPS - 1].time_ns]
        pulses = self.pulses_ns(1)
        self.assertEqual(len(pulses), 2)
        for pulse, edge in zip(pulses, expected):
            self.assertTrue(0 <= pulse - edge <= SLOT_NS, (pulse, edge))

    def test_what_an_mcu_cannot_is_refused(self):
        self.bring_up_lab()
        for field, value in (("PCOPulseWidth", 0.0), ("PCOEnable_RBV", 1)):
            self.assertTrue(self.put_fails(f"theta{field}", value), field)
        self.put("thetaPCOEndPosition", 2.0)
        self.put("thetaPCOIncrement", 0.5)
        self.assertTrue(self.put_fails("thetaPCOEnable", 1))
        self.assertEqual(self.get("thetaPCOEnable"), 0)


if __name__ == "__main__":
    unittest.main()
