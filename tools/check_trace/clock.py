"""Where tick i lies in the trace: it is not in the log, but the edges tell.

An MCU's clock is an offset and a rate like a crystal's; the one that most of its edges agree upon is taken.
"""

import math
import random
from bisect import bisect_left, bisect_right

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
        if motor.autonomous or any(move.result == "limit" or move.way is not None for move in motor.moves):
            pairs += pairs_by_move(motor, slot_ns)
            continue
        seen = [edge.time_ns for edge in motor.edges]
        pairs += pairs_of(motor.steps, seen)
        if len(motor.steps) != len(seen):
            pairs += pairs_of(reversed(motor.steps), reversed(seen))
    # Those whose slot is known, if there are some.
    sure = [(at_ns, away_ns) for at_ns, away_ns, early_ns in pairs if early_ns == 0]
    pairs = sure or [(at_ns, away_ns) for at_ns, away_ns, _ in pairs]
    if not pairs:
        return None
    rough = agreed_clock(pairs, slot_ns)
    good = [(time, away) for time, away in pairs if abs(away - rough.at(time)) <= slot_ns]
    return straight_line(good)


def rough_clock(motors):
    """From paths alone, whose steps are not known beforehand: the first edge of all comes behind the first tick of all, by
    no more than the first delay of a table. Between two paths all motors stand, for longer than the clocks of an MCU and of the
    trace drift apart."""
    edges_ns = [motor.edges[0].time_ns for motor in motors if motor.edges]
    starts_ns = [move.start_tick * move.tick_ns for motor in motors for move in motor.moves]
    starts_ns += [autonomous.begin_ns for motor in motors for autonomous in motor.autonomous]
    if not edges_ns or not starts_ns or min(starts_ns) == -math.inf:
        return NO_CLOCK
    tick_ns = next((move.tick_ns for motor in motors for move in motor.moves), 0)
    return Clock(0, min(edges_ns) - min(starts_ns) - tick_ns, 0.0)


def pairs_of(steps, seen):
    return [(step.emitted_ns, at - step.emitted_ns, step.early_ns) for step, at in zip(steps, seen)]


def pairs_by_move(motor, slot_ns):
    """Where in its edges each move of a motor may lie that has edges of which nobody knows how many."""
    seen = [edge.time_ns for edge in motor.edges]
    pairs = []
    by_move = motor.steps_by_move()
    for move in motor.moves:
        own = by_move[id(move)]
        if move.result == "limit":
            own = own[: abs(move.result_steps - move.from_steps) // 2]  # what lies after the switch is another way
        if not own:
            continue
        due = [step.emitted_ns for step in own]
        span_ns = due[-1] - due[0]
        slack_ns = 2 * slot_ns + MAX_RATE * span_ns + max(step.early_ns for step in own)
        middle, last = len(due) // 2, len(due) - 1
        to_middle_ns, to_last_ns = due[middle] - due[0], span_ns
        for first in range(len(seen) - last):
            begin_ns = seen[first]
            if abs(seen[first + last] - begin_ns - to_last_ns) <= slack_ns and abs(seen[first + middle] - begin_ns - to_middle_ns) <= slack_ns:
                pairs += pairs_of(own, seen[first : first + len(own)])
    return pairs


def agreed_clock(pairs, slot_ns):
    """The line through two of the points that has the most others near it."""
    sample = pairs[:: len(pairs) // 2000 + 1]
    parts = [sample[i : i + 200] for i in range(0, len(sample), 200)]
    offsets = sorted(d for _, d in sample)
    chance = random.Random(len(pairs))  # the same trace gives the same answer
    best = 0, None
    for _ in range(400):
        (t0, d0), (t1, d1) = chance.choice(sample), chance.choice(sample)
        rate = (d1 - d0) / (t1 - t0) if t1 != t0 else 0.0
        if rate == 0 or abs(rate) > MAX_RATE:
            rate = 0.0
            agree = bisect_right(offsets, d0 + slot_ns) - bisect_left(offsets, d0 - slot_ns)
        else:
            agree = near(parts, Clock(t0, d0, rate), slot_ns, best[0])
        if best[1] is None or (agree, -abs(rate)) > (best[0], -abs(best[1].rate)):
            best = agree, Clock(t0, d0, rate)
    return best[1]


def near(parts, clock, slot_ns, least):
    """How many points are near the line; 0 as soon as the rest cannot make it as many as `least`."""
    t0, d0, rate = clock.origin_ns, clock.offset_ns, clock.rate
    left = sum(map(len, parts))
    agree = 0
    for part in parts:
        if agree + left < least:
            return 0
        agree += sum(1 for t, d in part if abs(d - d0 - rate * (t - t0)) <= slot_ns)
        left -= len(part)
    return agree


def straight_line(points):
    """Least squares."""
    origin = sum(time for time, _ in points) / len(points)
    offset = sum(away for _, away in points) / len(points)
    spread = sum((time - origin) ** 2 for time, _ in points)
    slope = sum((time - origin) * (away - offset) for time, away in points)
    return Clock(origin, offset, slope / spread if spread else 0.0)
