"""Lines, computed anew with exact fractions of whole numbers: the run of a line by the table made of its motors' tables, and the steps that each
motor makes of it.

A motor with N of the line's L steps makes its step j when the run is at s = (j - 1/2) L / N + 1/2, of which the steps of
the run are s = 1, 2, ... L, and between two of them the run goes evenly. An MCU that makes the run itself ("moves":
"table") makes it in the slot in which s lies, rounded up to 1/256, until the first change. The table of the line has, with
r = N / L, all rounded up,

    A(k) = max r A_i(floor(r k)),  D(k) = max r D_i(k) for r = 1, else r D_i(max(0, floor(r k) - 1)),  c = max r c_i.

In ticks a motor's position is told in 1/256 step, rounded down; it ends on a whole step, which it does not go beyond, and before
its first step it rises twice as fast, from 0. So the tick of a motor's first step is judged as a first tick. A run that a trigger has started begins
"late_ns" after the beginning of its start tick. That of a line that goes on begins a tick later, if ticks are fine: the first one tells how far each motor is
from its last whole step.
"""

from fractions import Fraction

from check_trace.motion import FIRST_TICK, INTERIOR, LAST_TICK, MOST_WAIT_NS, Move, Plan, Table

MOST_CODES = 32767
MOST_UNITS = 2**31 - 1


def up(numerator, denominator):
    return -(-numerator // denominator)


class Part:
    """One motor of a line. Its delays as those of the run are fractions over `longest`, in ns."""

    def __init__(self, table, increment, longest, shortest_delay):
        self.table = table
        self.increment = increment
        self.longest = longest
        self.shortest_delay = shortest_delay

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
        return self._scaled(self.shortest_delay)


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


class Run(Plan):
    """Delays of the line's run, and what each is part of: "down" to the end; the index of the decelerating side, in a ramp to a
    shortest_delay; "lead", which ran when a change came; or else None."""

    def __init__(self, first_ns, table, steps, shortest_delay):
        super().__init__(first_ns, table.unit_ns)
        self._table = table
        self.kinds = []
        self.restart(steps, shortest_delay)

    def restart(self, steps, shortest_delay):
        self._lead_to(0, self._onward(steps, shortest_delay, 0, []), steps)

    def _lead_to(self, done, rest, count):
        """`rest`: delays with their kinds."""
        del self.kinds[done:]
        if done:
            self.kinds[-1] = "lead"

        def delays():
            for delay, kind in rest:
                self.kinds.append(kind)
                yield delay

        self.go_on(done, delays(), count)

    def _onward(self, steps, shortest_delay, first, ramp):
        """`steps` more, from the index `first` of the accelerating side, the first ones along `ramp` down to the shortest delay."""
        shortest_delay = max(shortest_delay, self._table.cruise)
        for j in range(1, steps + 1):
            along = j <= len(ramp) and ramp[j - 1] <= shortest_delay
            ahead = max(self._table.delay_from_start(first + j - 1), ramp[j - 1] if along else shortest_delay)
            back = self._table.delay_before_end(steps - j)
            yield max(ahead, back), "down" if back > ahead else len(ramp) - j if along else None

    def _ramps_down(self, running):
        """Only the last steps do, as many as the decelerating side has, and so few are worked out."""
        if self.kinds[running] not in ("down", "lead"):
            return False
        index = running + 1
        while self.has(index):
            if self.kinds[index] != "down":
                return False
            index += 1
        return True

    def ramp_down(self, running):
        """From the step `running`, counted from 0, on. A ramp that is under way goes on."""
        index = self.kinds[running]
        if self._ramps_down(running):
            ramp = self.delays[running + 1 :]
            lead = self.kinds[running]
        elif isinstance(index, int):
            ramp, lead = [self._table.delay_before_end(k) for k in range(index - 1, -1, -1)], "lead"
        else:
            ramp, lead = self._table.way_down(self.delays[running]), "lead"
        ramp = [(delay, "down") for delay in ramp if delay * self._table.unit_ns <= MOST_WAIT_NS]
        self._lead_to(running + 1, ramp, len(ramp))
        self.kinds[running] = lead

    def retarget(self, running, steps, shortest_delay):
        """To `steps` in all. Returns False if its ramp-down takes more, or would be shortened."""
        delay = self.delays[running]
        ramp = self._table.way_down(delay)
        after = steps - running - 1
        if after < len(ramp) or (steps < self.count and self._ramps_down(running)):
            return False
        first = next(i for i in range(len(self._table.accel) + 1) if self._table.delay_from_start(i) <= delay)
        if self._table.delay_from_start(first) == delay:
            first += 1
        self._lead_to(running + 1, self._onward(after, shortest_delay, first, ramp), after)
        return True


class LineMove(Move):
    """One motor's part of a run of a line."""

    def __init__(self, event, table, envelope):
        line = event["line"]
        self._increment = line["increment"]
        self._longest = line["longest"]
        self._from = line["from"]
        self._envelope = envelope
        goes_on = self._from > 0 and event["format"] == "fine" and event.get("moves", "stream") == "stream"
        super().__init__(event | {"late_ns": event.get("late_ns", 0) + (event["tick_ns"] if goes_on else 0)}, table)
        self.direction = line["direction"]
        self._first = self._made(self._from)
        self._rests = [(-1, self._rest())]  # from which tick of the move on, where it will rest, in steps of the line

    def _planned(self, event):
        return Run(self.late_ns, self._envelope, event["line"]["to"] - self._from, event.get("shortest_delay", 0))

    def _made(self, s):
        """The motor's steps, from the line's beginning, when the run has made `s` steps of it."""
        return (2 * self._increment * s - self._increment + self._longest) // (2 * self._longest)

    def _rest(self):
        return self._made(self._from + self._plan.count)

    def _count(self):
        return self._rest() - self._first

    def change(self, tick, target_steps=None, shortest_delay=0, run_steps=None):
        self.ticks_from = min(self.ticks_from, tick)
        if target_steps is not None:
            self.goal_steps = target_steps
        run = self._plan
        if tick <= self.start_tick:
            run.restart(run_steps if target_steps is not None else 0, shortest_delay)
            self._rests = [(-1, self._rest())]
            return
        running = run.made_by((tick - self.start_tick) * self.tick_ns)
        if running == run.count:
            return
        if target_steps is None or not run.retarget(running, run_steps, shortest_delay):
            run.ramp_down(running)
        self._rests.append((tick - self.start_tick, self._rest()))

    def _time(self, n):
        """The time of step n, counted from 0, exact: over 2 N."""
        whole = 2 * self._increment
        s = (2 * (self._first + n) + 1) * self._longest + self._increment - whole * self._from
        before, rest = divmod(s, whole)
        run = self._plan
        runs = run.has(before)
        return run.begin_ns(before) * whole + (rest * run.delays[before] * run.unit_ns if runs and rest else 0)

    def _time_ns(self, n):
        return self._time(n) / (2 * self._increment)

    def delay_of(self, index):
        """In units of the motor's own table, rounded up."""
        last = min(index, self._count() - 1)
        before = self._time(last - 1) if last else 2 * self._increment * self.late_ns
        return up(self._time(last) - before, 2 * self._increment * self.table.unit_ns)

    def too_close(self, most):
        """Judged are whole lines: what was made before a pause is not known here."""
        if not self.fine or self._from > 0:
            return None
        unit = 2 * self._increment * self.table.unit_ns
        count = self._count()
        before = None
        for j in range(min(count, most)):
            time = self._time(j)
            least = max(self.table.delay_from_start(j), self.table.delay_before_end(count - j - 1), self.table.cruise)
            if before is not None and time - before < least * unit:
                return j + 1
            before = time
        return None

    def _told(self, tick):
        at_ns = (tick + 1) * self.tick_ns
        rest = next(rest for since, rest in reversed(self._rests) if tick >= since)
        run, part = self._plan.place(at_ns)
        twice = 2 * self._increment * (256 * (self._from + run) + part)
        ruled = (twice + 256 * (self._longest - self._increment)) // (2 * self._longest)
        place = min(ruled, twice // self._longest, 256 * rest) - 256 * self._first
        made = place // 256
        return made, place if self.fine else 256 * made

    def _place(self, tick, before, after):
        return LAST_TICK if after == self._count() else FIRST_TICK if self._first + before == 0 else INTERIOR

    def _in_mcu(self, n):
        """And how long a 256th of the run's step is there."""
        parts = up(128 * (2 * (self._first + n) + 1) * self._longest, self._increment) + 128 - 256 * self._from
        before = up(parts, 256) - 1
        run = self._plan
        run.has(before)
        part_ns = Fraction(run.delays[before] * run.unit_ns, 256)
        return run.begin_ns(before) + (parts - 256 * before) * part_ns, part_ns

    def _bound_ns(self, tick, place, displacement, slots):
        """Two numbers are rounded down to 1/256 step, the run's position and the motor's; in the coarse format the motor's to a
        whole step, which is half a step from the middle."""
        if place == FIRST_TICK:
            return self.tick_ns
        rounding = 2 / 256 if self.fine else 1 / 2 + 2 / 256
        share = self._increment / self._longest
        return self._off_ns(tick, self._plan, share, place == LAST_TICK, rounding, displacement, slots)
