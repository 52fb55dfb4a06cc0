"""Deferred moves: targets are gathered, and begin together when they are let go."""

from __future__ import annotations

import itertools

from . import events
from .record import Record

Waiting = tuple[Record, events.Move]


class Deferred:
    def __init__(self) -> None:
        self.on = False
        self._waiting: dict[Record, events.Move] = {}

    def take(self, record: Record, ask: events.Move) -> events.Move | None:
        """Returns what it takes the place of."""
        before = self._waiting.pop(record, None)
        self._waiting[record] = ask
        record.jobs[ask.number].deferred = True
        return before

    def drop(self, record: Record) -> events.Move | None:
        return self._waiting.pop(record, None)

    def let_go(self) -> list[list[Waiting]]:
        """Groups that can be asked for as one: a request has one speed, in the unit of each motor."""
        waiting = [one for one in self._waiting.items() if one[1].number in one[0].jobs]  # a record has dropped the others
        self._waiting = {}
        for record, ask in waiting:
            record.jobs[ask.number].deferred = False

        def speed(one: Waiting) -> float:
            return one[1].speed or 0.0

        return [list(group) for _, group in itertools.groupby(sorted(waiting, key=speed), key=speed)]
