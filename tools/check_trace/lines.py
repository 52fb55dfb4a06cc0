"""Lines, computed anew with exact fractions of whole numbers: the run of a line by the table made of its motors' tables, and the steps that each
motor makes of it.

A motor with N of the line's L steps makes its step j when the run is at s = (j - 1/2) L / N + 1/2, of which the steps of
the run are s = 1, 2, ... L, and between two of them the run goes evenly. An MCU that makes the run itself ("moves":
"table") makes it in the slot in which s lies, rounded up to 1/256, until the first change. The table of the line has, with
r = N / L, all rounded up,

    A(k) = max r A_i(floor(r k)),  D(k) = max r D_i(k) for r = 1, else r D_i(max(0, floor(r k) - 1)),  c = max r c_i.

In ticks a motor's position is told in 1/256 step, rounded down; it ends on a whole step, which it does not go beyond, and before
its first step it rises twice as fast, from 0. A run that a trigger has started begins "late_ns" after the beginning of its start tick. So the tick of the first step of a run is judged as a first tick.
"""

import bisect
import math
from fractions import Fraction
from itertools import accumulate

from check_trace.motion import FIRST_TICK, INTERIOR, LAST_TICK, MOST_WAIT_NS, PERIODIC, Move, Step, Table

MOST_CODES = 32767
MOST_UNITS = 2**31 - 1


def up(numerator, denominator):
    return -(-numerator // denominator)


class Part:
    """One motor of a line. Its delays as those of the run are fractions over `longest`, in ns."""

    def __init__(self, table, increment, longest, floor):
        self.table = table
        self.increment = increment
        self.longest = longest
        self.floor = floor

    def _scaled(self, code):
        return self.increment * max(code, self.table.cruise) * self.table.unit_ns

    def accel(self, k):
        return self._scaled(self.table.delay_from_start(self.increment * k // self.longest))

    def decel(self, k):
        late = 0 if self.increment == self.longest else 1
        return self._scaled(self.table.delay_before_end(max(0, self.increment * k // self.longest - late)))

    def cruise(self):
        return self._scaled(0)

    def least(self):
        return self._scaled(self.floor)


class Envelope(Table):
    """The table of a line."""

    def __init__(self, parts):
        parts = [part for part in parts if part.increment > 0]
        longest = parts[0].longest
        slowest_ns = max(up(max(p.accel(0), p.decel(0), p.least()), longest) for p in parts)
        self.unit_ns = max(min(p.table.unit_ns for p in parts), up(slowest_ns, 65535))
        self._unit = longest * self.unit_ns
        self.cruise = max(up(p.cruise(), self._unit) for p in parts)
        self.accel = self._side(lambda k: max(p.accel(k) for p in parts))
        self.decel = self._side(lambda k: max(p.decel(k) for p in parts))

    def _side(self, delay):
        codes, units = [], 0
        while True:
            code = max(up(delay(len(codes)), self._unit), self.cruise)
            units += code
            if codes and code == self.cruise:
                return codes
            if codes and (len(codes) == MOST_CODES or units > MOST_UNITS):
                self.cruise = codes[-1]
                return codes
            codes.append(code)


class Run:
    """Delays of the line's run, and what each is part of: "down" to the end; the index of the decelerating side, in a ramp to a
    floor; "lead", which ran when a change came; or else None."""

    def __init__(self, table, steps, floor):
        self._table = table
        self.restart(steps, floor)

    def restart(self, steps, floor):
        self.delays, self.kinds = [], []
        self._go_on(steps, floor, 0, [])

    def _go_on(self, steps, floor, first, ramp):
        """`steps` more, from the index `first` of the accelerating side, the first ones along `ramp` down to the floor."""
        floor = max(floor, self._table.cruise)
        for j in range(1, steps + 1):
            along = j <= len(ramp) and ramp[j - 1] <= floor
            ahead = max(self._table.delay_from_start(first + j - 1), ramp[j - 1] if along else floor)
            back = self._table.delay_before_end(steps - j)
            self.delays.append(max(ahead, back))
            self.kinds.append("down" if back > ahead else len(ramp) - j if along else None)
        self.ends = list(accumulate(self.delays))

    def _lead(self, running):
        del self.delays[running + 1 :]
        del self.kinds[running + 1 :]
        self.kinds[running] = "lead"

    def _ramps_down(self, running):
        return self.kinds[running] in ("down", "lead") and all(kind == "down" for kind in self.kinds[running + 1 :])

    def _waited_for(self, ramp):
        return [delay for delay in ramp if delay * self._table.unit_ns <= MOST_WAIT_NS]

    def ramp_down(self, running):
        """From the step `running`, counted from 0, on. A ramp that is under way goes on."""
        if self._ramps_down(running):
            ramp = self._waited_for(self.delays[running + 1 :])
            del self.delays[running + 1 + len(ramp) :]
            del self.kinds[running + 1 + len(ramp) :]
            self.ends = list(accumulate(self.delays))
            return
        index = self.kinds[running]
        if isinstance(index, int):
            ramp = self._waited_for(self._table.delay_before_end(k) for k in range(index - 1, -1, -1))
        else:
            ramp = self._table.ramp_down(self.delays[running])
        self._lead(running)
        self.delays += ramp
        self.kinds += ["down"] * len(ramp)
        self.ends = list(accumulate(self.delays))

    def retarget(self, running, steps, floor):
        """To `steps` in all. Returns False if its ramp-down takes more, or would be shortened."""
        delay = self.delays[running]
        ramp = self._table.way_down(delay)
        after = steps - running - 1
        if after < len(ramp) or (self._ramps_down(running) and steps < len(self.delays)):
            return False
        first = next(i for i in range(len(self._table.accel) + 1) if self._table.delay_from_start(i) <= delay)
        if self._table.delay_from_start(first) == delay:
            first += 1
        self._lead(running)
        self._go_on(after, floor, first, ramp)
        return True


class LineMove(Move):
    """One motor's part of a run of a line."""

    def __init__(self, event, table, envelope):
        line = event["line"]
        self._increment = line["increment"]
        self._longest = line["longest"]
        self._from = line["from"]
        self._line_direction = line["direction"]
        self._run = Run(envelope, line["to"] - self._from, event.get("floor", 0))
        self._envelope = envelope
        super().__init__({**event, "floor": 0}, table)
        self.direction = self._line_direction
        self._rests = [(-1, self._rest())]  # from which tick of the move on, where it will rest, in steps of the line
        self._known = None

    def _made(self, s):
        """Of the motor, from the line's beginning, when the run has made `s` steps of it."""
        return (2 * self._increment * s - self._increment + self._longest) // (2 * self._longest)

    def _rest(self):
        return self._made(self._from + len(self._run.delays))

    def _go_to(self, goal_steps, floor):
        self._known = None

    def change(self, tick, target_steps=None, floor=0, run_steps=None):
        self._known = None
        self.ticks_from = min(self.ticks_from, tick)
        if target_steps is not None:
            self.goal_steps = target_steps
        if tick <= self.start_tick:
            self._run.restart(run_steps if target_steps is not None else 0, floor)
            self._rests = [(-1, self._rest())]
            return
        at_ns = (tick - self.start_tick) * self.tick_ns - self.late_ns
        running = bisect.bisect_right(self._run.ends, at_ns // self._envelope.unit_ns)
        if running == len(self._run.delays):
            return
        if target_steps is None or not self._run.retarget(running, run_steps, floor):
            self._run.ramp_down(running)
        self._rests.append((tick - self.start_tick, self._rest()))

    def times_ns(self):
        return [time / (2 * self._increment) for time in self._times()]

    def _times(self):
        """As times_ns, exact: over 2 N."""
        if self._known is None:
            self._known = list(self._steps_in_time())
        return self._known

    def _steps_in_time(self):
        ends = [0, *self._run.ends]
        whole = 2 * self._increment
        for j in range(self._made(self._from) + 1, self._rest() + 1):
            s = (2 * j - 1) * self._longest + self._increment - whole * self._from
            before, rest = divmod(s, whole)
            units = ends[before] * whole
            if rest > 0:
                units += rest * self._run.delays[before]
            yield units * self._envelope.unit_ns + whole * self.late_ns

    @property
    def delays(self):
        """In units of the motor's own table, rounded up."""
        times = [2 * self._increment * self.late_ns, *self._times()]
        return [up(after - before, 2 * self._increment * self.table.unit_ns) for before, after in zip(times, times[1:])]

    def too_close(self):
        """The first step that follows the one before it faster than the motor's own table allows; None: there is none. Judged
        are whole lines: what was made before a pause is not known here."""
        times = self._times()
        if not self.fine or self._from > 0:
            return None
        unit = 2 * self._increment * self.table.unit_ns
        for j in range(1, len(times)):
            back = self.table.delay_before_end(len(times) - j - 1)
            if times[j] - times[j - 1] < max(self.table.delay_from_start(j), back, self.table.cruise) * unit:
                return j + 1
        return None

    def end_steps(self):
        return self.from_steps + self.direction * (self._rest() - self._made(self._from))

    def end_tick(self):
        run_ns = (self._run.ends[-1] if self._run.ends else 0) * self._envelope.unit_ns + self.late_ns
        return self.start_tick - (-run_ns // self.tick_ns)

    def _place(self, tick):
        """What is told as the position at the end of a tick, 1/256 step from the line's beginning."""
        at_ns = (tick + 1) * self.tick_ns - self.late_ns
        rest = next(rest for since, rest in reversed(self._rests) if tick >= since)
        run = bisect.bisect_right(self._run.ends, at_ns // self._envelope.unit_ns)
        s = self._from + run
        part = 0
        if run < len(self._run.delays):
            since_ns = at_ns - (self._run.ends[run - 1] if run else 0) * self._envelope.unit_ns
            part = since_ns * 256 // (self._run.delays[run] * self._envelope.unit_ns)
        twice = 2 * self._increment * (256 * s + part)
        ruled = (twice + 256 * (self._longest - self._increment)) // (2 * self._longest)
        place = min(ruled, twice // self._longest, 256 * rest)
        return place if self.fine else place // 256 * 256

    def _time_in_mcu(self, j):
        """When an MCU that makes the run itself makes step j of the motor's line, and how long a 256th of the run's step is
        there: in ns."""
        parts = up(128 * (2 * j - 1) * self._longest, self._increment) + 128 - 256 * self._from
        before = up(parts, 256) - 1
        ends = self._run.ends[before - 1] if before else 0
        part_ns = Fraction(self._run.delays[before] * self._envelope.unit_ns, 256)
        return self.late_ns + ends * self._envelope.unit_ns + (parts - 256 * before) * part_ns, part_ns

    def steps(self, slots):
        times = self.times_ns()
        first = self._made(self._from)
        crossing = 256 if self.fine else 128
        q0 = 256 * first
        tick = 0
        made = 0
        while made < len(times):
            q1 = self._place(tick)
            after = max(q1 // 256 - first, made)
            if after > made:
                place = LAST_TICK if after == len(times) else FIRST_TICK if made == 0 else INTERIOR
                bound_ns = self._bound_ns(tick, place, q1 - q0, slots)
            for n in range(made, after):
                if self.start_tick + tick < self.ticks_from:
                    at_ns, part_ns = self._time_in_mcu(first + n + 1)
                    slot = min(math.floor((at_ns - tick * self.tick_ns) * slots / self.tick_ns), slots - 1)
                    if self.emission not in PERIODIC:
                        bound_ns = self.tick_ns / slots + float(part_ns)
                else:
                    slot = min((256 * (first + n) + crossing - q0) * slots // (q1 - q0), slots - 1)
                begin_ns = (self.start_tick + tick) * self.tick_ns
                yield Step(
                    move=self,
                    number=n + 1,
                    time_ns=self.start_tick * self.tick_ns + times[n],
                    emitted_ns=begin_ns + slot * self.tick_ns // slots,
                    early_ns=0,
                    tick=self.start_tick + tick,
                    nth=n - made,
                    direction=self.direction,
                    place=place,
                    bound_ns=bound_ns,
                )
            made = after
            q0 = q1
            tick += 1

    def _bound_ns(self, tick, place, displacement, slots):
        """As of any move (motion.py), with the share of the run's speed. Two numbers are rounded down to 1/256 step, the run's
        position and the motor's; in the coarse format the motor's to a whole step, which is half a step from the middle."""
        if self.emission in ("burst", "common-dir", "staggered") or place == FIRST_TICK:
            return self.tick_ns
        unit_ns = self._envelope.unit_ns
        begin = bisect.bisect_right(self._run.ends, (tick * self.tick_ns - self.late_ns) // unit_ns)
        end = bisect.bisect_right(self._run.ends, ((tick + 1) * self.tick_ns - self.late_ns) // unit_ns)
        delays = self._run.delays[begin : end + 1]
        share = self._increment / self._longest
        vmax = share / (min(delays) * unit_ns)
        vmin = 0 if place == LAST_TICK else share / (max(delays) * unit_ns)
        off_steps = (vmax - vmin) * self.tick_ns / 4 + (2 / 256 if self.fine else 1 / 2 + 2 / 256)
        return min(self.tick_ns, 256 * self.tick_ns / displacement * off_steps + self.tick_ns / slots)
