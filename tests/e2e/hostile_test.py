"""Broken and hostile payloads on a channel of requests, framed by hand: what LCM's own publish() would never send.

A datagram of LCM (small message): "LC02", sequence number, channel with its NUL, payload. A payload of move_t:
fingerprint of the type, utime_us, session, client_id, number, kind, dry_run, speed, speed_in_steps, motor_count, motors, each of them a
motor_amount_t: motor, in_steps, steps, user; numbers big-endian, a text as its length with NUL, characters, NUL.
Fingerprint, session and client are those of a move that bushctl has sent.
"""

import contextlib
import os
import random
import socket
import struct
import unittest

from rig import EndToEndTest

GROUP = ("239.255.76.67", 7667)
CHANNEL = b"BUSHD_MOVE"
MAGIC = 0x4C433032
MOVE_RELATIVE = 1
# Few enough that the kernel's buffer for them never overflows while the daemon is busy.
BATCH = 20


def text(content):
    return struct.pack(">i", len(content) + 1) + content + b"\0"


class Wire:
    """A member of LCM's multicast group."""

    def __init__(self):
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)
        self._socket.bind(("", GROUP[1]))
        membership = socket.inet_aton(GROUP[0]) + socket.inet_aton("127.0.0.1")
        self._socket.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, membership)
        self._sequence = 0

    def close(self):
        self._socket.close()

    def send_datagram(self, datagram):
        self._socket.sendto(datagram, GROUP)

    def send(self, payload, channel=CHANNEL):
        self._sequence += 1
        self.send_datagram(struct.pack(">II", MAGIC, self._sequence) + channel + b"\0" + payload)

    def next(self, wanted=CHANNEL):
        """The payload of the next request on this channel that anybody sends."""
        while True:
            datagram = self._socket.recv(65536)
            channel, _, payload = datagram[8:].partition(b"\0")
            if channel == wanted:
                return payload


class Hostile(EndToEndTest):
    def setUp(self):
        self.bring_up()
        self.wire = self.enterContext(contextlib.closing(Wire()))
        self.command("move", "--dry-run", "--lcm", "a0", 5)
        move = self.wire.next()
        self.fingerprint = move[:8]
        _, self.session, length = struct.unpack_from(">qqi", move, 8)
        self.client = move[28 : 28 + length - 1]

    def payload(self, client=None, number=100, motors=(b"a0",), steps=(5,), count=None, texts=None, session=None):
        """A move; `count` and `texts` (the motors' names, encoded) replace what would be right."""
        session = self.session if session is None else session
        head = struct.pack(">qq", 0, session) + text(self.client if client is None else client)
        head += struct.pack(">qbbd?", number, MOVE_RELATIVE, 0, 0.0, False)
        count = struct.pack(">i", len(motors) if count is None else count)
        texts = [text(motor) for motor in motors] if texts is None else texts
        amounts = [struct.pack(">?qd", True, each, 0.0) for each in steps]
        return self.fingerprint + head + count + b"".join(map(bytes.__add__, texts, amounts))

    def rejected(self):
        return self.status()["dropped_messages"]

    def assert_all_rejected(self, payloads):
        for begin in range(0, len(payloads), BATCH):
            batch = payloads[begin : begin + BATCH]
            expected = self.rejected() + len(batch)
            for payload in batch:
                self.wire.send(payload)
            self.wait_until("all of them to be rejected", lambda expected=expected: self.rejected() == expected)

    def assert_works(self):
        self.assertTrue(self.bushd.lives())
        before = self.positions()["b1"]
        self.command("move", "--wait", "b1", "5")
        after = self.positions()
        self.assertEqual(after.pop("b1"), before + 5)
        self.assertEqual(self.bushd.end(), 0)
        return after

    def test_good_payload_by_hand_is_run_once(self):
        for _ in range(3):
            self.wire.send(self.payload(steps=(5,)))
        self.wait_until("the move to be made", lambda: self.positions()["a0"] == 5)
        self.assertEqual(self.rejected(), 0)
        self.assertEqual(self.assert_works()["a0"], 5)

    def test_moves_of_unknown_sessions_are_refused(self):
        self.wire.send(self.payload(session=self.session ^ 1))
        self.wire.send(self.payload(session=0))
        self.wire.send(self.payload(client=b"another"))
        self.command("table", "list", "--lcm")  # answered, so all before it were looked at
        self.assertEqual(self.rejected(), 0)
        self.assertEqual(set(self.assert_works().values()), {0})

    def test_broken_payloads_are_rejected_and_counted(self):
        good = self.payload()
        truncated = [good[:length] for length in range(len(good))]
        lengths = [-(2**31), -1, 0, 2, 1000, 2**27, 2**31 - 1]
        wrong_counts = [self.payload(count=count) for count in lengths]
        wrong_texts = [self.payload(texts=[struct.pack(">i", length) + b"a0\0"]) for length in lengths]
        wrong_ends = [self.payload(texts=[struct.pack(">i", 3) + b"a0a"]), self.payload(texts=[text(b"a\0b")])]
        longer = [good + b"\0", good + bytes(60000)]
        wrong_fingerprint = [bytes(8) + good[8:], good[:7] + bytes([good[7] ^ 1]) + good[8:]]
        self.assert_all_rejected(truncated + wrong_counts + wrong_texts + wrong_ends + longer + wrong_fingerprint)
        self.assertEqual(set(self.assert_works().values()), {0})

    def test_random_payloads(self):
        seed = int(os.environ.get("BUSHD_TEST_SEED", random.randrange(2**32)))
        print(f"BUSHD_TEST_SEED={seed} repeats this", flush=True)
        chance = random.Random(seed)
        lengths = [chance.choice((chance.randrange(1, 16), chance.randrange(1, 1400))) for _ in range(200)]
        noise = [chance.randbytes(length) for length in lengths]
        # Half of them get past the fingerprint, into the fields.
        self.assert_all_rejected([self.fingerprint + each if i % 2 else each for i, each in enumerate(noise)])
        self.assertEqual(set(self.assert_works().values()), {0})

    def test_mutated_commands(self):
        seed = int(os.environ.get("BUSHD_TEST_SEED", random.randrange(2**32)))
        print(f"BUSHD_TEST_SEED={seed} repeats this", flush=True)
        chance = random.Random(seed)
        for number in range(100, 110):
            for _ in range(BATCH):
                # The motors do not exist: what is still a command after that is refused, so none may move.
                mutant = bytearray(self.payload(number=number, motors=(b"nobody", b"none"), steps=(5, 6)))
                for _ in range(chance.randrange(1, 4)):
                    mutant[chance.randrange(8, len(mutant))] = chance.choice((0, 1, 0x7F, 0x80, 0xFF))
                self.wire.send(bytes(mutant))
            self.command("table", "list", "--lcm")  # answered, so all before it were looked at
        self.assertEqual(set(self.assert_works().values()), {0})

    def test_commands_without_sense_are_refused(self):
        limits = [-(2**63), -(2**31) - 1, 2**31, 2**63 - 1]
        for number, steps in enumerate(limits, 101):
            self.wire.send(self.payload(number=number, steps=(steps,)))
        self.wire.send(self.payload(client=b"", number=110))
        self.wire.send(self.payload(client=b"x" * 65, number=110))
        self.wire.send(self.payload(client=b"two words", number=110))
        self.wire.send(self.payload(number=111, motors=(), steps=()))
        self.wire.send(self.payload(number=112, motors=(b"a0",) * 1000, steps=(1,) * 1000))
        self.wire.send(self.payload(number=113, motors=(b"x" * 50000,)))
        self.command("table", "list", "--lcm")  # answered, so all before it were looked at
        self.wait_until("those without a usable client_id to be counted", lambda: self.rejected() == 3)
        self.assertEqual(self.moves(), [])
        self.assert_works()

    def test_datagrams_that_are_no_lcm_messages(self):
        channel = CHANNEL + b"\0"
        # A fragment whose end wraps around crashes LCM itself, unless it is kept from it.
        fragment = struct.pack(">IIIIHH", 0x4C433033, 7, 100, 0, 0, 2) + channel + bytes(20)
        wrapping = struct.pack(">IIIIHH", 0x4C433033, 7, 100, 0xFFFFFF00, 1, 2) + bytes(0x120)
        endless_channel = struct.pack(">II", MAGIC, 0) + b"B" * 100
        for _ in range(10):
            for datagram in (b"", b"LC02", b"junk", endless_channel, fragment, wrapping):
                self.wire.send_datagram(datagram)
        self.wire.send(self.payload(), channel=b"BUSHD_NOTHING")
        self.wire.send(self.payload(), channel=b"")
        self.assertEqual(set(self.assert_works().values()), {0})


if __name__ == "__main__":
    unittest.main()
