"""Lines by the elementary law, computed anew: each step of the line is a step of one motor. Motors are taken in the order of their
outputs. With N of a motor, R the sum of those after it, and n and r what it and those have made, the next step is that of the first motor of
which F = N r - R n >= 0 (V. M. Ivanov 2023, of two motors): so F is 0 at first, F - R after a step of the motor and F + N after one of the others.

The table of the line has 1 / a in place of r = N / L before a delay, L the sum of all N, and its motors' indices are e lower: of the steps
after any other one, a motor's next one is the a-th at the earliest, and k steps of the line have floor(r k) - e of its own at least. Both follow
from the motors before it, each of which takes N of T steps and leaves the others to those after it: k of these have floor(k (T - N) / T) left.
"""

from bisect import bisect_right
from fractions import Fraction

from check_trace.lines import LineMove, Part


class Order:
    """Whose step is which. `increments` by output."""

    def __init__(self, increments):
        self._increments = {output: increments[output] for output in sorted(increments) if increments[output] > 0}
        self.steps = {output: [] for output in increments}
        value = dict.fromkeys(self._increments, 0)
        total = sum(self._increments.values())
        for step in range(1, total + 1):
            after = total
            for output, increment in self._increments.items():
                after -= increment
                if value[output] >= 0:
                    value[output] -= after
                    self.steps[output].append(step)
                    break
                value[output] += increment

    def _levels(self, output):
        total = sum(self._increments.values())
        for other, increment in self._increments.items():
            yield increment, total
            if other == output:
                return
            total -= increment

    def apart(self, output):
        *before, (own, total) = self._levels(output)
        apart = total // own
        for increment, total in reversed(before):
            apart = apart * total // (total - increment)
        return apart

    def late(self, output):
        levels = list(self._levels(output))
        increment, total = levels[-1]
        return len(levels) - (2 if increment == total and len(levels) > 1 else 1)


class ElementaryPart(Part):
    def __init__(self, table, increment, longest, shortest_delay, order, output):
        super().__init__(table, increment, longest, shortest_delay)
        self._apart = order.apart(output) if increment else 1
        self._late = order.late(output) if increment else 0

    def _scaled(self, code):
        """Over `longest`, as all of these are; rounded up later, so exact here."""
        return Fraction(self.longest * max(code, self.table.cruise) * self.table.unit_ns, self._apart)

    def _index(self, k, late):
        return max(0, self.increment * k // self.longest - late)

    def accel(self, k):
        return self._scaled(self.table.delay_from_start(self._index(k, self._late)))

    def decel(self, k):
        late = self._late + (0 if self.increment == self.longest else 1)
        return self._scaled(self.table.delay_before_end(self._index(k, late)))


class ElementaryMove(LineMove):
    """One motor's part of a run of such a line."""

    def __init__(self, event, table, envelope, order):
        self._steps = order.steps[event["output"]]
        super().__init__(event, table, envelope)

    def _made(self, s):
        return bisect_right(self._steps, s)

    def _time(self, n):
        step = self._steps[self._first + n] - self._from
        self._plan.has(step - 1)
        return 2 * self._increment * self._plan.begin_ns(step)

    def _told(self, tick):
        at_ns = (tick + 1) * self.tick_ns
        rest = next(rest for since, rest in reversed(self._rests) if tick >= since)
        run, part = self._plan.place(at_ns)
        step = self._from + run
        made = self._made(step)
        place = 256 * made
        if made < len(self._steps):
            before = self._steps[made - 1] if made else 0
            place += (256 * (step - before) + part) // (self._steps[made] - before)
        place = min(place, 256 * rest) - 256 * self._first
        made = place // 256
        return made, place if self.fine else 256 * made

    def _in_mcu(self, n):
        step = self._steps[self._first + n] - self._from
        run = self._plan
        run.has(step - 1)
        return run.begin_ns(step), Fraction(run.delays[step - 1] * run.unit_ns, 256)

    def _bound_ns(self, tick, place, displacement, slots):
        """Streamed steps of a tick are spread over it evenly; those of the line are apart by different numbers of its steps."""
        return self.tick_ns
