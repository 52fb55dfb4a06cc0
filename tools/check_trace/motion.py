"""The motion, computed anew from the table: every step's time, and the slot that an MCU makes it in.

What a move is.  Delay before step j of N:  max(A(j-1), D(N-j), c, shortest_delay), times the table's unit; the sum of the
first j delays is the table's time of step j, counted from the beginning of the move's start tick, or from
"late_ns" after it (a move that a trigger has started). A stop at tick k lets the step that runs then go on and adds the fewest steps m with D(m) <= its delay: D(m-1) .. D(0). A new target there goes on along A, or down to a shortest_delay along
D: of the j-th of the first m steps the shortest_delay is min(shortest_delay, D(m-j)).

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
the first. Of a table run an edge lies in its slot: |edge - table| <= T / S. With modes that
have periods (emission.py) it lies in its tick: T.
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

ENDINGS = "reached", "stopped", "turned", "late"  # results of which the plan tells where they leave the motor

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

    def delays(self, steps, shortest_delay):
        """The delays of a whole move, in time units, one after the other."""
        return (
            max(self.delay_from_start(j - 1), self.delay_before_end(steps - j), self.cruise, shortest_delay)
            for j in range(1, steps + 1)
        )

    def ramp_down(self, delay):
        """The delays that bring a motor to rest after a step made at `delay`: as `way_down`, but for those that it does not wait for."""
        return [down for down in self.way_down(delay) if down * self.unit_ns <= MOST_WAIT_NS]

    def way_down(self, delay):
        """From a step made at `delay` down to the slowest one."""
        fewest = next(k for k in range(len(self.decel) + 1) if self.delay_before_end(k) <= delay)
        return [self.delay_before_end(k) for k in range(fewest - 1, -1, -1)]

    def onward(self, delay, steps, shortest_delay):
        """The delays of `steps` more after one made at `delay`, to rest, one after the other."""
        a = next(i for i in range(len(self.accel) + 1) if self.delay_from_start(i) <= delay)
        if self.delay_from_start(a) == delay:
            a += 1
        shortest_delays = chain((min(shortest_delay, down) for down in self.way_down(delay)), repeat(shortest_delay))
        return (
            max(self.delay_from_start(a + j - 1), self.delay_before_end(steps - j), self.cruise, least)
            for j, least in zip(range(1, steps + 1), shortest_delays)
        )


class Plan:
    """Delays of steps and when these are made, worked out as far as somebody asks: a jog is planned for 2^31 steps, and
    few of them are made."""

    def __init__(self, first_ns, unit_ns):
        self.first_ns = first_ns
        self.unit_ns = unit_ns
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

    def has(self, index):
        """Whether there is this step, counted from 0; it is worked out."""
        while len(self.delays) <= index and self._work_out_next():
            pass
        return index < len(self.delays)

    def made_by(self, ns):
        """How many steps are made by then; the one that runs then is worked out."""
        while (not self.times_ns or self.times_ns[-1] <= ns) and self._work_out_next():
            pass
        return bisect.bisect_right(self.times_ns, ns)

    def begin_ns(self, index):
        """When this step begins; the one before it is worked out."""
        return self.times_ns[index - 1] if index else self.first_ns

    def place(self, ns):
        """How many steps are made by then, and how many 256ths of the one that runs."""
        made = self.made_by(ns)
        if made == self.count:
            return made, 0
        return made, (ns - self.begin_ns(made)) * 256 // (self.delays[made] * self.unit_ns)

    def running(self, begin_ns, end_ns):
        """The delays of the steps that run between these times."""
        first, last = self.made_by(begin_ns), self.made_by(end_ns)
        delays = self.delays[first : last + 1]
        return [*delays, self.begun[0]] if self.begun and last == self.count else delays

    def _work_out_next(self):
        delay = next(self._rest, None)
        if delay is None:
            return False
        self.times_ns.append((self.times_ns[-1] if self.times_ns else self.first_ns) + delay * self.unit_ns)
        self.delays.append(delay)
        return True


class Move:
    """One run of a motor. Its steps are worked out as far as somebody asks."""

    turns = False  # its steps are all in one direction
    way = None  # of a run of a path: its number

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
        self._plan = self._planned(event)
        self.result = None
        self.result_steps = None
        self._until = math.inf
        self.cut_ns = math.inf  # in bus time, where the trace ends meanwhile

    def look_until(self, tick):
        """What it does later is not worked out."""
        self._until = tick

    def _planned(self, event):
        plan = Plan(self.late_ns, self.table.unit_ns)
        self._go_to(plan, self.goal_steps, event.get("shortest_delay", 0))
        return plan

    def _go_to(self, plan, goal_steps, shortest_delay):
        steps = goal_steps - self.from_steps
        self.direction = 1 if steps >= 0 else -1
        plan.go_on(0, self.table.delays(abs(steps), shortest_delay), abs(steps))

    def change(self, tick, target_steps=None, shortest_delay=0):
        """What a stop, or a new target, at `tick` makes of the rest; changes follow each other."""
        self.ticks_from = min(self.ticks_from, tick)
        if target_steps is not None:
            self.goal_steps = target_steps
        plan = self._plan
        if tick <= self.start_tick:
            self._go_to(plan, self.from_steps if target_steps is None else target_steps, shortest_delay)
            return
        until_ns = (tick - self.start_tick) * self.tick_ns
        done = plan.made_by(until_ns)
        if done == plan.count:
            return
        running = plan.delays[done]
        if target_steps is not None:
            after = (target_steps - self.from_steps) * self.direction - (done + 1)
            if after >= len(self.table.way_down(running)):
                plan.go_on(done + 1, self.table.onward(running, after, shortest_delay), after)
                return
        if plan.times_ns[done] - until_ns > MOST_WAIT_NS:
            plan.begun = (running, until_ns)
            plan.go_on(done, (), 0)
            return
        rest = self.table.ramp_down(running)
        plan.go_on(done + 1, rest, len(rest))

    def made(self):
        """How many steps it has made, as its result says; 0 without one."""
        return 0 if self.result_steps is None else abs(self.result_steps - self.from_steps)

    def has_ended(self):
        """Whether it has come to the end of its plan, as its result says: then all of its steps were made."""
        return self.result in ENDINGS and self.result_steps == self.end_steps()

    def too_close(self, most):
        """The first step that comes sooner than its table allows, of the first `most` ones: none, where the table alone makes
        the delays."""
        return None

    def end_steps(self):
        return self.from_steps + self.direction * self._count()

    def runs_at(self, tick):
        """Whether it makes steps in this tick, or later."""
        return self._plan.made_by((tick - self.start_tick) * self.tick_ns) < self._plan.count

    def makes_steps(self):
        return self._count() > 0

    def name_of(self, number):
        return f"step {number} of {self._count()} of move {self.id}"

    def delay_of(self, index):
        """In units of its table, of a step counted from 0, or of the last one before it."""
        return self._plan.delays[index if self._plan.has(index) else -1]

    def _count(self):
        """How many steps it makes in all."""
        return self._plan.count

    # What lines do otherwise.

    def _time_ns(self, n):
        """The table's time of step n, counted from 0, from the beginning of the start tick."""
        return self._plan.times_ns[n]

    def _told(self, tick):
        """How many steps are made by the end of a tick, and the position there, in 1/256 step from its start."""
        plan = self._plan
        end_ns = (tick + 1) * self.tick_ns
        made = plan.made_by(end_ns)
        begun_delay, rest_ns = plan.begun or (0, -1)
        if not self.fine or (made == plan.count and end_ns > rest_ns):
            return made, 256 * made
        delay = plan.delays[made] if made < plan.count else begun_delay
        return made, 256 * made + (end_ns - plan.begin_ns(made)) * 256 // (delay * plan.unit_ns)

    def _place(self, tick, before, after):
        """The place of the steps from `before` to `after` of this tick."""
        if after == self._count() and not (self._plan.begun and (tick + 1) * self.tick_ns <= self._plan.begun[1]):
            return LAST_TICK
        return FIRST_TICK if tick == 0 else INTERIOR

    def _in_mcu(self, n):
        """When an MCU that makes the run itself makes step n, and how much later than by the table that may be: in ns."""
        return self._plan.times_ns[n], 0

    def _bound_ns(self, tick, place, displacement, slots):
        """How far an edge of a tick may lie from the table (above)."""
        stands = place == LAST_TICK or (tick == 0 and self.late_ns > 0)  # in a part of the tick
        return self._off_ns(tick, self._plan, 1, stands, 1 / 256 if self.fine else 1 / 2, displacement, slots)

    def _off_ns(self, tick, run, share, stands, rounding, displacement, slots):
        """The same, of a motor that makes this share of the run's steps."""
        delays = run.running(tick * self.tick_ns, (tick + 1) * self.tick_ns)
        vmax = share / (min(delays) * run.unit_ns)
        vmin = 0 if stands else share / (max(delays) * run.unit_ns)
        off_steps = (vmax - vmin) * self.tick_ns / 4 + rounding
        return min(self.tick_ns, 256 * self.tick_ns / displacement * off_steps + self.tick_ns / slots)

    def steps(self, slots):
        """Every step, one after the other: when by the table, and when by way of ticks and slots."""
        crossing = 256 if self.fine else 128
        made = 0
        q0 = 0  # position at the beginning of the tick, 1/256 step
        tick = 0
        while made < self._count() and self.start_tick + tick <= self._until:
            after, q1 = self._told(tick)
            after = max(after, made)
            by_table = self.start_tick + tick < self.ticks_from
            begin_ns = (self.start_tick + tick) * self.tick_ns
            if after > made:
                place = self._place(tick, made, after)
                bound_ns = self._bound_ns(tick, place, q1 - q0, slots)
            for n in range(made, after):
                if by_table:
                    at_ns, late_ns = self._in_mcu(n)
                    slot = (at_ns - tick * self.tick_ns) * slots // self.tick_ns
                    bound_ns = self.tick_ns / slots + float(late_ns)
                else:
                    slot = (256 * n + crossing - q0) * slots // (q1 - q0)
                # A step exactly at the tick's end belongs to the tick.
                slot = min(slot, slots - 1)
                yield Step(
                    move=self,
                    number=n + 1,
                    time_ns=self.start_tick * self.tick_ns + self._time_ns(n),
                    emitted_ns=begin_ns + slot * self.tick_ns // slots,
                    early_ns=0,
                    tick=self.start_tick + tick,
                    nth=n - made,
                    direction=self.direction,
                    place=place,
                    bound_ns=self.tick_ns if self.emission in PERIODIC else bound_ns,
                )
            made = after
            q0 = q1
            tick += 1
