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
from .flights import Flights
from .people import People, connect
from .record import Record
from .tasks import loop_time

LOG = logging.getLogger("bushd-epics")

TELLS_EVERY_S = 0.1  # 10 Hz a field
AGAIN_AFTER_S = 0.25
GONE = "not in bushd.toml any more"
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
        self._people = People(lambda program: connect(socket, program))
        self.records: dict[str, Record] = {}  # by motor
        self._names: dict[Record, str] = {}
        self._last: dict[str, model.Motor] = {}
        self._speeds_of: dict[str, Any] = {}
        self._timers: dict[Record, asyncio.TimerHandle] = {}
        self._asks = Asks(self._people, self._names, self.deliver)
        self.flights = Flights(self._people, self.records, self.deliver)
        self.deferred = Deferred()
        self._heard_at = 0.0
        self._silent = False
        self.appeared = asyncio.Event()  # all motors, with their speeds
        self.told = asyncio.Event()  # that, or why not
        self.why = ""  # nothing is heard of it; "": it is

    async def run(self) -> None:
        """Until it is cancelled, or a part of it has ended: then positions that are shown may be old."""
        try:
            async with asyncio.TaskGroup() as parts:
                parts.create_task(self._watch_silence())
                parts.create_task(self._keep_following())
        finally:
            await self._people.close()

    async def _keep_following(self) -> None:
        while True:
            try:
                await self._follow()
                self.why = ""
            except bushd.BushdError as error:
                if str(error) != self.why:
                    LOG.warning("%s", error)
                await self._lose(str(error))
            except Exception as error:
                LOG.exception("what bushd has told cannot be shown")
                await self._lose(f"bushd-epics has failed: {error}")
            await asyncio.sleep(AGAIN_AFTER_S)

    async def _lose(self, why: str) -> None:
        self.why = why
        self._fall_silent(why)
        self.told.set()
        await self._people.close()

    async def _follow(self) -> None:
        client = await connect(self._socket, "bushd-epics")
        looking: asyncio.Task[None] | None = None
        async with client:
            self._people.spare = client
            self._speeds_of.clear()
            look_at = float("-inf")
            try:
                async for status in client.watch(TELLS_EVERY_S):
                    now = loop_time()
                    self._heard_at = now
                    self._take(status, now)
                    if now >= look_at and (looking is None or looking.done()):
                        look_at = now + LOOKS_AT_SPEEDS_EVERY_S
                        looking = asyncio.create_task(self._look_at_speeds(client, status))
            finally:
                self._people.spare = None
                if looking is not None:
                    looking.cancel()

    def _take(self, status: model.Status, now: float) -> None:
        self._silent = False
        for name, told in status.motors.items():
            record = self.records.get(name)
            if record is None:
                record = self._add(name, is_axis=status.mcus[told.mcu].address == 0)
            elif _same(self._last.get(name), told) and not record.silent and not record.has_late_state:
                continue
            self._last[name] = told
            if record is not None:
                record.observe(motor.seen(told), now)
                self._shown.held(record, told.held)
                self.deliver(record)
                self.flights.look(record)
        for name in self.records.keys() - status.motors.keys():
            self._last.pop(name, None)
            self._silence(self.records[name], GONE)

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
            if self.records and not self._silent and loop_time() > self._heard_at + SILENT_AFTER_S:
                self._fall_silent(f"bushd has not been heard for {SILENT_AFTER_S:g} s")

    def _fall_silent(self, why: str) -> None:
        self._silent = True
        for record in self.records.values():
            self._silence(record, why)

    def _silence(self, record: Record, why: str) -> None:
        if record.silent != why:
            record.fall_silent(why, loop_time())
            self.deliver(record)

    # -- speeds

    async def _look_at_speeds(self, client: bushd.aio.Client, status: model.Status) -> None:
        """Beside the states: many motors have many tables, and positions do not wait for these."""
        try:
            await self._ask_speeds(client, status)
        except bushd.BushdError as error:
            LOG.warning("how fast motors go is not known: %s", error)
        except Exception:
            LOG.exception("how fast motors go is not known")
        if not self.appeared.is_set():
            LOG.info("%d motors and axes", len(self.records))
            self.appeared.set()
            self.told.set()

    async def _ask_speeds(self, client: bushd.aio.Client, status: model.Status) -> None:
        """Tables and settings of motors; of axes what a move of them would be."""
        configuration = await client.config()
        entries = await client.tables.list()
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
                if record.is_axis:
                    speeds = await self._axis_speeds(client, told)
                else:
                    speeds = await self._motor_speeds(client, told, entries, limit, share)
            except bushd.BushdError as error:
                LOG.warning("%s: how fast it goes is not known: %s", record.name, error)
                continue
            self._speeds_of[name] = key
            record.speeds(speeds)
            self.deliver(record)

    @staticmethod
    async def _motor_speeds(
        client: bushd.aio.Client, told: model.Motor, entries: tuple[model.TableEntry, ...], limit: str, share: str
    ) -> Speeds:
        name = f"{told.table.name}@{told.table.revision}" if told.table.revision else told.table.name
        table = await client.tables.get(name)
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
                record.ended(before.number, End.STOPPED, "", loop_time())
            return
        if isinstance(ask, events.Stop):
            self._drop_deferred(record)
        self._asks.start(record, ask)

    def _drop_deferred(self, record: Record) -> None:
        dropped = self.deferred.drop(record)
        if dropped is not None:
            record.refused(dropped.number, "stopped before the deferred moves began", loop_time())

    def defer(self, on: bool) -> None:
        self.deferred.on = on
        if not on:
            for group in self.deferred.let_go():
                self._asks.start_group(group)

    async def stop_all(self, who: str) -> None:
        """The daemon first; then what records still have in mind."""
        stopping = self._asks.stop_all(who)
        self.flights.no_more()
        for record in self.records.values():
            self._drop_deferred(record)
            record.halt(who, loop_time())
            self.deliver(record)
        await stopping

    def _set_timer(self, record: Record) -> None:
        wake_at = record.wake_at()
        if wake_at is None and record not in self._timers:  # as nearly always
            return
        timer = self._timers.pop(record, None)
        if timer is not None:
            timer.cancel()
        if wake_at is not None:
            loop = asyncio.get_running_loop()
            self._timers[record] = loop.call_at(wake_at, self._tick, record)

    def _tick(self, record: Record) -> None:
        self._timers.pop(record, None)
        record.tick(loop_time())
        self.deliver(record)


def _same(before: model.Motor | None, told: model.Motor) -> bool:
    return before is told or before == told
