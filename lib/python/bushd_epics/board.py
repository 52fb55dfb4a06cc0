"""The values of a record's fields, and what is to be done: all that a record says goes through here, in order."""

from __future__ import annotations

import itertools
from typing import Any

from . import alarms, events
from .alarms import Alarm
from .fields import FIELDS, Value

Event = events.Post | events.Raise | events.Done | events.Log | events.Ask

_numbers = itertools.count(1)


class Board:
    def __init__(self, name: str) -> None:
        self.name = name
        self.values: dict[str, Value] = {field: spec.initial for field, spec in FIELDS.items()}
        self.values["NAME"] = name
        self.shown: set[str] | None = None  # fields whose values are told; None: all
        self._out: list[Event] = []
        self._alarm: Alarm | None = None

    def take(self) -> list[Event]:
        """What has come out since this was called last, in the order in which it is to be done."""
        out, self._out = self._out, []
        return out

    # -- for the layers above

    def number(self, field: str) -> float:
        return float(self.values[field])

    def post(self, field: str, value: Value, always: bool = False) -> None:
        """`always`: also where it is what it was."""
        was = self.values[field]
        if was is value and not always:
            return
        if always or not _same(was, value):
            self.values[field] = value
            if self.shown is None or field in self.shown:
                self._out.append(events.Post(field, value))

    def post_all(self, values: dict[str, Value]) -> None:
        for field, value in values.items():
            self.post(field, value)

    def raise_alarm(self, alarm: Alarm) -> None:
        if alarm == self._alarm:
            return
        self._alarm = alarm
        self._out.append(events.Raise(alarm))
        self.post("STAT", alarm.status.name)
        self.post("SEVR", int(alarm.severity))
        self.post("AMSG", alarm.reason)
        # Who watches these hears of the alarm, whatever their values are.
        self.post("VAL", self.values["VAL"], always=True)
        self.post("DRBV", self.values["DRBV"], always=True)
        self.post("RBV", self.values["RBV"], always=True)

    @property
    def alarm(self) -> Alarm:
        return self._alarm or alarms.NONE

    def done(self, tokens: list[Any], error: str = "") -> None:
        self._out.extend(events.Done(token, error) for token in tokens if token is not None)
        tokens.clear()

    def log(self, text: str) -> None:
        self._out.append(events.Log(f"{self.name}: {text}"))

    def ask(self, ask: events.Ask) -> int:
        self._out.append(ask)
        return ask.number

    @staticmethod
    def next_number() -> int:
        """The next number, common to asks of all records."""
        return next(_numbers)


def _same(a: Value, b: Value) -> bool:
    if a == b:
        return type(a) is type(b)
    return a != a and b != b  # neither is a number
