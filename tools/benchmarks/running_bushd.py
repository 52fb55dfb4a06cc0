"""A daemon with simulated buses, those of many_motors.py, for the measurements of programs beside it."""

import argparse
import contextlib
import pathlib
import subprocess
import sys
import tempfile
import time

from many_motors import BIN, FAR_STEPS, GIVE_UP_S, configuration, go_first


class RunningBushd:
    """What is pushed on `stack` ends with it. Programs write to programs.log."""

    def __init__(self, mcus, buses):
        self.stack = contextlib.ExitStack()
        self._options = argparse.Namespace(buses=buses, mcus=mcus)

    def __enter__(self):
        try:
            self.begin()
        except BaseException:
            self.stack.close()
            raise
        return self

    def __exit__(self, *_):
        self.stack.close()

    def begin(self):
        self.folder = pathlib.Path(self.stack.enter_context(tempfile.TemporaryDirectory(prefix="bushd-bench-")))
        text, self.motors = configuration(self._options, self.folder)
        config = self.folder / "bushd.toml"
        config.write_text(text, encoding="utf-8")
        ports = [self.folder / f"port{bus}" for bus in range(self._options.buses)]
        for bus, port in enumerate(ports):
            self.start(BIN / "bushsim", "--config", config, "--bus", f"b{bus}", "--link", port)
        self.wait_for("bushsim offers no port", lambda: all(port.is_symlink() for port in ports))
        self.start(BIN / "bushd", "--config", config)
        self.bushctl("status", "--wait-s", str(GIVE_UP_S))

    @staticmethod
    def wait_for(what, holds):
        give_up_s = time.monotonic() + GIVE_UP_S
        while not holds():
            if time.monotonic() > give_up_s:
                sys.exit(what)
            time.sleep(0.05)

    def start(self, *command):
        with open(self.folder / "programs.log", "ab") as log:
            process = subprocess.Popen(list(map(str, command)), stdout=log, stderr=subprocess.STDOUT)
        self.stack.callback(end, process)
        go_first(process.pid)
        return process

    def bushctl(self, *arguments):
        subprocess.run([BIN / "bushctl", *arguments, "--socket", self.folder / "control"], check=True, stdout=subprocess.DEVNULL)

    def move_all(self):
        moves = [word for motor in range(self.motors) for word in (f"m{motor}", str(FAR_STEPS if motor % 2 else -FAR_STEPS))]
        self.bushctl("move", "--steps", *moves)


class Listener:
    """A process of Python that says what it has done, `ready` first, and how much it has heard when it is asked."""

    def __init__(self, code, ready, *arguments):
        command = [sys.executable, "-B", "-c", code, *map(str, arguments)]
        self._process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        if self._process.stdout.readline() != f"{ready}\n":
            self.end()
            sys.exit(f"a client is not ready: it does not say {ready!r}")

    def heard(self):
        self._process.stdin.write("\n")
        self._process.stdin.flush()
        return int(self._process.stdout.readline())

    def end(self):
        end(self._process)


def end(process):
    process.kill()
    process.wait()
