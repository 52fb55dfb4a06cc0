"""Motions of the client for asyncio."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Literal, overload

from . import arguments, model, requests
from .arguments import Amount
from .asks import Asks
from .motion import Jog, Motion
from .requests import Fields, Names, Rows, ask, line, motor_amounts, trigger, way, with_duration, with_speed


class Moving(Asks):
    """What moves motors, and what ends that."""

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
        """Moves motors; those on one bus start in the same tick.

            client.move("theta", to=12.5)                   # to a position
            client.move("theta", by=-400, unit="steps")     # by a distance
            client.move({"theta": 12.5, "phi": -3.0})       # several, to positions
            client.move(by={"theta": 1.0, "phi": 1.0})

        to, by: within +-(2^31 - 1) steps, and within the motor's soft limits; the nearest step counts. A distance
            counts from the target that a motor which moves was given; it is refused while the motor jogs or is paused.
        speed: not to be exceeded, above 0; without: as fast as table and `max_speed` of the motor allow.
        wait: False returns a `Motion` as soon as the daemon has accepted the move.

        A motor that moves is given a new target. Raises MoveFailed if a motor has not reached its target.
        """
        wanted = await self._amounts(motors, to, by, unit)
        return await self._moved([ask("MOVE", **way(**wanted.how, speed=speed))], list(wanted.values), wait, check)

    async def plan(
        self,
        motors: str | Mapping[str, float] | None = None,
        *,
        to: Amount | None = None,
        by: Amount | None = None,
        unit: str | None = None,
        speed: float | None = None,
    ) -> model.MovePlan:
        """What such a `move()` would be: how long, how fast, how much of the bus. Nothing moves; of motors at rest."""
        wanted = await self._amounts(motors, to, by, unit)
        return await self._planned([ask("MOVE", **way(**wanted.how, speed=speed), dry_run=True)])

    @overload
    async def move_line(self, motors: Mapping[str, float] | None = None, *, to: Mapping[str, float] | None = None,
                        by: Mapping[str, float] | None = None, unit: str | None = None, speed: float | None = None,
                        duration_s: float | None = None, law: str = "leading", feed: float | None = None,
                        wait: Literal[True] = True, check: bool = True) -> model.MoveResult: ...
    @overload
    async def move_line(self, motors: Mapping[str, float] | None = None, *, to: Mapping[str, float] | None = None,
                        by: Mapping[str, float] | None = None, unit: str | None = None, speed: float | None = None,
                        duration_s: float | None = None, law: str = "leading", feed: float | None = None,
                        wait: Literal[False], check: bool = True) -> Motion: ...
    async def move_line(
        self,
        motors: Mapping[str, float] | None = None,
        *,
        to: Mapping[str, float] | None = None,
        by: Mapping[str, float] | None = None,
        unit: str | None = None,
        speed: float | None = None,
        duration_s: float | None = None,
        law: str = "leading",
        feed: float | None = None,
        wait: bool = True,
        check: bool = True,
    ) -> model.MoveResult | Motion:
        """Moves motors of one bus along a straight line: at any moment each has made the same share of its way.

            client.move_line({"theta": 2.0, "phi": -0.5})      # to positions
            client.move_line(by={"theta": 10.0, "phi": 4.0}, duration_s=30)

        speed: no motor exceeds it, each in its own unit.
        duration_s: not shorter than this; refused where the motors cannot be so slow, or so quick.
        law: "elementary", of motors of one MCU: one motor makes one step at a time. Otherwise the motor with most
            steps leads, and the others step with it.
        feed: along the way, not to be exceeded, per second in the unit that the motors share; by the elementary law
            that of elementary steps.
        All else as of `move()`.
        """
        wanted = await self._amounts(motors, to, by, unit)
        request = ask("MOVE_LINE", **line(**wanted.how, speed=speed, duration_s=duration_s, law=law, feed=feed))
        return await self._moved([request], list(wanted.values), wait, check)

    async def plan_line(
        self,
        motors: Mapping[str, float] | None = None,
        *,
        to: Mapping[str, float] | None = None,
        by: Mapping[str, float] | None = None,
        unit: str | None = None,
        speed: float | None = None,
        duration_s: float | None = None,
        law: str = "leading",
        feed: float | None = None,
    ) -> model.MovePlan:
        """What such a `move_line()` would be. Nothing moves; of motors at rest."""
        wanted = await self._amounts(motors, to, by, unit)
        return await self._planned([ask("MOVE_LINE", **line(**wanted.how, speed=speed, duration_s=duration_s, law=law, feed=feed), dry_run=True)])

    @overload
    async def move_path(self, motors: Names, points: Rows, *, exact: bool = False, speed: float | None = None,
                        speeds: Iterable[float] = (), feed: float | None = None, in_steps: bool = False,
                        wait: Literal[True] = True, check: bool = True) -> model.MoveResult: ...
    @overload
    async def move_path(self, motors: Names, points: Rows, *, exact: bool = False, speed: float | None = None,
                        speeds: Iterable[float] = (), feed: float | None = None, in_steps: bool = False,
                        wait: Literal[False], check: bool = True) -> Motion: ...
    async def move_path(
        self,
        motors: Names,
        points: Rows,
        *,
        exact: bool = False,
        speed: float | None = None,
        speeds: Iterable[float] = (),
        feed: float | None = None,
        in_steps: bool = False,
        wait: bool = True,
        check: bool = True,
    ) -> model.MoveResult | Motion:
        """Moves motors of one bus, at rest, from point to point by one run.

            client.move_path(["x", "y"], [(0.5, 0.0), (1.0, 0.3), (1.0, 2.0)])

        points: 1 to 100000, each with a position of every motor in its unit, on the user's scale.
        exact: rest at each point; otherwise points are passed at speeds at which no motor jumps by more than it
            starts with from rest.
        speed: no motor exceeds it, per second, each in its own unit, with `in_steps` in steps.
        speeds: of a single motor: not exceeded on the way to that point; 0: none. As many as points, or none.
        feed: along the way, not to be exceeded, per second in the unit that the motors share, with `in_steps` in steps.
        All else as of `move()`. A part that the daemon refuses raises Refused, and nothing has moved.
        """
        names = list(motors)
        how: Fields = {"exact": exact, "speed": speed, "speeds": speeds, "feed": feed, "in_steps": in_steps}
        parts = requests.move_path(names, points, **how)
        return await self._moved(parts, names, wait, check)

    async def plan_path(
        self,
        motors: Names,
        points: Rows,
        *,
        exact: bool = False,
        speed: float | None = None,
        speeds: Iterable[float] = (),
        feed: float | None = None,
        in_steps: bool = False,
    ) -> model.MovePlan:
        """What such a `move_path()` would be, with the time at which each point is reached. Nothing moves."""
        how: Fields = {"exact": exact, "in_steps": in_steps, "dry_run": True}
        return await self._planned(requests.move_path(motors, points, speed=speed, speeds=speeds, feed=feed, **how))

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
        """Motors of one bus, at rest, follow positions in time (a fly scan).

            client.follow(["theta"], [0.0, 1.0, 2.5], [(0.0,), (4.0,), (10.0,)])

        time_s: each later than the one before, below 10^8.
        positions: a row for each time, with a position of every motor in its unit, on the user's scale; the first
            row is where the motors stand.
        cubic: between rows (Hermite); else linear.
        stretch: all times are so many times as long, 0.001..1000.

        All rows are checked before anything moves: RequestFailed names the first row and motor that cannot be
        followed, and the least stretch that would do. Waiting and results as of `move()`.
        """
        names = list(motors)
        self._trajectories += 1
        parts = requests.follow(names, time_s, positions, array=self._trajectories, cubic=cubic, stretch=stretch)
        return await self._moved(parts, names, wait, check)

    async def check_follow(
        self, motors: Names, time_s: Iterable[float], positions: Rows, *, cubic: bool = False, stretch: float = 1.0
    ) -> None:
        """Whether such a `follow()` would be accepted, from wherever the motors stand then. Nothing moves.

        Raises RequestFailed for what cannot be followed, and Refused, both as `follow()`.
        """
        self._trajectories += 1
        array = self._trajectories
        for part in requests.follow(list(motors), time_s, positions, array=array, cubic=cubic, stretch=stretch)[:-1]:
            await self._ask(part)

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
        """Finds the home switches of these motors, at rest; those of one MCU one after the other.

        all: of all motors that have `home` in bushd.toml, by its `order`; Ctrl-C stops all motors then.
        speed: of the fast approach. Raises MoveFailed if a switch was not found.
        """
        if bool(names) == bool(all):
            raise TypeError("name the motors to home, or write all=True")
        in_steps = await self._in_steps({name: 0.0 for name in names}, unit)
        request = ask("HOME", motors=names, all=all, **with_speed(speed, in_steps))
        return await self._moved([request], list(names), wait, check)

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
        """Lets these motors, at rest, wait for an edge at the trigger input of their MCU, to move by these distances.

        They begin together, three ticks and `delay_us` (50 to 1650000) after the edge. Returns once it is accepted;
        their activity is ARMED as soon as an edge starts them. They wait without an end, also when this program has
        ended; with `while_connected` they are disarmed when this client closes or its program ends (not over LCM).
        """
        in_steps = await self._in_steps(motors, unit)
        how = {**trigger(edge, delay_us, while_connected), **with_speed(speed, in_steps)}
        return await self._accepted(ask("ARM", **how, motors=motor_amounts(motors, in_steps)), list(motors))

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
        """Lets these motors, at rest, wait for an edge at the trigger inputs of their MCUs, to make a line (`move_line()`).

        For MCUs that make the line themselves; refused where they cannot. All else as of `arm()`.
        """
        wanted = await self._amounts(motors, to, by, unit)
        how = {**trigger(edge, delay_us, while_connected), **with_duration(duration_s)}
        return await self._accepted(ask("ARM_LINE", **how, **way(**wanted.how, speed=speed)), list(wanted.values))

    @overload
    async def run_programs(self, *names: str, wait: Literal[True] = True, check: bool = True) -> model.MoveResult: ...
    @overload
    async def run_programs(self, *names: str, wait: Literal[False], check: bool = True) -> Motion: ...
    async def run_programs(self, *names: str, wait: bool = True, check: bool = True) -> model.MoveResult | Motion:
        """Runs programs that were put (at least one), of MCUs of one bus: they begin with the same tick, or none does.

        `stop()`, `pause()` and `resume()` of one of its motors are for the whole program. The reason of the result says at
        which frame each has ended, and why. Waiting and results as of `move()`.
        """
        if not names:
            raise TypeError("name the programs to run")
        listed = (await self._ask(ask("LIST_PROGRAMS", repeatable=True))).detail.programs
        motors = [motor.motor for program in listed if program.program in names for motor in program.motors]
        return await self._moved([ask("RUN_PROGRAMS", programs=names)], motors, wait, check)

    def jog(
        self, name: str, speed: float, *, unit: str | None = None, keepalive_ms: int = 500, check: bool = True
    ) -> Jog:
        """Lets a motor move on, up to its soft limit, while a block runs:

            with client.jog("theta", 2.0) as jog:
                ...
                jog.change(-1.0)

        speed: signed, per second. At the end of the block, however it is left, the motor ramps down. So it does when
        this process ends, or is not heard for `keepalive_ms` (50 to 10000).

        The end of the block raises MoveFailed if anything else than the block has ended the jog: its soft limit
        (Outcome.LIMIT), somebody's stop (Outcome.STOPPED).
        """

        async def in_steps() -> bool:
            return await self._in_steps({name: speed}, unit)

        return Jog(self._driver, name, speed, in_steps, keepalive_ms, check)

    async def stop(self, *names: str, wait: bool = True, check: bool = True) -> model.Result | None:
        """Ramps these motors down; none named: all. Returns once they stand (with `wait`)."""
        request = requests.stop(names)
        if wait:
            return await self._result(request, check)
        exchange = self._begin(request)
        await self._driver.until(lambda: exchange.accepted or exchange.over)
        if exchange.error is not None:
            raise exchange.error
        if exchange.outcome is not None and exchange.outcome is not model.Outcome.DONE:
            return arguments.result_of(exchange, check)  # it could not stop all, and says so at once
        return None

    async def emergency_stop(self, *, check: bool = True) -> model.Result:
        """Stops all motors of all buses at once, until `clear()`."""
        return await self._result(ask("EMERGENCY_STOP", repeatable=True), check)
