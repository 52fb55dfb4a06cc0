"""How far motions are worked out. One that has come to its end is, as a whole. One that has not, such as a jog that met its limit
or goes on when the trace ends, may have been planned for 2^31 steps: it is as far as the trace goes."""

import itertools
import math

from check_trace.clock import MAX_RATE
from check_trace.emission import arrange


def open_moves(motor):
    """With the move that follows, or None."""
    for move, after in zip(motor.moves, [*motor.moves[1:], None]):
        if not move.has_ended():
            yield move, after


def begin_work(motors, end_ns):
    """Before it is known where its ticks lie in the trace, all of the trace may be behind the beginning of a move."""
    for motor in motors:
        for move, _ in open_moves(motor):
            move.look_until(move.start_tick + math.ceil(end_ns * (1 + MAX_RATE) / move.tick_ns))


def look_at_all_of_the_trace(motors, clocks, end_ns):
    """Now that it is known. Returns whether there is a move to be worked out again."""
    found = False
    for motor in motors:
        clock = clocks.get(motor.address)
        for move, after in open_moves(motor):
            if clock is not None and move.result != "limit":
                move.cut_ns = clock.bus_ns(end_ns)
                last = math.floor(move.cut_ns / move.tick_ns)
                move.look_until(last if after is None else min(last, after.start_tick - 1))
                found = True
    return found


def work_out(motors, slots_of):
    """Gives the motors their steps. Of a move whose end is not known they are no more than the motor has edges, and one."""
    for motor in motors:
        motor.steps = []
        for move in motor.moves:
            most = len(motor.edges) + 1 if move.cut_ns == math.inf and not move.has_ended() else None
            motor.steps += itertools.islice(move.steps(slots_of(motor.address)), most)
    for address in {motor.address for motor in motors}:
        arrange([motor for motor in motors if motor.address == address], slots_of(address))
    for motor in motors:
        motor.steps = [step for step in motor.steps if step.emitted_ns <= step.move.cut_ns]
