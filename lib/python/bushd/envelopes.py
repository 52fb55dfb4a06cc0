"""Speed envelopes: moves of several speeds, in files that `bushtab envelope` makes.

    envelope = bushd.Envelope.load("slow-ends.envelope")
    points, speeds = envelope.path(client.motor("feed"))
    client.move_path(["feed"], points, speeds=speeds)
"""

from __future__ import annotations

import dataclasses
import fractions
import math
import os
import pathlib
import tomllib
from typing import Any

from . import model

_KEYS = ("description", "table", "by", "steps_per_unit", "zones", "end")
_MOST_ZONES = 100
_SAME_SCALE = 1e-9


@dataclasses.dataclass(frozen=True)
class Envelope:
    """Numbers are steps and steps per second, or a unit of `steps_per_unit` and that per second."""

    table: str  # the name of the table by which the motor changes its speed
    zones: tuple[tuple[float, float], ...]  # where each begins, and its speed
    end: float
    by_position: bool = False  # else places are distances from where the motion begins
    steps_per_unit: float | None = None
    description: str = ""

    def __post_init__(self) -> None:
        if not 1 <= len(self.zones) <= _MOST_ZONES:
            raise ValueError(f"{len(self.zones)} zones; allowed: 1 to {_MOST_ZONES}")
        places = [place for place, _ in self.zones] + [self.end]
        numbers = [*places, *(speed for _, speed in self.zones)]
        if not all(math.isfinite(number) for number in numbers):
            raise ValueError("zones and end: allowed: finite numbers")
        if any(speed <= 0 for _, speed in self.zones):
            raise ValueError("zones: allowed: speeds above 0")
        if not self.by_position and places[0] != 0:
            raise ValueError(f"zones: the first one begins at {places[0]}; allowed by distance: 0, where the motion begins")
        up = self.end > places[0]
        if any((to <= at) if up else (to >= at) for at, to in zip(places, places[1:])):
            raise ValueError("zones: allowed: each one, and then the end, further on in one direction")
        if self.steps_per_unit is not None and not 0 < self.steps_per_unit < math.inf:
            raise ValueError(f"steps_per_unit={self.steps_per_unit}; allowed: a number above 0")

    @classmethod
    def load(cls, file: str | os.PathLike[str]) -> Envelope:
        """Raises OSError, or ValueError with the file, the key and what is allowed."""
        text = pathlib.Path(file).read_text(encoding="utf-8")
        try:
            return cls._of(tomllib.loads(text))
        except (ValueError, TypeError) as error:
            raise ValueError(f"{file}: {error}") from error

    @classmethod
    def _of(cls, read: dict[str, Any]) -> Envelope:
        for key in read:
            if key not in _KEYS:
                raise ValueError(f"{key}: unknown key; allowed: {', '.join(_KEYS)}")
        for key in ("table", "zones", "end"):
            if key not in read:
                raise ValueError(f"{key}: is missing")
        by = read.get("by", "distance")
        if by not in ("distance", "position"):
            raise ValueError(f'by: is {by!r}; allowed: "distance", "position"')
        if not isinstance(read["table"], str) or not read["table"]:
            raise ValueError("table: allowed: the name of a table")
        zones = read["zones"]
        if not isinstance(zones, list) or not all(isinstance(zone, list) and len(zone) == 2 for zone in zones):
            raise ValueError("zones: allowed: pairs, each [from, speed]")
        scale = read.get("steps_per_unit")
        return cls(
            table=read["table"],
            zones=tuple((_number("zones", place), _number("zones", speed)) for place, speed in zones),
            end=_number("end", read["end"]),
            by_position=by == "position",
            steps_per_unit=None if scale is None else _number("steps_per_unit", scale),
            description=str(read.get("description", "")),
        )

    def path(self, motor: model.Motor) -> tuple[list[tuple[float]], list[float]]:
        """Points and speeds for `move_path()`, of a motor that has this table and this scale; by distance from where it stands.

        By position the first one is where the first zone begins, and the way there as fast as the table allows.
        """
        if motor.table.name != self.table:
            raise ValueError(f"the envelope is for the table {self.table}, and {motor.name} goes by {motor.table.name}")
        own = float(fractions.Fraction(motor.steps_per_unit))
        if self.steps_per_unit is not None and not math.isclose(own, self.steps_per_unit, rel_tol=_SAME_SCALE):
            raise ValueError(f"the envelope has {self.steps_per_unit} steps per unit, and {motor.name} has {motor.steps_per_unit}")
        if not self.by_position and (motor.position is None or motor.moving):
            raise ValueError(f"{motor.name}: an envelope by distance begins at a position that is known, and at rest")
        in_steps = self.steps_per_unit is None
        speed_factor = 1 / own if in_steps else 1.0
        sign = -1 if motor.negative else 1

        def position(place: float) -> float:
            if not in_steps:
                return place if self.by_position else float(motor.position or 0) + place
            if self.by_position:
                return motor.offset + sign * place / own
            return float(motor.position or 0) + sign * place / own

        points = [(position(place),) for place, _ in self.zones[1:]] + [(position(self.end),)]
        speeds = [speed * speed_factor for _, speed in self.zones]
        if not self.by_position:
            return points, speeds
        return [(position(self.zones[0][0]),), *points], [0.0, *speeds]


def _number(key: str, value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise ValueError(f"{key}: is {value!r}; allowed: a number")
    return float(value)
