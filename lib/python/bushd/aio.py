"""The client for asyncio: `async with bushd.aio.connect() as client: await client.move("theta", to=4.0)`.

Functions, arguments, results and errors are those of `bushd.Client`, which describes them; here they are coroutines.
Any number of them may run at the same time. A task that is cancelled while it waits for a motion ramps the motors down,
waits until they stand, and is cancelled then; one that is cancelled again does not wait.
"""

from __future__ import annotations

import asyncio
import os
import types
from collections.abc import AsyncIterator, Awaitable, Callable, Generator, Iterable, Mapping
from typing import Literal, TypeVar, overload

from . import arguments, model, requests
from .arguments import Amount
from .driver import Driver
from .errors import NoDaemon
from .links import DEFAULT_PREFIX, Link, open_link
from .motion import Jog, Motion, finish
from .requests import Names, Rows
from .session import Exchange, Request, Session, StatusQuery, Timing
from .status import StatusCollector

T = TypeVar("T")

KEEP: object = object()  # of config(): leave the setting as it is


class Connecting:
    """What `connect()` returns: to be awaited, or entered by `async with`."""

    def __init__(self, opens: Callable[[], Awaitable[Client]]) -> None:
        self._opens = opens
        self._client: Client | None = None

    def __await__(self) -> Generator[object, None, Client]:
        return self._opens().__await__()

    async def __aenter__(self) -> Client:
        self._client = await self
        return self._client

    async def __aexit__(self, *_: object) -> None:
        if self._client is not None:
            await self._client.close()


def connect(
    socket: str | os.PathLike[str] | None = None,
    *,
    lcm: bool | str = False,
    prefix: str = DEFAULT_PREFIX,
    program: str | None = None,
    timing: Timing = Timing(),
) -> Connecting:
    """As `bushd.connect()`: `client = await connect()`, or `async with connect() as client:`."""

    async def opens() -> Client:
        return Client(open_link(socket, lcm, prefix), arguments.client_id(program), prefix, timing)

    return Connecting(opens)


class Client:
    """As `bushd.Client`, for asyncio. Of one loop."""

    def __init__(self, link: Link, client_id: str, prefix: str = DEFAULT_PREFIX, timing: Timing = Timing()) -> None:
        session = Session(client_id, loses=link.loses, remedy=link.remedy, prefix=prefix, timing=timing)
        self._timing = timing
        self._driver = Driver(link, session)
        self.tables = Tables(self)
        self._arrays = 0  # numbers of those that it has told

    @property
    def id(self) -> str:
        """The name by which the daemon knows this client, in results, history and logs."""
        return self._driver.session.client_id

    async def close(self) -> None:
        self._driver.close()

    async def __aenter__(self) -> Client:
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: types.TracebackType | None
    ) -> None:
        await self.close()

    # -- where motors are

    async def status(self, timeout_s: float = 3.0) -> model.Status:
        return (await self._query(timeout_s)).status()

    async def health(self, timeout_s: float = 3.0) -> dict[str, model.BusHealth]:
        return (await self._query(timeout_s)).health()

    @overload
    async def where(self) -> dict[str, model.Motor]: ...
    @overload
    async def where(self, name: str) -> model.Motor: ...
    async def where(self, name: str | None = None) -> dict[str, model.Motor] | model.Motor:
        status = await self.status()
        return dict(status.motors) if name is None else arguments.find(status, name)

    async def watch(self, every_s: float = 0.1) -> AsyncIterator[model.Status]:
        collector = StatusCollector()
        self._driver.subscribe(collector)
        try:
            await self._query(self._timing.answer_within_s)
            while True:
                seen = collector.states_heard
                yield collector.status()
                await asyncio.sleep(every_s)
                await self._hear(collector, seen)
        finally:
            self._driver.unsubscribe(collector)

    # -- motion

    @overload
    async def move(self, motors: str | Mapping[str, float] | None = None, *, to: Amount | None = None,
                   by: Amount | None = None, unit: str | None = None, speed: float | None = None,
                   wait: Literal[True] = True, check: bool = True) -> model.MoveResult: ...
    @overload
    async def move(self, motors: str | Mapping[str, float] | None = None, *, to: Amount | None = None,
                   by: Amount | None = None, unit: str | None = None, speed: float | None = None,
                   wait: Literal[False], check: bool = True) -> Motion: ...
    async def move(
        self,
        motors: str | Mapping[str, float] | None = None,
        *,
        to: Amount | None = None,
        by: Amount | None = None,
        unit: str | None = None,
        speed: float | None = None,
        wait: bool = True,
        check: bool = True,
    ) -> model.MoveResult | Motion:
        wanted = await self._amounts(motors, to, by, unit)
        request = requests.move(wanted.values, absolute=wanted.absolute, in_steps=wanted.in_steps, speed=speed)
        motion = self._motion(request, list(wanted.values))
        return await motion.wait(check=check) if wait else await motion.accepted()

    @overload
    async def move_line(self, motors: Mapping[str, float] | None = None, *, to: Mapping[str, float] | None = None,
                        by: Mapping[str, float] | None = None, unit: str | None = None, speed: float | None = None,
                        duration_s: float | None = None, wait: Literal[True] = True,
                        check: bool = True) -> model.MoveResult: ...
    @overload
    async def move_line(self, motors: Mapping[str, float] | None = None, *, to: Mapping[str, float] | None = None,
                        by: Mapping[str, float] | None = None, unit: str | None = None, speed: float | None = None,
                        duration_s: float | None = None, wait: Literal[False], check: bool = True) -> Motion: ...
    async def move_line(
        self,
        motors: Mapping[str, float] | None = None,
        *,
        to: Mapping[str, float] | None = None,
        by: Mapping[str, float] | None = None,
        unit: str | None = None,
        speed: float | None = None,
        duration_s: float | None = None,
        wait: bool = True,
        check: bool = True,
    ) -> model.MoveResult | Motion:
        wanted = await self._amounts(motors, to, by, unit)
        request = requests.move_line(
            wanted.values, absolute=wanted.absolute, in_steps=wanted.in_steps, speed=speed, duration_s=duration_s
        )
        motion = self._motion(request, list(wanted.values))
        return await motion.wait(check=check) if wait else await motion.accepted()

    async def plan_line(
        self,
        motors: Mapping[str, float] | None = None,
        *,
        to: Mapping[str, float] | None = None,
        by: Mapping[str, float] | None = None,
        unit: str | None = None,
        speed: float | None = None,
        duration_s: float | None = None,
    ) -> model.MovePlan:
        wanted = await self._amounts(motors, to, by, unit)
        request = requests.move_line(
            wanted.values,
            absolute=wanted.absolute,
            in_steps=wanted.in_steps,
            speed=speed,
            duration_s=duration_s,
            dry_run=True,
        )
        return _there((await self._ask(request)).detail.plan)

    @overload
    async def move_path(self, motors: Names, points: Rows, *, exact: bool = False, speed: float | None = None,
                  speeds: Iterable[float] = (), in_steps: bool = False, wait: Literal[True] = True,
                  check: bool = True) -> model.MoveResult: ...
    @overload
    async def move_path(self, motors: Names, points: Rows, *, exact: bool = False, speed: float | None = None,
                  speeds: Iterable[float] = (), in_steps: bool = False, wait: Literal[False],
                  check: bool = True) -> Motion: ...
    async def move_path(
        self,
        motors: Names,
        points: Rows,
        *,
        exact: bool = False,
        speed: float | None = None,
        speeds: Iterable[float] = (),
        in_steps: bool = False,
        wait: bool = True,
        check: bool = True,
    ) -> model.MoveResult | Motion:
        names = list(motors)
        *before, last = requests.move_path(
            names, points, exact=exact, speed=speed, speeds=speeds, in_steps=in_steps
        )
        for part in before:
            await self._ask(part)
        motion = self._motion(last, names)
        return await motion.wait(check=check) if wait else await motion.accepted()

    async def plan_path(
        self,
        motors: Names,
        points: Rows,
        *,
        exact: bool = False,
        speed: float | None = None,
        speeds: Iterable[float] = (),
        in_steps: bool = False,
    ) -> model.MovePlan:
        parts = requests.move_path(
            motors, points, exact=exact, speed=speed, speeds=speeds, in_steps=in_steps, dry_run=True
        )
        for part in parts:
            exchange = await self._ask(part)
        return _there(exchange.detail.plan)

    @overload
    async def follow(self, motors: Names, time_s: Iterable[float], positions: Rows, *, cubic: bool = False,
               stretch: float = 1.0, wait: Literal[True] = True, check: bool = True) -> model.MoveResult: ...
    @overload
    async def follow(self, motors: Names, time_s: Iterable[float], positions: Rows, *, cubic: bool = False,
               stretch: float = 1.0, wait: Literal[False], check: bool = True) -> Motion: ...
    async def follow(
        self,
        motors: Names,
        time_s: Iterable[float],
        positions: Rows,
        *,
        cubic: bool = False,
        stretch: float = 1.0,
        wait: bool = True,
        check: bool = True,
    ) -> model.MoveResult | Motion:
        names = list(motors)
        self._arrays += 1
        *rows, run = requests.follow(names, time_s, positions, array=self._arrays, cubic=cubic, stretch=stretch)
        for part in rows:
            await self._ask(part)
        motion = self._motion(run, names)
        return await motion.wait(check=check) if wait else await motion.accepted()

    async def plan(
        self,
        motors: str | Mapping[str, float] | None = None,
        *,
        to: Amount | None = None,
        by: Amount | None = None,
        unit: str | None = None,
        speed: float | None = None,
    ) -> model.MovePlan:
        wanted = await self._amounts(motors, to, by, unit)
        exchange = await self._ask(
            requests.move(
                wanted.values, absolute=wanted.absolute, in_steps=wanted.in_steps, speed=speed, dry_run=True
            )
        )
        return _there(exchange.detail.plan)

    @overload
    async def home(self, *names: str, all: bool = False, speed: float | None = None, unit: str | None = None,
                   wait: Literal[True] = True, check: bool = True) -> model.MoveResult: ...
    @overload
    async def home(self, *names: str, all: bool = False, speed: float | None = None, unit: str | None = None,
                   wait: Literal[False], check: bool = True) -> Motion: ...
    async def home(
        self,
        *names: str,
        all: bool = False,
        speed: float | None = None,
        unit: str | None = None,
        wait: bool = True,
        check: bool = True,
    ) -> model.MoveResult | Motion:
        if bool(names) == bool(all):
            raise TypeError("name the motors to home, or write all=True")
        in_steps = await self._in_steps({name: 0.0 for name in names}, unit)
        motion = self._motion(requests.home(names, every=all, speed=speed, in_steps=in_steps), list(names))
        return await motion.wait(check=check) if wait else await motion.accepted()

    async def arm(
        self,
        motors: Mapping[str, float],
        *,
        unit: str | None = None,
        edge: Literal["rising", "falling"] = "rising",
        delay_us: int = 50,
        speed: float | None = None,
        while_connected: bool = False,
    ) -> Motion:
        in_steps = await self._in_steps(motors, unit)
        request = requests.arm(
            motors,
            in_steps=in_steps,
            edge=edge,
            delay_us=delay_us,
            speed=speed,
            while_connected=while_connected,
        )
        return await self._motion(request, list(motors)).accepted()

    async def arm_line(
        self,
        motors: Mapping[str, float] | None = None,
        *,
        to: Mapping[str, float] | None = None,
        by: Mapping[str, float] | None = None,
        unit: str | None = None,
        edge: Literal["rising", "falling"] = "rising",
        delay_us: int = 50,
        speed: float | None = None,
        duration_s: float | None = None,
        while_connected: bool = False,
    ) -> Motion:
        wanted = await self._amounts(motors, to, by, unit)
        request = requests.arm_line(
            wanted.values,
            absolute=wanted.absolute,
            in_steps=wanted.in_steps,
            edge=edge,
            delay_us=delay_us,
            speed=speed,
            duration_s=duration_s,
            while_connected=while_connected,
        )
        return await self._motion(request, list(wanted.values)).accepted()

    async def disarm(self, *names: str, check: bool = True) -> model.Result:
        return await self._result(requests.of_motors("DISARM", names), check)

    def jog(
        self, name: str, speed: float, *, unit: str | None = None, keepalive_ms: int = 500, check: bool = True
    ) -> Jog:
        async def in_steps() -> bool:
            return await self._in_steps({name: speed}, unit)

        return Jog(self._driver, name, speed, in_steps, keepalive_ms, check)

    async def stop(self, *names: str, wait: bool = True, check: bool = True) -> model.Result | None:
        request = requests.stop(names)
        if wait:
            return await self._result(request, check)
        exchange = self._driver.session.begin(request, self._driver.now())
        await self._driver.until(lambda: exchange.accepted or exchange.over)
        if exchange.error is not None:
            raise exchange.error
        if exchange.outcome is not None and exchange.outcome is not model.Outcome.DONE:
            return arguments.result_of(exchange, check)  # it could not stop all, and says so at once
        return None

    async def emergency_stop(self, *, check: bool = True) -> model.Result:
        return await self._result(requests.emergency_stop(), check)

    async def pause(self, *names: str, check: bool = True) -> model.Result:
        return await self._result(requests.of_motors("PAUSE", names), check)

    async def resume(self, *names: str, check: bool = True) -> model.Result:
        return await self._result(requests.of_motors("RESUME", names), check)

    async def hold(self, *names: str, check: bool = True) -> model.Result:
        return await self._result(requests.of_motors("HOLD", names), check)

    async def release(self, *names: str, check: bool = True) -> model.Result:
        return await self._result(requests.of_motors("RELEASE", names), check)

    # -- positions, drivers, settings

    async def set_position(
        self,
        motors: str | Mapping[str, float],
        position: float | None = None,
        *,
        unit: str | None = None,
        dial: bool = False,
        check: bool = True,
    ) -> model.Result:
        wanted = await self._amounts(motors, position, None, unit)
        request = requests.set_position(wanted.values, in_steps=wanted.in_steps, dial=dial)
        return await self._result(request, check)

    async def confirm(self, *names: str, check: bool = True) -> model.Result:
        return await self._result(requests.of_motors("CONFIRM", names), check)

    async def enable(self, *names: str, check: bool = True) -> model.Result:
        return await self._result(requests.of_motors("ENABLE", names), check)

    async def disable(self, *names: str, check: bool = True) -> model.Result:
        return await self._result(requests.of_motors("DISABLE", names), check)

    async def clear(self, *names: str, check: bool = True) -> model.Result:
        return await self._result(requests.of_motors("CLEAR_FAULTS", names), check)

    async def position_compare(
        self,
        name: str,
        position: float,
        *,
        unit: str | None = None,
        positive: bool = True,
        negative: bool = True,
        delay_us: int = 0,
        width_us: int = 10,
        check: bool = True,
    ) -> model.Result:
        in_steps = await self._in_steps({name: position}, unit)
        request = requests.position_compare(
            name,
            position,
            in_steps=in_steps,
            positive=positive,
            negative=negative,
            delay_us=delay_us,
            width_us=width_us,
        )
        return await self._result(request, check)

    async def config(
        self,
        name: str | None = None,
        *,
        offset: float | object = KEEP,
        direction: str | object = KEEP,
        soft_limits: tuple[float, float] | None | object = KEEP,
        input_active: str | object = KEEP,
        local: bool | object = KEEP,
        keypad: bool | object = KEEP,
        velocity: tuple[int, int, int] | None | object = KEEP,
        currents: tuple[int | str, ...] | None | object = KEEP,
        max_speed: float | None | object = KEEP,
        acceleration: float | object = KEEP,
    ) -> model.Configuration:
        given = {
            "offset": offset,
            "direction": direction,
            "soft_limits": soft_limits,
            "input_active": input_active,
            "local": local,
            "keypad": keypad,
            "velocity": velocity,
            "currents": currents,
            "max_speed": max_speed,
            "acceleration": acceleration,
        }
        changes = {key: value for key, value in given.items() if value is not KEEP}
        if changes and name is None:
            raise TypeError("name the motor whose settings are to change")
        if changes and name is not None:
            request = requests.change_configuration(name, changes)
        else:
            request = requests.show_configuration([] if name is None else [name])
        return _there((await self._ask(request)).detail.configuration)

    async def history(self, name: str, most: int = 20) -> list[model.PastMotion]:
        return list((await self._ask(requests.history(name, most))).detail.motions)

    async def camac(
        self,
        cycles: Iterable[requests.Cycle],
        *,
        crate: int = 1,
        mode: str = "single",
        count: int | None = None,
        last: tuple[int, int] | None = None,
    ) -> model.CamacResult:
        request = requests.camac(cycles, crate=crate, mode=mode, count=count, last=last)
        return _there((await self._ask(request)).detail.camac)

    # -- how

    def _motion(self, request: Request, names: list[str]) -> Motion:
        return Motion(self._driver, self._driver.session.begin(request, self._driver.now()), names)

    async def _ask(self, request: Request, check: bool = True) -> Exchange:
        """Its exchange once it is over, and has succeeded (with `check`)."""
        exchange = self._driver.session.begin(request, self._driver.now())
        await finish(self._driver, exchange)
        arguments.result_of(exchange, check)
        return exchange

    async def _result(self, request: Request, check: bool) -> model.Result:
        return arguments.result_of(await self._ask(request, check), check)

    async def _query(self, timeout_s: float) -> StatusCollector:
        driver = self._driver
        query: StatusQuery = driver.session.begin_status(driver.now(), timeout_s)
        try:
            await driver.until(lambda: query.over)
        finally:
            driver.session.abandon_status(query)
        if query.error is not None:
            raise query.error
        return query.collector

    async def _hear(self, collector: StatusCollector, seen: int) -> None:
        """Until there is a state newer than those that were seen."""
        driver = self._driver
        try:
            async with asyncio.timeout(self._timing.silence_limit_s):
                await driver.until(
                    lambda: driver.session.ended is not None
                    or (collector.states_heard != seen and collector.has_motors())
                )
        except TimeoutError:
            raise NoDaemon(driver.link.remedy) from None
        if driver.session.ended is not None:
            raise NoDaemon(driver.session.ended)

    async def _amounts(
        self, motors: str | Mapping[str, float] | None, to: Amount | None, by: Amount | None, unit: str | None
    ) -> arguments.Amounts:
        wanted = arguments.amounts(motors, to, by, unit)
        await self._in_steps(wanted.values, unit)
        return wanted

    async def _in_steps(self, values: Mapping[str, float], unit: str | None) -> bool:
        """Whether these are steps; where a unit is written, it must be that of the motors."""
        if unit is not None and unit != requests.STEPS:
            arguments.check_unit(arguments.Amounts(values, True, unit), await self.status())
        return unit == requests.STEPS


class Tables:
    """As `bushd.Tables`, for asyncio: `await client.tables.list()`."""

    def __init__(self, client: Client) -> None:
        self._client = client

    async def list(self) -> tuple[model.TableEntry, ...]:
        return (await self._client._ask(requests.list_tables())).detail.entries

    async def get(self, name: str) -> model.Table:
        tables = (await self._client._ask(requests.get_table(name))).detail.tables
        return _there(tables[0] if tables else None)

    async def set(self, name: str, table: model.Table) -> model.TableEntry:
        entries = (await self._client._ask(requests.set_table(name, table))).detail.entries
        return _there(entries[0] if entries else None)

    async def use(self, group: str, table: str, *, check: bool = True) -> model.Result:
        return await self._client._result(requests.use_table(group, table), check)

    async def reload(self, *, check: bool = True) -> model.Result:
        return await self._client._result(requests.reload_tables(), check)


def _there(value: T | None) -> T:
    if value is None:
        raise NoDaemon("the daemon's answer lacks what was asked for: it is of another version")
    return value


__all__ = ["Client", "Connecting", "Jog", "Motion", "Tables", "connect"]
