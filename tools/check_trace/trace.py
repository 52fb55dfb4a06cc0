"""Where STEP becomes active, out of a VCD file (IEEE 1364-2005, clause 18)."""

import math
import re
from collections import defaultdict, namedtuple

from check_trace.problems import InputError

Edge = namedtuple("Edge", "time_ns direction direction_for_ns enabled")

# Levels of a motor's outputs, step by step, the first one in the lowest bit.
SEQUENCES = {
    "wave": (1, 2, 4, 8),
    "full": (3, 6, 12, 9),
    "half": (1, 3, 2, 6, 4, 12, 8, 9),
    "three-phase": (1, 3, 2, 6, 4, 5),
}
PHASE_OUTPUTS = 4


# Which outputs of an MCU are active low, by their numbers.
Levels = namedtuple("Levels", "enable_low step_low direction_low")
ACTIVE_HIGH = Levels(False, frozenset(), frozenset())


class Trace:
    """What the pins did, by (address, output)."""

    def __init__(self, path, common_dirs=(), phases=None, levels=None):
        """`common_dirs`: addresses of MCUs with one DIR for all; `phases`: sequences by address; `levels`: by address, too."""
        self._common_dirs = common_dirs
        self._phases = phases or {}
        self._levels = levels or {}
        self._ends = False  # whoever has written it says so at its end
        self._ended = False
        self.torn = []  # (place, time): phases that do not follow each other
        self.edges = defaultdict(list)  # rising STEP edges, with DIR and EN as they were
        self.pulses = defaultdict(list)  # of STEP: (begin, width)
        self.double = []  # (place, time): STEP rises while it is high
        self.disorder = []  # (place, time): a time stamp before the one before
        self.end_ns = 0
        try:
            with open(path, encoding="ascii") as file:
                tokens = (token for line in file for token in line.split())
                self._read_changes(tokens, self._read_head(tokens))
                if self._ends and not self._ended:
                    raise InputError(f"{path}: the trace is unfinished: bushsim still writes it, or was killed; end it by SIGTERM, then check")
        except OSError as error:
            raise InputError(f"{path}: {error.strerror}") from None
        except (ValueError, IndexError, StopIteration) as error:
            raise InputError(f"{path}: not a VCD file that can be read: {error}") from None

    def _is_low(self, address, kind, output):
        """Whether this wire is active low."""
        levels = self._levels.get(address, ACTIVE_HIGH)
        if kind == "en":
            return levels.enable_low
        return output in (levels.step_low if kind == "step" else levels.direction_low)

    def _read_head(self, tokens):
        """Wires by their code: (address, kind, output)."""
        wires = {}
        scopes = []
        timescale = None
        for keyword in tokens:
            section = []
            for word in tokens:
                if word == "$end":
                    break
                section.append(word)
            if keyword == "$version":
                self._ends = section == ["bushd", "virtual", "bus"]
            elif keyword == "$timescale":
                timescale = "".join(section)
            elif keyword == "$scope":
                scopes.append(section[1])
            elif keyword == "$upscope":
                scopes.pop()
            elif keyword == "$var":
                mcu = re.fullmatch(r"mcu(\d+)", scopes[-1])
                wire = re.fullmatch(r"(step|dir|en|common_dir)(\d*)", section[3])
                if mcu and wire:
                    wires[section[2]] = (int(mcu[1]), wire[1], int(wire[2] or 0))
            elif keyword == "$enddefinitions":
                break
        if timescale != "1ns":
            raise ValueError(f"its $timescale is {timescale}, not 1 ns")
        if not wires:
            raise ValueError("no scope mcu<address> with wires step<n>, dir<n> and en")
        return wires

    def _read_changes(self, tokens, wires):
        now = 0
        went_back = False
        initial = False  # what follows is how wires are when the trace begins
        # Asked for at each change.
        wires = {code: (*wire, (wire[0], wire[2]), not self._is_low(*wire)) for code, wire in wires.items()}
        high_since = {}
        direction = defaultdict(lambda: (False, -math.inf))  # level, since when
        enabled = defaultdict(bool)
        windings = Windings(self) if self._phases else None
        for token in tokens:
            if token[0] == "#":
                time = int(token[1:])
                went_back = time < now
                now = time
                self.end_ns = max(self.end_ns, now)
                continue
            if token == "$comment":
                self._ended = [*iter(lambda: next(tokens), "$end")] == ["end", "of", "trace"]
                continue
            if token[0] in "bBrR":
                next(tokens)  # a vector's or a real's code stands apart
                continue
            if token[0] == "$":
                initial = token == "$dumpvars"
                continue
            wire = wires.get(token[1:])
            if wire is None:
                continue
            address, kind, _, place, active_high = wire
            level = (token[0] == "1") == active_high
            if went_back:
                self.disorder.append((place, now))
                went_back = False
            if kind == "en":
                enabled[address] = level
            elif kind == "common_dir":
                direction[address, kind] = level, now
            elif kind == "step" and address in self._phases:
                windings.change(now, place, level, self._phases[address], enabled[address])
            elif kind == "dir":
                if direction[place][0] != level:
                    direction[place] = level, now
            elif initial:
                pass  # no edge
            elif level:
                if place in high_since:
                    self.double.append((place, now))
                high_since[place] = now
                shared = address in self._common_dirs
                dir_level, dir_since = direction[(address, "common_dir") if shared else place]
                self.edges[place].append(Edge(now, dir_level, now - dir_since, enabled[address]))
            elif place in high_since:
                since = high_since.pop(place)
                self.pulses[place].append((since, now - since))
        if windings is not None:
            windings.settle()
        for place, since in high_since.items():
            self.pulses[place].append((since, now - since))
        for edges in self.edges.values():
            edges.sort()


class Windings:
    """Steps of motors whose windings are switched: the way that their levels take through the sequence."""

    def __init__(self, trace):
        self._trace = trace
        self._levels = defaultdict(int)  # by (address, motor)
        self._at = defaultdict(int)  # place in the sequence
        self._now = 0
        self._changed = {}  # in this moment: (sequence, enabled) by (address, motor)

    def change(self, now, place, level, sequence, enabled):
        if now != self._now:
            self.settle()
            self._now = now
        motor = place[0], place[1] // PHASE_OUTPUTS
        bit = 1 << place[1] % PHASE_OUTPUTS
        self._levels[motor] = self._levels[motor] | bit if level else self._levels[motor] & ~bit
        self._changed[motor] = SEQUENCES[sequence], enabled

    def settle(self):
        """All that changes at one time is one change."""
        for motor, (sequence, enabled) in self._changed.items():
            levels, at = self._levels[motor], self._at[motor]
            if levels in (0, sequence[at]):
                continue
            for step in (1, -1):
                after = (at + step) % len(sequence)
                if levels == sequence[after]:
                    self._at[motor] = after
                    self._trace.edges[motor].append(Edge(self._now, step > 0, math.inf, enabled))
                    break
            else:
                self._trace.torn.append((motor, self._now))
        self._changed.clear()
