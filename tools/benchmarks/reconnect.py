"""How long clients of bushd-epics are without it when the bridge, or the daemon, is killed and started again at once.

    tests/tools/with-loopback-multicast build/lab-clients/bin/python tools/benchmarks/reconnect.py

Two clients watch LAB:m0.RBV, one of libca (pyepics) and one of p4p. A client is back with the first value that is not INVALID. Times are since the
kill, and since what was started again was ready: the bridge says so in its log, the daemon answers and its MCUs take moves. --repeater runs
caproto-repeater, from which clients of libca hear that a server has come; installations of EPICS have one of their own.
"""

import argparse
import contextlib
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import threading
import time

from bridge import ADDRESS, bridge
from many_motors import BIN, GIVE_UP_S, configuration

os.environ.update(EPICS_PVA_ADDR_LIST=ADDRESS, EPICS_PVA_AUTO_ADDR_LIST="NO")
INVALID = 3
# Between two kills. Not always the same: libca looks for a server that it has lost at the ticks of a timer of 10 s.
REST_S = (4.0, 7.0, 2.5)
CLIENTS = {
    "libca": """
import epics, sys, time
watched = epics.PV("LAB:m0.RBV", form="time", auto_monitor=True, callback=lambda severity, **_: print(time.monotonic(), severity, flush=True))
sys.stdin.read()
""",
    "p4p": """
import sys, time
from p4p.client.thread import Context
context = Context("pva")
watched = context.monitor("LAB:m0.RBV", lambda value: print(time.monotonic(), value.raw.alarm.severity, flush=True))
sys.stdin.read()
""",
}


class Client:
    def __init__(self, kind):
        self.name = kind
        command = [sys.executable, "-B", "-c", CLIENTS[kind]]
        self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        self._heard = []
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self):
        for line in self.process.stdout:
            at_s, severity = line.split()
            self._heard.append((float(at_s), int(severity)))

    def back(self, since_s):
        """When it has heard the first value after that time which is not INVALID."""
        give_up_s = time.monotonic() + GIVE_UP_S
        while time.monotonic() < give_up_s:
            found = next((at_s for at_s, severity in list(self._heard) if at_s > since_s and severity < INVALID), None)
            if found is not None:
                return found
            time.sleep(0.02)
        sys.exit(f"{self.name} hears nothing any more")


class Lab:
    def __init__(self, stack, repeater):
        self._folder = pathlib.Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="bushd-reconnect-")))
        text, _ = configuration(argparse.Namespace(buses=1, mcus=1), self._folder)
        self._config = self._folder / "bushd.toml"
        self._config.write_text(text, encoding="utf-8")
        self._started = []
        stack.callback(self._end)
        if repeater:
            self.start(pathlib.Path(sys.executable).parent / "caproto-repeater")
        self.start(BIN / "bushsim", "--config", self._config, "--bus", "b0", "--link", self._folder / "port0")
        while not (self._folder / "port0").is_symlink():
            time.sleep(0.05)
        self.bushd = self.start_bushd()
        self.bushctl("set", "m0", "--dial", "0")
        self.control = self._folder / "control"
        self._bridges = 0

    def start(self, *command):
        with open(self._folder / "programs.log", "ab") as log:
            self._started.append(subprocess.Popen(list(map(str, command)), stdout=log, stderr=subprocess.STDOUT))
        return self._started[-1]

    def start_bushd(self):
        bushd = self.start(BIN / "bushd", "--config", self._config)
        self.bushctl("status", "--wait-s", str(GIVE_UP_S))
        return bushd

    def bridge(self):
        self._bridges += 1
        return bridge(self.control, self._folder / f"bridge{self._bridges}.log")

    def bushctl(self, *arguments):
        subprocess.run([BIN / "bushctl", *arguments, "--socket", self._folder / "control"], check=True, stdout=subprocess.DEVNULL)

    def _end(self):
        for process in self._started:
            process.kill()
            process.wait()


def tell(what, clients, killed_s, ready_s):
    for client in clients:
        back_s = client.back(killed_s)
        print(f"{what}, {client.name}: back {back_s - killed_s:.2f} s after the kill, {back_s - ready_s:.2f} s after it was ready", flush=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--times", type=int, default=3)
    parser.add_argument("--repeater", action="store_true")
    options = parser.parse_args()
    with contextlib.ExitStack() as stack:
        lab = Lab(stack, options.repeater)
        clients = []
        for number in range(options.times + 1):
            with lab.bridge() as process:
                ready_s = time.monotonic()
                if number:
                    tell("bridge killed", clients, killed_s, ready_s)
                else:
                    clients = [Client(kind) for kind in CLIENTS]
                    stack.callback(lambda: [client.process.kill() for client in clients])
                    tell("first", clients, ready_s, ready_s)
                time.sleep(REST_S[number % len(REST_S)])
                killed_s = time.monotonic()
                process.send_signal(signal.SIGKILL)
                process.wait()
        with lab.bridge():
            tell("bridge killed", clients, killed_s, time.monotonic())
            for number in range(options.times):
                time.sleep(REST_S[number % len(REST_S)])
                killed_s = time.monotonic()
                lab.bushd.kill()
                lab.bushd.wait()
                lab.bushd = lab.start_bushd()
                ready_s = time.monotonic()
                lab.bushctl("set", "m0", "--dial", "0")
                tell("daemon killed", clients, killed_s, ready_s)


if __name__ == "__main__":
    main()
