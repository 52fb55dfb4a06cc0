"""Carries out what a record asks for, by `bushd.aio`, and tells it what has become of that."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable, Coroutine, Hashable
from typing import Any

import bushd
import bushd.aio
from bushd import model

from . import events, motor
from .deferred import Waiting
from .events import End
from .people import People
from .record import Record
from .tasks import Tasks, loop_time
from .turns import Turn, Turns

LOG = logging.getLogger("bushd-epics")
JOG_IS_LOOKED_AT_S = 0.02
NEVER_BEGAN = "stopped before it began"
MOTIONS = (events.Home, events.Jog, events.Resume)  # beside moves

ENDS = {
    model.Outcome.DONE: End.REACHED,
    model.Outcome.REACHED: End.REACHED,
    model.Outcome.STOPPED: End.STOPPED,
    model.Outcome.LIMIT: End.LIMIT,
    model.Outcome.LINK: End.LINK,
    model.Outcome.FAULT: End.FAULT,
}

Deliver = Callable[[Record], None]


class Asks:
    """What is asked of the motors of one daemon. `names`: of the motors, by record."""

    def __init__(self, people: People, names: dict[Record, str], deliver: Deliver) -> None:
        self._people = people
        self._names = names
        self._deliver = deliver
        self._turns = Turns()
        self._tasks = Tasks()
        self._jogs: dict[int, bushd.aio.Jog] = {}  # that the daemon has accepted
        self._open_jogs: set[int] = set()  # that were asked for
        self._let_go: set[int] = set()  # of these, those that were ended before they were accepted

    def start(self, record: Record, ask: events.Ask) -> None:
        """For each record in the order in which it is called; a stop overtakes what has not been sent."""
        match ask:
            case events.Move():
                self.start_group([(record, ask)])
            case events.Stop():
                self._tasks.spawn(self._stop_one(record, ask, self._stop([record], _who(ask), lambda client: self._stop_and_look(client, record))))
            case events.EndJog():
                self._tasks.spawn(self._end_jog(record, ask))
            case _:
                if isinstance(ask, events.Jog):
                    self._open_jogs.add(ask.number)
                self._tasks.spawn(self._carry_out(self._turns.take(_who(ask), [record]), record, ask))

    def start_group(self, group: list[Waiting]) -> None:
        """Moves that are asked for as one."""
        self._tasks.spawn(self._move(self._turns.take(_who(group[0][1]), [record for record, _ in group]), group))

    def stop_all(self, who: str) -> asyncio.Task[None]:
        """Raises BushdError when it is awaited."""

        async def stop(client: bushd.aio.Client) -> None:
            await client.stop()

        return self._tasks.spawn(self._stop(list(self._names), who, stop))

    async def finish(self) -> None:
        """Once nothing is under way any more."""
        await self._tasks.finish()

    # -- moves

    async def _move(self, turn: Turn, group: list[Waiting]) -> None:
        who = _who(group[0][1])
        self._people.begin(who)
        try:
            await self._ask_move(turn, who, group)
        except bushd.BushdError as error:
            for record, ask in group:
                self._failed(record, ask, error, turn.was_sent)
        except (TypeError, ValueError) as error:
            for record, ask in group:
                self._tell(record, record.refused, ask.number, str(error))
        except Exception as error:
            for record, ask in group:
                self._fails_itself(record, ask, error)
        finally:
            turn.taken()
            self._people.end(who)

    async def _ask_move(self, turn: Turn, who: str, group: list[Waiting]) -> None:
        await turn.come()
        client = await self._people.client(who)
        for record, ask in [one for one in group if one[0] in turn.stopped]:
            group.remove((record, ask))
            self._tell(record, record.refused, ask.number, NEVER_BEGAN)
        if not group:
            return
        turn.stopped.clear()
        turn.sent()
        targets = {self._names[record]: ask.to for record, ask in group}
        motion = await client.move(targets, speed=group[0][1].speed, wait=False)
        for record, ask in group:
            self._tell(record, record.accepted, ask.number)
        await self._stop_again(turn, client)
        turn.taken()
        result = await motion.wait(check=False)
        await self._move_ended(client, group, result)

    async def _stop_again(self, turn: Turn, client: bushd.aio.Client) -> None:
        """What was sent meanwhile to stop it may have overtaken it."""
        again: set[Hashable] = set()
        while late := turn.stopped - again:
            again |= late
            await client.stop(*sorted(name for record, name in self._names.items() if record in late), wait=False, check=False)

    async def _move_ended(self, client: bushd.aio.Client, group: list[Waiting], result: model.MoveResult) -> None:
        status = None
        if not result.outcome.succeeded:
            status = await status_of(client)
        for record, ask in group:
            one = result[self._names[record]]
            if status is None:
                record.observe(motor.seen_at_end(record.seen, one), loop_time())
            else:
                self._observe(record, status)
            self._tell(record, record.ended, ask.number, ENDS[one.outcome], "" if one.outcome.succeeded else result.reason)

    # -- what ends motions

    def _stop(self, records: list[Record], who: str, send: Callable[[bushd.aio.Client], Awaitable[None]]) -> Coroutine[Any, Any, None]:
        """Over a connection that is ready, whosever: one that has to be made first would let motors go on meanwhile."""
        client, own = self._people.ready(who)
        if client is not None and not own:
            LOG.info("stopped by %s, over another connection", who)
        by = who if own or client is None else None
        self._turns.stop(records, by)
        turn = self._turns.take(by, records)

        async def goes() -> None:
            self._people.begin(who)
            try:
                over = client or await self._people.client(who)
                turn.sent()
                await send(over)
            finally:
                turn.taken()
                self._people.end(who)

        return goes()

    async def _stop_one(self, record: Record, ask: events.Ask, stopping: Coroutine[Any, Any, None]) -> None:
        try:
            await stopping
            self._tell(record, record.ended, ask.number, End.REACHED, "")
        except bushd.RequestFailed as error:
            self._tell(record, record.ended, ask.number, ENDS[error.result.outcome], error.result.reason)
        except bushd.BushdError as error:
            self._failed(record, ask, error, False)
        except Exception as error:
            self._fails_itself(record, ask, error)

    async def _stop_and_look(self, client: bushd.aio.Client, record: Record) -> None:
        await client.stop(self._names[record])
        self._observe(record, await status_of(client))

    async def _end_jog(self, record: Record, ask: events.EndJog) -> None:
        """A jog whose beginning is not answered yet ends as soon as it is, or never begins."""
        try:
            jog = self._jogs.get(ask.jog)
            if jog is not None:
                await jog.end()
            elif ask.jog in self._open_jogs:
                self._let_go.add(ask.jog)
            self._tell(record, record.ended, ask.number, End.REACHED, "")
        except bushd.BushdError as error:
            self._failed(record, ask, error, True)
        except Exception as error:
            self._fails_itself(record, ask, error)

    # -- all else

    async def _carry_out(self, turn: Turn, record: Record, ask: events.Ask) -> None:
        who = _who(ask)
        self._people.begin(who)
        try:
            await turn.come()
            client = await self._people.client(who)
            if isinstance(ask, MOTIONS) and record in turn.stopped:
                return self._tell(record, record.refused, ask.number, NEVER_BEGAN)
            if ask.number in self._let_go:
                return self._tell(record, record.ended, ask.number, End.STOPPED, "")
            turn.stopped.clear()
            turn.sent()
            try:
                outcome, reason = await self._ask(turn, client, record, ask)
            except bushd.RequestFailed as error:
                outcome, reason = ENDS[error.result.outcome], error.result.reason
            turn.taken()
            self._observe(record, await status_of(client))
            self._tell(record, record.ended, ask.number, outcome, reason)
        except bushd.BushdError as error:
            self._failed(record, ask, error, turn.was_sent)
        except (TypeError, ValueError) as error:
            self._tell(record, record.refused, ask.number, str(error))
        except Exception as error:
            self._fails_itself(record, ask, error)
        finally:
            self._open_jogs.discard(ask.number)
            self._let_go.discard(ask.number)
            turn.taken()
            self._people.end(who)

    async def _ask(self, turn: Turn, client: bushd.aio.Client, record: Record, ask: events.Ask) -> tuple[str, str]:
        name = self._names[record]
        match ask:
            case events.Jog():
                return await self._jog(turn, client, record, name, ask)
            case events.Home():
                motion = await client.home(name, speed=ask.speed, wait=False)
                self._tell(record, record.accepted, ask.number)
                await self._stop_again(turn, client)
                turn.taken()
                return _end_of(await motion.wait(check=False), name)
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

    async def _jog(self, turn: Turn, client: bushd.aio.Client, record: Record, name: str, ask: events.Jog) -> tuple[str, str]:
        """Its signs of life are this process's; `EndJog` comes when the client has gone."""
        jog = await client.jog(name, ask.speed, check=False).begin()
        self._jogs[ask.number] = jog
        try:
            self._tell(record, record.accepted, ask.number)
            if turn.stopped or ask.number in self._let_go:
                await jog.end()
            turn.taken()
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

    def _fails_itself(self, record: Record, ask: events.Ask, error: Exception) -> None:
        """A fault of the bridge: who has put is answered nevertheless."""
        LOG.error("%s: what was asked for is given up", record.name, exc_info=error)
        self._tell(record, record.lost, ask.number, f"bushd-epics has failed: {error}")

    def _observe(self, record: Record, status: model.Status | None) -> None:
        name = self._names[record]
        if status is not None and name in status.motors:
            record.observe(motor.seen(status.motors[name]), loop_time())

    def _tell(self, record: Record, told: Callable[..., None], *what: Any) -> None:
        told(*what, loop_time())
        self._deliver(record)


def _end_of(result: model.MoveResult, name: str) -> tuple[str, str]:
    outcome = next((one.outcome for one in result if one.motor == name), result.outcome)
    return ENDS[outcome], "" if outcome.succeeded else result.reason


async def status_of(client: bushd.aio.Client) -> model.Status | None:
    """As it is now; None where nobody answers, which the watch will tell as well."""
    try:
        return await client.status()
    except bushd.BushdError:
        return None


def _who(ask: events.Ask) -> str:
    return str(ask.who or "bushd-epics")
