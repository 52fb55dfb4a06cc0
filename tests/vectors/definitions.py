"""What docs/protocol.md and docs/tables.md define, with exact fractions, sharing no code with the engine."""

import zlib
from fractions import Fraction


class Table:
    """Delays in time units; both sides from slow to fast."""

    def __init__(self, unit_ns, accel, decel=None, cruise=None):
        self.unit_ns = unit_ns
        self.accel = accel
        self.decel = accel if decel is None else decel
        self.cruise = accel[-1] if cruise is None else cruise

    def a(self, i):
        return self.accel[i] if i < len(self.accel) else self.cruise

    def d(self, i):
        return self.decel[i] if i < len(self.decel) else self.cruise

    def move(self, steps):
        return [max(self.a(j - 1), self.d(steps - j), self.cruise) for j in range(1, steps + 1)]

    def crc32(self):
        symmetric = self.decel is self.accel
        numbers = [len(self.accel), 0 if symmetric else len(self.decel), self.cruise]
        data = b"".join(n.to_bytes(2, "little") for n in numbers) + self.unit_ns.to_bytes(4, "little")
        codes = self.accel if symmetric else self.accel + self.decel
        return zlib.crc32(data + b"".join(code.to_bytes(2, "little") for code in codes))

    def parts(self, steps):
        """How many steps of a move are made at the accelerating side's delays, at cruise, and at the decelerating
        side's."""
        kinds = ""
        for j in range(1, steps + 1):
            a, d = self.a(j - 1), self.d(steps - j)
            kinds += "c" if max(a, d) <= self.cruise else "a" if a >= d else "d"
        assert kinds == "".join(sorted(kinds, key="acd".index))
        return kinds.count("a"), kinds.count("c"), kinds.count("d")

    def slower(self, shortest_delay):
        """The same with a shortest delay under every delay."""
        return Table(self.unit_ns, self.accel, self.decel, max(self.cruise, shortest_delay))

    def ramp_down(self, delay):
        """The delays after a step made at `delay`: the fewest steps k with D(k) <= delay."""
        k = 0
        while k < len(self.decel) and self.d(k) > delay:
            k += 1
        return [self.d(i) for i in range(k - 1, -1, -1)]


def position(delays_ns, time_ns, over_ns, fine):
    """In 1/256 step at a time after the beginning; the first delay was over by `over_ns` then."""
    elapsed = time_ns + over_ns
    steps = 0
    for delay in delays_ns:
        if elapsed < delay:
            return steps * 256 + (int(Fraction(elapsed) * 256 / delay) if fine else 0)
        elapsed -= delay
        steps += 1
    return steps * 256


def displacements(delays, unit_ns, tick_ns, fine, over_ns=0, start=0):
    """Signed 1/256 steps of every tick until the last step is made."""
    delays_ns = [delay * unit_ns for delay in delays]
    total = sum(delays_ns) - over_ns
    at, out, n = start, [], 0
    while n * tick_ns < total:
        n += 1
        now = position(delays_ns, n * tick_ns, over_ns, fine)
        out.append(now - at)
        at = now
    return out


def encode_displacements(values, direction, fine):
    if fine:
        return b"".join((value * direction).to_bytes(2, "little", signed=True) for value in values)
    return bytes((0x80 if direction > 0 else 0) | value // 256 for value in values)


def slots_of(displacement, remainder, slot_count, crossing):
    """Slots of one tick's steps, and the remainder after it."""
    direction = -1 if displacement < 0 else 1
    distance = abs(displacement)
    slots = []
    i = 0
    while distance and crossing + 256 * i - remainder * direction <= distance:
        share = Fraction(crossing + 256 * i - remainder * direction, distance)
        slots.append(min(int(share * slot_count), slot_count - 1))
        i += 1
    return slots, remainder + displacement - 256 * len(slots) * direction


def line_steps(increment, longest, run_steps):
    """How many steps a motor of a line has made after so many of the run, which may be a broken number."""
    share = Fraction(increment, longest)
    return max(0, (share * (run_steps - Fraction(1, 2)) + Fraction(1, 2)).__floor__())


def line_position(increment, longest, run_steps):
    """In 1/256 step: up to its first step it rises twice as fast from 0, until it is where the rule says."""
    share = Fraction(increment, longest)
    ruled = share * (run_steps - Fraction(1, 2)) + Fraction(1, 2)
    return (256 * min(2 * share * run_steps, ruled)).__floor__()


def identify_window(unique_id, salt, windows):
    mask = 0xFFFFFFFF
    value = 2166136261
    for byte in unique_id + salt.to_bytes(2, "little"):
        value = (value ^ byte) * 16777619 & mask
    value = (value ^ value >> 16) * 0x85EBCA6B & mask
    value = (value ^ value >> 13) * 0xC2B2AE35 & mask
    return (value ^ value >> 16) % windows


def cobs(raw):
    out = bytearray()
    for block in raw.split(b"\0"):
        out += bytes([len(block) + 1]) + block
    return bytes(out)


def frame(address, kind, sequence, payload):
    raw = bytes([address, kind, sequence]) + payload
    raw += zlib.crc32(raw).to_bytes(4, "little")
    assert len(raw) <= 254
    return cobs(raw) + b"\0"
