"""How long a jog may go on: as long as its client is there, and not longer than a time after it was asked for last. The time is told."""

from __future__ import annotations

from typing import Any

from .record import Record

LONGEST_S = 60.0
UNREAD_S = 1.0  # so long something that was sent to its client may wait there, or on the way


class Jogs:
    def __init__(self, longest_s: float = LONGEST_S) -> None:
        self.longest_s = longest_s
        self._asked_at: dict[int, float] = {}  # by number
        self._waits_since: dict[Any, float] = {}  # by circuit

    @staticmethod
    def of(record: Record) -> list[Any]:
        return [job for job in record.jobs.values() if job.kind == "jog" and not job.stopping]

    def renew(self, record: Record, field: str, circuit: Any, now: float) -> bool:
        """JOGF or JOGR was put to 1 by the client that jogs with it already: it may go on."""
        mine = [job for job in self.of(record) if job.circuit is circuit]
        if not mine or record.values[field] != 1:
            return False
        self._asked_at.update({job.number: now for job in mine})
        return True

    def look(self, records: list[Record], waiting: Any, now: float) -> list[tuple[Record, Any, str]]:
        """Those that are to end: record, circuit, and why. `waiting`: the bytes for a circuit that its client has not taken."""
        jogs = [(record, job) for record in records for job in self.of(record)]
        numbers = {job.number for _, job in jogs}
        self._asked_at = {number: at for number, at in self._asked_at.items() if number in numbers}
        self._look_at_circuits({job.circuit: None for _, job in jogs}, waiting, now)
        ends = []
        for record, job in jogs:
            asked_at = self._asked_at.setdefault(job.number, now)
            if now >= asked_at + self.longest_s:
                ends.append((record, job.circuit, f"nobody has put it to 1 again for {self.longest_s:g} s (--longest-jog-s)"))
            elif now > self._waits_since.get(job.circuit, now) + UNREAD_S:
                ends.append((record, job.circuit, f"its client has taken nothing for {UNREAD_S:g} s"))
        return ends

    def _look_at_circuits(self, circuits: dict[Any, None], waiting: Any, now: float) -> None:
        self._waits_since = {circuit: since for circuit, since in self._waits_since.items() if circuit in circuits}
        for circuit in circuits:
            if waiting(circuit) == 0:
                self._waits_since.pop(circuit, None)
            else:
                self._waits_since.setdefault(circuit, now)
