"""What the tests of bushd-web share: the real programs, and pages that speak as the one in a browser does."""

import http.client
import json
import os
import pathlib
import socket
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "e2e"))
from rig import TOP, EndToEndTest, program
from websocket import WebSocket


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class OpenPage:
    """One page: what it asks, and what it has been told."""

    def __init__(self, socket, daemon="bushd"):
        self.socket = socket
        self.daemon = daemon  # of several
        self.hello = None
        self.daemons = {}
        self.motors = {}
        self.mcus = {}
        self.descriptions = {}
        self.buses = {}
        self.replies = []
        self._count = 0

    def ask(self, request, **fields):
        """Returns the number of the request."""
        self._count += 1
        self.socket.send({"kind": "ask", "id": self._count, "daemon": self.daemon, "request": request, "fields": fields})
        return self._count

    def say(self, kind, **fields):
        self._count += 1
        self.socket.send({"kind": kind, "id": self._count, **fields})
        return self._count

    def take(self):
        """Takes in one message."""
        told = self.socket.receive()
        kind = told["kind"]
        if kind == "hello":
            self.hello = told
        elif kind == "daemon":
            self.daemons[told["daemon"]] = told
        elif told.get("daemon", self.daemon) != self.daemon:
            pass
        elif kind == "state":
            if told["full"]:
                self.motors, self.mcus = {}, {}
            for mcu in told["mcus"]:
                motors = mcu.pop("motors")
                self.mcus[mcu["mcu"]] = mcu
                self.motors |= {motor["name"]: motor for motor in motors}
        elif kind == "description":
            for mcu in told["mcus"]:
                self.descriptions |= {motor["name"]: motor for motor in mcu["motors"]}
        elif kind == "health":
            self.buses |= {bus["bus"]: bus for bus in told["buses"]}
        elif kind == "reply":
            self.replies.append(told)
        return told

    def take_until(self, holds):
        while not holds():
            self.take()

    def answer(self, number):
        """The first reply to a request."""
        return self._reply(number, lambda reply: True)

    def result(self, number):
        """The last reply to it."""
        return self._reply(number, lambda reply: reply["phase"] != "accepted")

    def _reply(self, number, wanted):
        found = []

        def there():
            found[:] = [reply for reply in self.replies if reply["id"] == number and wanted(reply)]
            return bool(found)

        self.take_until(there)
        return found[0]


class WebTest(EndToEndTest):
    def bring_up_web(self, *options, kept=False):
        """`kept`: the daemon keeps positions and history."""
        self.write_config(state=self.file("state") if kept else "")
        self.bushsim = self.start_bushsim()
        self.bushd = self.start_bushd()
        self.wait_until_ready()
        self.survey()
        self.start_web(*options)

    def survey(self, *names):
        """Somebody says that these motors, or all, stand at 0."""
        for name in names or ("*",):
            self.command("set", name, "0")

    def start_web(self, *options, log="bushd-web.log"):
        self.port = free_port()
        self.web = self.start([program("BUSHD_WEB"), "--listen", f"127.0.0.1:{self.port}", "--daemon", f"bushd={self.file('control')}",
                               "--tokens", self.file("tokens"), "--page", self.page_folder(), *options], log)
        self.wait_until("bushd-web listens", lambda: "the page is at" in self.web.said())

    def page_folder(self):
        folder = self.file("page")
        folder.mkdir(exist_ok=True)
        (folder / "index.html").write_text("<!doctype html><title>a page</title>\n")
        return folder

    def make_token(self, name="anna", *options):
        made = self.command("web-token", name, "--file", self.file("tokens"), "--json", *options)
        return json.loads(made.stdout)["token"]

    def log_in(self, token):
        """The cookie of this token."""
        status, headers, _ = self.http("POST", "/api/login", json.dumps({"token": token}))
        self.assertEqual(status, 200)
        return headers["set-cookie"].partition(";")[0]

    def http(self, method, path, body=None, **headers):
        """Status, headers by lower case, body."""
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=30)
        try:
            connection.request(method, path, body, {name.replace("_", "-"): value for name, value in headers.items()})
            response = connection.getresponse()
            return response.status, {name.lower(): value for name, value in response.getheaders()}, response.read().decode()
        finally:
            connection.close()

    def open_page(self, token=None, daemon="bushd", **options):
        if token is not None:
            options["cookie"] = self.log_in(token)
        page = OpenPage(WebSocket(self.port, **options), daemon)
        self.addCleanup(page.socket.close)
        page.take_until(lambda: page.hello)
        return page

    def end_programs(self):
        for running in reversed(self.programs):
            running.end()


def main():
    unittest.main()
