"""When in its tick a step is made where that depends on the other motors of its MCU (docs/protocol.md, EMISSION).

T_step is P slots, and a motor's step n of a tick (n = 0 ...) is made in period n. A period begins s slots, the time for
DIR, after the tick's beginning and P slots after the one before. In it the motors step

    burst        in its first slot
    common-dir   in its first slot to the left, in its second to the right; P is even, s is 0
    staggered    in rising order of outputs: p slots apart, p for "settle_us", if that leaves all of them room in P;
                 otherwise evenly. If an MCU has measured p itself, an edge may lie anywhere up to there, in that order.
                 While a motor of the MCU moves by itself or meets its limit, nobody knows how many step in a period: then
                 an edge may lie anywhere in its period.
    common-dir-staggered
                 as staggered, of pairs of slots in place of slots: P and p are even. Those to the left come first, in the
                 first slots of their pairs, then those to the right, in the second ones; s is 0
"""

import math
from collections import defaultdict

STAGGERED = ("staggered", "common-dir-staggered")
COMMON_DIR = ("common-dir", "common-dir-staggered")
PERIODIC = ("burst", "common-dir", *STAGGERED)


def arrange(motors, slots):
    """Gives the steps of an MCU's motors their slots, where the motors' own motion does not."""
    together = defaultdict(list)  # those of one period
    unsure = [span for motor in motors for span in spans_by_itself(motor)]
    for motor in motors:
        for i, step in enumerate(motor.steps):
            if step.move.emission in PERIODIC:
                # Nobody knows how many steps one has made that met its limit.
                apart = motor.output if step.move.result == "limit" else None
                together[step.tick, step.nth, apart].append((motor.output, motor, i))
    for (tick, nth, _), group in together.items():
        group.sort(key=turn)
        known = not any(begin <= tick < end for begin, end in unsure)
        for place, (_, motor, i) in enumerate(group):
            step = motor.steps[i]
            slot, early = slot_of(step.move, nth, place, len(group), step.direction, slots)
            if step.move.emission in STAGGERED and not known:
                slot, early = anywhere(step.move, nth, slots)
            tick_ns = step.move.tick_ns
            motor.steps[i] = step._replace(
                emitted_ns=tick * tick_ns + min(slot, slots - 1) * tick_ns // slots, early_ns=early * tick_ns // slots
            )


def turn(one):
    output, motor, i = one
    step = motor.steps[i]
    return step.move.emission == "common-dir-staggered" and step.direction > 0, output


def spans_by_itself(motor):
    """From tick, to tick."""
    for autonomous in motor.autonomous:
        yield autonomous.begin_tick, autonomous.end_tick
    for move, after in zip(motor.moves, [*motor.moves[1:], None]):
        if move.result == "limit":
            yield move.start_tick, math.inf if after is None else after.start_tick


def anywhere(move, nth, slots):
    period = period_of(move, slots)
    if move.emission in COMMON_DIR:
        period += period % 2
    return slot_of(move, nth, 0, 1, -1, slots)[0] + period - 1, period - 1


def period_of(move, slots):
    return -(-move.step_ns * slots // move.tick_ns)


def slot_of(move, nth, place, count, direction, slots):
    """The slot, and by how many it may be earlier."""
    period = period_of(move, slots)
    shortest_ns = move.tick_ns - move.tick_ns // 64
    begin = -(-move.dir_setup_ns * slots // shortest_ns) + nth * period
    if move.emission == "burst":
        return begin, 0
    if move.emission == "common-dir":
        return nth * (period + period % 2) + (direction > 0), 0
    if move.emission == "common-dir-staggered":
        pair, early = staggered_place(move, place, count, (period + 1) // 2, -(-settle_slots(move, slots) // 2))
        return nth * (period + period % 2) + 2 * pair + (direction > 0), 2 * early
    slot, early = staggered_place(move, place, count, period, settle_slots(move, slots))
    return begin + slot, early


def settle_slots(move, slots):
    return -(-move.settle_ns * slots // move.tick_ns)


def staggered_place(move, place, count, places, apart):
    """The place among so many, `apart` of them for the current to settle."""
    evenly = place * places // count
    if move.settle_ns == 0:
        return evenly, evenly - place
    return (place * apart if count * apart < places else evenly), 0
