"""Carries out what profiles, position compares and triggers of one daemon ask for, by `bushd.aio`."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable, Mapping
from typing import Any

import bushd
import bushd.aio
from bushd import model
from bushd.motion import Motion

from . import compare, events, motor, profile, trigger
from .asks import ENDS, NEVER_BEGAN, Deliver, status_of
from .compare import Compare
from .events import End, Seen
from .people import People
from .profile import BadProfile, Profile, Trajectory
from .record import Putter, Record
from .tasks import Tasks, loop_time
from .trigger import Trigger

LOG = logging.getLogger("bushd-epics")
POINTS_ARE_TOLD_EVERY_S = 0.1

Show = Callable[[str, Any], None]  # a field and its value
Work = Callable[[bushd.aio.Client], Awaitable[tuple[str, str]]]  # how it has ended, and why


class Flight:
    def __init__(self, motors: tuple[str, ...]) -> None:
        self.motors = motors
        self.stopped = False  # nothing of it begins any more


class Flights:
    def __init__(self, people: People, records: Mapping[str, Record], deliver: Deliver) -> None:
        """`records`: by motor. `deliver`: what a record has to say."""
        self._people = people
        self._records = records
        self._deliver_record = deliver
        self._under_way: dict[Profile | Trigger, Flight] = {}
        self._shows: dict[Profile | Compare | Trigger, Show] = {}
        self._records_of: dict[Compare | Trigger, Record] = {}
        self._triggers: dict[Record, Trigger] = {}
        self._comparing = asyncio.Lock()  # what was put last holds
        self._tasks = Tasks()

    def add(self, one: Profile, show: Show) -> None:
        self._shows[one] = show

    def add_beside(self, record: Record, one: Compare | Trigger, show: Show) -> None:
        self._records_of[one] = record
        self._shows[one] = show
        if isinstance(one, Trigger):
            self._triggers[record] = one

    def put(self, one: Profile | Compare | Trigger, field: str, value: Any, by: Putter) -> None:
        if isinstance(one, Profile):
            one.put(field, value, by, self._where)
        else:
            one.put(field, value, by)
        self._deliver(one)

    def look(self, record: Record) -> None:
        """Its motor may wait for an edge, or have begun to move by one."""
        one = self._triggers.get(record)
        if one is not None:
            one.see(record.seen)
            self._deliver(one)

    async def finish(self) -> None:
        """Once nothing is under way any more."""
        while self._tasks.any:
            await self._tasks.finish()

    # -- stops

    def flies(self, record: Record) -> bool:
        name = self._motor(record)
        return any(name in flight.motors for flight in self._under_way.values())

    def stop(self, record: Record, by: Putter) -> None:
        """The flights of this record's motor, with all their motors; the put is answered when the daemon has answered."""
        name = self._motor(record)
        flights = [flight for flight in self._under_way.values() if name in flight.motors]
        for flight in flights:
            flight.stopped = True
        motors = sorted({name for flight in flights for name in flight.motors})

        def answer(error: str) -> None:
            if by.token is not None:
                by.token(error)

        self._tasks.spawn(self._stop(motors, str(by.who), answer))

    def no_more(self) -> None:
        """All motors are being stopped: nothing of what flies begins any more."""
        for flight in self._under_way.values():
            flight.stopped = True

    async def _stop(self, motors: list[str], who: str, answer: Callable[[str], None]) -> None:
        """Over a connection that is ready, whosever."""
        self._people.begin(who)
        error = ""
        try:
            client, _ = self._people.ready(who)
            await (client or await self._people.client(who)).stop(*motors)
        except bushd.BushdError as failed:
            error = str(failed)
        except Exception as failed:
            LOG.error("a stop is given up", exc_info=failed)
            error = f"bushd-epics has failed: {failed}"
        finally:
            self._people.end(who)
        answer(error)

    # -- what they ask for

    def _deliver(self, one: Profile | Compare | Trigger) -> None:
        for event in one.take():
            match event:
                case events.Post():
                    self._shows[one](event.field, event.value)
                case events.Done():
                    self._answer(one, event)
                case profile.Check() if isinstance(one, Profile):
                    self._tasks.spawn(self._check(one, event))
                case profile.Fly() if isinstance(one, Profile):
                    # Before anything else has its turn: a stop that comes now ends it.
                    self._under_way[one] = Flight(event.trajectory.motors)
                    self._tasks.spawn(self._fly(one, event))
                case compare.Set() if isinstance(one, Compare):
                    self._tasks.spawn(self._set_compare(one, event))
                case trigger.Arm() if isinstance(one, Trigger):
                    self._under_way[one] = Flight((self._motor(self._records_of[one]),))
                    self._tasks.spawn(self._arm(one, event))
                case profile.Abort() | trigger.Disarm() if not isinstance(one, Compare):
                    self._abort(one, event.by)

    def _answer(self, one: Profile | Compare | Trigger, done: events.Done) -> None:
        """What a profile says names it."""
        if done.error:
            LOG.warning("%s%s", "" if isinstance(one, Profile) else f"{one.name}: ", done.error)
        done.token(done.error)

    def _abort(self, one: Profile | Trigger, by: Putter) -> None:
        flight = self._under_way.get(one)
        if flight is None:
            one.aborted(by)
            return self._deliver(one)
        flight.stopped = True

        def answer(error: str) -> None:
            one.aborted(by, error)
            self._deliver(one)

        self._tasks.spawn(self._stop(list(flight.motors), str(by.who), answer))

    async def _check(self, one: Profile, ask: profile.Check) -> None:
        made = ask.trajectory

        async def asks(client: bushd.aio.Client) -> tuple[str, str]:
            await client.check_follow(made.motors, made.time_s, made.rows, cubic=True)
            return End.REACHED, ""

        end, reason = await self._over(str(ask.who), asks)
        one.checked("" if end == End.REACHED else reason or end)
        self._deliver(one)

    async def _fly(self, one: Profile, ask: profile.Fly) -> None:
        made, flight = ask.trajectory, self._under_way[one]

        async def flies(client: bushd.aio.Client) -> tuple[str, str]:
            async def move() -> Motion:
                return await client.move(dict(zip(made.motors, made.rows[0])), speed=self._speed(made), wait=False)

            async def follow() -> Motion:
                return await client.follow(made.motors, made.time_s, made.rows, cubic=True, wait=False)

            result = await self._leg(flight, client, move)
            if result is not None and result.outcome.succeeded:
                result = await self._leg(flight, client, follow, one)
            return await self._ended(flight, client, result)

        await self._end(one, str(ask.who), flies)

    async def _end(self, one: Profile | Trigger, who: str, work: Work) -> None:
        end, reason = await self._over(who, work)
        flight = self._under_way.pop(one)
        one.over(End.STOPPED if flight.stopped and end != End.REACHED else end, reason)
        self._deliver(one)

    async def _leg(
        self, flight: Flight, client: bushd.aio.Client, begin: Callable[[], Awaitable[Motion]], one: Profile | None = None
    ) -> model.MoveResult | None:
        """None: it never began. `one`: this is what the profile calls its execution."""
        if flight.stopped:
            return None
        motion = await begin()
        if flight.stopped:  # the stop may have overtaken it
            await client.stop(*flight.motors, wait=False, check=False)
        telling = None
        if one is not None:
            one.flying()
            self._deliver(one)
            telling = asyncio.create_task(self._tell_points(one))
        try:
            return await motion.wait(check=False)
        finally:
            if telling is not None:
                telling.cancel()

    async def _ended(self, flight: Flight, client: bushd.aio.Client, result: model.MoveResult | None) -> tuple[str, str]:
        """Who hears of the end has heard where the motors stand."""
        if result is None:
            return End.STOPPED, NEVER_BEGAN
        rest = {one.motor: one for one in result} if result.outcome.succeeded else {}
        status = None if result.outcome.succeeded else await status_of(client)
        at = loop_time()
        for name, record in self._records.items():
            if name in rest:
                record.comes_to_rest(motor.seen_at_end(record.seen, rest[name]), at)
            elif name in flight.motors and status is not None and name in status.motors:
                seen = motor.seen(status.motors[name])
                if seen.moving or seen.busy:
                    record.observe(seen, at)
                else:
                    record.comes_to_rest(seen, at)
            else:
                continue
            self._deliver_record(record)
        return ENDS[result.outcome], "" if result.outcome.succeeded else result.reason

    async def _tell_points(self, one: Profile) -> None:
        began = loop_time()
        while True:
            await asyncio.sleep(POINTS_ARE_TOLD_EVERY_S)
            one.passed(loop_time() - began)
            self._deliver(one)

    async def _over(self, who: str, work: Work) -> tuple[str, str]:
        """Over the connection of this user; how it has ended."""
        self._people.begin(who)
        try:
            return await work(await self._people.client(who))
        except bushd.RequestFailed as error:
            outcome: model.Outcome = error.result.outcome
            return End.FAULT if outcome.succeeded else ENDS[outcome], error.result.reason
        except (bushd.BushdError, TypeError, ValueError) as error:
            return End.FAULT, str(error)
        except Exception as error:
            LOG.error("what was asked for is given up", exc_info=error)
            return End.FAULT, f"bushd-epics has failed: {error}"
        finally:
            self._people.end(who)

    def _speed(self, made: Trajectory) -> float | None:
        """To the first row: a request has one speed, so the least VELO that somebody has set."""
        speeds = [self._records[motor].floor("VELO") for motor in made.motors if motor in self._records]
        return min((speed for speed in speeds if speed is not None), default=None)

    def _where(self, motor: str) -> Seen:
        record = self._records.get(motor)
        if record is None:
            raise BadProfile(f"{motor}: bushd has no motor of this name, or names.toml does not show it")
        if record.is_axis:
            raise BadProfile(f"{motor} is a pseudo-axis; name its motors in [profiles]")
        if record.silent or not record.seen.live:
            raise BadProfile(f"{motor}: {record.silent or 'its MCU is offline'}")
        return record.seen

    def _motor(self, record: Record) -> str:
        return next((motor for motor, other in self._records.items() if other is record), "")

    # -- position compare

    async def _set_compare(self, one: Compare, ask: compare.Set) -> None:
        record = self._records_of[one]

        async def asks(client: bushd.aio.Client) -> tuple[str, str]:
            await client.position_compare(
                self._motor(record), ask.position, positive=ask.on, negative=ask.on, width_us=ask.width_us
            )
            return End.REACHED, ""

        async with self._comparing:
            end, reason = await self._over(str(ask.by.who), asks)
        one.answered(ask, "" if end == End.REACHED else reason or end)
        self._deliver(one)
        if end == End.REACHED and ask.on:
            for other, its in self._records_of.items():
                if isinstance(other, Compare) and its is not record and other.is_on and _mcu(its) == _mcu(record):
                    other.replaced()
                    self._deliver(other)

    # -- triggers

    async def _arm(self, one: Trigger, ask: trigger.Arm) -> None:
        """The daemon disarms it when this process has ended: nobody would be told of the move any more."""
        record, flight = self._records_of[one], self._under_way[one]
        (name,) = flight.motors

        async def waits(client: bushd.aio.Client) -> tuple[str, str]:
            async def arm() -> Motion:
                return await client.arm(
                    {name: ask.distance},
                    edge="falling" if ask.falling else "rising",
                    delay_us=ask.delay_us,
                    speed=record.floor("VELO"),
                    while_connected=True,
                )

            return await self._ended(flight, client, await self._leg(flight, client, arm))

        await self._end(one, str(ask.who), waits)


def _mcu(record: Record) -> str:
    return record.seen.place.partition(" ")[0]
