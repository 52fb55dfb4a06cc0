"""The blocking client. It runs the client of `aio` in a thread of its own, so jogs are kept alive and states are read
while the caller does something else."""

from __future__ import annotations

import os
import types
from collections.abc import Iterable, Iterator, Mapping
from typing import Literal, overload

from . import aio, model, requests
from .aio import KEEP
from .arguments import Amount
from .handles import Jog, Motion, Tables
from .links import DEFAULT_PREFIX
from .loop import Loop as _Loop
from .requests import Names, Rows
from .session import Timing


def connect(
    socket: str | os.PathLike[str] | None = None,
    *,
    lcm: bool | str = False,
    prefix: str = DEFAULT_PREFIX,
    program: str | None = None,
    timing: Timing = Timing(),
) -> Client:
    """A client of the daemon: `with bushd.connect() as client: ...`.

    Without arguments: the control socket of this PC ($BUSHD_CONTROL, else /run/bushd/control, else
    $XDG_RUNTIME_DIR/bushd/control). LCM only where this user has no right to that, or where there is none and
    $LCM_DEFAULT_URL is set.

    socket: path of another control socket.
    lcm: True ($LCM_DEFAULT_URL, else on this PC), or a URL such as "udpm://239.255.76.67:7667?ttl=1".
    prefix: of the LCM channels; `[lcm] prefix` in bushd.toml.
    program: begins the name of this client in logs and histories; by default that of the script.

    Raises NoDaemon at once where there is no daemon at the socket, or no network for LCM.
    """

    async def opens() -> aio.Client:
        return await aio.connect(socket, lcm=lcm, prefix=prefix, program=program, timing=timing)

    loop = _Loop()
    try:
        return Client(loop, loop.run(opens()))
    except BaseException:
        loop.close()
        raise


class Client:
    """One client of one daemon. Made by `connect()`; any thread may call it.

    Positions, distances and speeds (per second) are in the motor's unit, on the user's scale. `unit="steps"` makes them
    steps, which must be whole numbers; `unit="mm"` says what is expected: ValueError if a motor has another unit.

    Every request may raise Refused (the daemon refuses it, with the reason; nothing has moved), NoDaemon (no answer),
    ResultUnknown (the daemon has ended or restarted meanwhile), and TwoDaemons (on LCM). One that has not succeeded
    raises RequestFailed, of motions MoveFailed, with the result in it; `check=False` returns that result.

    Ctrl-C while it waits for a motion ramps the motors down, waits until they stand, and raises KeyboardInterrupt; a
    second Ctrl-C does not wait.
    """

    def __init__(self, loop: _Loop, client: aio.Client) -> None:
        self._loop = loop
        self._client = client
        self.tables = Tables(loop, client.tables)

    @property
    def id(self) -> str:
        """The name by which the daemon knows this client, in results, history and logs."""
        return self._client.id

    def close(self) -> None:
        """Jogs of this client ramp down. Moves that were begun with wait=False go on."""
        if not self._loop.closed:
            self._loop.run(self._client.close())
            self._loop.close()

    def __enter__(self) -> Client:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: types.TracebackType | None
    ) -> None:
        self.close()

    # -- where motors are

    @overload
    def where(self) -> dict[str, model.Motor]: ...
    @overload
    def where(self, name: str) -> model.Motor: ...
    def where(self, name: str | None = None) -> dict[str, model.Motor] | model.Motor:
        """The state of this motor, or of all by name: `client.where("theta").position`. Raises UnknownMotor."""
        if name is None:
            return self._loop.run(self._client.where())
        return self._loop.run(self._client.where(name))

    def status(self, timeout_s: float = 3.0) -> model.Status:
        """All motors and MCUs, as they are now. Raises NoDaemon if it is not complete within this time."""
        return self._loop.run(self._client.status(timeout_s))

    def health(self, timeout_s: float = 3.0) -> dict[str, model.BusHealth]:
        """Error counts and latencies of buses and MCUs, by bus."""
        return self._loop.run(self._client.health(timeout_s))

    def watch(self, every_s: float = 0.1) -> Iterator[model.Status]:
        """States as they come, at most one in so many seconds: `for status in client.watch(): ...`.

        20 times a second while a motor moves, else twice. Raises NoDaemon when they cease.
        """
        states = self._client.watch(every_s)
        try:
            while True:
                yield self._loop.run(anext(states))  # type: ignore[arg-type]  # it is a coroutine
        finally:
            if not self._loop.closed:
                self._loop.run(states.aclose())  # type: ignore[attr-defined]

    # -- motion

    @overload
    def move(self, motors: str | Mapping[str, float] | None = None, *, to: Amount | None = None,
             by: Amount | None = None, unit: str | None = None, speed: float | None = None,
             wait: Literal[True] = True, check: bool = True) -> model.MoveResult: ...
    @overload
    def move(self, motors: str | Mapping[str, float] | None = None, *, to: Amount | None = None,
             by: Amount | None = None, unit: str | None = None, speed: float | None = None,
             wait: Literal[False], check: bool = True) -> Motion: ...
    def move(
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
        if not wait:
            begun = self._client.move(motors, to=to, by=by, unit=unit, speed=speed, wait=False)
            return Motion(self._loop, self._loop.run(begun))
        return self._loop.run(self._client.move(motors, to=to, by=by, unit=unit, speed=speed, check=check))

    @overload
    def move_line(self, motors: Mapping[str, float] | None = None, *, to: Mapping[str, float] | None = None,
                  by: Mapping[str, float] | None = None, unit: str | None = None, speed: float | None = None,
                  duration_s: float | None = None, wait: Literal[True] = True,
                  check: bool = True) -> model.MoveResult: ...
    @overload
    def move_line(self, motors: Mapping[str, float] | None = None, *, to: Mapping[str, float] | None = None,
                  by: Mapping[str, float] | None = None, unit: str | None = None, speed: float | None = None,
                  duration_s: float | None = None, wait: Literal[False], check: bool = True) -> Motion: ...
    def move_line(
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
        """Moves motors of one bus along a straight line: at any moment each has made the same share of its way.

            client.move_line({"theta": 2.0, "phi": -0.5})      # to positions
            client.move_line(by={"theta": 10.0, "phi": 4.0}, duration_s=30)

        speed: no motor exceeds it, each in its own unit.
        duration_s: not shorter than this; refused where the motors cannot be so slow, or so quick.
        All else as of `move()`.
        """
        if not wait:
            begun = self._client.move_line(
                motors, to=to, by=by, unit=unit, speed=speed, duration_s=duration_s, wait=False
            )
            return Motion(self._loop, self._loop.run(begun))
        return self._loop.run(
            self._client.move_line(motors, to=to, by=by, unit=unit, speed=speed, duration_s=duration_s, check=check)
        )

    def plan_line(
        self,
        motors: Mapping[str, float] | None = None,
        *,
        to: Mapping[str, float] | None = None,
        by: Mapping[str, float] | None = None,
        unit: str | None = None,
        speed: float | None = None,
        duration_s: float | None = None,
    ) -> model.MovePlan:
        """What such a `move_line()` would be. Nothing moves; of motors at rest."""
        return self._loop.run(
            self._client.plan_line(motors, to=to, by=by, unit=unit, speed=speed, duration_s=duration_s)
        )

    @overload
    def move_path(self, motors: Names, points: Rows, *, exact: bool = False, speed: float | None = None,
                  speeds: Iterable[float] = (), in_steps: bool = False, wait: Literal[True] = True,
                  check: bool = True) -> model.MoveResult: ...
    @overload
    def move_path(self, motors: Names, points: Rows, *, exact: bool = False, speed: float | None = None,
                  speeds: Iterable[float] = (), in_steps: bool = False, wait: Literal[False],
                  check: bool = True) -> Motion: ...
    def move_path(
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
        """Moves motors of one bus, at rest, from point to point by one run.

            client.move_path(["x", "y"], [(0.5, 0.0), (1.0, 0.3), (1.0, 2.0)])

        points: 1 to 100000, each with a position of every motor in its unit, on the user's scale.
        exact: rest at each point; otherwise points are passed at speeds at which no motor jumps by more than it
            starts with from rest.
        speed: no motor exceeds it, per second, each in its own unit, with `in_steps` in steps.
        speeds: of a single motor: not exceeded on the way to that point; 0: none. As many as points, or none.
        All else as of `move()`. A part that the daemon refuses raises Refused, and nothing has moved.
        """
        if not wait:
            begun = self._client.move_path(
                motors, points, exact=exact, speed=speed, speeds=speeds, in_steps=in_steps, wait=False
            )
            return Motion(self._loop, self._loop.run(begun))
        return self._loop.run(
            self._client.move_path(
                motors, points, exact=exact, speed=speed, speeds=speeds, in_steps=in_steps, check=check
            )
        )

    def plan_path(
        self,
        motors: Names,
        points: Rows,
        *,
        exact: bool = False,
        speed: float | None = None,
        speeds: Iterable[float] = (),
        in_steps: bool = False,
    ) -> model.MovePlan:
        """What such a `move_path()` would be, with the time at which each point is reached. Nothing moves."""
        return self._loop.run(
            self._client.plan_path(motors, points, exact=exact, speed=speed, speeds=speeds, in_steps=in_steps)
        )

    @overload
    def follow(self, motors: Names, time_s: Iterable[float], positions: Rows, *, cubic: bool = False,
               stretch: float = 1.0, wait: Literal[True] = True, check: bool = True) -> model.MoveResult: ...
    @overload
    def follow(self, motors: Names, time_s: Iterable[float], positions: Rows, *, cubic: bool = False,
               stretch: float = 1.0, wait: Literal[False], check: bool = True) -> Motion: ...
    def follow(
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
        if not wait:
            begun = self._client.follow(motors, time_s, positions, cubic=cubic, stretch=stretch, wait=False)
            return Motion(self._loop, self._loop.run(begun))
        return self._loop.run(
            self._client.follow(motors, time_s, positions, cubic=cubic, stretch=stretch, check=check)
        )

    def plan(
        self,
        motors: str | Mapping[str, float] | None = None,
        *,
        to: Amount | None = None,
        by: Amount | None = None,
        unit: str | None = None,
        speed: float | None = None,
    ) -> model.MovePlan:
        """What such a `move()` would be: how long, how fast, how much on the line. Nothing moves; of motors at rest."""
        return self._loop.run(self._client.plan(motors, to=to, by=by, unit=unit, speed=speed))

    @overload
    def home(self, *names: str, all: bool = False, speed: float | None = None, unit: str | None = None,
             wait: Literal[True] = True, check: bool = True) -> model.MoveResult: ...
    @overload
    def home(self, *names: str, all: bool = False, speed: float | None = None, unit: str | None = None,
             wait: Literal[False], check: bool = True) -> Motion: ...
    def home(
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
        if not wait:
            begun = self._client.home(*names, all=all, speed=speed, unit=unit, wait=False)
            return Motion(self._loop, self._loop.run(begun))
        return self._loop.run(self._client.home(*names, all=all, speed=speed, unit=unit, check=check))

    def arm(
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
        begun = self._client.arm(
            motors, unit=unit, edge=edge, delay_us=delay_us, speed=speed, while_connected=while_connected
        )
        return Motion(self._loop, self._loop.run(begun))

    def arm_line(
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
        begun = self._client.arm_line(
            motors,
            to=to,
            by=by,
            unit=unit,
            edge=edge,
            delay_us=delay_us,
            speed=speed,
            duration_s=duration_s,
            while_connected=while_connected,
        )
        return Motion(self._loop, self._loop.run(begun))

    def disarm(self, *names: str, check: bool = True) -> model.Result:
        """Ends the wait for the trigger of these motors, and of all armed with them; none named: of all."""
        return self._loop.run(self._client.disarm(*names, check=check))

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
        made = self._loop.call(lambda: self._client.jog(name, speed, unit=unit, keepalive_ms=keepalive_ms, check=check))
        return Jog(self._loop, made)

    def stop(self, *names: str, wait: bool = True, check: bool = True) -> model.Result | None:
        """Ramps these motors down; none named: all. Returns once they stand (with `wait`)."""
        return self._loop.run(self._client.stop(*names, wait=wait, check=check))

    def emergency_stop(self, *, check: bool = True) -> model.Result:
        """Stops all motors of all buses at once, until `clear()`."""
        return self._loop.run(self._client.emergency_stop(check=check))

    def pause(self, *names: str, check: bool = True) -> model.Result:
        """Ramps down these motors, or those of these groups, and keeps their targets; none named: all.

        Their moves stay open until `resume()`, a stop or a new target."""
        return self._loop.run(self._client.pause(*names, check=check))

    def resume(self, *names: str, check: bool = True) -> model.Result:
        """Lets paused motors, or those of these groups, go on to their targets; none named: all."""
        return self._loop.run(self._client.resume(*names, check=check))

    def hold(self, *names: str, check: bool = True) -> model.Result:
        """Refuses motions of these motors or groups (none named: all) until `release()`; what is under way goes on."""
        return self._loop.run(self._client.hold(*names, check=check))

    def release(self, *names: str, check: bool = True) -> model.Result:
        """Allows motions of motors or groups that are held; none named: of all."""
        return self._loop.run(self._client.release(*names, check=check))

    # -- positions, drivers, settings

    def set_position(
        self,
        motors: str | Mapping[str, float],
        position: float | None = None,
        *,
        unit: str | None = None,
        dial: bool = False,
        check: bool = True,
    ) -> model.Result:
        """Says where motors, at rest, stand: `set_position("theta", 0.0)`, or of several by a mapping.

        In a motor's unit it changes the offset of the user's scale. With `dial`, in steps, and of a motor without a
        unit it sets the position, which is KNOWN then.
        """
        return self._loop.run(self._client.set_position(motors, position, unit=unit, dial=dial, check=check))

    def confirm(self, *names: str, check: bool = True) -> model.Result:
        """Says that the positions of these motors (at least one), at rest, are right as shown: they are KNOWN."""
        return self._loop.run(self._client.confirm(*names, check=check))

    def enable(self, *names: str, check: bool = True) -> model.Result:
        """Enables the drivers of the MCUs of these motors; none named: of all."""
        return self._loop.run(self._client.enable(*names, check=check))

    def disable(self, *names: str, check: bool = True) -> model.Result:
        """Disables them. Refused while one of their motors moves."""
        return self._loop.run(self._client.disable(*names, check=check))

    def clear(self, *names: str, check: bool = True) -> model.Result:
        """Clears faults, and a latched emergency stop, of the MCUs of these motors; none named: of all."""
        return self._loop.run(self._client.clear(*names, check=check))

    def position_compare(
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
        """Lets the position compare output of the motor's MCU pulse when the motor arrives at the position.

        positive, negative: by steps in these directions; neither: no pulses any more.
        delay_us: from the step to the pulse, 0 to 1500000. width_us: of the pulse, 1 to 1000000.
        """
        return self._loop.run(
            self._client.position_compare(
                name,
                position,
                unit=unit,
                positive=positive,
                negative=negative,
                delay_us=delay_us,
                width_us=width_us,
                check=check,
            )
        )

    def config(
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
        """Shows the settings of this motor (or of all), or changes those that are written, of a motor at rest.

            client.config("theta", soft_limits=(-5.0, 30.0))    # None: no soft limits
            client.config("theta", offset=12.5, direction="negative")
            client.config("theta", local=True, keypad=False)    # who at its MCU moves it
            client.config("theta", velocity=(100, 1500, 500))   # least and full speed in steps/s, steps/s^2
            client.config("theta", currents=(1500, 1000, 300, "fast"))   # ramp, cruise, hold in mA, decay
            client.config("theta", max_speed=2.5)               # above 0, in units a second; None: as fast as its table
            client.config("theta", acceleration=0.5)            # of that of its table, above 0 and at most 1

        They are kept until the key in bushd.toml is edited. Returns what holds now, and what the file says.
        """
        return self._loop.run(
            self._client.config(
                name,
                offset=offset,
                direction=direction,
                soft_limits=soft_limits,
                input_active=input_active,
                local=local,
                keypad=keypad,
                velocity=velocity,
                currents=currents,
                max_speed=max_speed,
                acceleration=acceleration,
            )
        )

    def history(self, name: str, most: int = 20) -> list[model.PastMotion]:
        """What has moved this motor, the newest first; `most` 1 to 1000. Refused without a state store."""
        return self._loop.run(self._client.history(name, most))

    def camac(
        self,
        cycles: Iterable[requests.Cycle],
        *,
        crate: int = 1,
        mode: str = "single",
        count: int | None = None,
        last: tuple[int, int] | None = None,
    ) -> model.CamacResult:
        """Cycles of a CAMAC crate, each (N, A, F) or, of functions that write, (N, A, F, data).

        mode: "single", each cycle of the list; "repeat", "q-stop" and "scan" begin at the address of the first one, and each
        cycle has a word to write. count: words to read, 1 to 4096. last: station and subaddress with which a scan ends.
        """
        return self._loop.run(self._client.camac(cycles, crate=crate, mode=mode, count=count, last=last))
