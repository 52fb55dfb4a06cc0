"""One daemon: its motors as records, kept up to date, and found again whenever it has gone."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from typing import Any, Protocol

import bushd
import bushd.aio
from bushd import model

from . import events, motor
from .asks import Asks
from .deferred import Deferred
from .events import End, Speeds
from .people import People, connect
from .record import Record

LOG = logging.getLogger("bushd-epics")

TELLS_EVERY_S = 0.1  # 10 Hz a field
AGAIN_AFTER_S = 0.25
SILENT_AFTER_S = 2.0  # at rest states come twice a second
LOOKS_AT_SPEEDS_EVERY_S = 10.0


class Shown(Protocol):
    """Where fields are shown, and puts are answered."""

    def post(self, record: Record, event: events.Post) -> None: ...
    def alarm(self, record: Record, event: events.Raise) -> None: ...
    def appear(self, record: Record) -> None: ...
    def held(self, record: Record, held: bool) -> None: ...


class Daemon:
    def __init__(self, socket: str | None, record_name: Callable[[str], str], shown: Shown) -> None:
        """`record_name`: of a motor; "": it is not shown."""
        self._socket = socket
        self._record_name = record_name
        self._shown = shown
        self._people = People(socket)
        self.records: dict[str, Record] = {}  # by motor
        self._names: dict[Record, str] = {}
        self._last: dict[str, model.Motor] = {}
        self._speeds_of: dict[str, Any] = {}
        self._timers: dict[Record, asyncio.TimerHandle] = {}
        self._asks = Asks(self._people, self._names, self.deliver)
        self.deferred = Deferred()
        self._heard_at = 0.0
        self._silent = False
        self.appeared = asyncio.Event()

    async def run(self) -> None:
        """Until it is cancelled."""
        watching = asyncio.create_task(self._watch_silence())
        why = ""
        try:
            while True:
                try:
                    await self._follow()
                except bushd.BushdError as error:
                    if str(error) != why:
                        why = str(error)
                        LOG.warning("%s", why)
                    self._fall_silent(why)
                    await self._people.close()
                else:
                    why = ""
                await asyncio.sleep(AGAIN_AFTER_S)
        finally:
            watching.cancel()
            await self._people.close()

    async def _follow(self) -> None:
        client = await connect(self._socket, "bushd-epics")
        async with client:
            self._speeds_of.clear()
            looked_at = float("-inf")
            async for status in client.watch(TELLS_EVERY_S):
                now = _now()
                self._heard_at = now
                self._take(status, now)
                if now >= looked_at + LOOKS_AT_SPEEDS_EVERY_S:
                    looked_at = now
                    await self._look_at_speeds(client, status)
                if not self.appeared.is_set():
                    LOG.info("%d motors and axes", len(self.records))
                    self.appeared.set()

    def _take(self, status: model.Status, now: float) -> None:
        self._silent = False
        for name, told in status.motors.items():
            record = self.records.get(name)
            if record is None:
                record = self._add(name, is_axis=status.mcus[told.mcu].address == 0)
            elif self._last.get(name) == told and not record.silent and not record.has_late_state:
                continue
            self._last[name] = told
            if record is not None:
                record.observe(motor.seen(told), now)
                self._shown.held(record, told.held)
                self.deliver(record)

    def _add(self, name: str, is_axis: bool) -> Record | None:
        shown_as = self._record_name(name)
        if not shown_as:
            return None
        record = Record(shown_as, is_axis)
        self.records[name] = record
        self._names[record] = name
        self._shown.appear(record)
        return record

    # -- what is heard no more

    async def _watch_silence(self) -> None:
        while True:
            await asyncio.sleep(SILENT_AFTER_S / 4)
            if self.records and not self._silent and _now() > self._heard_at + SILENT_AFTER_S:
                self._fall_silent(f"bushd has not been heard for {SILENT_AFTER_S:g} s")

    def _fall_silent(self, why: str) -> None:
        self._silent = True
        for record in self.records.values():
            record.fall_silent(why, _now())
            self.deliver(record)

    # -- speeds

    async def _look_at_speeds(self, client: bushd.aio.Client, status: model.Status) -> None:
        """Tables and settings of motors; of axes what a move of them would be."""
        configuration = await client.config()
        settings = {(one.motor, one.key): one.value for one in configuration.settings}
        for name, record in self.records.items():
            told = status.motors.get(name)
            if told is None or told.moving:
                continue
            limit, share = settings.get((name, "max_speed"), "none"), settings.get((name, "acceleration"), "1")
            key = (told.table, limit, share, told.steps_per_unit)
            if self._speeds_of.get(name) == key:
                continue
            try:
                speeds = await self._axis_speeds(client, told) if record.is_axis else await self._motor_speeds(client, told, limit, share)
            except bushd.BushdError as error:
                LOG.warning("%s: how fast it goes is not known: %s", record.name, error)
                continue
            self._speeds_of[name] = key
            record.speeds(speeds)
            self.deliver(record)

    async def _motor_speeds(self, client: bushd.aio.Client, told: model.Motor, limit: str, share: str) -> Speeds:
        name = f"{told.table.name}@{told.table.revision}" if told.table.revision else told.table.name
        table = await client.tables.get(name)
        entries = await client.tables.list()
        entry = next(one for one in entries if one.name == table.name)
        step = motor.seen(told).scale.resolution
        return motor.speeds(table, entry, step, None if limit == "none" else float(limit), float(share or 1))

    @staticmethod
    async def _axis_speeds(client: bushd.aio.Client, told: model.Motor) -> Speeds:
        """Not faster than that: the mean of a move to the farther limit, or of a unit's way."""
        low, high = told.soft_limits or (None, None)
        here = told.position or 0.0
        by = 1.0
        if low is not None and high is not None:
            by = (high if high - here > here - low else low) - here
        plan = await client.plan(told.name, by=by)
        return Speeds(top=abs(by) / max(plan.duration_s, 1e-3), least=0.0, ramp_s=0.0)

    # -- what records have to say

    def deliver(self, record: Record) -> None:
        while told := record.take():
            for event in told:
                match event:
                    case events.Post():
                        self._shown.post(record, event)
                    case events.Raise():
                        self._shown.alarm(record, event)
                    case events.Done():
                        event.token(event.error)
                    case events.Log():
                        LOG.warning("%s", event.text)
                    case events.Ask():
                        self._begin(record, event)
        self._set_timer(record)

    def _begin(self, record: Record, ask: events.Ask) -> None:
        if isinstance(ask, events.Move) and self.deferred.on:
            before = self.deferred.take(record, ask)
            if before is not None:
                record.ended(before.number, End.STOPPED, "", _now())
            return
        if isinstance(ask, events.Stop):
            self._drop_deferred(record)
        self._asks.start(record, ask)

    def _drop_deferred(self, record: Record) -> None:
        dropped = self.deferred.drop(record)
        if dropped is not None:
            record.ended(dropped.number, End.STOPPED, "stopped before the deferred moves began", _now())

    def defer(self, on: bool) -> None:
        self.deferred.on = on
        if not on:
            for group in self.deferred.let_go():
                self._asks.start_group(group)

    async def stop_all(self, who: str) -> None:
        client = await self._people.client(who)
        for record in self.records.values():
            self._drop_deferred(record)
            self.deliver(record)
        await client.stop()

    def _set_timer(self, record: Record) -> None:
        timer = self._timers.pop(record, None)
        if timer is not None:
            timer.cancel()
        wake_at = record.wake_at()
        if wake_at is not None:
            loop = asyncio.get_running_loop()
            self._timers[record] = loop.call_at(wake_at, self._tick, record)

    def _tick(self, record: Record) -> None:
        self._timers.pop(record, None)
        record.tick(_now())
        self.deliver(record)



def _now() -> float:
    return asyncio.get_running_loop().time()
