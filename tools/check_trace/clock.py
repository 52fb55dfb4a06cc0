"""Where tick i lies in the trace: it is not in the log, but the edges tell.

An MCU's clock is an offset and a rate like a crystal's; the one that most of its edges agree upon is taken.
"""

import random

MAX_RATE = 100e-6  # crystals are better


class Clock:
    """Bus time (tick number x tick) of one MCU against the time of the trace."""

    def __init__(self, origin_ns, offset_ns, rate):
        self.origin_ns = origin_ns
        self.offset_ns = offset_ns
        self.rate = rate

    def at(self, bus_ns):
        """Trace time minus bus time."""
        return self.offset_ns + self.rate * (bus_ns - self.origin_ns)

    def bus_ns(self, trace_ns):
        bus_ns = trace_ns - self.offset_ns
        return bus_ns - self.rate * (bus_ns - self.origin_ns)  # rate^2 is nothing


NO_CLOCK = Clock(0, 0, 0.0)


def fit_clock(motors, slot_ns):
    """The clock upon which most edges agree; None if there are none.

    Which step an edge is, is certain but for a missing or a surplus one before it. So where the numbers of a
    motor differ its edges are counted from both ends: one of the two is right for every edge but the odd one.
    """
    pairs = []
    for motor in motors:
        expected = [step.emitted_ns for step in motor.steps]
        seen = [edge.time_ns for edge in motor.edges]
        pairs += [(due, at - due) for due, at in zip(expected, seen)]
        if len(expected) != len(seen):
            pairs += [(due, at - due) for due, at in zip(reversed(expected), reversed(seen))]
    if not pairs:
        return None
    rough = agreed_clock(pairs, slot_ns)
    good = [(time, away) for time, away in pairs if abs(away - rough.at(time)) <= slot_ns]
    return straight_line(good)


def agreed_clock(pairs, slot_ns):
    """The line through two of the points that has the most others near it."""
    sample = pairs[:: len(pairs) // 2000 + 1]
    chance = random.Random(len(pairs))  # the same trace gives the same answer
    best = None
    for _ in range(400):
        (t0, d0), (t1, d1) = chance.choice(sample), chance.choice(sample)
        rate = (d1 - d0) / (t1 - t0) if t1 != t0 else 0.0
        if abs(rate) > MAX_RATE:
            rate = 0.0
        agree = sum(1 for t, d in sample if abs(d - d0 - rate * (t - t0)) <= slot_ns)
        if best is None or (agree, -abs(rate)) > (best[0], -abs(best[1].rate)):
            best = agree, Clock(t0, d0, rate)
    return best[1]


def straight_line(points):
    """Least squares."""
    origin = sum(time for time, _ in points) / len(points)
    offset = sum(away for _, away in points) / len(points)
    spread = sum((time - origin) ** 2 for time, _ in points)
    slope = sum((time - origin) * (away - offset) for time, away in points)
    return Clock(origin, offset, slope / spread if spread else 0.0)
