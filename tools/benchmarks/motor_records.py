"""Processor time of bushd-epics: 512 motors at rest, and 64 that move, all watched by a client.

    tests/tools/with-loopback-multicast build/lab-clients/bin/python tools/benchmarks/motor_records.py

The daemon and its buses are those of many_motors.py. A client of libca (pyepics) watches of each motor the fields that ophyd's EpicsMotor
watches and that change; how many values it hears is printed as well. To compare: --python-path FOLDER has other modules of the bridge.
"""

import argparse
import pathlib
import time

from bridge import PYTHON_PATH, bridge
from many_motors import used
from running_bushd import Listener, RunningBushd

FIELDS = ("VAL", "RBV", "DMOV", "MOVN", "HLS", "LLS", "TDIR")
CLIENT = """
import epics, itertools, sys
heard = itertools.count()
names = [f"LAB:m{motor}.{field}" for motor in range(int(sys.argv[1])) for field in sys.argv[2:]]
variables = [epics.PV(name, form="time", auto_monitor=True, callback=lambda **_: next(heard)) for name in names]
for variable in variables:
    assert variable.wait_for_connection(60), variable.pvname
print("watches", flush=True)
for line in sys.stdin:
    print(next(heard), flush=True)
"""


class Lab(RunningBushd):
    """With a bridge, and a client that watches."""

    def __init__(self, options, buses, profile=None):
        super().__init__(options.mcus, buses)
        self._python_path, self._seconds, self._profile = options.python_path, options.seconds, profile

    def begin(self):
        super().begin()
        log = self.folder / "bushd-epics.log"
        self._bridge = self.stack.enter_context(bridge(self.folder / "control", log, self._python_path, self._profile))
        self._client = Listener(CLIENT, "watches", self.motors, *FIELDS)
        self.stack.callback(self._client.end)

    def measure(self, what):
        heard, (before_s, _), began_s = self._client.heard(), used(self._bridge.pid), time.monotonic()
        time.sleep(self._seconds)
        passed_s = time.monotonic() - began_s
        share = (used(self._bridge.pid)[0] - before_s) / passed_s
        rate = (self._client.heard() - heard - 1) / passed_s
        print(f"{what}: bushd-epics {100 * share:.2f} % of a core, {rate:.0f} values a second heard", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--seconds", type=float, default=10, help="of each measurement")
    parser.add_argument("--mcus", type=int, default=4, help="of each bus, 16 motors each")
    parser.add_argument("--resting-buses", type=int, default=8)
    parser.add_argument("--moving-buses", type=int, default=1)
    parser.add_argument("--settle-s", type=float, default=15, help="before a measurement: the bridge looks at speeds, and clients connect")
    parser.add_argument("--python-path", type=pathlib.Path, default=PYTHON_PATH)
    parser.add_argument("--profile", metavar="FILE", help="cProfile of the bridge, to FILE.rest and FILE.moving")
    options = parser.parse_args()
    if options.moving_buses:
        with Lab(options, options.moving_buses, options.profile and f"{options.profile}.moving") as lab:
            lab.move_all()
            time.sleep(options.settle_s)
            lab.measure(f"{lab.motors} motors moving")
    if options.resting_buses:
        with Lab(options, options.resting_buses, options.profile and f"{options.profile}.rest") as lab:
            time.sleep(options.settle_s)
            lab.measure(f"{lab.motors} motors at rest")


if __name__ == "__main__":
    main()
