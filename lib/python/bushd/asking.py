"""What every function of the client for asyncio does: begin a request, wait for it, and look at its answer."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from typing import TypeVar

from . import arguments, model, requests
from .arguments import Amount
from .driver import Driver
from .errors import NoDaemon
from .links import Link
from .motion import Motion, finish
from .session import Exchange, Request, Session, StatusQuery, Timing
from .status import StatusCollector

T = TypeVar("T")


class Asking:
    """Base of the client."""

    def __init__(self, link: Link, client_id: str, prefix: str, timing: Timing) -> None:
        session = Session(client_id, loses=link.loses, remedy=link.remedy, prefix=prefix, timing=timing)
        self._timing = timing
        self._driver = Driver(link, session)
        self._trajectories = 0  # numbers of those that it has told

    def _begin(self, request: Request) -> Exchange:
        return self._driver.session.begin(request, self._driver.now())

    async def _ask(self, request: Request, check: bool = True) -> Exchange:
        """Its exchange once it is over, and has succeeded (with `check`)."""
        exchange = self._begin(request)
        await finish(self._driver, exchange)
        arguments.result_of(exchange, check)
        return exchange

    async def _result(self, request: Request, check: bool) -> model.Result:
        return arguments.result_of(await self._ask(request, check), check)

    async def _accepted(self, request: Request, names: list[str]) -> Motion:
        return await Motion(self._driver, self._begin(request), names).accepted()

    async def _moved(self, parts: list[Request], names: list[str], wait: bool, check: bool) -> model.MoveResult | Motion:
        """The last of the parts begins the motion."""
        for part in parts[:-1]:
            await self._ask(part)
        motion = Motion(self._driver, self._begin(parts[-1]), names)
        return await motion.wait(check=check) if wait else await motion.accepted()

    async def _planned(self, parts: list[Request]) -> model.MovePlan:
        for part in parts:
            exchange = await self._ask(part)
        return there(exchange.detail.plan)

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
            status = (await self._query(self._timing.answer_within_s)).status()
            arguments.check_unit(arguments.Amounts(values, True, unit), status)
        return unit == requests.STEPS


def there(value: T | None) -> T:
    if value is None:
        raise NoDaemon("the daemon's answer lacks what was asked for: it is of another version")
    return value
