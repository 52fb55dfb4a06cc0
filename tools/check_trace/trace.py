"""Rising STEP edges out of a VCD file (IEEE 1364-2005, clause 18)."""

import math
import re
from collections import defaultdict, namedtuple

from check_trace.problems import InputError

Edge = namedtuple("Edge", "time_ns direction direction_for_ns enabled")


class Trace:
    """What the pins did, by (address, output)."""

    def __init__(self, path):
        self.edges = defaultdict(list)  # rising STEP edges, with DIR and EN as they were
        self.pulses = defaultdict(list)  # of STEP: (begin, width)
        self.double = []  # (place, time): STEP rises while it is high
        self.disorder = []  # (place, time): a time stamp before the one before
        try:
            with open(path, encoding="ascii") as file:
                tokens = (token for line in file for token in line.split())
                self._read_changes(tokens, self._read_head(tokens))
        except OSError as error:
            raise InputError(f"{path}: {error.strerror}") from None
        except (ValueError, IndexError, StopIteration) as error:
            raise InputError(f"{path}: not a VCD file that can be read: {error}") from None

    @staticmethod
    def _read_head(tokens):
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
            if keyword == "$timescale":
                timescale = "".join(section)
            elif keyword == "$scope":
                scopes.append(section[1])
            elif keyword == "$upscope":
                scopes.pop()
            elif keyword == "$var":
                mcu = re.fullmatch(r"mcu(\d+)", scopes[-1])
                wire = re.fullmatch(r"(step|dir|en)(\d*)", section[3])
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
        high_since = {}
        direction = defaultdict(lambda: (False, -math.inf))  # level, since when
        enabled = defaultdict(bool)
        for token in tokens:
            if token[0] == "#":
                time = int(token[1:])
                went_back = time < now
                now = time
                continue
            if token[0] in "bBrR":
                next(tokens)  # a vector's or a real's code stands apart
                continue
            wire = wires.get(token[1:])
            if wire is None or token[0] == "$":
                continue
            address, kind, output = wire
            place = address, output
            level = token[0] == "1"
            if went_back:
                self.disorder.append((place, now))
                went_back = False
            if kind == "en":
                enabled[address] = level
            elif kind == "dir":
                if direction[place][0] != level:
                    direction[place] = level, now
            elif level:
                if place in high_since:
                    self.double.append((place, now))
                high_since[place] = now
                dir_level, dir_since = direction[place]
                self.edges[place].append(Edge(now, dir_level, now - dir_since, enabled[address]))
            elif place in high_since:
                since = high_since.pop(place)
                self.pulses[place].append((since, now - since))
        for place, since in high_since.items():
            self.pulses[place].append((since, now - since))
        for edges in self.edges.values():
            edges.sort()
