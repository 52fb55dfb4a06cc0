"""Carries out what a record asks for, by `bushd.aio`, and tells it what has become of that."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from typing import Any

import bushd
import bushd.aio
from bushd import model

from . import events, motor
from .deferred import Waiting
from .events import End
from .people import People
from .record import Record

LOG = logging.getLogger("bushd-epics")
JOG_IS_LOOKED_AT_S = 0.02

_ENDS = {
    model.Outcome.DONE: End.REACHED,
    model.Outcome.REACHED: End.REACHED,
    model.Outcome.STOPPED: End.STOPPED,
    model.Outcome.LIMIT: End.LIMIT,
    model.Outcome.LINK: End.LINK,
    model.Outcome.FAULT: End.FAULT,
}

Deliver = Callable[[Record], None]


class Asks:
    """Of the motors of one daemon. `names`: of the motors, by record."""

    def __init__(self, people: People, names: dict[Record, str], deliver: Deliver) -> None:
        self._people = people
        self._names = names
        self._deliver = deliver
        self._tasks: set[asyncio.Task[None]] = set()
        self._jogs: dict[int, bushd.aio.Jog] = {}

    def start(self, record: Record, ask: events.Ask) -> None:
        """In the order in which they are asked for: each is sent before its task first waits."""
        if isinstance(ask, events.Move):
            self.start_group([(record, ask)])
        else:
            self._spawn(self._carry_out(record, ask))

    def start_group(self, group: list[Waiting]) -> None:
        self._spawn(self._move(group))

    async def finish(self) -> None:
        """Once nothing is under way any more."""
        if self._tasks:
            await asyncio.wait(set(self._tasks))

    def _spawn(self, coroutine: Any) -> None:
        task = asyncio.get_running_loop().create_task(coroutine)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    # -- moves

    async def _move(self, group: list[Waiting]) -> None:
        who = _who(group[0][1])
        self._people.begin(who)
        try:
            await self._ask_move(who, group)
        finally:
            self._people.end(who)

    async def _ask_move(self, who: str, group: list[Waiting]) -> None:
        targets = {self._names[record]: ask.to for record, ask in group}
        sent = False
        try:
            client = await self._people.client(who)
            sent = True
            motion = await client.move(targets, speed=group[0][1].speed, wait=False)
        except bushd.BushdError as error:
            for record, ask in group:
                self._failed(record, ask, error, sent)
            return
        except (TypeError, ValueError) as error:
            for record, ask in group:
                self._tell(record, record.refused, ask.number, str(error))
            return
        for record, ask in group:
            self._tell(record, record.accepted, ask.number)
        try:
            result = await motion.wait(check=False)
        except bushd.BushdError as error:
            for record, ask in group:
                self._failed(record, ask, error, True)
            return
        await self._move_ended(client, group, result)

    async def _move_ended(self, client: bushd.aio.Client, group: list[Waiting], result: model.MoveResult) -> None:
        status = None
        if not result.outcome.succeeded:
            status = await _status(client)
        for record, ask in group:
            one = result[self._names[record]]
            if status is None:
                record.observe(motor.seen_at_end(record.seen, one), _now())
            else:
                self._observe(record, status)
            self._tell(record, record.ended, ask.number, _ENDS[one.outcome], "" if one.outcome.succeeded else result.reason)

    # -- all else

    async def _carry_out(self, record: Record, ask: events.Ask) -> None:
        who = _who(ask)
        self._people.begin(who)
        sent = False
        try:
            client = await self._people.client(who)
            sent = True
            outcome, reason = await self._ask(client, record, ask)
            self._observe(record, await _status(client))
            self._tell(record, record.ended, ask.number, outcome, reason)
        except bushd.RequestFailed as error:
            self._observe(record, await _status(client))
            self._tell(record, record.ended, ask.number, _ENDS[error.result.outcome], error.result.reason)
        except bushd.BushdError as error:
            self._failed(record, ask, error, sent)
        except (TypeError, ValueError) as error:
            self._tell(record, record.refused, ask.number, str(error))
        finally:
            self._people.end(who)

    async def _ask(self, client: bushd.aio.Client, record: Record, ask: events.Ask) -> tuple[str, str]:
        name = self._names[record]
        match ask:
            case events.Jog():
                return await self._jog(client, record, name, ask)
            case events.EndJog():
                if ask.jog in self._jogs:
                    await self._jogs[ask.jog].end()
            case events.Home():
                motion = await client.home(name, speed=ask.speed, wait=False)
                self._tell(record, record.accepted, ask.number)
                return _end_of(await motion.wait(check=False), name)
            case events.Stop():
                await client.stop(name)
            case events.Pause():
                await client.pause(name)
            case events.Resume():
                await client.resume(name)
            case events.SetPosition():
                await client.set_position({name: ask.to}, dial=ask.dial)
            case events.Configure():
                await client.config(name, **dict(ask.changes))
            case events.Enable():
                await (client.enable(name) if ask.on else client.disable(name))
            case events.Hold():
                await (client.hold(name) if ask.on else client.release(name))
        return End.REACHED, ""

    async def _jog(self, client: bushd.aio.Client, record: Record, name: str, ask: events.Jog) -> tuple[str, str]:
        """Its signs of life are this process's; `EndJog` comes when the client has gone."""
        jog = await client.jog(name, ask.speed, check=False).begin()
        self._jogs[ask.number] = jog
        try:
            self._tell(record, record.accepted, ask.number)
            while not jog.done:
                await asyncio.sleep(JOG_IS_LOOKED_AT_S)
            return _end_of(jog.result, name)
        finally:
            del self._jogs[ask.number]

    # -- what is told

    def _failed(self, record: Record, ask: events.Ask, error: bushd.BushdError, sent: bool) -> None:
        """What was never sent is as good as refused; of what was sent nobody knows, unless the daemon says so."""
        lost = sent and not isinstance(error, bushd.Refused)
        LOG.warning("%s: %s", record.name, error)
        self._tell(record, record.lost if lost else record.refused, ask.number, str(error))

    def _observe(self, record: Record, status: model.Status | None) -> None:
        name = self._names[record]
        if status is not None and name in status.motors:
            record.observe(motor.seen(status.motors[name]), _now())

    def _tell(self, record: Record, told: Callable[..., None], *what: Any) -> None:
        told(*what, _now())
        self._deliver(record)


def _end_of(result: model.MoveResult, name: str) -> tuple[str, str]:
    outcome = next((one.outcome for one in result if one.motor == name), result.outcome)
    return _ENDS[outcome], "" if outcome.succeeded else result.reason


async def _status(client: bushd.aio.Client) -> model.Status | None:
    """As it is now; None where nobody answers, which the watch will tell as well."""
    try:
        return await client.status()
    except bushd.BushdError:
        return None


def _who(ask: events.Ask) -> str:
    return str(ask.who or "bushd-epics")


def _now() -> float:
    return asyncio.get_running_loop().time()
