"""What the chosen ones lead to."""

from fractions import Fraction

from chosen import TABLES
from definitions import displacements, encode_displacements, line_position, line_steps, position, slots_of


def delays_of(table, steps, tick_ns, stop):
    """The delays of a move, or of one that is asked to ramp down at the beginning of a tick; and the step that runs then."""
    delays = table.move(steps)
    if stop is None:
        return delays, None
    made = steps_made(table, delays, stop * tick_ns)
    if made == len(delays):
        return delays, None
    return delays[:made + 1] + table.ramp_down(delays[made]), made


def steps_made(table, delays, time_ns):
    return position([d * table.unit_ns for d in delays], time_ns, 0, False) // 256


def move_bytes(name, steps, tick_ns, form, stop, shortest_delay):
    table, fine = TABLES[name].slower(shortest_delay), form == "fine"
    delays, _ = delays_of(table, abs(steps), tick_ns, stop)
    values = displacements(delays, table.unit_ns, tick_ns, fine)
    assert sum(values) == 256 * len(delays)
    return encode_displacements(values, -1 if steps < 0 else 1, fine)


def run_state(name, steps, tick_ns, form, stop, shortest_delay, tick, ticks):
    """The fields of an entry of TABLE_TICKS behind the motor, at the beginning of `tick`, for `ticks` more."""
    table = TABLES[name].slower(shortest_delay)
    cruise_delay = table.cruise if table.cruise != TABLES[name].cruise else 0
    direction = -1 if steps < 0 else 1
    delays, stopped_at = delays_of(table, abs(steps), tick_ns, stop if stop is not None and stop <= tick else None)
    made = steps_made(table, delays, tick * tick_ns)
    assert made < len(delays)
    since, since_ns = divmod(tick * tick_ns - table.unit_ns * sum(delays[:made]), table.unit_ns)
    if stopped_at is not None:
        # The part of the accelerating side that the ramp-down gave up is empty, and stays named by its end.
        accel_end = table.parts(abs(steps))[0]
        lead = delays[stopped_at] if made == stopped_at else 0
        return [direction, 0, since, since_ns, lead, accel_end, accel_end, 0, len(delays) - max(made, stopped_at + 1),
                cruise_delay]
    accel, cruise, decel = table.parts(abs(steps))
    left_at_end = delays[steps_made(table, delays, (tick + ticks) * tick_ns):]
    cruises = made >= accel and len(left_at_end) > decel
    return [direction, int(cruises), since, since_ns, 0] + ([0] * 4 if cruises else [
        min(made, accel), accel, min(cruise, max(0, accel + cruise - made)), min(decel, len(delays) - made)
    ]) + [cruise_delay]


def rest_bytes(name, steps, tick_ns, form, stop, shortest_delay, tick, ticks):
    width = 2 if form == "fine" else 1
    return move_bytes(name, steps, tick_ns, form, stop, shortest_delay)[tick * width:(tick + ticks) * width]


def take_over_bytes(name, delay, fraction, direction, tick_ns, form):
    table, fine = TABLES[name], form == "fine"
    over_ns = -(-delay * table.unit_ns * fraction // 256)
    delays = [delay] + table.ramp_down(delay)
    start = fraction if fine else 0
    return encode_displacements(displacements(delays, table.unit_ns, tick_ns, fine, over_ns, start), direction, fine)


def slot_lists(slot_count, crossing, values):
    remainder, lists = 0, []
    for value in values:
        slots, remainder = slots_of(value, remainder, slot_count, crossing)
        lists.append(slots)
    return lists, remainder


def line_answers(increment, longest, first, last):
    """After each step of the run the steps made, and the position at a fraction of the next one in 1/256."""
    made = [line_steps(increment, longest, s) for s in range(first, last + 1)]
    fractions = [s * 89 % 256 for s in range(first, last)]
    positions = [line_position(increment, longest, s + Fraction(f, 256)) for s, f in zip(range(first, last), fractions)]
    return made, fractions, positions
