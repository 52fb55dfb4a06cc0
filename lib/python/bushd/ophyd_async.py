# mypy: allow-subclassing-any, allow-untyped-decorators
# mypy: disable-error-code="import, misc, no-any-return, type-arg"
"""Devices for Bluesky, of ophyd-async, over the control socket:

    from bushd.ophyd_async import Daemon, Motor

    daemon = Daemon()
    with init_devices():
        theta = Motor(daemon, "theta")
        phi = Motor(daemon, "phi")
    RE(grid_scan([detector], theta, 0, 1, 11, phi, 0, 2, 21))

Motors that a plan sets together start together: they are one request of the daemon. What the daemon refuses, and what ends before its
target, fails the plan with the daemon's reason. A position that is not known is not read: that raises UntrustedPosition.

This module needs ophyd-async and bluesky: `pip install 'bushd[ophyd]'`. The rest of bushd does not need it.
"""

from __future__ import annotations

import asyncio
import dataclasses
from collections.abc import AsyncIterator, Iterable, Mapping, Sequence
from typing import Any

from ophyd_async.core import (
    AsyncStatus,
    Device,
    DeviceConnector,
    DeviceMap,
    NotConnectedError,
    WatchableAsyncStatus,
    WatcherUpdate,
)

from . import aio, model
from .devices import Daemon, Step, UntrustedPosition, trusted
from .errors import BushdError
from .motion import Motion
from .requests import Rows

Readings = dict[str, Any]  # as bluesky's protocols have them: by name {"value": ..., "timestamp": ...}
DataKeys = dict[str, Any]
Targets = Mapping[str, float] | Sequence[float]


class _Connector(DeviceConnector):
    """Looks whether the daemon is there and has these motors."""

    def __init__(self, daemon: Daemon, names: Sequence[str]) -> None:
        self._daemon = daemon
        self._names = names

    async def connect_mock(self, device: Any, mock: Any) -> None:
        raise NotImplementedError("bushd's devices have no mock: let bushsim simulate their MCUs")

    async def connect_real(self, device: Any, timeout: float, force_reconnect: bool) -> None:
        try:
            async with asyncio.timeout(timeout):
                for name in self._names:
                    await self._daemon.motor(name)
        except (BushdError, TimeoutError) as error:
            raise NotConnectedError(str(error) or f"no answer of bushd within {timeout:g} s") from error


class Motor(Device):
    """A motor: readable, movable with progress, locatable, stoppable.

    motor: its name in bushd.toml; its unit is that of the daemon.
    name: of the device and its readings; by default the variable's in `init_devices()`.
    uncertain: moves it, and reads its position with an alarm, also while that is uncertain.
    """

    def __init__(self, daemon: Daemon, motor: str, name: str = "", *, uncertain: bool = False) -> None:
        self.motor = motor
        self._daemon = daemon
        self._uncertain = uncertain
        super().__init__(name=name, connector=_Connector(daemon, [motor]))

    @property
    def hints(self) -> dict[str, Any]:
        return {"fields": [self.name]}

    async def read(self) -> Readings:
        """The position now. Raises UntrustedPosition."""
        status = await self._daemon.status()
        return self._reading(status)

    async def describe(self) -> DataKeys:
        return _data_key(self.name, await self._daemon.motor(self.motor))

    async def read_configuration(self) -> Readings:
        """What the position is worth, and the table by which it moves."""
        status = await self._daemon.status()
        motor = status[self.motor]
        table = f"{motor.table.name}@{motor.table.revision} {motor.table.hash}" if motor.table.name else ""
        said = {"trust": motor.trust.value, "table": table, "steps_per_unit": motor.steps_per_unit}
        return {f"{self.name}-{key}": {"value": value, "timestamp": status.at.timestamp()} for key, value in said.items()}

    async def describe_configuration(self) -> DataKeys:
        source = f"bushd://{self.motor}"
        keys = ("trust", "table", "steps_per_unit")
        return {f"{self.name}-{key}": {"source": source, "dtype": "string", "shape": []} for key in keys}

    async def locate(self) -> dict[str, float]:
        """Where it is to stand in the end, and where it stands. Raises UntrustedPosition."""
        motor = trusted(await self._daemon.motor(self.motor), self._uncertain)
        assert motor.position is not None and motor.target is not None
        return {"setpoint": motor.target, "readback": motor.position}

    async def check_value(self, value: float) -> None:
        """Raises Refused if such a move would be: soft limits and all else that the daemon checks."""
        await (await self._daemon.client()).plan(self.motor, to=float(value))

    def set(self, value: float, timeout: float | None = None) -> WatchableAsyncStatus[float]:
        """Moves it, together with the motors that are set beside it.

        timeout: in seconds, for the whole motion; then it is stopped. Without, the daemon tells when it has ended.
        """
        target = float(value)
        step = self._daemon.set({self.motor: target}, self._uncertain)
        return WatchableAsyncStatus(self._updates(step, target, timeout), name=self.name)

    async def stop(self, success: bool = False) -> None:
        """Ramps it down. With `success`, as the RunEngine does when it pauses and at each end: only what this program moves, all that was set together at once."""
        await (self._daemon.stop_own(self.motor) if success else self._daemon.stop(self.motor))

    async def _updates(self, step: Step, target: float, timeout: float | None) -> AsyncIterator[WatcherUpdate[float]]:
        async for motor in self._daemon.progress(step, self.motor, timeout_s=timeout):
            before = step.before[self.motor].position
            if motor.position is None or before is None:
                continue
            yield WatcherUpdate(
                current=motor.position,
                initial=before,
                target=target,
                name=self.name,
                unit=motor.unit,
                precision=motor.precision,
            )

    def _reading(self, status: model.Status) -> Readings:
        motor = trusted(status[self.motor], self._uncertain)
        reading: dict[str, Any] = {"value": motor.position, "timestamp": status.at.timestamp(), "alarm_severity": 0}
        if motor.trust is model.Trust.UNCERTAIN:
            reading |= {"alarm_severity": 2, "message": motor.uncertain_reason}
        return {self.name: reading}


class PseudoAxis(Motor):
    """A pseudo-axis of bushd.toml. It is as trusted as the least trusted of its motors; all that a motor does it does as well."""


class MotorGroup(DeviceMap):
    """Some motors as one device: `group["theta"]` is the motor, and a plan sets and reads all of them at once.

        slits = MotorGroup(daemon, ["left", "right"])
        RE(bps.mv(slits, {"left": -1.0, "right": 1.0}))    # or slits, (-1.0, 1.0)

    Motors of a plan need no group to start together. A group is read by one question.
    """

    def __init__(self, daemon: Daemon, motors: Sequence[str], name: str = "", *, uncertain: bool = False) -> None:
        self._daemon = daemon
        self._uncertain = uncertain
        self._names = list(motors)
        super().__init__({motor: Motor(daemon, motor, uncertain=uncertain) for motor in motors}, name=name)

    @property
    def hints(self) -> dict[str, Any]:
        return {"fields": [device.name for device in self.values()]}

    async def read(self) -> Readings:
        status = await self._daemon.status()
        return _merged(device._reading(status) for device in self.values())

    async def describe(self) -> DataKeys:
        status = await self._daemon.status()
        return _merged(_data_key(device.name, status[device.motor]) for device in self.values())

    async def read_configuration(self) -> Readings:
        return _merged([await device.read_configuration() for device in self.values()])

    async def describe_configuration(self) -> DataKeys:
        return _merged([await device.describe_configuration() for device in self.values()])

    async def locate(self) -> dict[str, dict[str, float]]:
        at = {motor: await device.locate() for motor, device in self.items()}
        return {what: {motor: one[what] for motor, one in at.items()} for what in ("setpoint", "readback")}

    def set(self, value: Targets, timeout: float | None = None) -> WatchableAsyncStatus[float]:
        """Moves the motors that are named, or all of them in their order."""
        targets = self._targets(value)
        return self._watched(self._daemon.set(targets, self._uncertain), targets, timeout)

    async def stop(self, success: bool = False) -> None:
        await (self._daemon.stop_own(*self._names) if success else self._daemon.stop(*self._names))

    def _targets(self, value: Targets) -> dict[str, float]:
        if not isinstance(value, Mapping):
            value = dict(zip(self._names, value, strict=True))
        unknown = value.keys() - set(self._names)
        if unknown or not value:
            raise ValueError(f"{self.name}: {', '.join(sorted(unknown)) or 'no motor'} is not one of {', '.join(self._names)}")
        return {motor: float(target) for motor, target in value.items()}

    def _watched(self, step: Step, targets: Mapping[str, float], timeout: float | None) -> WatchableAsyncStatus[float]:
        """Its progress is that of the first motor."""
        return WatchableAsyncStatus(self._updates(step, targets, timeout), name=self.name)

    async def _updates(
        self, step: Step, targets: Mapping[str, float], timeout: float | None
    ) -> AsyncIterator[WatcherUpdate[float]]:
        first = next(iter(targets))
        async for motor in self._daemon.progress(step, *targets, timeout_s=timeout):
            before = step.before[first].position
            if motor.position is not None and before is not None:
                yield WatcherUpdate(motor.position, before, targets[first], name=first, unit=motor.unit, precision=motor.precision)


class Line(MotorGroup):
    """Motors of one bus that go straight: at any moment each has made the same share of its way.

    speed: no motor exceeds it, each in its own unit per second. duration_s: a line does not take less.
    law: "leading", or "elementary": one motor makes one step at a time. feed: not exceeded along the way, per second in the unit
    that the motors share. All may be changed.
    """

    def __init__(
        self,
        daemon: Daemon,
        motors: Sequence[str],
        name: str = "",
        *,
        speed: float | None = None,
        duration_s: float | None = None,
        law: str = "leading",
        feed: float | None = None,
        uncertain: bool = False,
    ) -> None:
        self.speed = speed
        self.duration_s = duration_s
        self.law = law
        self.feed = feed
        super().__init__(daemon, motors, name, uncertain=uncertain)

    def set(self, value: Targets, timeout: float | None = None) -> WatchableAsyncStatus[float]:
        targets, speed, duration_s = self._targets(value), self.speed, self.duration_s
        law, feed = self.law, self.feed

        async def begin(client: aio.Client) -> Motion:
            return await client.move_line(targets, speed=speed, duration_s=duration_s, law=law, feed=feed, wait=False)

        return self._watched(self._daemon.begin(targets, begin, self._uncertain), targets, timeout)


@dataclasses.dataclass(frozen=True)
class Pulses:
    """Pulses of the position compare output of the motor's MCU, whenever the motor arrives at the position."""

    motor: str
    position: float
    positive: bool = True  # by steps in this direction
    negative: bool = True
    delay_us: int = 0  # from the step to the pulse
    width_us: int = 10

    async def set(self, client: aio.Client) -> None:
        await client.position_compare(
            self.motor,
            self.position,
            positive=self.positive,
            negative=self.negative,
            delay_us=self.delay_us,
            width_us=self.width_us,
        )

    async def take_back(self, client: aio.Client) -> None:
        await client.position_compare(self.motor, self.position, positive=False, negative=False)


@dataclasses.dataclass(frozen=True)
class Path:
    """From point to point by one run, as of `bushd.Client.move_path()`."""

    motors: Sequence[str]
    rows: Rows  # points, of which the first is where it begins
    exact: bool = False
    speed: float | None = None
    pulses: Pulses | None = None

    async def begin(self, client: aio.Client) -> Motion:
        _, *points = self.rows
        return await client.move_path(self.motors, points, exact=self.exact, speed=self.speed, wait=False)


@dataclasses.dataclass(frozen=True)
class Trajectory:
    """Positions in time, as of `bushd.Client.follow()`."""

    motors: Sequence[str]
    time_s: Sequence[float]
    rows: Rows  # the first is where it begins
    cubic: bool = False
    stretch: float = 1.0
    pulses: Pulses | None = None

    async def begin(self, client: aio.Client) -> Motion:
        return await client.follow(
            self.motors, self.time_s, self.rows, cubic=self.cubic, stretch=self.stretch, wait=False
        )


class PathFlyer(Device):
    """Flies a path: `prepare(flyer, Path(...))` moves to its first point, checks the rest and sets the pulses; `kickoff` begins it; it is
    `complete` once all motors stand at the last point. `collect` has one event, with the positions of that.

    Its motors may be those of other devices. Pulses are taken back when the flight is over, however it ended.
    """

    def __init__(self, daemon: Daemon, name: str = "", *, uncertain: bool = False) -> None:
        self._daemon = daemon
        self._uncertain = uncertain
        self._prepared: Path | Trajectory | None = None
        self._path: Path | Trajectory | None = None  # flown last, or under way
        self._flight: Step | None = None
        self._pulses: Pulses | None = None  # that are set
        self._flown: model.Status | None = None  # when all motors stood at the last point
        super().__init__(name=name, connector=_Connector(daemon, []))

    @AsyncStatus.wrap
    async def prepare(self, value: Path | Trajectory) -> None:
        """Raises what the daemon says of the path before anything moves along it."""
        await self.stop(success=True)
        rows = _rows(value)
        start = dict(zip(value.motors, rows[0], strict=True))
        self._flight = self._daemon.set(start, self._uncertain)
        await _over(self._daemon, self._flight)
        client = await self._daemon.client()
        if isinstance(value, Path):
            await client.plan_path(value.motors, rows[1:], exact=value.exact, speed=value.speed)
        if value.pulses is not None:
            self._pulses = value.pulses
            await value.pulses.set(client)
        self._prepared = value

    @AsyncStatus.wrap
    async def kickoff(self) -> None:
        """Done once the daemon has accepted it. Each flight is prepared anew: one that was stopped does not go on from where it is."""
        value, self._prepared = self._prepared, None
        if value is None:
            raise RuntimeError(f"{self.name}: prepare it with a Path or a Trajectory before each kickoff")
        rows = _rows(value)
        self._path, self._flown = value, None
        end = dict(zip(value.motors, rows[-1]))
        self._flight = self._daemon.begin(end, value.begin, self._uncertain)
        await self._flight.accepted.wait()
        if self._flight.task.done():
            self._flight.check(value.motors[0])

    def complete(self) -> WatchableAsyncStatus[float]:
        return WatchableAsyncStatus(self._completed(), name=self.name)

    async def _completed(self) -> AsyncIterator[WatcherUpdate[float]]:
        flight, path = self._flight, self._path
        if flight is None or path is None:
            raise RuntimeError(f"{self.name}: it was not kicked off")
        try:
            first = path.motors[0]
            async for motor in self._daemon.progress(flight, *path.motors):
                before = flight.before[first].position
                if motor.position is not None and before is not None:
                    yield WatcherUpdate(motor.position, before, flight.targets[first], name=first, unit=motor.unit)
            if (await flight.task) is not None and not flight.pardoned:
                self._flown = await self._daemon.status()
        finally:
            await self._take_pulses_back()

    async def describe_collect(self) -> dict[str, DataKeys]:
        status = await self._daemon.status()
        names = self._path.motors if self._path is not None else []
        return {self.name: _merged(_data_key(f"{self.name}-{name}", status[name]) for name in names)}

    async def collect(self) -> AsyncIterator[dict[str, Any]]:
        """One event, of a flight that came to its end. One that is under way is stopped: so the RunEngine ends what it has begun."""
        if self._flown is None or self._path is None:
            await self.stop(success=True)
            return
        status, self._flown = self._flown, None
        keys = {f"{self.name}-{name}": trusted(status[name], self._uncertain).position for name in self._path.motors}
        at = status.at.timestamp()
        yield {"time": at, "data": keys, "timestamps": dict.fromkeys(keys, at)}

    async def pause(self) -> None:
        """The RunEngine pauses: what is under way ramps down, and is to be prepared anew."""
        await self.stop(success=True)

    @AsyncStatus.wrap
    async def stage(self) -> None:
        await self.stop(success=True)

    @AsyncStatus.wrap
    async def unstage(self) -> None:
        await self.stop(success=True)

    async def stop(self, success: bool = False) -> None:
        """Ramps down what it has begun; nothing, if nothing is under way."""
        self._prepared = None
        flight = self._flight
        if flight is not None and not flight.task.done():
            names = list(flight.targets)
            await (self._daemon.stop_own(*names) if success else self._daemon.stop(*names))
        await self._take_pulses_back()

    async def _take_pulses_back(self) -> None:
        if self._pulses is not None:
            await self._pulses.take_back(await self._daemon.client())
            self._pulses = None


async def _over(daemon: Daemon, step: Step) -> None:
    async for _ in daemon.progress(step, *step.targets):
        pass


def _rows(value: Path | Trajectory) -> list[list[float]]:
    rows = [[float(position) for position in row] for row in value.rows]
    if len(rows) < 2:
        raise ValueError("a path has at least two points; the first is where it begins")
    return rows


def _merged(parts: Iterable[dict[str, Any]]) -> dict[str, Any]:
    return {key: value for part in parts for key, value in part.items()}


def _data_key(key: str, motor: model.Motor) -> DataKeys:
    said: dict[str, Any] = {"source": f"bushd://{motor.name}", "dtype": "number", "shape": [], "dtype_numpy": "<f8"}
    said |= {"units": motor.unit, "precision": motor.precision}
    if motor.soft_limits is not None:
        low, high = motor.soft_limits
        said["limits"] = {"control": {"low": low, "high": high}}
    return {key: said}


__all__ = ["Daemon", "Line", "Motor", "MotorGroup", "Path", "PathFlyer", "PseudoAxis", "Pulses", "Trajectory", "UntrustedPosition"]
