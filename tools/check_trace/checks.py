"""Edges against steps, and what else pins and positions must fulfil."""

import bisect
import itertools
import json
import math

from check_trace.clock import NO_CLOCK
from check_trace.emission import STAGGERED
from check_trace.problems import InputError

MAX_SKEW_NS = 20_000  # between the MCUs of a bus


def name_of(step):
    return step.move.name_of(step.number)


class MotorCheck:
    """All edges of one motor against all steps that it was to make."""

    def __init__(self, motor, clock, slot_ns, problems):
        self._motor = motor
        self._clock = clock
        self._slot_ns = slot_ns
        self._problems = problems
        self._planned = []  # the steps that moves which met their limit have made by the table

    def run(self):
        edges = self._without_paths(self._without_autonomous(self._motor.edges))
        steps, edges = self._without_limits(edges)
        self._motor.steps = sorted(steps + self._planned, key=lambda step: step.time_ns)
        missing, surplus = [], []
        i = j = 0
        while i < len(steps) or j < len(edges):
            if i == len(steps):
                away_ns = -math.inf
            elif j == len(edges):
                away_ns = math.inf
            else:
                away_ns = self._away_ns(steps[i], edges[j])
            # A nanosecond for the trace's own rounding.
            if self._too_early(steps, i, away_ns):
                surplus.append(edges[j])
                j += 1
            elif away_ns > self._slot_ns + 1:
                missing.append(steps[i])
                i += 1
            else:
                self._explain(missing, surplus)
                missing, surplus = [], []
                self._check(steps[i], edges[j])
                i += 1
                j += 1
        self._explain(missing, surplus)

    def _too_early(self, steps, i, away_ns):
        early_ns = steps[i].early_ns if i < len(steps) else 0
        return away_ns < -self._slot_ns - early_ns - 1

    def _without_autonomous(self, edges):
        """Looks at the edges of homing, of local motion and of the measuring step; returns the others."""
        rest = []
        for edge in edges:
            at_ns = self._clock.bus_ns(edge.time_ns)
            autonomous = next((a for a in self._motor.autonomous if a.begin_ns <= at_ns < a.end_ns), None)
            if self._clock is NO_CLOCK and self._motor.autonomous:  # nothing tells when its ticks are
                autonomous = self._motor.autonomous[0]
            if autonomous is None:
                rest.append(edge)
                continue
            autonomous.travelled += 1 if edge.direction else -1
            self._check_other(edge, f"an edge of {autonomous.what}")
        for autonomous in self._motor.autonomous:
            if autonomous.sets or self._clock is NO_CLOCK:
                continue
            moved = autonomous.position_steps - autonomous.from_steps
            if moved != autonomous.travelled:
                text = f"{autonomous.what} is said to have moved it by {moved} steps, its edges by {autonomous.travelled}"
                self._problems.add(self._motor, "position", text)
        return self._without_measuring(rest)

    def _without_measuring(self, edges):
        """A step and the way back, by which an MCU measures its supply current before it moves anything."""
        moves = self._motor.moves
        measures = any(move.emission in STAGGERED and move.settle_ns == 0 for move in moves)
        if not measures or len(edges) < 2 or edges[0].direction == edges[1].direction:
            return edges
        first_ns = moves[0].start_tick * moves[0].tick_ns
        if self._clock.bus_ns(edges[1].time_ns) >= first_ns:
            return edges
        for edge in edges[:2]:
            self._check_other(edge, "an edge of the measuring step")
        return edges[2:]

    def _without_paths(self, edges):
        """Sets the edges of each path apart: from its first run to the next motion that is none of its runs."""
        groups = [(way, next(moves)) for way, moves in itertools.groupby(self._motor.moves, lambda move: move.way)]
        before, of_groups = self._split(edges, [first for _, first in groups])
        rest = before
        for (way, _), own in zip(groups, of_groups):
            if way is None:
                rest = rest + own
            else:
                self._motor.path_edges[way] += own
        return rest

    def _without_limits(self, edges):
        """Moves that a limit switch has ended: by the table as far as they go by it, then to rest by the MCU's own ramp.
        Returns the steps and edges of the others."""
        moves = self._motor.moves
        own_steps = self._motor.steps_by_move()
        if not any(move.result == "limit" for move in moves):
            return [step for move in moves for step in own_steps[id(move)]], edges
        rest, of_moves = self._split(edges, moves)
        steps = []
        for move, own in zip(moves, of_moves):
            if move.result == "limit" and move.way is None:
                self._check_limited(move, own_steps[id(move)], own)
            else:
                steps += own_steps[id(move)]
                rest += own
        return steps, rest

    def _split(self, edges, moves):
        """Edges before the first of these moves, and those from the beginning of each to that of the next one."""
        times_ns = [self._clock.bus_ns(edge.time_ns) for edge in edges]
        begins = [bisect.bisect_left(times_ns, move.start_tick * move.tick_ns - self._slot_ns) for move in moves]
        ends = [*begins[1:], len(edges)]
        return edges[: begins[0]] if moves else edges, [edges[begin:end] for begin, end in zip(begins, ends)]

    def _check_limited(self, move, steps, edges):
        made = move.direction * (move.result_steps - move.from_steps)
        # Along a trajectory it may have turned round.
        seen = move.direction * sum(1 if edge.direction else -1 for edge in edges) if move.turns else len(edges)
        if made != seen:
            text = f"move {move.id} is said to have made {made} steps until its limit, its edges are {seen}"
            self._problems.add(self._motor, "position", text)
        planned = 0
        for step, edge in zip(steps, edges):
            away_ns = self._away_ns(step, edge)
            if away_ns > self._slot_ns + 1 or self._too_early(steps, planned, away_ns):
                break
            self._check(step, edge)
            self._planned.append(step)
            planned += 1
        ramp = edges[planned:]
        for edge in ramp:
            self._check_other(edge, f"an edge of the ramp of move {move.id}", None if move.turns else move.direction)
        # In the coarse format an MCU takes its speed from the steps of a few ticks.
        knows = move.makes_steps() and not move.turns
        running = move.delay_of(max(planned - 1, 0)) if knows else move.table.cruise
        unsure = 3 * move.tick_ns // (running * move.table.unit_ns) + 2
        most = len(move.table.ramp_down(running)) + unsure
        if len(ramp) > most:
            text = f"move {move.id} goes on for {len(ramp)} steps after its limit, by the table for {most}"
            self._report("limit", text, ramp[0])

    def _check_other(self, edge, name, direction=None):
        """What holds for every edge, also where its time is not known."""
        self._motor.others += 1
        if direction is not None and edge.direction != (direction > 0):
            self._report("direction", f"{name} has DIR {int(edge.direction)}", edge)
        if edge.direction_for_ns < self._slot_ns / 2 - 1:
            self._report("direction", f"DIR changed only {edge.direction_for_ns} ns before {name}", edge)
        if not edge.enabled:
            self._report("enable", f"EN is low at {name}", edge)

    def _away_ns(self, step, edge):
        return self._clock.bus_ns(edge.time_ns) - step.emitted_ns

    def _report(self, kind, text, edge):
        self._problems.add(self._motor, kind, text, edge.time_ns)

    def _explain(self, missing, surplus):
        """What lies between two good edges: a missing and a surplus one are one that was displaced."""
        for step, edge in zip(missing, surplus):
            away_ns = self._away_ns(step, edge)
            ticks = away_ns / step.move.tick_ns
            text = f"{name_of(step)} is {away_ns / 1000:+.1f} us ({ticks:+.2f} ticks) from its slot"
            self._report("time", text, edge)
        for step in missing[len(surplus) :]:
            if step.emitted_ns > step.move.cut_ns - self._slot_ns:
                continue  # the trace ends there
            due_ns = step.emitted_ns + self._clock.at(step.emitted_ns)
            self._problems.add(self._motor, "missing", f"{name_of(step)} is missing", due_ns)
        for edge in surplus[len(missing) :]:
            self._report("surplus", "an edge that no move explains", edge)

    def _check(self, step, edge):
        """An edge that lies within a slot of where the step should be."""
        motor = self._motor
        at_ns = self._clock.bus_ns(edge.time_ns)
        error_ns = at_ns - step.time_ns
        motor.errors_ns[step.place].append(error_ns)
        motor.off_slot_ns = max(motor.off_slot_ns, abs(at_ns - step.emitted_ns))
        motor.bound_share = max(motor.bound_share, abs(error_ns) / step.bound_ns)

        if edge.direction != (step.direction > 0):
            self._report("direction", f"{name_of(step)} has DIR {int(edge.direction)}", edge)
        if edge.direction_for_ns < self._slot_ns / 2 - 1:
            text = f"DIR changed only {edge.direction_for_ns} ns before {name_of(step)}"
            self._report("direction", text, edge)
        if not edge.enabled:
            self._report("enable", f"EN is low at {name_of(step)}", edge)
        # A pulse begins with its slot, the last one a slot before the tick's end: so the clock may err by
        # half a slot to either side.
        clock_ns = self._slot_ns / 2
        tick = int((at_ns + clock_ns) // step.move.tick_ns)
        if tick != step.tick:
            self._report("tick", f"{name_of(step)} is in tick {tick}, by the table in {step.tick}", edge)
        if abs(error_ns) > step.bound_ns + clock_ns:
            text = f"{name_of(step)} is {error_ns / 1000:+.1f} us from the table"
            self._report("time", f"{text}, allowed are {step.bound_ns / 1000:.1f} us", edge)


def check_pins(trace, motors, slot_ns_of, problems):
    """What holds for every output, whether or not the log knows a motor there."""
    motor_at = {(motor.address, motor.output): motor for motor in motors}

    def owner(place):
        return motor_at.get(place) or f"output {place[1]} of mcu{place[0]} (no motor in the log)"

    for place, time_ns in trace.disorder:
        problems.add(owner(place), "order", "stands in the trace after a later change", time_ns)
    for place, time_ns in trace.double:
        problems.add(owner(place), "pulse", "STEP rises while it is high", time_ns)
    for place, pulses in trace.pulses.items():
        for time_ns, width_ns in pulses:
            if not 0 < width_ns <= slot_ns_of(place[0]):
                text = f"a STEP pulse of {width_ns} ns, longer than a slot or void"
                problems.add(owner(place), "pulse", text, time_ns)
    for place, time_ns in trace.torn:
        problems.add(owner(place), "phases", "its levels are no neighbours in the sequence", time_ns)
    for place, edges in trace.edges.items():
        if place not in motor_at:
            for edge in edges:
                problems.add(owner(place), "surplus", "an edge that no move explains", edge.time_ns)


def check_skew(motors, clocks, problems):
    """All MCUs of a bus must begin their ticks at the same time. Returns the largest difference."""
    if not clocks:
        return 0
    times = [motor.steps[i].time_ns for motor in motors if motor.steps for i in (0, -1)]
    reference = min(clocks)
    largest_ns = 0
    for address, clock in clocks.items():
        skews_ns = [clock.at(time) - clocks[reference].at(time) for time in (min(times), max(times))]
        skew_ns = max(skews_ns, key=abs)
        largest_ns = max(largest_ns, abs(skew_ns))
        if abs(skew_ns) > MAX_SKEW_NS:
            own = [motor for motor in motors if motor.address == address]
            names = ", ".join(motor.name for motor in own)
            text = f"ticks begin {skew_ns / 1000:+.1f} us from those of mcu{reference}"
            problems.add(f"{own[0].mcu} ({names})", "skew", f"{text}, allowed are {MAX_SKEW_NS // 1000} us")
    return largest_ns


def check_positions(path, motors, problems):
    """What the daemon says in the end (bushctl status --json) against edges counted by their DIR."""
    try:
        with open(path, encoding="utf-8") as file:
            said = {entry["name"]: entry["position_steps"] for entry in json.load(file)["motors"]}
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(f"{path}: not the output of bushctl status --json: {error!r}") from None
    for motor in motors:
        set_by_steps = motor.set_by_steps + sum(
            autonomous.position_steps - autonomous.from_steps - autonomous.travelled for autonomous in motor.autonomous if autonomous.sets
        )
        counted = motor.from_steps + set_by_steps + motor.travelled()
        if said.get(motor.name) != counted:
            text = f"the daemon says it is at {said.get(motor.name)} steps, its edges lead to {counted}"
            problems.add(motor, "position", text)
