"""Paths, judged by what comes out of the pins: the file of points, the tables and the edges, and nothing of how the run was
planned.

On a segment of L steps of the longest motor, a motor with N steps makes its step j when the run is at s = (j - 1/2) L / N + 1/2
of it. So every edge says where the run is. It is asked

- that each motor makes the steps of its points, in their order; where it turns round a step and the same step back may be left
  out, for a tick says only where it ends;
- that the edges of all motors, put in the order of their s, are in the order of time, to two ticks: one for each of two edges.
  Positions are then within half a step of one point of the path, and what a tick is off its run;
- that a motor takes no less time for 1, 4, 16 and 64 steps than its table has for them, to two ticks: of the interval before a
  step that follows i others since the motor stood or turned round, and that k follow until it does, max(A(i), D(k), c, shortest_delay).

A run may be paused and go on anywhere, and end anywhere.
"""

import csv
from copy import copy
from fractions import Fraction
from itertools import accumulate

from check_trace.problems import InputError

WINDOWS = 1, 4, 16, 64
TOLERANCE_TICKS = 2


def read_points(path):
    """Names of motors, and rows of positions in steps."""
    try:
        with open(path, encoding="utf-8", newline="") as file:
            lines = [line for line in file if line.strip() and not line.lstrip().startswith("#")]
        names, *rows = csv.reader(lines)
        return [name.strip() for name in names], [[Fraction(word.strip()) for word in row] for row in rows]
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: not a file of points: {error}") from None


class Step:
    """One that a motor is to make: where the run is then, and how many it makes before and after without a rest."""

    def __init__(self, s, direction, before):
        self.s = s
        self.direction = direction
        self.before = before
        self.to_go = 0


def steps_of(points, motor, lengths):
    steps = []
    begin = 0
    for row, longest in enumerate(lengths):
        way = points[row + 1][motor] - points[row][motor]
        direction = (way > 0) - (way < 0)
        goes_on = row > 0 and direction != 0 and steps and came == direction
        for j in range(1, abs(way) + 1):
            s = begin + Fraction((2 * j - 1) * longest, 2 * abs(way)) + Fraction(1, 2)
            before = steps[-1].before + 1 if goes_on or j > 1 else 0
            steps.append(Step(s, direction, before))
        came = direction
        begin += longest
    return steps


def count_to_go(steps):
    for step, following in zip(reversed(steps[:-1]), reversed(steps[1:])):
        step.to_go = following.to_go + 1 if following.before > 0 else 0


def matched(steps, edges, turns):
    """Edges with their steps; None: they are not those of the path. `turns` is told how many were left out."""
    made = []
    i = 0
    for edge in edges:
        while i < len(steps) and edge.direction != (steps[i].direction > 0):
            if i + 1 == len(steps) or steps[i + 1].direction == steps[i].direction:
                return None
            turns.append(steps[i])
            i += 2
        if i == len(steps):
            return None
        made.append((steps[i], edge))
        i += 1
    return made


def of_path(motors, way):
    """The motors of a path, as if it was their only motion."""
    for motor in motors:
        moves = [move for move in motor.moves if move.way == way]
        if moves:
            part = copy(motor)
            part.moves, part.from_steps, part.edges = moves, moves[0].from_steps, motor.path_edges[way]
            yield part


class PathCheck:
    def __init__(self, names, rows, shortest_delays, problems):
        self._names = names
        self._rows = rows
        self._shortest_delays = shortest_delays  # by name
        self._problems = problems

    def run(self, motors, tick_ns):
        """Returns how many edges were judged."""
        self._tolerance_ns = TOLERANCE_TICKS * tick_ns
        by_name = {motor.name: motor for motor in motors}
        missing = [name for name in self._names if name not in by_name]
        if missing:
            raise InputError(f"{', '.join(missing)}: no move of the path's motors is in the log")
        own = [by_name[name] for name in self._names]
        points = [[motor.from_steps for motor in own]]
        points += [[round(position) for position in row] for row in self._rows]
        points = [points[0]] + [after for before, after in zip(points, points[1:]) if after != before]
        lengths = [max(abs(b - a) for a, b in zip(before, after)) for before, after in zip(points, points[1:])]
        judged = []
        for column, motor in enumerate(own):
            made = matched(steps_of(points, column, lengths), motor.edges, [])
            if made is None:
                self._problems.add(motor, "path", "its edges are not the steps of the path's points")
                continue
            count_to_go([step for step, _ in made])
            self._check_intervals(motor, made)
            judged += [(step.s, edge.time_ns, motor) for step, edge in made]
        self._check_order(sorted(judged, key=lambda one: one[:2]))
        return len(judged)

    def _check_order(self, judged):
        latest_ns, latest_s = None, None
        for s, time_ns, motor in judged:
            if latest_ns is not None and s > latest_s and time_ns < latest_ns - self._tolerance_ns:
                text = f"its step at {float(s):.1f} comes {(latest_ns - time_ns) / 1000:.1f} us before others at {float(latest_s):.1f}"
                self._problems.add(motor, "path", f"{text} steps of the run", time_ns)
                return
            if latest_ns is None or time_ns > latest_ns:
                latest_ns, latest_s = time_ns, s

    def _check_intervals(self, motor, made):
        table = motor.moves[0].table
        shortest_delay = max(table.cruise, self._shortest_delays.get(motor.name, 0))
        least = []
        for step, _ in made[1:]:
            own = shortest_delay
            if step.before > 0:
                own = max(own, table.delay_from_start(step.before), table.delay_before_end(step.to_go))
            least.append(own * table.unit_ns)
        sums = [0, *accumulate(least)]
        for window in WINDOWS:
            for last in range(window, len(made)):
                took_ns = made[last][1].time_ns - made[last - window][1].time_ns
                asked_ns = sums[last] - sums[last - window]
                if took_ns < asked_ns - self._tolerance_ns:
                    text = f"{window} steps take {took_ns / 1000:.1f} us, by its table {asked_ns / 1000:.1f} us or more"
                    self._problems.add(motor, "path", text, made[last][1].time_ns)
                    return
