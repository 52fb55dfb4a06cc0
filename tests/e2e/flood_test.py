"""Floods of requests that take long, and a stop among them. What is asserted is an order, never a time: every answer
has the daemon's clock in it."""

import selectors
import socket
import struct
import threading
import unittest

from rig import FAR, MOTORS, EndToEndTest

CLIENTS = 25
DRY_RUNS = 5000
ACCEPTED, REFUSED, RESULT = 1, 2, 3
KINDS = {ACCEPTED: "accepted", REFUSED: "refused", RESULT: "result"}


def answer_of(packet):
    """(daemon's clock, phase) of a packet on channel REPLY."""
    channel, _, data = packet.partition(b"\0")
    if channel != b"REPLY":
        return None
    utime_us, _, length = struct.unpack_from(">qqi", data, 8)
    phase, = struct.unpack_from(">b", data, 8 + 20 + length + 8)
    return utime_us, KINDS[phase]


class Floods(EndToEndTest):
    def packet_of(self, *arguments):
        """What bushctl sends first for these arguments, caught by a daemon that is none."""
        path = str(self.file("caught"))
        listener = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self.addCleanup(listener.close)
        listener.bind(path)
        listener.listen(1)
        caught = []

        def catch():
            client, _ = listener.accept()
            caught.append(client.recv(65536))
            client.close()

        catcher = threading.Thread(target=catch)
        catcher.start()
        self.bushctl(*arguments, "--socket", path)
        catcher.join(60)
        self.file("caught").unlink()
        return caught[0]

    def from_another(self, packet, number):
        """The same of another client: its name has as many characters."""
        channel, _, data = packet.partition(b"\0")
        length, = struct.unpack_from(">i", data, 8 + 16)
        name = f"flood{number:03}".ljust(length - 1, "x").encode()
        return channel + b"\0" + data[:28] + name + data[28 + length - 1:]

    def connect(self):
        client = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        client.connect(str(self.file("control")))
        client.setblocking(False)
        self.addCleanup(client.close)
        return client

    def test_an_emergency_stop_comes_before_the_dry_runs_that_wait(self):
        self.bring_up()
        far = [argument for name in MOTORS if name != "a0" for argument in (name, FAR)]
        dry_run = self.packet_of("move", "--dry-run", *far)
        emergency_stop = self.packet_of("estop")
        move = self.start_move("a0", FAR)

        flood = selectors.DefaultSelector()
        left = {}
        for number in range(CLIENTS):
            client = self.connect()
            left[client] = DRY_RUNS // CLIENTS
            flood.register(client, selectors.EVENT_READ | selectors.EVENT_WRITE, self.from_another(dry_run, number))
        answers = []

        def exchange():
            for key, ready in flood.select(1):
                client = key.fileobj
                if ready & selectors.EVENT_READ:
                    packet = client.recv(65536)
                    self.assertTrue(packet, "the daemon has hung up")
                    answers.append(answer_of(packet))
                if ready & selectors.EVENT_WRITE and left[client] > 0:
                    client.send(key.data)
                    left[client] -= 1
                    if left[client] == 0:
                        flood.modify(client, selectors.EVENT_READ, key.data)

        while any(left.values()):
            exchange()
        operator = self.connect()
        operator.setblocking(True)
        operator.send(emergency_stop)
        stopped_us, phase = answer_of(operator.recv(65536))
        self.assertEqual(phase, "accepted")
        # Every dry run is refused, or accepted and planned.
        finals = ("refused", "result")
        while sum(phase in finals for _, phase in answers) < DRY_RUNS:
            exchange()
        accepted_before = sum(phase == "accepted" and utime_us < stopped_us for utime_us, phase in answers)
        planned_before = sum(phase == "result" and utime_us < stopped_us for utime_us, phase in answers)
        self.assertGreater(accepted_before - planned_before, 10, "so many waited, and all of them wait longer than it")
        self.wait_until("the move's result", lambda: not move.lives())
        self.assertIn("emergency stop", move.said())
        self.assertNotIn("ran it down by itself", self.bushd.said())
        self.assertTrue(self.bushd.lives())


if __name__ == "__main__":
    unittest.main()
