"""Steps, dial and user's scale of a motor: user = offset + dial, or offset - dial; dial = steps x resolution."""

from __future__ import annotations

import dataclasses
import fractions
import functools

LONGEST_STEP_S = 3600.0


@dataclasses.dataclass(frozen=True)
class Scale:
    resolution: float = 1.0  # of a step, in the unit: MRES
    negative: bool = False
    offset: float = 0.0

    @property
    def sign(self) -> float:
        return -1.0 if self.negative else 1.0

    def user(self, dial: float) -> float:
        return self.offset + self.sign * dial

    def dial(self, user: float) -> float:
        return self.sign * (user - self.offset)

    @property
    def least_speed(self) -> float:
        """A step an hour: nothing slower is taken by bushd. The last digit is left to it."""
        return abs(self.resolution) / LONGEST_STEP_S * (1 - 1e-12)

    def steps(self, dial: float) -> int:
        return round(dial / self.resolution)


@functools.lru_cache(maxsize=1024)
def resolution(steps_per_unit: str) -> float:
    """The resolution of a motor with so many steps in a unit, as bushd tells it: "320", "12.5", "1/3", or "" where its unit is steps."""
    parts = [fractions.Fraction(part) for part in (steps_per_unit or "1").split("/")]
    value = parts[0] / (parts[1] if len(parts) > 1 else 1)
    return float(1 / value) if value > 0 else 1.0
