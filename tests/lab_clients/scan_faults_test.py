#!/usr/bin/env python3
"""Bridge, daemon and adapter fail in the middle of a grid_scan of EpicsMotors: the plan fails or goes on, never with a position that is wrong."""

import bisect
import logging
import re
import signal
import threading
import time
import unittest

from lab import PLACES, STEPS, LabTest
from rig import Trace

logging.getLogger("ophyd").setLevel(logging.CRITICAL)

ROWS, COLUMNS = (0.0, 2.0), (0.0, 40.0, 80.0)
POINTS = [(row, column) for row in ROWS for column in COLUMNS]
UNDER_WAY_STEPS = 400
HELD_UP_S = 5


class ScanFaults(LabTest):
    def scan_and(self, fail, speed=None):
        """Runs the plan; `fail` is called, in a thread of its own, once phi is on its way to the second point. Whether the plan has ended well."""
        import bluesky.plans as bp
        from bluesky import RunEngine

        self.bring_up_lab()
        motors = [self.epics_motor(name) for name in ("theta", "phi")]
        if speed is not None:
            self.put("phi.VELO", speed)
        engine = RunEngine({})
        engine.log.logger.disabled = True  # of a run that is to fail it prints the whole way
        self.events = []  # (time of CLOCK_MONOTONIC, positions)
        engine.subscribe(self.hear_event, name="event")
        troubles = []

        def watch():
            try:
                self.wait_until_travelled(UNDER_WAY_STEPS, "phi")
                self.events_before = len(self.events)
                fail()
            except BaseException as error:
                troubles.append(error)

        watching = threading.Thread(target=watch)
        watching.start()
        try:
            engine(bp.grid_scan([], motors[0], ROWS[0], ROWS[-1], len(ROWS), motors[1], COLUMNS[0], COLUMNS[-1], len(COLUMNS)))
            ended_well = True
        except Exception as error:
            print("the plan failed:", type(error).__name__, error, flush=True)
            ended_well = False
        watching.join()
        self.assertEqual(troubles, [])
        return ended_well

    def hear_event(self, _, event):
        self.events.append((time.monotonic_ns(), (event["data"]["theta"], event["data"]["phi"])))

    def assert_events_are_right(self, ended_well):
        """Each was taken at its point, and there its motors stood, by the edges of the trace. Ends all programs."""
        print(f"{self.events_before} events before the fault, {len(self.events)} in all", flush=True)
        self.wait_until("the motors to rest", lambda: not any(motor["moving"] for motor in self.motors().values()))
        self.wait_until_ready()
        stand = {name: motor["position_steps"] for name, motor in self.motors().items()}
        self.end_all()
        told = [positions for _, positions in self.events]
        self.assertEqual(self.events_before, 1)
        self.assertEqual(told, POINTS[: len(told)])
        self.assertEqual(len(told) == len(POINTS), ended_well)
        trace = self.file("trace.vcd")
        with open(trace, encoding="ascii") as file:
            begin_ns = int(re.search(r"time 0 is (\d+) ns of CLOCK_MONOTONIC", file.read(1000))[1])
        edges = {name: Trace(trace).edges.get(place, []) for name, place in PLACES.items()}
        for at_ns, positions in self.events:
            self.assertEqual(positions, tuple(steps_at(edges[name], at_ns - begin_ns) / STEPS for name in ("theta", "phi")))
        self.assertEqual(stand, {name: steps_at(made, float("inf")) for name, made in edges.items()})

    # -- the bridge

    def kill_bridge(self):
        self.bridge.send(signal.SIGKILL)
        self.bridge.process.wait()

    def test_the_bridge_is_killed_and_is_back_before_the_motor_arrives(self):
        def fail():
            self.kill_bridge()
            self.bridge = self.start_bridge()

        self.assert_events_are_right(self.scan_and(fail, speed=8.0))

    def test_the_bridge_is_killed_and_is_back_after_the_motor_has_arrived(self):
        def fail():
            self.kill_bridge()
            self.wait_until("phi to arrive", lambda: not self.motors()["phi"]["moving"])
            self.bridge = self.start_bridge()

        self.assert_events_are_right(self.scan_and(fail))

    def test_the_bridge_is_stopped_for_a_while(self):
        self.assert_events_are_right(self.scan_and(lambda: hold_up(self.bridge)))

    # -- the daemon

    def test_the_daemon_is_killed(self):
        def fail():
            self.bushd.send(signal.SIGKILL)
            self.bushd.process.wait()
            self.bushd = self.start_bushd("moves-after.jsonl")

        ended_well = self.scan_and(fail)
        self.assertFalse(ended_well, "it has not seen how phi has come to rest")
        self.assert_events_are_right(ended_well)

    def test_the_daemon_is_stopped_for_a_while(self):
        self.assert_events_are_right(self.scan_and(lambda: hold_up(self.bushd)))

    def test_the_adapter_is_unplugged(self):
        def fail():
            self.bushsim.send(signal.SIGUSR1)
            self.wait_until("both MCUs to be OFFLINE", lambda: self.mcu_states() == ["OFFLINE", "OFFLINE"])
            self.bushsim.send(signal.SIGUSR2)

        ended_well = self.scan_and(fail)
        self.assertFalse(ended_well, "phi has not come to its point")
        self.assert_events_are_right(ended_well)


def hold_up(program):
    program.send(signal.SIGSTOP)
    time.sleep(HELD_UP_S)  # what is tested
    program.send(signal.SIGCONT)


def steps_at(edges, time_ns):
    made = bisect.bisect_right([edge.time_ns for edge in edges], time_ns)
    return sum(1 if edge.direction else -1 for edge in edges[:made])


if __name__ == "__main__":
    unittest.main()
