"""Processor time of bushd-web: 64 motors that move and 512 at rest, with one page and with fifty.

    tests/tools/with-loopback-multicast python3 tools/benchmarks/web.py

The daemon and its buses are those of many_motors.py. Pages are connections that read all that they are told, in a process of their own.
"""

import argparse
import socket
import time

from many_motors import BIN, TOP, used
from running_bushd import Listener, RunningBushd

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


class Lab(RunningBushd):
    """With bushd-web."""

    def __init__(self, options, buses):
        super().__init__(options.mcus, buses)
        self._seconds = options.seconds

    def begin(self):
        super().begin()
        self.port = free_port()
        self.web = self.start(BIN / "bushd-web", "--listen", f"127.0.0.1:{self.port}", "--daemon", f"bushd={self.folder / 'control'}",
                              "--tokens", self.folder / "tokens", "--page", TOP / "build" / "web")
        self.wait_for("bushd-web does not listen", lambda: "the page is at" in (self.folder / "programs.log").read_text())

    def measure(self, what, pages):
        readers = Listener(PAGES, "open", TOP / "tests" / "web", self.port, pages)
        try:
            before, (before_s, _), began_s = readers.heard(), used(self.web.pid), time.monotonic()
            time.sleep(self._seconds)
            passed_s = time.monotonic() - began_s
            share = (used(self.web.pid)[0] - before_s) / passed_s
            rate = (readers.heard() - before) / passed_s / pages
            print(f"{what}, {pages} page{'s' if pages > 1 else ''}: bushd-web {100 * share:.2f} % of a core, "
                  f"{rate / 1000:.0f} kB/s a page", flush=True)
        finally:
            readers.end()


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
