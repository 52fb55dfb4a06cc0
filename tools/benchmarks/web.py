"""Processor time of bushd-web: 64 motors that move and 512 at rest, with one page and with fifty.

    tests/tools/with-loopback-multicast python3 tools/benchmarks/web.py

The daemon and its buses are those of many_motors.py. Pages are connections that read all that they are told, in a process of their own.
"""

import argparse
import contextlib
import pathlib
import socket
import subprocess
import sys
import tempfile
import time

from many_motors import BIN, FAR_STEPS, GIVE_UP_S, TOP, configuration, go_first, used

PAGES = """
import selectors, sys
sys.path.insert(0, sys.argv[1])
from websocket import WebSocket
pages = selectors.DefaultSelector()
for _ in range(int(sys.argv[3])):
    page = WebSocket(int(sys.argv[2]))
    pages.register(page._socket, selectors.EVENT_READ)
print("open", flush=True)
count = 0
pages.register(sys.stdin, selectors.EVENT_READ)
while True:
    for key, _ in pages.select():
        if key.fileobj is sys.stdin:
            if not sys.stdin.readline():
                sys.exit()
            print(count, flush=True)
        else:
            count += len(key.fileobj.recv(1 << 20))
"""


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Lab:
    """A daemon with simulated buses, and bushd-web."""

    def __init__(self, options, buses):
        self._stack = contextlib.ExitStack()
        self._options = argparse.Namespace(buses=buses, mcus=options.mcus)
        self._seconds = options.seconds

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
        self._folder = pathlib.Path(self._stack.enter_context(tempfile.TemporaryDirectory(prefix="bushd-web-")))
        text, self.motors = configuration(self._options, self._folder)
        config = self._folder / "bushd.toml"
        config.write_text(text, encoding="utf-8")
        ports = [self._folder / f"port{bus}" for bus in range(self._options.buses)]
        for bus, port in enumerate(ports):
            self._start(BIN / "bushsim", "--config", config, "--bus", f"b{bus}", "--link", port)
        self._await("bushsim offers no port", lambda: all(port.is_symlink() for port in ports))
        self._start(BIN / "bushd", "--config", config)
        self.bushctl("status", "--wait-s", str(GIVE_UP_S))
        self.port = free_port()
        self.web = self._start(BIN / "bushd-web", "--listen", f"127.0.0.1:{self.port}", "--daemon", f"bushd={self._folder / 'control'}",
                               "--tokens", self._folder / "tokens", "--page", TOP / "build" / "web")
        self._await("bushd-web does not listen", lambda: "the page is at" in (self._folder / "programs.log").read_text())

    @staticmethod
    def _await(what, holds):
        give_up_s = time.monotonic() + GIVE_UP_S
        while not holds():
            if time.monotonic() > give_up_s:
                sys.exit(what)
            time.sleep(0.05)

    def _start(self, *command):
        with open(self._folder / "programs.log", "ab") as log:
            process = subprocess.Popen(list(map(str, command)), stdout=log, stderr=subprocess.STDOUT)
        self._stack.callback(self._end, process)
        go_first(process.pid)
        return process

    @staticmethod
    def _end(process):
        process.kill()
        process.wait()

    def bushctl(self, *arguments):
        subprocess.run([BIN / "bushctl", *arguments, "--socket", self._folder / "control"], check=True, stdout=subprocess.DEVNULL)

    def move_all(self):
        moves = [word for motor in range(self.motors) for word in (f"m{motor}", str(FAR_STEPS if motor % 2 else -FAR_STEPS))]
        self.bushctl("move", "--steps", *moves)

    def measure(self, what, pages):
        command = [sys.executable, "-B", "-c", PAGES, str(TOP / "tests" / "web"), str(self.port), str(pages)]
        readers = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        try:
            if readers.stdout.readline() != "open\n":
                sys.exit("the pages are not open")
            before, (before_s, _), began_s = self._heard(readers), used(self.web.pid), time.monotonic()
            time.sleep(self._seconds)
            passed_s = time.monotonic() - began_s
            share = (used(self.web.pid)[0] - before_s) / passed_s
            rate = (self._heard(readers) - before) / passed_s / pages
            print(f"{what}, {pages} page{'s' if pages > 1 else ''}: bushd-web {100 * share:.2f} % of a core, "
                  f"{rate / 1000:.0f} kB/s a page", flush=True)
        finally:
            self._end(readers)

    @staticmethod
    def _heard(readers):
        readers.stdin.write("\n")
        readers.stdin.flush()
        return int(readers.stdout.readline())


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--seconds", type=float, default=10, help="of each measurement")
    parser.add_argument("--mcus", type=int, default=4, help="of each bus, 16 motors each")
    parser.add_argument("--pages", type=int, default=50, help="at the second measurement of each kind")
    options = parser.parse_args()
    for buses, moving in ((1, True), (8, False)):
        with Lab(options, buses) as lab:
            if moving:
                lab.move_all()
                time.sleep(2)
            for pages in (1, options.pages):
                lab.measure(f"{lab.motors} motors {'moving' if moving else 'at rest'}", pages)


if __name__ == "__main__":
    main()
