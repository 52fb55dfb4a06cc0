"""Motions under way, for asyncio: what waits for one, and what ends it."""

from __future__ import annotations

import asyncio
import types
from collections.abc import Awaitable, Callable

from . import arguments, model, requests
from .driver import Driver
from .errors import BushdError
from .session import Exchange, Request


async def finish(driver: Driver, exchange: Exchange, ending: Request | None = None) -> None:
    """Until it is over. Cancelled meanwhile, it is ended by `ending`, if it moves motors, and waited for."""
    try:
        await driver.until(lambda: exchange.over)
    except asyncio.CancelledError:
        if ending is not None:
            await end(driver, exchange, ending)
        raise
    finally:
        driver.session.abandon(exchange)


async def end(driver: Driver, exchange: Exchange, ending: Request) -> None:
    """Ends it by this request, and waits until it is over, or cannot be ended."""
    if not exchange.sent:
        return driver.session.abandon(exchange)
    # Before it is accepted, what is to end it might be carried out first.
    await driver.until(lambda: exchange.accepted or exchange.over)
    if exchange.over:
        return
    stopping = driver.session.begin(ending, driver.now())
    try:
        await driver.until(lambda: exchange.over or stopping.error is not None)
    finally:
        driver.session.abandon(stopping)


class Motion:
    """A motion under way, of `move(..., wait=False)`, of `home()` and `run_programs()` with it, of `arm()` and `arm_line()`."""

    def __init__(self, driver: Driver, exchange: Exchange, names: list[str]) -> None:
        self._driver = driver
        self._exchange = exchange
        self._names = names

    @property
    def done(self) -> bool:
        """It has ended, in whatever way; `wait()` returns at once."""
        return self._exchange.over

    async def accepted(self) -> Motion:
        """Once the daemon has accepted it. Raises Refused, NoDaemon, TwoDaemons."""
        exchange = self._exchange
        try:
            await self._driver.until(lambda: exchange.accepted or exchange.over)
        except asyncio.CancelledError:
            await end(self._driver, exchange, requests.stop(self._names))
            raise
        if exchange.error is not None:
            raise exchange.error
        return self

    async def wait(self, *, check: bool = True) -> model.MoveResult:
        """Its result, once all motors stand. Cancelled, it ramps them down. Raises MoveFailed, ResultUnknown."""
        await finish(self._driver, self._exchange, requests.stop(self._names))
        return arguments.move_result_of(self._exchange, check)

    async def stop(self) -> model.MoveResult:
        """Ramps its motors down. Returns the result once they stand."""
        await end(self._driver, self._exchange, requests.stop(self._names))
        return await self.wait(check=False)


class Jog:
    """A motor that moves on, of `Client.jog()`."""

    def __init__(
        self,
        driver: Driver,
        name: str,
        speed: float,
        in_steps: Callable[[], Awaitable[bool]],
        keepalive_ms: int,
        check: bool,
    ) -> None:
        self._driver = driver
        self._name = name
        self._speed = speed
        self._find_unit = in_steps
        self._in_steps = False
        self._keepalive_ms = keepalive_ms
        self._check = check
        self._exchange: Exchange | None = None
        self._timer: asyncio.TimerHandle | None = None

    @property
    def done(self) -> bool:
        """The motor has come to its soft limit, or somebody else has ended the jog, or its link is gone."""
        return self._exchange is not None and self._exchange.over

    @property
    def result(self) -> model.MoveResult:
        """How it has ended, once it is done. Raises ResultUnknown, NoDaemon."""
        if self._exchange is None or not self._exchange.over:
            raise BushdError(f"{self._name}: the jog has not ended")
        return arguments.move_result_of(self._exchange, check=False)

    async def begin(self) -> Jog:
        """Returns once the daemon has accepted it."""
        self._in_steps = await self._find_unit()
        driver = self._driver
        exchange = self._exchange = driver.session.begin(self._request(self._speed), driver.now())
        try:
            await driver.until(lambda: exchange.accepted or exchange.over)
        except asyncio.CancelledError:
            await end(driver, exchange, self._request(0.0))
            raise
        if exchange.error is not None:
            raise exchange.error
        self._renew()
        return self

    async def change(self, speed: float) -> None:
        """Another speed, signed; the motor slows down, speeds up, or ramps down and comes back. Raises Refused."""
        if self.done:
            raise BushdError(f"{self._name}: the jog has ended: {self.result.reason}")
        exchange = self._driver.session.begin(self._request(speed), self._driver.now())
        await finish(self._driver, exchange)
        arguments.result_of(exchange, check=True)

    async def end(self, *, steps_after: int | None = None) -> model.MoveResult:
        """Ramps the motor down, or lets it end so many steps (0 to 2^31 - 1) on. Returns once it stands."""
        exchange = self._exchange
        if exchange is None:
            raise BushdError(f"{self._name}: the jog has not begun")
        self._let_go()
        await end(self._driver, exchange, self._request(0.0, steps_after))
        self._driver.session.abandon(exchange)
        return self.result

    async def __aenter__(self) -> Jog:
        return await self.begin()

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: types.TracebackType | None
    ) -> None:
        if error is not None:
            # What has gone wrong in the block is told. Without signs of life the motor ramps down in any case.
            try:
                await self.end()
            except BushdError:
                pass
            return
        await self.end()
        assert self._exchange is not None
        arguments.move_result_of(self._exchange, self._check)

    def _request(self, speed: float, steps_after: int | None = None) -> Request:
        return requests.jog(
            self._name, speed, in_steps=self._in_steps, keepalive_ms=self._keepalive_ms, steps_after=steps_after
        )

    def _renew(self) -> None:
        exchange = self._exchange
        if exchange is None or exchange.over:
            return
        renewal = requests.renew_jog(self._name, keepalive_ms=self._keepalive_ms)
        self._driver.send(self._driver.session.once(renewal, exchange.session))
        self._timer = self._driver.loop.call_later(self._keepalive_ms / 3000, self._renew)

    def _let_go(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
