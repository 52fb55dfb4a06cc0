"""Position compare of a motor: what the variables of the motor module's positionCompare mean. Without caproto and without a socket.

An MCU compares with one position of one of its motors. So `PCOIncrement`, or an end that is not the start, is refused.
"""

from __future__ import annotations

import dataclasses
import math
from typing import Any

from .fields import Field, Kind
from .record import Putter
from .variables import Variables

_ENABLE = ("Disable", "Enable")


def _pair(name: str, kind: Kind, initial: Any, words: tuple[str, ...] = (), position: bool = False) -> dict[str, Field]:
    return {
        name: Field(kind, initial, words, settable=True, is_position=position),
        f"{name}_RBV": Field(kind, initial, words, why_not="it says what holds", is_position=position),
    }


FIELDS: dict[str, Field] = {
    **_pair("PCOStartPosition", Kind.DOUBLE, 0.0, position=True),
    **_pair("PCOEndPosition", Kind.DOUBLE, 0.0, position=True),
    **_pair("PCOIncrement", Kind.DOUBLE, 0.0, position=True),
    **_pair("PCOPulseWidth", Kind.DOUBLE, 10.0),  # microseconds
    **_pair("PCOEnable", Kind.ENUM, 0, _ENABLE),
}


@dataclasses.dataclass(frozen=True)
class Set:
    """Asks the daemon for pulses, or for none any more; answered by `answered`."""

    by: Putter
    on: bool
    position: float
    width_us: int


class Compare(Variables[Set]):
    def __init__(self, name: str) -> None:
        self.name = name
        super().__init__(FIELDS)

    @property
    def is_on(self) -> bool:
        return bool(self.values["PCOEnable_RBV"])

    def put(self, field: str, value: Any, by: Putter) -> None:
        error = FIELDS[field].why_not if not FIELDS[field].settable else self._unfit(field, value)
        if error:
            return self._done(by.token, f"{field}: {error}")
        if field != "PCOEnable":
            self._post(field, value)
            self._post(f"{field}_RBV", value)
            return self._done(by.token)
        why_not = self._cannot_enable() if value else ""
        if why_not or (not value and not self.is_on):
            self._show_enabled()
            return self._done(by.token, why_not)
        self._post("PCOEnable", value)
        self._out.append(Set(by, bool(value), self.values["PCOStartPosition"], int(self.values["PCOPulseWidth"])))

    def answered(self, asked: Set, error: str = "") -> None:
        if not error:
            self._post("PCOEnable_RBV", int(asked.on))
        self._show_enabled()
        self._done(asked.by.token, error)

    def replaced(self) -> None:
        """Its MCU compares with something else now."""
        self._post("PCOEnable_RBV", 0)
        self._show_enabled()

    def _show_enabled(self) -> None:
        self._post("PCOEnable", self.values["PCOEnable_RBV"])

    @staticmethod
    def _unfit(field: str, value: Any) -> str:
        if not math.isfinite(value):
            return "it is to be a finite number"
        if field == "PCOPulseWidth" and (value != int(value) or not 1 <= value <= 1_000_000):
            return f"{value:g} us; allowed: whole numbers from 1 to 1000000"
        return ""

    def _cannot_enable(self) -> str:
        start, end = self.values["PCOStartPosition"], self.values["PCOEndPosition"]
        if self.values["PCOIncrement"] and end != start:
            return "an MCU compares with one position: put PCOIncrement to 0, then it is PCOStartPosition"
        return ""
