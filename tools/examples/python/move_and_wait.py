#!/usr/bin/env python3
"""Example of a client in Python: moves motors as one group and waits until all stand.

Needs PyPI's lcm and the generated package bushd; `setup-venv DIRECTORY` makes a Python that has both.
Prints every reply of the daemon; exit code 0 only if all motors reached their targets.
"""

import argparse
import os
import socket
import sys
import time
import uuid

import lcm
from bushd import command_t, reply_t, state_t

RESEND_EVERY_S = 0.3  # until the daemon has answered
ANSWER_WITHIN_S = 3.0
SILENCE_LIMIT_S = 5.0  # while the result is awaited


class Client:
    """One command at a time; docs/lcm.md has the rules that this follows."""

    def __init__(self, url, prefix):
        self.lcm = lcm.LCM(url)
        self.channel = prefix + "_COMMAND"
        host = "".join(c if c.isascii() and c.isalnum() else "_" for c in socket.gethostname())[:20]
        self.id = f"example-python-{host}-{os.getpid()}-{uuid.uuid4().hex[:8]}"
        self.number = 0
        self.replies = {}  # phase -> reply_t, of the command under way
        self.state_heard = 0.0
        self.sequence = None
        self.restarted = False
        self.lcm.subscribe(prefix + "_REPLY", self._on_reply)
        # A snapshot of many MCUs is a burst of messages.
        self.lcm.subscribe(prefix + "_STATE", self._on_state).set_queue_capacity(256)

    def _on_reply(self, _channel, data):
        try:
            reply = reply_t.decode(data)
        except Exception:  # anybody may send anything
            return
        if reply.client_id == self.id and reply.number == self.number and reply.phase not in self.replies:
            self.replies[reply.phase] = reply
            show(reply)

    def _on_state(self, _channel, data):
        try:
            state = state_t.decode(data)
        except Exception:
            return
        # The daemon counts its snapshots up from its start.
        if self.sequence is not None and state.sequence < self.sequence:
            self.restarted = True
        self.sequence = state.sequence
        self.state_heard = time.monotonic()

    def run(self, command):
        """Sends the command and returns the reply_t that ends it: REFUSED or RESULT."""
        self.number += 1
        self.replies = {}
        self.sequence = None
        self.restarted = False
        command.client_id = self.id
        command.number = self.number
        command.utime_us = time.time_ns() // 1000
        command.motor_count = len(command.motors)
        payload = command.encode()

        began = time.monotonic()
        next_send = began
        while True:
            now = time.monotonic()
            for phase in (reply_t.REFUSED, reply_t.RESULT):
                if phase in self.replies:
                    return self.replies[phase]
            if self.restarted:
                # It does not know the command any more and would run it once more.
                raise RuntimeError("the daemon has restarted meanwhile; the result is lost")
            accepted = reply_t.ACCEPTED in self.replies
            if not accepted and now - began > ANSWER_WITHIN_S:
                raise RuntimeError("no bushd answers; is it running, with this URL and prefix?")
            if accepted and now - max(self.state_heard, began) > SILENCE_LIMIT_S:
                raise RuntimeError("the daemon has fallen silent; what became of the command is unknown")
            # Datagrams may be lost. The daemon answers a command with a known number again and does not run it
            # again. Once accepted, it is asked for only while its state shows that it is still the same daemon.
            if now >= next_send and (not accepted or now - self.state_heard < 0.1):
                self.lcm.publish(self.channel, payload)
                next_send = now + (1.0 if accepted else RESEND_EVERY_S)
            self.lcm.handle_timeout(50)


def show(reply):
    phase = {reply_t.ACCEPTED: "accepted", reply_t.REFUSED: "refused"}.get(reply.phase, "result")
    print(f"{phase}: {reply.reason}", flush=True)
    for motor, result, position_steps in zip(reply.motors, reply.motor_results, reply.position_steps):
        print(f"  {motor}: {result}, stands at {position_steps}", flush=True)


def main():
    parser = argparse.ArgumentParser(description="Moves motors as one group and waits until all stand.")
    parser.add_argument("--url", default="udpm://239.255.76.67:7667?ttl=0")
    parser.add_argument("--prefix", default="BUSHD")
    parser.add_argument("words", nargs="+", metavar="NAME STEPS", help="motors, and by how many steps")
    arguments = parser.parse_args()
    if len(arguments.words) % 2:
        parser.error("every NAME wants its STEPS")

    command = command_t()
    command.kind = command_t.MOVE_RELATIVE
    command.motors = arguments.words[0::2]
    try:
        command.steps = [int(word) for word in arguments.words[1::2]]
    except ValueError as error:
        parser.error(str(error))

    try:
        reply = Client(arguments.url, arguments.prefix).run(command)
    except RuntimeError as error:
        sys.exit(f"move_and_wait.py: {error}")
    return 0 if reply.result == "reached" else 1


if __name__ == "__main__":
    sys.exit(main())
