"""What bushd promises of positions (docs/positions.md, docs/configuration.md): a model that shares no code with it.

Steps count; user and dial positions are exact fractions of what people have written, rounded to the nearest step, ties
away from zero. Here is what follows from a request and the state before it, and nothing of how it comes about.
"""
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Optional

MOST_STEPS = 2**31 - 1
LONGEST_DELAY_S = 3600


class Refused(Exception):
    """Holds a part of the reason that people are told."""


def as_written(number: float) -> Fraction:
    """The number that the shortest decimal text of this double means."""
    return Fraction(repr(float(number)))


def nearest(value: Fraction) -> int:
    """Ties away from zero."""
    steps = int(abs(value) + Fraction(1, 2))
    return -steps if value < 0 else steps


def above(value: Fraction) -> int:
    return -(-value.numerator // value.denominator)


def below(value: Fraction) -> int:
    return value.numerator // value.denominator


@dataclass
class Amount:
    """An amount of steps, or of user units as somebody has written them."""
    steps: Optional[int] = None
    user: Optional[str] = None

    def as_json(self):
        return {"steps": self.steps} if self.steps is not None else {"user": float(self.user)}


@dataclass
class Motor:
    name: str
    unit: bool = False
    steps_per_unit: Fraction = Fraction(1)
    negative: bool = False
    offset: Fraction = Fraction(0)
    limits: Optional[tuple] = None  # on the dial
    max_speed: Optional[Fraction] = None
    time_unit_ns: int = 1
    backlash: Fraction = Fraction(0)  # in units; its sign is that of the last approach
    backlash_speed: Optional[Fraction] = None
    settle_ms: int = 0
    # What is.
    steps: int = 0
    trust: str = "known"  # known, restored, unconfirmed (nobody has said where it stands), uncertain
    # The offset is as exact as it is written: not so where a user position was set and the dial has no short text.
    exact_offset: bool = True
    held: bool = False
    in_file: tuple = field(default=(Fraction(0), False, None))  # offset, negative, limits

    def is_as_written(self):
        """What is now is what bushd.toml says."""
        self.in_file = (self.offset, self.negative, self.limits)

    # Coordinates.
    def dial(self, steps: int) -> Fraction:
        return steps / self.steps_per_unit

    def user(self, steps: int) -> Fraction:
        return self.offset - self.dial(steps) if self.negative else self.offset + self.dial(steps)

    def _within(self, steps: int) -> int:
        if abs(steps) > MOST_STEPS:
            raise Refused("positions lie within")
        return steps

    def steps_of_dial(self, dial: Fraction) -> int:
        return self._within(nearest(dial * self.steps_per_unit))

    def steps_of_position(self, amount: Amount) -> set:
        """All that the daemon may make of it: two where a tie depends on digits that an offset does not have."""
        if amount.steps is not None:
            return {amount.steps}
        user = Fraction(amount.user)
        if not self.unit:
            return {self._whole(user)}
        dial = self.offset - user if self.negative else user - self.offset
        exact = dial * self.steps_per_unit
        if not self.exact_offset and abs(abs(exact) % 1 - Fraction(1, 2)) < Fraction(1, 10**6):
            return {self._within(below(exact)), self._within(above(exact))}
        return {self._within(nearest(exact))}

    def steps_of_distance(self, amount: Amount) -> int:
        if amount.steps is not None:
            return amount.steps
        user = Fraction(amount.user)
        if not self.unit:
            return self._whole(user)
        steps = self.steps_of_dial(user)
        return -steps if self.negative else steps

    def steps_of_distances(self, amount: Amount) -> set:
        """Both, for a distance that is no whole number of steps: it counts from the target as it was asked for, which may be
        half a step off on either side (docs/positions.md, "Distances"). tests/daemon/relative_moves_test.cpp has the sums.
        """
        if amount.steps is not None or not self.unit:
            return {self.steps_of_distance(amount)}
        exact = Fraction(amount.user) * self.steps_per_unit
        found = {self._within(below(exact)), self._within(above(exact))}
        return {-steps for steps in found} if self.negative else found

    def _whole(self, value: Fraction) -> int:
        if value.denominator != 1:
            raise Refused("no whole number of steps")
        return self._within(int(value))

    # Limits and speeds.
    def step_limits(self) -> tuple:
        low, high = (above(self.limits[0] * self.steps_per_unit), below(self.limits[1] * self.steps_per_unit))
        return (max(low, -MOST_STEPS), min(high, MOST_STEPS))

    def may_aim(self, target: int, nearest_steps: int, farthest_steps: int) -> Optional[bool]:
        """Whether a target keeps to the soft limits, of a motor that is somewhere between these; None: that depends on
        where exactly. A motor beyond a limit may be moved back."""
        if self.limits is None:
            return True
        low, high = self.step_limits()
        verdicts = {min(low, at) <= target <= max(high, at) for at in (nearest_steps, farthest_steps)}
        return verdicts.pop() if len(verdicts) == 1 else None

    def shortest_delay(self, speed: Optional[Fraction], in_steps: bool) -> int:
        """The shortest of all delays of a move, in time units."""
        shortest_delays = [0]
        for value, scale in ((self.max_speed, self.steps_per_unit), (speed, 1 if in_steps else self.steps_per_unit)):
            if value is None:
                continue
            if value * scale * LONGEST_DELAY_S < 1:
                raise Refused("an hour a step")
            shortest_delays.append(above(Fraction(10**9) / (value * scale * self.time_unit_ns)))
        return max(shortest_delays)

    def backlash_steps(self) -> int:
        steps = nearest(self.backlash * self.steps_per_unit)
        return -steps if self.negative else steps

    def approach_shortest_delay(self, shortest_delay: int) -> int:
        if self.backlash_speed is None:
            return shortest_delay
        return max(shortest_delay, above(Fraction(10**9) / (self.backlash_speed * self.steps_per_unit * self.time_unit_ns)))

    def legs(self, at: Optional[int], target: int, shortest_delay: int) -> list:
        """Where each leg of a move ends, and its shortest delay; `at`: None if it moves, so that its direction says nothing."""
        backlash = self.backlash_steps()
        if backlash == 0 or at == target:
            return [(target, shortest_delay)]
        slow = self.approach_shortest_delay(shortest_delay)
        from_that_side = at is not None and (target > at) == (backlash > 0)
        if from_that_side and (slow == shortest_delay or abs(target - at) <= abs(backlash)):
            return [(target, slow)]
        return [(target - backlash, shortest_delay), (target, slow)]

    def direction(self, speed: Fraction, in_steps: bool) -> int:
        """In steps, of a jog."""
        return -1 if (speed < 0) != (self.negative and not in_steps) else 1

    def farthest(self, direction: int) -> int:
        """Where a jog from rest leads; None: it goes on and on."""
        if self.limits is None:
            return None
        low, high = self.step_limits()
        limit = high if direction > 0 else low
        if (limit - self.steps) * direction <= 0:
            raise Refused("stands at or beyond its soft limit")
        return limit

    def jog(self, speed: Fraction, in_steps: bool) -> int:
        """From rest: its direction."""
        self.must_be_free()
        self.shortest_delay(abs(speed), in_steps)
        direction = self.direction(speed, in_steps)
        self.farthest(direction)
        if self.trust == "uncertain":
            raise Refused("its position is uncertain")
        return direction

    # What may be asked of it.
    def must_be_free(self):
        if self.held:
            raise Refused("it is held")

    def targets(self, absolute: bool, amount: Amount, base: int) -> set:
        """The targets of a move that somebody asks for; `base` is where it stands, or its present target."""
        if absolute:
            found = self.steps_of_position(amount)
        else:
            found = {base + steps for steps in self.steps_of_distances(amount)}
        if any(abs(target - (0 if absolute else base)) > 2 * MOST_STEPS for target in found):
            raise Refused("out of range")
        self.must_be_free()
        if self.trust == "uncertain":
            raise Refused("its position is uncertain")
        if any(abs(target) > MOST_STEPS for target in found):
            raise Refused("beyond")
        return found

    def set_user(self, user: str):
        """Changes the offset."""
        if self.trust == "uncertain":
            raise Refused("its position is uncertain")
        dial = self.dial(self.steps)
        exact = Fraction(user) + dial if self.negative else Fraction(user) - dial
        self.offset = as_written(float(exact))
        self.exact_offset = self.offset == exact

    def set_steps(self, steps: int):
        self.steps = self._within(steps)
        self.trust = "known"

    def confirm(self):
        self.trust = "known"

    def configure(self, key: str, value):
        """`value`: of the offset as people write it, of the direction whether it is negative, of the limits two such
        texts or None."""
        if key == "soft_limits":
            limits = None if value is None else (Fraction(value[0]), Fraction(value[1]))
            if limits and above(limits[0] * self.steps_per_unit) > below(limits[1] * self.steps_per_unit):
                raise Refused("has no step from")
            self.limits = limits
        elif not self.unit:
            raise Refused("it has no unit")
        elif key == "direction":
            self.negative = value
        else:
            self.offset = Fraction(value)
            self.exact_offset = True

    def is_outside(self) -> bool:
        if self.limits is None:
            return False
        low, high = self.step_limits()
        return not low <= self.steps <= high

    # What happens to it.
    def mcu_restarted(self, in_motion: bool):
        if in_motion and self.trust in ("known", "restored"):
            self.trust = "uncertain"
        elif in_motion and self.trust == "unconfirmed":
            self.trust = "uncertain"
        elif self.trust == "known":
            self.trust = "restored"

    def daemon_restarted(self, kept: bool):
        if kept:
            return  # the MCU has counted on, and a hold is kept
        self.held = False
        self.trust = "unconfirmed"
        self.offset, self.negative, self.limits = self.in_file
        self.exact_offset = True

    def trust_told(self) -> str:
        return "uncertain" if self.trust == "unconfirmed" else self.trust
