"""The order of what is asked of the daemon for one record, whoever asks: each user has a connection of its own, and these overtake each other.

What one user asks goes out in its order. What another one asks waits until the daemon has taken what was asked before. A stop waits
for nobody: what has not gone out yet never does, and what has may have been overtaken, so it is stopped once more when it is taken.
"""

from __future__ import annotations

import asyncio
from collections.abc import Hashable, Iterable


class Turn:
    """The turn of something that is asked for."""

    def __init__(self, who: str | None, records: Iterable[Hashable], before: list[Turn]) -> None:
        """`who`: of whose connection; None: it goes over that of somebody else."""
        self.who = who
        self.records = list(records)
        self.stopped: set[Hashable] = set()  # of its records, before it was taken
        self._before = before
        self._sent = asyncio.Event()
        self._taken = asyncio.Event()

    async def come(self) -> None:
        """Until it may go out."""
        for other in self._before:
            in_order = other.who is not None and other.who == self.who and not other.stopped  # else it is stopped once more
            await (other._sent if in_order else other._taken).wait()
        self._before = []

    @property
    def was_sent(self) -> bool:
        return self._sent.is_set()

    def sent(self) -> None:
        """It goes out before anything else of this loop has its turn."""
        self._sent.set()

    def taken(self) -> None:
        """The daemon has accepted it, or it is over."""
        self._sent.set()
        self._taken.set()

    @property
    def was_taken(self) -> bool:
        return self._taken.is_set()


class Turns:
    def __init__(self) -> None:
        self._open: dict[Hashable, list[Turn]] = {}

    def take(self, who: str | None, records: Iterable[Hashable]) -> Turn:
        """Behind all that is open for these records."""
        records = list(records)
        before = {turn: None for record in records for turn in self.open(record)}
        turn = Turn(who, records, list(before))
        for record in records:
            self._open.setdefault(record, []).append(turn)
        return turn

    def open(self, record: Hashable) -> list[Turn]:
        """Not taken yet."""
        turns = [turn for turn in self._open.get(record, []) if not turn.was_taken]
        if turns:
            self._open[record] = turns
        else:
            self._open.pop(record, None)
        return turns

    def stop(self, records: Iterable[Hashable], who: str | None) -> None:
        """By a stop that goes out now, over the connection of `who`: it does not overtake what has gone out over that."""
        for record in records:
            for turn in self.open(record):
                if not (turn.was_sent and turn.who == who):
                    turn.stopped.add(record)
