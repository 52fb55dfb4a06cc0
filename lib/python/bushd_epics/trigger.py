"""A move that waits for an edge at the trigger input of the motor's MCU: what its variables mean. Without caproto and without a socket.

The motor module has no names for that; these are bushd's own.
"""

from __future__ import annotations

import dataclasses
import math
from typing import Any

from .events import End, Seen
from .fields import Field, Kind
from .record import Putter
from .variables import Variables

RISING = 0  # trgEdge
IDLE, ARMING, ARMED, MOVING = range(4)  # trgState
LEAST_DELAY_US, MOST_DELAY_US = 50, 1_650_000

_SAID = "it is what the trigger does, and cannot be put"

FIELDS: dict[str, Field] = {
    "_trgEdge": Field(Kind.ENUM, RISING, ("Rising", "Falling"), settable=True),
    "_trgDelay": Field(Kind.DOUBLE, float(LEAST_DELAY_US), settable=True),  # microseconds
    "_trgDistance": Field(Kind.DOUBLE, 0.0, settable=True, is_position=True),
    "_trgArm": Field(Kind.ENUM, 0, ("Done", "Arm"), settable=True),
    "_trgState": Field(Kind.ENUM, IDLE, ("Idle", "Arming", "Armed", "Moving"), why_not=_SAID),
    "_trgMessage": Field(Kind.CHARS, "", why_not=_SAID),
}


@dataclasses.dataclass(frozen=True)
class Arm:
    """Asks the daemon to let the motor wait; answered by `over`, when it has moved or will not."""

    who: Any
    distance: float
    falling: bool
    delay_us: int


@dataclasses.dataclass(frozen=True)
class Disarm:
    """Asks for a stop, which ends the wait as well; answered by `aborted`."""

    by: Putter


class Trigger(Variables[Arm | Disarm]):
    def __init__(self, name: str) -> None:
        self.name = name
        super().__init__(FIELDS)
        self._waiting: list[Any] = []  # the token of the put that has armed it

    @property
    def is_on(self) -> bool:
        return bool(self.values["_trgArm"])

    # -- clients

    def put(self, field: str, value: Any, by: Putter) -> None:
        error = FIELDS[field].why_not if not FIELDS[field].settable else self._unfit(field, value)
        if error:
            return self._done(by.token, f"{field}: {error}")
        if field != "_trgArm":
            self._post(field, value)
            return self._done(by.token)
        if not value:
            return self._out.append(Disarm(by)) if self.is_on else self._done(by.token)
        if self.is_on:
            return self._done(by.token, "it is armed already, or moves by its trigger: put _trgArm to Done first, or wait")
        self._post("_trgArm", 1)
        self._post("_trgMessage", "")
        self._post("_trgState", ARMING)
        self._waiting.append(by.token)
        values = self.values
        self._out.append(Arm(by.who, values["_trgDistance"], values["_trgEdge"] != RISING, int(values["_trgDelay"])))

    # -- the daemon

    def see(self, seen: Seen) -> None:
        """What its motor does. It was at rest when it was armed."""
        if not self.is_on:
            return
        if seen.armed:
            self._post("_trgState", ARMED)
        elif seen.moving or seen.busy:
            self._post("_trgState", MOVING)

    def over(self, end: str, reason: str) -> None:
        """`end`: one of `End`."""
        error = "" if end == End.REACHED else reason or end
        self._post("_trgMessage", error)
        self._post("_trgState", IDLE)
        self._post("_trgArm", 0)
        tokens, self._waiting = self._waiting, []
        for token in tokens:
            self._done(token, error)

    def aborted(self, by: Putter, error: str = "") -> None:
        self._done(by.token, error)

    # -- for the above

    @staticmethod
    def _unfit(field: str, value: Any) -> str:
        if not math.isfinite(value):
            return "it is to be a finite number"
        if field == "_trgDelay" and (value != int(value) or not LEAST_DELAY_US <= value <= MOST_DELAY_US):
            return f"{value:g} us; allowed: whole numbers from {LEAST_DELAY_US} to {MOST_DELAY_US}"
        return ""
