"""Logs of moves and the traces that follow from them, made slowly and without the code under test.

Positions are Fractions looked up step by step; nothing is shared with tools/check_trace.
"""

import hashlib
import json
import math
from fractions import Fraction

TICK_NS = 2_560_000
SLOTS = 256
PULSE_NS = 5_000


def delays_of(table, steps):
    accel, cruise = table["accel"], table.get("cruise", table["accel"][-1])
    decel = table.get("decel", accel[::-1])
    delays = []
    for j in range(1, steps + 1):
        up = accel[j - 1] if j <= len(accel) else cruise
        left = steps - j
        down = decel[len(decel) - 1 - left] if left < len(decel) else cruise
        delays.append(max(up, down, cruise))
    return delays


def sha256_of(table):
    """The checksum of what moves a motor, by the rule in docs/tables.md."""
    accel = table["accel"]
    decel = table.get("decel", accel[::-1])
    numbers = [table["time_unit_ns"], table.get("cruise", accel[-1]), len(accel)] + accel + decel
    return hashlib.sha256("".join(str(number) + " " for number in numbers).encode("ascii")).hexdigest()


def way_down(table, delay):
    """The delays of the fewest steps that follow one made at `delay`, to rest."""
    decel = table.get("decel", table["accel"][::-1])
    ways = (k for k in range(len(decel)) if decel[len(decel) - 1 - k] <= delay)
    k = next(ways, len(decel))
    return decel[len(decel) - k :]


def is_far(ns):
    """Nobody waits for a step that is so far away, by the rule in docs/tables.md."""
    return 2 * ns > 1_000_000_000


def stopped(table, delays, after_ns):
    """The delays of a move that is stopped `after_ns` after its time 0."""
    if after_ns <= 0:
        return []
    unit_ns = table["time_unit_ns"]
    now = 0
    for done, delay in enumerate(delays):
        now += delay * unit_ns
        if now > after_ns and is_far(now - after_ns):
            return delays[:done]
        if now > after_ns:
            return delays[: done + 1] + [code for code in way_down(table, delay) if not is_far(code * unit_ns)]
    return delays


def retargeted(table, delays, after_ns, target):
    """The delays of a move whose target, in steps from its start, is another from `after_ns` on."""
    if after_ns <= 0:
        return delays_of(table, target)
    now = 0
    for done, delay in enumerate(delays, 1):
        now += delay * table["time_unit_ns"]
        if now > after_ns:
            break
    else:
        return delays
    if target < done + len(way_down(table, delay)):
        return stopped(table, delays, after_ns)
    # As long a move as no ramp at its ends can disturb, from where its delay is that of the running step.
    accel, cruise = table["accel"], table.get("cruise", table["accel"][-1])
    up = [max(code, cruise) for code in accel] + [cruise] * (target + 1)
    while up and up[0] > delay:
        up.pop(0)
    if max(up[0], cruise) == delay:
        up.pop(0)
    down = delays_of({**table, "accel": [cruise], "decel": table.get("decel", accel[::-1])}, target)[done:]
    return delays[:done] + [max(a, d) for a, d in zip(up, down)]


def edges_of(table, delays, fine, ticks_from_ns, late_ns=0, begun=None):
    """ns since the start tick's beginning of every edge of a move, which begins late_ns after that; before ticks_from_ns the
    table is run as it is. `begun`: the delay of a step that is not made, and when the motor rests."""
    times = [late_ns]
    for delay in delays:
        times.append(times[-1] + delay * table["time_unit_ns"])
    ticks = -(-times[-1] // TICK_NS)

    def position(at_ns):
        whole = 0
        while whole < len(delays) and times[whole + 1] <= at_ns:
            whole += 1
        if whole == len(delays) and fine and begun and at_ns <= begun[1]:
            part = Fraction(at_ns - times[-1], begun[0] * table["time_unit_ns"])
            return whole + Fraction(int(part * 256), 256)
        if whole == len(delays) or not fine or at_ns < late_ns:
            return Fraction(whole)
        part = Fraction(at_ns - times[whole], times[whole + 1] - times[whole])
        return whole + Fraction(int(part * 256), 256)

    edges = []
    for tick in range(ticks):
        begin, end = position(tick * TICK_NS), position((tick + 1) * TICK_NS)
        for number in range(1, len(delays) + 1):
            if not begin < number <= end:
                continue
            if tick * TICK_NS < ticks_from_ns:
                slot = min(times[number] * SLOTS // TICK_NS, (tick + 1) * SLOTS - 1)
                edges.append(slot * TICK_NS // SLOTS)
                continue
            crossing = Fraction(number) if fine else number - Fraction(1, 2)
            slot = min(int((crossing - begin) / (end - begin) * SLOTS), SLOTS - 1)
            edges.append(tick * TICK_NS + slot * TICK_NS // SLOTS)
    return edges


class Scene:
    """Motors that move; may be spoilt in many ways before it is written."""

    def __init__(self, table, table_file, fine=True, moves=None):
        self.table = table
        self.table_file = table_file
        self.fine = fine
        self.moves = moves  # "stream", "table", or None: the log does not say
        self.emission = {}  # what the log says of it, if it is not even
        self.burst_slots = None  # T_step, and from a tick's beginning to its first step
        self.events = []
        self.edges = {}  # (address, output): [[time_ns, direction]]
        self.steps = {}  # by motor
        self.delays = {}  # by motor, of its last move
        self.ticks_from_ns = {}  # by motor, of its last move: after its start, before that the table is run
        self.rates = {}  # ppm by address
        self.offsets_ns = {1: 700_000_123, 2: 700_000_123}  # by address
        self.en_low_ns = {}  # address: [(from, to)]
        self.raw = None  # the trace's changes in their order, if it is not to be made from the above

    def move(self, motor, address, output, start_tick, steps, stop_tick=None, move_id=1, late_ns=0):
        direction = 1 if steps >= 0 else -1
        start = self.steps.get(motor, 0)
        delays = delays_of(self.table, abs(steps))
        event = {"id": move_id, "motor": motor}
        self.events.append({
            "event": "move", **event, "bus": "hall", "address": address, "output": output,
            "table_file": self.table_file, "table_sha256": sha256_of(self.table), "tick_ns": TICK_NS,
            "format": "fine" if self.fine else "coarse", "start_tick": start_tick, "steps": steps, "from_steps": start,
            **({"moves": self.moves} if self.moves else {}), **({"late_ns": late_ns} if late_ns else {}),
             **self.emission,
        })
        self.ticks_from_ns[motor] = math.inf if self.moves == "table" else 0
        result = "reached"
        begun = None
        if stop_tick is not None:
            whole = delays
            after_ns = self._changed(motor, (stop_tick - start_tick) * TICK_NS)
            delays = stopped(self.table, delays, after_ns if after_ns <= 0 else after_ns - late_ns)
            if after_ns > 0 and len(delays) < len(whole) and late_ns + sum(delays) * self.table["time_unit_ns"] <= after_ns:
                begun = (whole[len(delays)], after_ns)
            self.events.append({"event": "stop", **event, "tick": stop_tick})
            if len(delays) != abs(steps):
                result = "stopped"
        end = start + direction * len(delays)
        self.steps[motor] = end
        self.delays[motor] = delays
        self.events.append({"event": "result", **event, "result": result, "position_steps": end})
        own = self.edges.setdefault((address, output), [])
        own += self._edges(motor, delays, start_tick, direction, late_ns, begun)
        return len(delays)

    def change(self, motor, event, tick, target=None):
        """Changes the last move of a motor; `target` counts from that move's start."""
        move = next(e for e in reversed(self.events) if e["event"] == "move" and e["motor"] == motor)
        result = self.events.pop()
        after_ns = self._changed(motor, (tick - move["start_tick"]) * TICK_NS)
        direction = 1 if move["steps"] >= 0 else -1
        line = {"event": event, "id": move["id"], "motor": motor, "tick": tick}
        delays = self.delays[motor]
        if event == "stop":
            delays = stopped(self.table, delays, after_ns)
        else:
            delays = retargeted(self.table, delays, after_ns, target)
            line["target_steps"] = move["from_steps"] + direction * target
        wanted = abs(move["steps"]) if target is None else target
        result["result"] = "reached" if len(delays) == wanted else "stopped" if target is None else "turned"
        result["position_steps"] = self.steps[motor] = move["from_steps"] + direction * len(delays)
        self.events += [line, result]
        self.delays[motor] = delays
        own = self.edges[move["address"], move["output"]]
        begin = move["start_tick"] * TICK_NS
        own[:] = [edge for edge in own if edge[0] < begin]
        own += self._edges(motor, delays, move["start_tick"], direction)
        return len(delays)

    def autonomous(self, motor, address, output, from_tick, directions, sets_to=None):
        """Homing, or local motion: a step every two ticks. Only homing sets the position."""
        before = self.steps.get(motor, 0)
        after = before + sum(directions) if sets_to is None else sets_to
        self.steps[motor] = after
        self.events.append({
            "event": "autonomous", "motor": motor, "bus": "hall", "address": address, "output": output, "tick_ns": TICK_NS,
            "what": "local" if sets_to is None else "homing", "set": sets_to is not None, "from_steps": before,
            "position_steps": after, "from_tick": from_tick - 1, "until_tick": from_tick + 2 * len(directions) + 20,
        })
        self.edges.setdefault((address, output), []).extend(
            [(from_tick + 2 * i) * TICK_NS + PULSE_NS, direction] for i, direction in enumerate(directions)
        )

    def meets_limit(self, motor, after):
        """The last move of a motor ends so many steps after its start, by a ramp of the MCU's own: a step every two ticks."""
        move = next(e for e in reversed(self.events) if e["event"] == "move" and e["motor"] == motor)
        ramp = len(self.table["accel"]) // 2
        direction = 1 if move["steps"] >= 0 else -1
        result = self.events[-1]
        result["result"] = "limit"
        result["position_steps"] = self.steps[motor] = move["from_steps"] + direction * (after + ramp)
        own = self.edges[move["address"], move["output"]]
        del own[len(own) - abs(move["steps"]) + after :]
        own += [[own[-1][0] + 2 * (i + 1) * TICK_NS, direction] for i in range(ramp)]

    def _changed(self, motor, after_ns):
        self.ticks_from_ns[motor] = min(self.ticks_from_ns[motor], after_ns)
        return after_ns

    def _edges(self, motor, delays, start_tick, direction, late_ns=0, begun=None):
        edges = edges_of(self.table, delays, self.fine, self.ticks_from_ns[motor], late_ns, begun)
        if self.burst_slots:
            step, first = self.burst_slots
            ticks = [at // TICK_NS for at in edges]
            edges = [
                tick * TICK_NS + (first + (i - ticks.index(tick)) * step) * TICK_NS // SLOTS for i, tick in enumerate(ticks)
            ]
        return [[start_tick * TICK_NS + at, direction] for at in edges]

    def write_moves(self, path):
        with open(path, "w", encoding="utf-8") as file:
            for event in self.events:
                print(json.dumps(event), file=file)

    def trace_time(self, address, bus_ns):
        drift = bus_ns * self.rates.get(address, 0) // 1_000_000
        return self.offsets_ns[address] + bus_ns + drift

    def changes(self):
        """(time, rank, address, wire, level): DIR stands before STEP if they change at once."""
        changes = []
        for address in {address for address, _ in self.edges}:
            changes.append((1000, 0, address, "en", 1))
            for low, high in self.en_low_ns.get(address, []):
                changes.append((self.trace_time(address, low), 0, address, "en", 0))
                changes.append((self.trace_time(address, high), 0, address, "en", 1))
        for (address, output), edges in self.edges.items():
            level = 0
            for bus_ns, direction in edges:
                at = self.trace_time(address, bus_ns)
                if level != (direction > 0):
                    level = int(direction > 0)
                    # As an MCU does: when the pulses of the tick before are over.
                    begin = self.trace_time(address, bus_ns // TICK_NS * TICK_NS - TICK_NS // SLOTS // 2)
                    changes.append((begin, 1, address, f"dir{output}", level))
                changes.append((at, 2, address, f"step{output}", 1))
                changes.append((at + PULSE_NS, 2, address, f"step{output}", 0))
        return sorted(changes)

    def write_trace(self, path):
        addresses = sorted({address for address, _ in self.edges})
        with open(path, "w", encoding="ascii") as file:
            print("$timescale 1 ns $end", file=file)
            for address in addresses:
                print(f"$scope module mcu{address} $end", file=file)
                for output in range(16):
                    print(f"$var wire 1 s{address}_{output} step{output} $end", file=file)
                    print(f"$var wire 1 d{address}_{output} dir{output} $end", file=file)
                print(f"$var wire 1 e{address} en $end", file=file)
                print("$upscope $end", file=file)
            print("$enddefinitions $end\n#0\n$dumpvars", file=file)
            for address in addresses:
                print(f"0e{address}", file=file)
            print("$end", file=file)
            for time, _, address, wire, level in self.raw or self.changes():
                output = wire.lstrip("stepdirn")
                code = f"e{address}" if wire == "en" else f"{wire[0]}{address}_{output}"
                print(f"#{time}\n{level}{code}", file=file)
