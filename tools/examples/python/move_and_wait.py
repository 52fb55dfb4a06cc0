#!/usr/bin/env python3
"""Example of a client in Python: moves motors as one group and waits until all stand.

Speaks over the control socket (--socket PATH) or LCM; the messages are the same. Needs PyPI's lcm and the generated
package bushd; `setup-venv DIRECTORY` makes a Python that has both. Prints every answer of the daemon; exit code 0 only
if all motors reached their targets.
"""

import argparse
import os
import random
import select
import socket
import sys
import time
import uuid

import lcm
from bushd import answer_t, hello_t, mcu_state_t, motor_amount_t, move_t, reply_header_t, request_t, welcome_t

RESEND_EVERY_S = 0.3  # until the daemon has answered
ASK_AGAIN_EVERY_S = 1.0  # while the result is awaited: it may have been lost
ANSWER_WITHIN_S = 3.0
SILENCE_LIMIT_S = 5.0  # while the result is awaited


class Lcm:
    """Datagrams: any of them may be lost, so requests are repeated, in a session that tells repetitions."""

    loses = True

    def __init__(self, url, prefix, handler):
        self.lcm = lcm.LCM(url)
        self.prefix = prefix + "_"
        for channel in ("WELCOME", "REPLY", "STATE"):
            # The states of many MCUs are a burst of messages.
            take = lambda _, data, channel=channel: handler(channel, data)
            self.lcm.subscribe(self.prefix + channel, take).set_queue_capacity(256)

    def send(self, channel, message):
        self.lcm.publish(self.prefix + channel, message.encode())

    def handle(self, timeout_s):
        self.lcm.handle_timeout(int(timeout_s * 1000))


class Socket:
    """A connection: nothing is lost, and it is a session by itself. One packet: channel, NUL, message."""

    loses = False

    def __init__(self, path, handler):
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self.socket.connect(path)
        self.handler = handler

    def send(self, channel, message):
        self.socket.send(channel.encode() + b"\0" + message.encode())

    def handle(self, timeout_s):
        if not select.select([self.socket], [], [], timeout_s)[0]:
            return
        packet = self.socket.recv(65536)
        if not packet:
            raise RuntimeError("the daemon has ended; what became of the move is unknown")
        channel, _, data = packet.partition(b"\0")
        self.handler(channel.decode(), data)


class Client:
    """One request at a time; docs/lcm.md has the rules that this follows."""

    def __init__(self, connect):
        host = "".join(c if c.isascii() and c.isalnum() else "_" for c in socket.gethostname())[:20]
        self.id = f"example-python-{host}-{os.getpid()}-{uuid.uuid4().hex[:8]}"
        self.nonce = random.randrange(2**63)
        self.session = 0
        self.number = 0
        self.answers = {}  # phase -> answer_t, to the request under way
        self.parts = {}  # phase -> part -> answer_t
        self.state_heard = 0.0
        self.run = None  # of the daemon
        self.restarted = False
        self.transport = connect(self._on_message)

    def _on_message(self, channel, data):
        take = {"WELCOME": (welcome_t, self._on_welcome), "REPLY": (answer_t, self._on_answer),
                "STATE": (mcu_state_t, self._on_state)}
        if channel not in take:
            return
        kind, handler = take[channel]
        try:
            message = kind.decode(data)
        except Exception:  # on a network anybody may send anything
            return
        handler(message)

    def _on_welcome(self, welcome):
        if (welcome.client_id, welcome.nonce) == (self.id, self.nonce):
            self.session = welcome.session

    def _on_answer(self, answer):
        reply = answer.reply
        mine = reply.client_id == self.id and reply.number == self.number
        if mine and reply.session == self.session and reply.phase not in self.answers:
            # A result of very many motors comes in parts.
            parts = self.parts.setdefault(reply.phase, {})
            parts[reply.part] = answer
            if len(parts) == reply.parts:
                self.answers[reply.phase] = answer
                show([parts[part] for part in sorted(parts)])

    def _on_state(self, state):
        if self.run is not None and state.run != self.run:
            self.restarted = True
        self.run = state.run
        self.state_heard = time.monotonic()

    def open_session(self):
        hello = hello_t()
        hello.client_id = self.id
        hello.nonce = self.nonce
        give_up = time.monotonic() + ANSWER_WITHIN_S
        while self.session == 0:
            if time.monotonic() > give_up:
                raise RuntimeError("no bushd answers; is it running, with this URL and prefix, or this socket?")
            self.transport.send("HELLO", hello)
            self.transport.handle(RESEND_EVERY_S)

    def ask(self, channel, message):
        """Sends the request and returns the answer_t that ends it: REFUSED or RESULT."""
        self.open_session()
        self.number += 1
        self.answers = {}
        self.parts = {}
        self.run = None
        self.restarted = False
        message.request = request_t()
        message.request.utime_us = time.time_ns() // 1000
        message.request.session = self.session
        message.request.client_id = self.id
        message.request.number = self.number

        began = time.monotonic()
        next_send = began
        while True:
            for phase in (reply_header_t.REFUSED, reply_header_t.RESULT):
                if phase in self.answers:
                    return self.answers[phase]
            now = time.monotonic()
            accepted = reply_header_t.ACCEPTED in self.answers
            if not accepted and now - began > ANSWER_WITHIN_S:
                raise RuntimeError("no bushd answers; is it running, with this URL and prefix, or this socket?")
            if self.restarted:
                raise RuntimeError("the daemon has restarted meanwhile; the result is lost")
            if self.transport.loses and accepted and now - max(self.state_heard, began) > SILENCE_LIMIT_S:
                raise RuntimeError("the daemon has fallen silent; what became of the move is unknown")
            # A number that the daemon has seen in this session is answered again, and not carried out again.
            if now >= next_send:
                self.transport.send(channel, message)
                wait_s = ASK_AGAIN_EVERY_S if accepted else RESEND_EVERY_S
                next_send = now + wait_s if self.transport.loses else float("inf")
            self.transport.handle(0.05)


def show(parts):
    reply = parts[0].reply
    phase = {reply_header_t.ACCEPTED: "accepted", reply_header_t.REFUSED: "refused"}.get(reply.phase, reply.outcome)
    print(f"{phase}: {reply.reason}" if reply.reason else phase, flush=True)
    for answer in parts:
        for motor, outcome, position, unit in zip(answer.motors, answer.outcomes, answer.user_positions, answer.units):
            print(f"  {motor}: {outcome}, stands at {position:.12g} {unit}", flush=True)


def main():
    parser = argparse.ArgumentParser(description="Moves motors as one group and waits until all stand.")
    parser.add_argument("--socket", metavar="PATH", help="the daemon's control socket; without it LCM is used")
    parser.add_argument("--url", default="udpm://239.255.76.67:7667?ttl=0")
    parser.add_argument("--prefix", default="BUSHD")
    parser.add_argument("words", nargs="+", metavar="NAME DISTANCE", help="motors, and how far, in their units")
    arguments = parser.parse_args()
    if len(arguments.words) % 2:
        parser.error("every NAME wants its DISTANCE")

    move = move_t()
    move.kind = move_t.RELATIVE
    try:
        for name, distance in zip(arguments.words[0::2], arguments.words[1::2]):
            amount = motor_amount_t()
            amount.motor = name
            amount.user = float(distance)
            move.motors.append(amount)
        move.motor_count = len(move.motors)
    except ValueError as error:
        parser.error(str(error))

    def connect(handler):
        if arguments.socket:
            return Socket(arguments.socket, handler)
        return Lcm(arguments.url, arguments.prefix, handler)

    try:
        answer = Client(connect).ask("MOVE", move)
    except (RuntimeError, OSError) as error:
        sys.exit(f"move_and_wait.py: {error}")
    return 0 if answer.reply.outcome == "reached" else 1


if __name__ == "__main__":
    sys.exit(main())
