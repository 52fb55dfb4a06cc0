"""The client for asyncio: `async with bushd.aio.connect() as client: await client.move("theta", to=4.0)`.

Functions, arguments, results and errors are those of `bushd.Client`, which is made of this one when the package is built
(make_client); here they are coroutines, also where an example of a description does not await them. Any number of them may
run at the same time.
"""

from __future__ import annotations

import asyncio
import os
import types
from collections.abc import AsyncIterator, Awaitable, Callable, Generator, Iterable, Mapping
from typing import overload

from . import arguments, messages, model, requests
from .asking import there
from .links import DEFAULT_PREFIX, Link, open_link
from .motion import Jog, Motion
from .moving import Moving
from .requests import ask
from .session import Timing
from .status import StatusCollector


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
    """A client of the daemon: `async with bushd.aio.connect() as client: ...`.

    Without arguments: the control socket of this PC ($BUSHD_CONTROL, else /run/bushd/control, else
    $XDG_RUNTIME_DIR/bushd/control). LCM only where this user has no right to that, or where there is none and
    $LCM_DEFAULT_URL is set.

    socket: path of another control socket.
    lcm: True ($LCM_DEFAULT_URL, else on this PC), or a URL such as "udpm://239.255.76.67:7667?ttl=1".
    prefix: of the LCM channels; `[lcm] prefix` in bushd.toml.
    program: begins the name of this client in logs and histories; by default that of the script.

    Raises NoDaemon at once where there is no daemon at the socket, or no network for LCM.
    """

    async def opens() -> Client:
        return Client(open_link(socket, lcm, prefix), arguments.client_id(program), prefix, timing)

    return Connecting(opens)


class Client(Moving):
    """One client of one daemon. Made by `connect()`; of one asyncio loop.

    Positions, distances and speeds (per second) are in the motor's unit, on the user's scale. `unit="steps"` makes them
    steps, which must be whole numbers; `unit="mm"` says what is expected: ValueError if a motor has another unit.

    Every request may raise Refused (the daemon refuses it, with the reason; nothing has moved), NoDaemon (no answer),
    ResultUnknown (the daemon has ended or restarted meanwhile), and TwoDaemons (on LCM). One that has not succeeded
    raises RequestFailed, of motions MoveFailed, with the result in it; `check=False` returns that result.

    A task that is cancelled while it waits for a motion ramps the motors down, waits until they stand, and is cancelled
    then; one that is cancelled again does not wait.
    """

    def __init__(self, link: Link, client_id: str, prefix: str = DEFAULT_PREFIX, timing: Timing = Timing()) -> None:
        super().__init__(link, client_id, prefix, timing)
        self.tables = Tables(self)

    @property
    def id(self) -> str:
        """The name by which the daemon knows this client, in results, history and logs."""
        return self._driver.session.client_id

    @property
    def connected(self) -> bool:
        """False once the daemon has ended, or this client is closed: each request raises NoDaemon then. Connect anew."""
        return self._driver.session.ended is None

    async def close(self) -> None:
        """Jogs of this client ramp down. Moves that were begun with wait=False go on."""
        self._driver.close()

    async def __aenter__(self) -> Client:
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: types.TracebackType | None
    ) -> None:
        await self.close()

    # -- where motors are

    @overload
    async def where(self) -> dict[str, model.Motor]: ...
    @overload
    async def where(self, name: str) -> model.Motor: ...
    async def where(self, name: str | None = None) -> dict[str, model.Motor] | model.Motor:
        """The state of this motor, or of all by name: `client.where("theta").position`. Raises UnknownMotor."""
        status = await self.status()
        return dict(status.motors) if name is None else arguments.find(status, name)

    async def status(self, timeout_s: float = 3.0) -> model.Status:
        """All motors and MCUs, as they are now. Raises NoDaemon if it is not complete within this time."""
        return (await self._query(timeout_s)).status()

    async def health(self, timeout_s: float = 3.0) -> dict[str, model.BusHealth]:
        """Error counts and latencies of buses and MCUs, by bus."""
        return (await self._query(timeout_s)).health()

    async def watch(self, every_s: float = 0.1) -> AsyncIterator[model.Status]:
        """States as they come, at most one in so many seconds: `for status in client.watch(): ...`.

        20 times a second while a motor moves (of more than 128 such MCUs, in turns), else twice. Raises NoDaemon when they cease.
        """
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
        """Says where motors, at rest, stand: `set_position("theta", 0.0)`, or of several by a mapping.

        In a motor's unit it changes the offset of the user's scale. With `dial`, in steps, and of a motor without a
        unit it sets the position, which is KNOWN then.
        """
        wanted = await self._amounts(motors, position, None, unit)
        motor_amounts = requests.motor_amounts(wanted.values, wanted.in_steps)
        return await self._result(ask("SET_POSITION", motors=motor_amounts, dial=dial), check)

    async def clear(self, *names: str, check: bool = True) -> model.Result:
        """Clears faults, and a latched emergency stop, of the MCUs of these motors; none named: of all."""
        return await self._result(ask("CLEAR_FAULTS", motors=names), check)

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
        """Lets the position compare output of the motor's MCU pulse when the motor arrives at the position.

        positive, negative: by steps in these directions; neither: no pulses any more.
        delay_us: from the step to the pulse, 0 to 1500000. width_us: of the pulse, 1 to 1000000.
        """
        in_steps = await self._in_steps({name: position}, unit)
        kind = messages.position_compare_t
        arrivals = (kind.POSITIVE if positive else 0) | (kind.NEGATIVE if negative else 0)
        amount = requests.motor_amount(name, position, in_steps)
        request = ask("POSITION_COMPARE", position=amount, arrivals=arrivals, delay_us=delay_us, width_us=width_us)
        return await self._result(request, check)

    async def config(self, name: str | None = None, **settings: object) -> model.Configuration:
        """Shows the settings of this motor (or of all), or changes those that are written, of a motor at rest.

            client.config("theta", soft_limits=(-5.0, 30.0))    # None: no soft limits
            client.config("theta", offset=12.5, direction="negative")
            client.config("theta", local=True, keypad=False)    # who at its MCU moves it
            client.config("theta", velocity=(100, 1500, 500))   # least and full speed in steps/s, steps/s^2
            client.config("theta", currents=(1500, 1000, 300, "fast"))   # ramp, cruise, hold in mA, decay
            client.config("theta", max_speed=2.5)               # above 0, in units a second; None: as fast as its table
            client.config("theta", acceleration=0.5)            # of that of its table, above 0 and at most 1
            client.config("theta", phase_sequence="half")       # or "wave", "full"; of all motors of its MCU

        They are kept until the key in bushd.toml is edited. Returns what holds now, and what the file says.
        """
        if settings and name is None:
            raise TypeError("name the motor whose settings are to change")
        if settings and name is not None:
            request = requests.change_configuration(name, settings)
        else:
            request = ask("CONFIGURE", kind="SHOW", motors=[] if name is None else [name], repeatable=True)
        return there((await self._ask(request)).detail.configuration)

    async def history(self, name: str, most: int = 20) -> list[model.PastMotion]:
        """What has moved this motor, the newest first; `most` 1 to 1000. Refused without a state store."""
        return list((await self._ask(ask("GET_HISTORY", motor=name, most=most, repeatable=True))).detail.motions)

    async def put_program(
        self, name: str, program: str, points: Mapping[str, str] = {}, *, dry_run: bool = False
    ) -> model.Program:
        """Puts a program into the memory of the MCU of its motors, in place of the one there; nothing moves.

            client.put_program("scan", pathlib.Path("scan.toml").read_text())

        name: 1 to 63 of A-Z a-z 0-9 _ . -, the first one no -
        program: TOML (docs/programs.md of bushd).
        points: the text of each file of points that the program names, by that name: {"way.csv": "x,y\\n1,2\\n"}.
        dry_run: only check it.

        Returns once it has arrived, with what it will do from where its motors stand. All texts together are a message:
        at most 57344 bytes. Refused while a program of that MCU is under way.
        """
        exchange = await self._ask(requests.put_program(name, program, points, dry_run=dry_run))
        return there(exchange.detail.programs[0] if exchange.detail.programs else None)

    async def list_programs(self) -> dict[str, model.Program]:
        """What each MCU that can have a program has, and how far it has come, by MCU ("<bus>:<address>")."""
        exchange = await self._ask(ask("LIST_PROGRAMS", repeatable=True))
        return {program.mcu: program for program in exchange.detail.programs}

    async def erase_program(self, name: str, *, check: bool = True) -> model.Result:
        """Erases a program from the memory of its MCU. Refused while it is under way."""
        return await self._result(ask("ERASE_PROGRAM", program=name), check)

    async def camac(
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
        request = requests.camac(cycles, crate=crate, mode=mode, count=count, last=last)
        return there((await self._ask(request)).detail.camac)


class Tables:
    """The tables that the daemon finds: `client.tables`."""

    def __init__(self, client: Client) -> None:
        self._client = client

    async def list(self) -> tuple[model.TableEntry, ...]:
        """All of them; invalid ones with their fault."""
        return (await self._client._ask(ask("LIST_TABLES", repeatable=True))).detail.entries

    async def get(self, name: str) -> model.Table:
        """What its file says. name: NAME, NAME@REVISION or NAME@TAG."""
        tables = (await self._client._ask(ask("GET_TABLE", table=name, repeatable=True))).detail.tables
        return there(tables[0] if tables else None)

    async def set(self, name: str, table: model.Table) -> model.TableEntry:
        """Writes it as the next revision; no group gets it by that. Returns what it is now.

        table: what `get()` has returned, changed by `dataclasses.replace`; refused if the table has changed since. With
        hash "" it is a new one.
        """
        said = ("name", "description", "revision", "time_unit_ns", "cruise", "accel", "decel")
        content = messages.table_t(**{field: getattr(table, field) for field in said})
        request = ask("SET_TABLE", table=name, expected_hash=table.hash, content=content)
        entries = (await self._client._ask(request)).detail.entries
        return there(entries[0] if entries else None)

    async def use(self, group: str, table: str, *, check: bool = True) -> model.Result:
        """Gives a group this table (NAME, NAME@REVISION or NAME@TAG), from its next move on."""
        return await self._client._result(ask("USE_TABLE", group=group, table=table), check)

    async def reload(self, *, check: bool = True) -> model.Result:
        """Reads the tables of all groups again."""
        return await self._client._result(ask("RELOAD_TABLES"), check)


__all__ = ["Client", "Connecting", "Jog", "Motion", "Tables", "connect"]
