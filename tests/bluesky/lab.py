"""What the tests with Bluesky share: the real programs, a RunEngine as it comes, and what the simulator's trace says of where motors stood.

They need the environment that tools/setup --lab-clients makes; $BUSHD_BLUESKY_PYTHON is the Python of another one. Without one they are
skipped.
"""

import asyncio
import os
import pathlib
import sys
import threading
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "e2e"))
from rig import TABLE_RUNS, TOP, EndToEndTest

PYTHON = pathlib.Path(os.environ.get("BUSHD_BLUESKY_PYTHON", TOP / "build/lab-clients/bin/python"))
WITHOUT = ("no ophyd-async and bluesky: run tools/setup --lab-clients, or name the Python of another environment in "
           "$BUSHD_BLUESKY_PYTHON")

# The longest delay between steps of the tables is 10 ms, and a move begins no sooner than 20 ms after it was asked for.
REST_NS = 15_000_000


def main():
    """Runs the tests of the calling script by the Python of the environment."""
    if PYTHON.exists() and os.path.realpath(sys.prefix) != os.path.realpath(PYTHON.parents[1]):
        os.execv(PYTHON, [str(PYTHON), "-B", *sys.argv])
    unittest.main()


def bluesky_is_there():
    try:
        import bluesky
        import ophyd_async
    except ImportError:
        return False
    return True


def in_hundredths(name):
    """100 steps of these motors are a millimetre."""
    return f'name = "{name}"\nunit = "mm"\nsteps_per_unit = 100\nsoft_limits = [-50, 50]'


SLIT = """
[[pseudo]]
name = ["gap", "centre"]
unit = "mm"
motors = ["a0", "a1"]
kind = "slit"
precision = 2
"""


@unittest.skipUnless(bluesky_is_there(), WITHOUT)
class BlueskyTest(EndToEndTest):
    def bring_up_lab(self, with_units=(), more="", bus_lines=()):
        self.write_config(bus_lines=bus_lines)
        config = self.file("bushd.toml")
        text = config.read_text()
        for name in with_units:
            text = text.replace(f'name = "{name}"', in_hundredths(name))
        config.write_text(text + more)
        self.bushsim = self.start_bushsim()
        self.bushd = self.start_bushd()
        self.wait_until_ready()
        self.survey()
        if with_units:
            self.command("confirm", *with_units)
        self.start_engine()

    def start_engine(self):
        from bluesky import RunEngine

        from bushd.ophyd_async import Daemon

        self.engine = RunEngine({}, context_managers=[])
        self.engine.log.logger.disabled = True  # of a run that is to fail it prints the whole way
        self.daemon = Daemon(self.file("control"))
        self.documents = []
        self.engine.subscribe(lambda kind, document: self.documents.append((kind, document)))

    def connected(self, *devices):
        self.in_loop(self._connect, devices)
        return devices

    @staticmethod
    async def _connect(devices):
        for device in devices:
            await device.connect()

    def motors_of(self, *names):
        from bushd.ophyd_async import Motor

        return self.connected(*(Motor(self.daemon, name, name) for name in names))

    def in_loop(self, function, *arguments):
        """The result of a coroutine function, in the engine's loop."""
        return asyncio.run_coroutine_threadsafe(function(*arguments), self.engine.loop).result()

    def read(self, *names):
        """What the events have of these keys."""
        return [tuple(event["data"][name] for name in names) for kind, event in self.documents if kind == "event"]

    def cause_of(self, plan):
        """Why a plan failed."""
        from bluesky.utils import FailedStatus

        with self.assertRaises(Exception) as failed:
            self.engine(plan)
        error = failed.exception
        return error.__cause__ if isinstance(error, FailedStatus) else error

    def move_after_trouble(self, plan, *arguments):
        """Once more, while the daemon says that its first ticks came too late, as on a loaded machine: then nothing has moved."""
        from bluesky.utils import FailedStatus

        for _ in range(10):
            try:
                return self.engine(plan(*arguments))
            except FailedStatus as error:
                if "did not reach" not in str(error.__cause__):
                    raise
        self.fail("the first ticks were late ten times")

    def when_moving(self, name, steps, act):
        """Does this, in a thread of its own, once the motor is so many steps under way."""
        def wait():
            self.wait_until_travelled(steps, name)
            act()

        thread = threading.Thread(target=wait)
        thread.start()
        self.addCleanup(thread.join)
        return thread

    # -- what the log and the trace say

    def end_programs(self):
        self.assertEqual(self.bushd.end(), 0)
        self.assertEqual(self.bushsim.end(), 0)

    def steps_asked(self):
        """Requests that moved motors, in their order: the motors of each."""
        return [event["motors"] for event in self.logged() if event["event"] == "request" and event["request"] == "move"]

    def stops_asked(self):
        return [event["motors"] for event in self.logged() if event["event"] == "request" and event["request"] == "stop"]

    def assert_started_together(self):
        """Motors of one request are given one start tick. One that misses it, as on a loaded machine, begins once more by itself."""
        late = {event["id"] for event in self.logged() if event["event"] == "result" and event["result"] == "late"}
        starts = []
        for event in self.logged():
            if event["event"] == "request":
                starts.append(set())
                begun = {}
            elif event["event"] == "move" and starts:
                if begun.get(event["motor"]) not in late:
                    starts[-1].add(event["start_tick"])
                begun[event["motor"]] = event["id"]
        self.assertEqual([ticks for ticks in starts if len(ticks) > 1], [])

    def rests_in_trace(self, *names):
        """Where these motors stood between the bursts of steps, in steps. After bushsim has ended."""
        edges = sorted((edge.time_ns, name, 1 if edge.direction else -1) for name, made in self.traced().items() if name in names for edge in made)
        at = dict.fromkeys(names, 0)
        rests = [tuple(at.values())]
        for (time_ns, name, step), (next_ns, *_) in zip(edges, [*edges[1:], (edges[-1][0] + 2 * REST_NS,)] if edges else []):
            at[name] += step
            if next_ns - time_ns >= REST_NS:
                rests.append(tuple(at.values()))
        return rests


def without_repeats(points):
    return [point for number, point in enumerate(points) if number == 0 or point != points[number - 1]]


__all__ = ["SLIT", "TABLE_RUNS", "BlueskyTest", "main", "without_repeats"]
