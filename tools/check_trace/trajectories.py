"""Motors that follow trajectories, computed anew with exact fractions of whole numbers (lib/motion/trajectory.h has the
same law in words).

Positions count in 2^-32 step, times in ns from the first row. Between rows the motion is, rounded down, p + d t / h, or Hermite's cubic by
its powers of u = floor(2^40 t / h) / 2^40. What an MCU is told at the end of a tick is that position and half a step more in the motor's
direction, or that position alone where it stands; on the way there from where it stood or turned round, it goes twice as fast as the
motion at most, or half as fast as the motor begins. At the end it comes to a whole step.

A step is due where the motion crosses the middle between two steps: a motor is within half a step of its row's line, and where it
turned round or began, as late as it takes to catch up. Steps around a turn are judged as those of a first tick.
"""

import bisect
from collections import namedtuple
from itertools import accumulate

from check_trace.emission import PERIODIC
from check_trace.motion import FIRST_TICK, INTERIOR, LAST_TICK, MOST_WAIT_NS, Move, Step

STEP = 2**32
SHARE_BITS = 40
MOST_IN_A_TICK = 127 * STEP

# row: of the trajectory, before the tick's end; None: it ramps down. turned: in this tick, or it has still to catch up at its beginning
Tick = namedtuple("Tick", "told_256 direction row last turned")


class Trajectory:
    """The rows of all its motors."""

    def __init__(self, event):
        self.cubic = event["interpolation"] == "cubic"
        self.times = []
        self.positions = []
        self.closed = False
        self.add(event)

    def add(self, event):
        for time_ns, *positions in event["rows"]:
            self.times.append(time_ns)
            self.positions.append(positions)
        self.closed = event["closed"]

    def known(self):
        """The last row up to which the motion is known."""
        return len(self.times) - (2 if self.cubic and not self.closed else 1)

    def speed(self, row, column, times_ns):
        """At a row, times a time: of the parabola through it and its neighbours."""
        if row == 0 or row + 1 == len(self.times):
            return 0
        before_ns = self.times[row] - self.times[row - 1]
        after_ns = self.times[row + 1] - self.times[row]
        before = self.positions[row][column] - self.positions[row - 1][column]
        after = self.positions[row + 1][column] - self.positions[row][column]
        both = before_ns + after_ns
        return before * times_ns // before_ns * after_ns // both + after * times_ns // after_ns * before_ns // both

    def at(self, row, column, time_ns):
        t = time_ns - self.times[row]
        h = self.times[row + 1] - self.times[row]
        begin = self.positions[row][column]
        d = self.positions[row + 1][column] - begin
        if not self.cubic:
            return begin + d * t // h
        m0, m1 = self.speed(row, column, h), self.speed(row + 1, column, h)
        u = (t << SHARE_BITS) // h
        total = m0 + m1 - 2 * d
        for k in (3 * d - 2 * m0 - m1, m0, 0):
            total = ((total * u) >> SHARE_BITS) + k
        return begin + total


class TrajectoryMove(Move):
    """One motor's way along a trajectory, and by its table to rest where that ends in motion, or is stopped."""

    turns = True

    def __init__(self, event, table, trajectory):
        self._trajectory = trajectory
        self._column = event["trajectory"]["column"]
        self._stop = None
        self._known = None
        super().__init__(event, table)
        self.direction = 1

    def _planned(self, event):
        """By its rows, of which some may still come."""

    def look_until(self, tick):
        super().look_until(tick)
        self._known = None

    def change(self, tick, target_steps=None, shortest_delay=0):
        if self._stop is None:
            self._stop = tick
        self._known = None

    @property
    def goal_steps(self):
        """Where its last row is; what the log says of its target is that of the rows that were there then."""
        return (self._trajectory.positions[-1][self._column] + STEP // 2) // STEP

    @goal_steps.setter
    def goal_steps(self, steps):
        pass

    def _rests(self):
        """It needs no ramp after the last row: it is at most as fast there as the first code, but for rounding."""
        trajectory = self._trajectory
        if not trajectory.closed or trajectory.cubic:
            return trajectory.closed
        way = abs(trajectory.positions[-1][self._column] - trajectory.positions[-2][self._column])
        first_ns = max(self.table.accel[0], self.table.decel[0]) * self.table.unit_ns
        return way * first_ns * 10**8 <= (trajectory.times[-1] - trajectory.times[-2]) * STEP * (10**8 + 1)

    def _ticks(self):
        """What its MCU is told at the end of each tick, in 1/256 step."""
        trajectory, column = self._trajectory, self._column
        known = trajectory.known()
        end_ns = trajectory.times[known]
        rests = self._rests()
        at = trajectory.positions[0][column]
        rest = (trajectory.positions[known][column] + STEP // 2) // STEP * STEP
        told = (at + STEP // 2) // STEP * STEP
        made = told // STEP
        least = min(self.tick_ns * STEP // (2 * self.table.accel[0] * self.table.unit_ns), STEP)
        direction = row = tick = way = 0
        fastest_now = fastest_before = fastest_told = 0  # in the running step, the one before it, and as told
        over = False
        while not (over and told == rest) and self.start_tick + tick <= self._until:
            time_ns = (tick + 1) * self.tick_ns
            stopped = self._stop is not None and self.start_tick + tick >= self._stop
            if stopped or (time_ns > end_ns and not rests):
                break
            while row + 1 < known and trajectory.times[row + 1] < time_ns:
                row += 1
            over = rests and time_ns >= end_ns
            before, at = at, trajectory.positions[known][column] if over else trajectory.at(row, column, time_ns)
            way = at - before
            lags = direction == 0 or told != before + direction * (STEP // 2)
            turns = way != 0 and (direction == 0 or (way > 0) != (direction > 0))
            if way:
                direction = 1 if way > 0 else -1
            aim = at + direction * (STEP // 2) if way else at
            if over:
                aim = rest
            elif rests and row + 1 == known and not trajectory.cubic and way:
                aim = min(aim, rest) if direction > 0 else max(aim, rest)
            most = min(max(2 * abs(way), least), MOST_IN_A_TICK)
            move = max(-most, min(aim - told, most))
            if not over and way and move * direction < 0:
                move = 0
            told += move
            parts = -(-told >> 24) if direction < 0 else told >> 24
            steps = int((parts - 256 * made) / 256)
            made += steps
            if steps or turns:
                fastest_before = 0 if turns else fastest_now
                fastest_now = fastest_told = 0
            fastest_now = max(fastest_now, abs(way))
            fastest_told = max(fastest_told, move * direction)
            # The way to its last step is cut off there: as of any move, it comes with the end of its tick.
            last = over or (rests and row + 1 == known and told == rest)
            yield Tick(parts if self.fine else 256 * made, direction, row, last, turns or lags)
            tick += 1
        else:
            return
        if self._stop is not None and self._stop <= self.start_tick:
            return
        fastest = min(max(fastest_now, fastest_before), 2 * abs(way))
        yield from self._ramp(tick, row, at, told, made, direction, fastest, max(fastest_told, 1))

    def _ramp(self, tick, row, at, told, made, direction, fastest, fastest_told):
        """As if its MCU heard no more: the running step, as fast as it and the one before it were anywhere, and the fewest that follow."""
        trajectory, column = self._trajectory, self._column
        time_ns = (tick + 1) * self.tick_ns
        if time_ns <= trajectory.times[trajectory.known()] or self._rests():
            while row + 1 < trajectory.known() and trajectory.times[row + 1] < time_ns:
                row += 1
            over = time_ns >= trajectory.times[trajectory.known()]
            way = (trajectory.positions[trajectory.known()][column] if over else trajectory.at(row, column, time_ns)) - at
            if direction == 0 or way * direction > 0:
                fastest = max(fastest, abs(way))
        unit_ns = self.table.unit_ns
        delay = (self.tick_ns * STEP + fastest) // (fastest * unit_ns) if fastest else 0
        parts = -(-told >> 24) if direction < 0 else told >> 24
        # What is still being caught up was told in half its time.
        caught_up = told == at + (direction or 1) * (STEP // 2)
        begun = (parts - 256 * made) * (direction or 1) if caught_up else 0
        # Less of its time is over than of its way, where it was told faster than it goes now.
        begun = min(max(begun * min(fastest, fastest_told) // fastest_told, 0), 255)
        delays = []
        if 0 < delay <= 65535:
            delay = max(delay, min(self.table.accel[-1], self.table.decel[-1], self.table.cruise))
            delays = [delay, *self.table.ramp_down(delay)]
        since_ns = -(-delays[0] * unit_ns * begun // 256) if delays else 0
        if delays and delays[0] * unit_ns - since_ns > MOST_WAIT_NS:
            delays = []
        ends = list(accumulate(code * unit_ns for code in delays))
        done = 0
        while True:
            since_ns += self.tick_ns
            done = bisect.bisect_right(ends, since_ns)
            q = 256 * (made + (direction or 1) * done)
            if self.fine and done < len(ends):
                q += (direction or 1) * ((since_ns - (ends[done - 1] if done else 0)) * 256 // (delays[done] * unit_ns))
            yield Tick(q, direction, None, True, False)
            if done == len(ends):
                return

    def _due(self, tick, row, level):
        """When the motion crosses a position in this tick, from the beginning of the trajectory; None: not in this tick."""
        trajectory, column = self._trajectory, self._column
        low, high = tick * self.tick_ns, min((tick + 1) * self.tick_ns, trajectory.times[trajectory.known()])
        if high <= low:
            return None

        def at(time_ns):
            k = row
            while k > 0 and trajectory.times[k] > time_ns:
                k -= 1
            return trajectory.at(k, column, time_ns)

        rises = at(high) > at(low)
        if (at(low) - level) * (1 if rises else -1) > 0 or (at(high) - level) * (1 if rises else -1) < 0:
            return None
        while high - low > 1:
            middle = (low + high) // 2
            low, high = (middle, high) if (at(middle) < level) == rises else (low, middle)
        return high

    def _swing(self, tick, row):
        """The greatest and the least speed around a tick, in steps per ns."""
        trajectory, column = self._trajectory, self._column
        end_ns = trajectory.times[trajectory.known()]
        speeds = []
        for part in range(-4, 8):
            begin, end = ((4 * tick + part) * self.tick_ns // 4, (4 * tick + part + 1) * self.tick_ns // 4)
            if begin < 0 or end > end_ns:
                speeds.append(0)
                continue
            k = bisect.bisect_right(trajectory.times, begin, 0, trajectory.known()) - 1
            last = bisect.bisect_left(trajectory.times, end, 1, trajectory.known()) - 1
            speeds.append((trajectory.at(last, column, end) - trajectory.at(k, column, begin)) / STEP / (end - begin))
        return max(speeds), min(speeds)

    def _work_out(self):
        """Its steps: (tick, nth in it, direction, q0, q1, made before, due, place, bound)."""
        if self._known is not None:
            return self._known
        self._known = []
        made = self.from_steps
        q0 = 256 * made
        since_turn = 0
        self._ticks_made = 0
        for tick, told in enumerate(self._ticks()):
            self._ticks_made = tick + 1
            since_turn = 0 if told.turned else since_turn + 1
            q1 = told.told_256
            direction = 1 if q1 > q0 else -1
            before = made
            nth = 0
            while (q1 - 256 * (made + direction)) * direction >= 0:
                level = (2 * made + direction) * (STEP // 2)
                due = None if told.row is None else self._due(tick, told.row, level)
                late = due is None and told.row is not None
                place = FIRST_TICK if late or since_turn == 0 else LAST_TICK if told.last else INTERIOR
                # By its ramp, or late after a turn, it is where the law of that puts it.
                self._known.append((tick, nth, direction, q0, q1, before, made, due, place, since_turn, told.row))
                made += direction
                nth += 1
            q0 = q1
        self._end_steps = made
        return self._known

    def _count(self):
        return len(self._work_out())

    def end_steps(self):
        self._work_out()
        return self._end_steps

    def runs_at(self, tick):
        self._work_out()
        return tick < self.start_tick + self._ticks_made

    def too_close(self, most):
        """Judged are steps between two turns, of the rows alone; of a cubic, whose speed changes within a tick, with what that makes."""
        table = self.table
        slack = 1 / 32 if self._trajectory.cubic else 1e-6
        run = []

        def judge(ends, index=0):
            for i in range(1, len(run)):
                delay = run[i][1] - run[i - 1][1]
                least = max(table.delay_from_start(i), table.cruise)
                if ends:
                    least = max(least, table.delay_before_end(len(run) - 1 - i + index))
                if delay * (1 + slack) + 2 < least * table.unit_ns:
                    return run[i][0]
            return None

        slowest_ns = max(table.accel[0], table.decel[0]) * table.unit_ns
        for number, (_, _, direction, _, _, _, _, due, _, _, _) in enumerate(self._work_out()[:most], 1):
            if due is None:
                run.clear()
                continue
            rests = run and (direction != run[-1][2] or due - run[-1][1] >= slowest_ns)
            if rests:
                found = judge(True, 1 if direction == run[-1][2] and due - run[-1][1] < 2 * slowest_ns else 0)
                if found is not None:
                    return found
                run.clear()
            run.append((number, due, direction))
        return judge(self.result == "reached")

    def steps(self, slots):
        crossing = 256 if self.fine else 128
        for number, (tick, nth, direction, q0, q1, before, made, due, place, since_turn, row) in enumerate(self._work_out(), 1):
            way = (256 * made - q0) * direction + crossing
            slot = min(max(way, 0) * slots // abs(q1 - q0), slots - 1)
            begin_ns = (self.start_tick + tick) * self.tick_ns
            emitted_ns = begin_ns + slot * self.tick_ns // slots
            bound_ns = self.tick_ns
            if due is not None and place == INTERIOR and self.emission not in PERIODIC:
                vmax, vmin = self._swing(tick, row)
                rounding = 2 / 256 if self.fine else 1 / 2 + 1 / 256
                off_steps = (vmax - vmin) * self.tick_ns / 4 + rounding
                bound_ns = min(self.tick_ns, 256 * self.tick_ns / abs(q1 - q0) * off_steps + self.tick_ns / slots)
            yield Step(
                move=self,
                number=number,
                time_ns=emitted_ns if due is None else self.start_tick * self.tick_ns + due,
                emitted_ns=emitted_ns,
                early_ns=0,
                tick=self.start_tick + tick,
                nth=nth,
                direction=direction,
                place=place,
                bound_ns=bound_ns,
            )
