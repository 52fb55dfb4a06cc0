"""Processor time of bushd-epics: 512 motors at rest, and 64 that move, all watched by a client.

    tests/tools/with-loopback-multicast build/lab-clients/bin/python tools/benchmarks/motor_records.py

The daemon and its buses are those of many_motors.py. A client of libca (pyepics) watches of each motor the fields that ophyd's EpicsMotor
watches and that change; how many values it hears is printed as well. To compare: --python-path FOLDER has other modules of the bridge.
"""

import argparse
import contextlib
import pathlib
import subprocess
import sys
import tempfile
import time

from bridge import PYTHON_PATH, bridge
from many_motors import BIN, FAR_STEPS, GIVE_UP_S, configuration, go_first, used

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


class Lab:
    """A daemon with simulated buses, a bridge, and a client that watches."""

    def __init__(self, options, buses, profile=None):
        self._stack = contextlib.ExitStack()
        self._options = argparse.Namespace(buses=buses, mcus=options.mcus)
        self._python_path, self._seconds, self._profile = options.python_path, options.seconds, profile

    def __enter__(self):
        try:
            self._begin()
        except BaseException:
            self._stack.close()
            raise
        return self

    def __exit__(self, *_):
        self._stack.close()

    def _begin(self):
        self._folder = pathlib.Path(self._stack.enter_context(tempfile.TemporaryDirectory(prefix="bushd-records-")))
        text, self.motors = configuration(self._options, self._folder)
        config = self._folder / "bushd.toml"
        config.write_text(text, encoding="utf-8")
        ports = [self._folder / f"port{bus}" for bus in range(self._options.buses)]
        for bus, port in enumerate(ports):
            self._start(BIN / "bushsim", "--config", config, "--bus", f"b{bus}", "--link", port)
        give_up_s = time.monotonic() + GIVE_UP_S
        while not all(port.is_symlink() for port in ports):
            if time.monotonic() > give_up_s:
                sys.exit("bushsim offers no port")
            time.sleep(0.05)
        self._start(BIN / "bushd", "--config", config)
        self.bushctl("status", "--wait-s", str(GIVE_UP_S))
        log = self._folder / "bushd-epics.log"
        self._bridge = self._stack.enter_context(bridge(self._folder / "control", log, self._python_path, self._profile))
        command = [sys.executable, "-B", "-c", CLIENT, str(self.motors), *FIELDS]
        self._client = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self._stack.callback(self._end, self._client)
        if self._client.stdout.readline() != "watches\n":
            sys.exit("the client does not hear of all motors")

    def _start(self, *command):
        with open(self._folder / "programs.log", "ab") as log:
            process = subprocess.Popen(list(map(str, command)), stdout=log, stderr=subprocess.STDOUT)
        self._stack.callback(self._end, process)
        go_first(process.pid)

    @staticmethod
    def _end(process):
        process.kill()
        process.wait()

    def bushctl(self, *arguments):
        subprocess.run([BIN / "bushctl", *arguments, "--socket", self._folder / "control"], check=True, stdout=subprocess.DEVNULL)

    def _heard(self):
        self._client.stdin.write("\n")
        self._client.stdin.flush()
        return int(self._client.stdout.readline())

    def measure(self, what):
        heard, (before_s, _), began_s = self._heard(), used(self._bridge.pid), time.monotonic()
        time.sleep(self._seconds)
        passed_s = time.monotonic() - began_s
        share = (used(self._bridge.pid)[0] - before_s) / passed_s
        rate = (self._heard() - heard - 1) / passed_s
        print(f"{what}: bushd-epics {100 * share:.2f} % of a core, {rate:.0f} values a second heard", flush=True)

    def move_all(self):
        moves = [word for motor in range(self.motors) for word in (f"m{motor}", str(FAR_STEPS if motor % 2 else -FAR_STEPS))]
        self.bushctl("move", "--steps", *moves)


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
