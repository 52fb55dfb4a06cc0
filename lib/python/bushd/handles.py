"""What the blocking client hands out: motions under way, jogs, and tables."""

from __future__ import annotations

import types

from . import aio, model, motion
from .loop import Loop as _Loop


class Motion:
    """A motion under way, of `move(..., wait=False)`, `home(..., wait=False)`, `arm()` and `arm_line()`."""

    def __init__(self, loop: _Loop, begun: motion.Motion) -> None:
        self._loop = loop
        self._motion = begun

    @property
    def done(self) -> bool:
        """It has ended, in whatever way; `wait()` returns at once."""
        return self._motion.done

    def wait(self, *, check: bool = True) -> model.MoveResult:
        """Its result, once all motors stand. Ctrl-C ramps them down. Raises MoveFailed, ResultUnknown."""
        return self._loop.run(self._motion.wait(check=check))

    def stop(self) -> model.MoveResult:
        """Ramps its motors down. Returns the result once they stand."""
        return self._loop.run(self._motion.stop())


class Jog:
    """A motor that moves on, of `Client.jog()`."""

    def __init__(self, loop: _Loop, jog: motion.Jog) -> None:
        self._loop = loop
        self._jog = jog

    @property
    def done(self) -> bool:
        """The motor has come to its soft limit, or somebody else has ended the jog, or its link is gone."""
        return self._jog.done

    @property
    def result(self) -> model.MoveResult:
        """How it has ended, once it is done."""
        return self._jog.result

    def change(self, speed: float) -> None:
        """Another speed, signed; the motor slows down, speeds up, or ramps down and comes back. Raises Refused."""
        self._loop.run(self._jog.change(speed))

    def end(self, *, steps_after: int | None = None) -> model.MoveResult:
        """Ramps the motor down, or lets it end so many steps (0 to 2^31 - 1) on. Returns once it stands."""
        return self._loop.run(self._jog.end(steps_after=steps_after))

    def __enter__(self) -> Jog:
        self._loop.run(self._jog.begin())
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: types.TracebackType | None
    ) -> None:
        self._loop.run(self._jog.__aexit__(kind, error, trace))


class Tables:
    """The tables that the daemon finds: `client.tables`."""

    def __init__(self, loop: _Loop, tables: aio.Tables) -> None:
        self._loop = loop
        self._tables = tables

    def list(self) -> tuple[model.TableEntry, ...]:
        """All of them; invalid ones with their fault."""
        return self._loop.run(self._tables.list())

    def get(self, name: str) -> model.Table:
        """What its file says. name: NAME, NAME@REVISION or NAME@TAG."""
        return self._loop.run(self._tables.get(name))

    def set(self, name: str, table: model.Table) -> model.TableEntry:
        """Writes it as the next revision; no group gets it by that. Returns what it is now.

        table: what `get()` has returned, changed by `dataclasses.replace`; refused if the table has changed since. With
        hash "" it is a new one.
        """
        return self._loop.run(self._tables.set(name, table))

    def use(self, group: str, table: str, *, check: bool = True) -> model.Result:
        """Gives a group this table (NAME, NAME@REVISION or NAME@TAG), from its next move on."""
        return self._loop.run(self._tables.use(group, table, check=check))

    def reload(self, *, check: bool = True) -> model.Result:
        """Reads the tables of all groups again."""
        return self._loop.run(self._tables.reload(check=check))
