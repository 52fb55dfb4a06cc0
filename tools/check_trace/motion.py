"""The motion, computed anew from the table: every step's time, and the slot that an MCU makes it in.

What a move is.  Delay before step j of N:  max(A(j-1), D(N-j), c, floor), times the table's unit; the sum of the
first j delays is the table's time of step j, counted from the beginning of the move's start tick, or from
"late_ns" after it (a move that a trigger has started). A stop at tick k lets the step that runs then go on and adds the fewest steps m with D(m) <= its delay: D(m-1) .. D(0). A new target there goes on along A, or down to a floor along
D: of the j-th of the first m steps the floor is min(floor, D(m-j)).

What an MCU makes of it.  A step belongs to tick i if its time lies in (begin of i, end of i]. Position is
linear between steps; q is the position at a tick's end, rounded down to 1/256 step (fine) or to a whole step
(coarse). Within the tick the motor moves evenly from q0 to q1 = q0 + d. Step n is made in the slot, of S in
a tick, in which that line crosses n (fine) or n - 1/2 (coarse: so that c steps are spaced evenly). A move
that the MCU runs by its own table ("moves": "table") is made otherwise: every step in the slot in which its
time lies, until the first change; from that tick on it is made of ticks as well.

Emission "phases" has the same slots; the others make the steps of a tick one after the other (emission.py).

How far an edge may lie from the table.  T is the tick, v the speed in steps per time. Within the tick the
true position has slopes from vmin to vmax, so it leaves its own chord by at most (vmax - vmin) T / 4.
Rounding lowers the chord by up to r = 1/256 step; in the coarse format by up to a whole step, of which the
crossing half a step earlier takes back half: r = 1/2. The line's slope is d / T, and a slot adds up to T / S:

    |edge - table|  <=  T / d * ((vmax - vmin) T / 4 + r) + T / S,  and never more than T

In a move's last tick vmin is 0, as the motor comes to rest somewhere in it: it is reported apart, and so is
the first. Of a table run an edge lies in its slot: |edge - table| <= T / S. With burst, common-dir
and staggered it lies in its tick: T.
"""

import bisect
import hashlib
import math
from collections import namedtuple
from itertools import chain, repeat

from check_trace.emission import PERIODIC
from check_trace.problems import InputError

# nth: in its tick, from 0; early_ns: by so much it may be made before emitted_ns, besides the slot's width
Step = namedtuple("Step", "move number time_ns emitted_ns early_ns tick nth direction place bound_ns")
INTERIOR, FIRST_TICK, LAST_TICK = range(3)

# A ramp-down waits no longer for a step (docs/tables.md).
MOST_WAIT_NS = 500_000_000


class Table:
    def __init__(self, path, content):
        try:
            self.accel = content["accel"]
            self.decel = content.get("decel", self.accel[::-1])[::-1]  # by steps before the end
            self.cruise = content.get("cruise", self.accel[-1])
            self.unit_ns = content["time_unit_ns"]
        except (KeyError, IndexError) as error:
            raise InputError(f"{path}: table cannot be read: {error!r}") from None

    def sha256(self):
        numbers = [self.unit_ns, self.cruise, len(self.accel), *self.accel, *self.decel[::-1]]
        return hashlib.sha256("".join(f"{number} " for number in numbers).encode()).hexdigest()

    def delay_from_start(self, i):
        return self.accel[i] if i < len(self.accel) else self.cruise

    def delay_before_end(self, i):
        return self.decel[i] if i < len(self.decel) else self.cruise

    def delays(self, steps, floor):
        """Of a whole move, in time units, one after the other."""
        return (
            max(self.delay_from_start(j - 1), self.delay_before_end(steps - j), self.cruise, floor)
            for j in range(1, steps + 1)
        )

    def ramp_down(self, delay):
        """The delays that bring a motor to rest after a step made at `delay`: as `way_down`, but for those that it does not wait for."""
        return [down for down in self.way_down(delay) if down * self.unit_ns <= MOST_WAIT_NS]

    def way_down(self, delay):
        """From a step made at `delay` down to the slowest one."""
        fewest = next(k for k in range(len(self.decel) + 1) if self.delay_before_end(k) <= delay)
        return [self.delay_before_end(k) for k in range(fewest - 1, -1, -1)]

    def onward(self, delay, steps, floor):
        """The delays of `steps` more after one made at `delay`, to rest, one after the other."""
        a = next(i for i in range(len(self.accel) + 1) if self.delay_from_start(i) <= delay)
        if self.delay_from_start(a) == delay:
            a += 1
        floors = chain((min(floor, down) for down in self.way_down(delay)), repeat(floor))
        return (
            max(self.delay_from_start(a + j - 1), self.delay_before_end(steps - j), self.cruise, least)
            for j, least in zip(range(1, steps + 1), floors)
        )


class Plan:
    """Delays of steps and when these are made, worked out as far as somebody asks: a jog is planned for 2^31 steps, and
    few of them are made."""

    def __init__(self, first_ns, unit_ns):
        self._first_ns = first_ns
        self._unit_ns = unit_ns
        self.delays = []
        self.times_ns = []
        self.begun = None  # a step that is not made: its delay, and when the motor rests
        self.go_on(0, (), 0)

    def go_on(self, done, rest, count):
        """Behind the first `done` steps there are these `count` ones."""
        del self.delays[done:]
        del self.times_ns[done:]
        self._rest = iter(rest)
        self.count = done + count

    def work_out(self, until_ns):
        """So that all steps made by then are there, and the one that runs then."""
        last_ns = self.times_ns[-1] if self.times_ns else self._first_ns
        while last_ns <= until_ns and (delay := next(self._rest, None)) is not None:
            last_ns += delay * self._unit_ns
            self.delays.append(delay)
            self.times_ns.append(last_ns)


class Move:
    turns = False  # its steps are all in one direction

    def __init__(self, event, table):
        self.id = event["id"]
        self.tick_ns = event["tick_ns"]
        self.fine = {"fine": True, "coarse": False}[event["format"]]
        self.emission = event.get("emission", "even")
        if self.emission not in ("even", "phases", *PERIODIC):
            raise InputError(f"move {self.id} is emitted {self.emission}, which is not known here")
        self.sequence = event.get("phase_sequence")
        self.step_ns = 1000 * event.get("step_us", 0)
        self.settle_ns = 1000 * event.get("settle_us", 0)
        self.dir_setup_ns = 1000 * event.get("dir_setup_us", 0)
        self.start_tick = event["start_tick"]
        self.late_ns = event.get("late_ns", 0)  # begins so long after the beginning of its start tick
        self.from_steps = event["from_steps"]
        self.table = table
        # From this tick on it is made of ticks.
        self.ticks_from = {"stream": self.start_tick, "table": math.inf}[event.get("moves", "stream")]
        self.goal_steps = self.from_steps + event["steps"]
        self._plan = Plan(self.late_ns, table.unit_ns)
        self._go_to(self.goal_steps, event.get("floor", 0))
        self.result = None
        self.result_steps = None

    @property
    def delays(self):
        self._plan.work_out(math.inf)
        return self._plan.delays

    def times_ns(self):
        """The table's times of the steps, from the beginning of the start tick."""
        self._plan.work_out(math.inf)
        return self._plan.times_ns

    def _go_to(self, goal_steps, floor):
        steps = goal_steps - self.from_steps
        self.direction = 1 if steps >= 0 else -1
        self._plan.go_on(0, self.table.delays(abs(steps), floor), abs(steps))

    def change(self, tick, target_steps=None, floor=0):
        """What a stop, or a new target, at `tick` makes of the rest; changes follow each other."""
        self.ticks_from = min(self.ticks_from, tick)
        if target_steps is not None:
            self.goal_steps = target_steps
        if tick <= self.start_tick:
            self._go_to(self.from_steps if target_steps is None else target_steps, floor)
            return
        plan = self._plan
        until_ns = (tick - self.start_tick) * self.tick_ns
        plan.work_out(until_ns)
        done = bisect.bisect_right(plan.times_ns, until_ns)
        if done == plan.count:
            return
        running = plan.delays[done]
        if target_steps is not None:
            after = (target_steps - self.from_steps) * self.direction - (done + 1)
            if after >= len(self.table.way_down(running)):
                plan.go_on(done + 1, self.table.onward(running, after, floor), after)
                return
        if plan.times_ns[done] - until_ns > MOST_WAIT_NS:
            plan.begun = (running, until_ns)
            plan.go_on(done, (), 0)
            return
        rest = self.table.ramp_down(running)
        plan.go_on(done + 1, rest, len(rest))

    def too_close(self):
        """A step that comes sooner than its table allows: none, where the table alone makes the delays."""
        return None

    def end_steps(self):
        return self.from_steps + self.direction * self._plan.count

    def end_tick(self):
        """The first tick in which the motor is at rest again."""
        times = self.times_ns()
        return self.start_tick - (-times[-1] // self.tick_ns) if times else self.start_tick

    def steps(self, slots):
        """Every step: when by the table, and when by way of ticks and slots."""
        times = self.times_ns()
        delays = self._plan.delays
        begun_delay, rest_ns = self._plan.begun or (0, -1)
        if begun_delay:
            delays = [*delays, begun_delay]
        crossing = 256 if self.fine else 128
        made = 0
        q0 = 0  # position at the beginning of the tick, 1/256 step
        tick = 0
        while made < len(times):
            end_ns = (tick + 1) * self.tick_ns
            after = bisect.bisect_right(times, end_ns, made)
            q1 = 256 * after
            if self.fine and (after < len(times) or end_ns <= rest_ns):
                since_ns = end_ns - (times[after - 1] if after else self.late_ns)
                q1 += since_ns * 256 // (delays[after] * self.table.unit_ns)
            if after > made:
                last = after == len(times) and end_ns > rest_ns
                place = LAST_TICK if last else FIRST_TICK if tick == 0 else INTERIOR
                stands = last or (tick == 0 and self.late_ns > 0)  # in a part of the tick
                bound_ns = self.bound_ns(delays[made : after + 1], stands, q1 - q0, slots)
            by_table = self.start_tick + tick < self.ticks_from
            begin_ns = (self.start_tick + tick) * self.tick_ns
            for n in range(made, after):
                if by_table:
                    slot = (times[n] - tick * self.tick_ns) * slots // self.tick_ns
                else:
                    slot = (256 * n + crossing - q0) * slots // (q1 - q0)
                # A step exactly at the tick's end belongs to the tick.
                slot = min(slot, slots - 1)
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
                    bound_ns=self.tick_ns if self.emission in PERIODIC else self.tick_ns / slots if by_table else bound_ns,
                )
            made = after
            q0 = q1
            tick += 1

    def bound_ns(self, delays, stands, displacement, slots):
        """How far an edge of a tick may lie from the table (above); `delays` are those that run in it."""
        vmax = 1 / (min(delays) * self.table.unit_ns)
        vmin = 0 if stands else 1 / (max(delays) * self.table.unit_ns)
        rounding = 1 / 256 if self.fine else 1 / 2
        off_steps = (vmax - vmin) * self.tick_ns / 4 + rounding
        return min(self.tick_ns, 256 * self.tick_ns / displacement * off_steps + self.tick_ns / slots)
