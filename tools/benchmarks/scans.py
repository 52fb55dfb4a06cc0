"""What Bluesky takes for each point of a grid_scan of four motors: with devices of bushd.ophyd_async, and with ophyd's EpicsMotor over bushd-epics.

    tests/tools/with-loopback-multicast build/lab-clients/bin/python tools/benchmarks/scans.py

The same points by the client alone, which moves all motors of a point by one request, are the time of the motion: what is more is printed as well.
Points that were read elsewhere than they should be end it.
"""

import argparse
import asyncio
import itertools
import logging
import pathlib
import statistics
import sys
import tempfile
import time

sys.dont_write_bytecode = True
TOP = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(TOP / "build" / "release" / "lib" / "python"))
from bridge import bridge
from latency import World

PLACES = {"a0": (1, 0), "a1": (1, 1), "b0": (2, 0), "b1": (2, 1)}
STEPS = 2  # from point to point


class Scans:
    def __init__(self, world, side):
        from bluesky import RunEngine

        self._world = world
        self._values = range(0, STEPS * side, STEPS)
        self._points = list(itertools.product(self._values, repeat=len(PLACES)))
        self._engine = RunEngine({}, context_managers=[])
        self._read = []
        self._engine.subscribe(lambda _, event: self._read.append(tuple(event["data"][name] for name in PLACES)), name="event")

    def alone(self):
        return self._each_s(lambda: [self._world.client.move(dict(zip(PLACES, point)), unit="steps") for point in self._points])

    def scan(self, motors):
        import bluesky.plans as bp

        self._read.clear()
        words = [word for motor in motors for word in (motor, self._values[0], self._values[-1], len(self._values))]
        each_s = self._each_s(lambda: self._engine(bp.grid_scan([], *words)))
        if self._read != self._points:
            sys.exit(f"points were read elsewhere: {[pair for pair in zip(self._read, self._points) if pair[0] != pair[1]]}")
        return each_s

    def _each_s(self, run):
        self._world.client.move(dict(zip(PLACES, self._points[0])), unit="steps")
        began_s = time.monotonic()
        run()
        return (time.monotonic() - began_s) / len(self._points)

    def native_motors(self):
        from bushd.ophyd_async import Daemon, Motor

        daemon = Daemon(self._world.control)
        motors = [Motor(daemon, name, name) for name in PLACES]

        async def connect():
            for motor in motors:
                await motor.connect()

        asyncio.run_coroutine_threadsafe(connect(), self._engine.loop).result()
        return motors

    @staticmethod
    def epics_motors():
        from ophyd import EpicsMotor

        motors = [EpicsMotor(f"LAB:{name}", name=name) for name in PLACES]
        for motor in motors:
            motor.wait_for_connection(timeout=20)
        return motors


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--side", type=int, default=3, help="points of each of the four motors")
    parser.add_argument("--times", type=int, default=3, help="the median is printed")
    options = parser.parse_args()
    logging.getLogger("ophyd").setLevel(logging.ERROR)
    with World(PLACES) as world, tempfile.TemporaryDirectory(prefix="bushd-scans-") as folder:
        with bridge(world.control, pathlib.Path(folder) / "bushd-epics.log"):
            scans = Scans(world, options.side)
            native, epics = scans.native_motors(), scans.epics_motors()
            runs = [(scans.alone(), scans.scan(native), scans.scan(epics)) for _ in range(options.times)]
    alone, *others = (1000 * statistics.median(times_s) for times_s in zip(*runs))
    print(f"{options.side ** len(PLACES)} points of {len(PLACES)} motors, {STEPS} steps from point to point; ms a point, medians of {options.times}")
    print(f"{'the client alone':24}{alone:8.1f}")
    for name, each in zip(("bushd.ophyd_async", "EpicsMotor"), others):
        print(f"{name:24}{each:8.1f}, beside the motion {each - alone:.1f}")


if __name__ == "__main__":
    main()
