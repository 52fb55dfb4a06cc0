"""A profile move: what the variables of the motor module's profileMoveController mean. Without caproto, without a socket, without a clock.

Positions of some motors over time are put, built (checked), executed and read back. `put` takes what a client has put, `checked`,
`flying`, `passed`, `over` and `aborted` what has become of what was asked for; after each of them `take` has what is to be done.

`Times[k]` is the time from point k to the next one. With v the speed from the first point to the second one and T = `Acceleration`,
motors begin at rest before the first point, by v/2 T and a little more, and pass it with v; so it is, mirrored, behind the last one.
Cubics through three rows give a parabola exactly, and these runs are parabolas, so the speed at both ends of the profile is v.
"""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Callable, Iterable, Sequence
from typing import Any

from .events import End, Seen
from .fields import Field, Kind
from .record import Putter
from .scale import Scale
from .variables import Variables

MOST_POINTS = 2000
RAMP_ROWS = 8  # of a run before the first point, and after the last one
_LEAD = 1 / RAMP_ROWS  # of a row's time: so long it goes with v already before the first point

UNDEFINED, SUCCESS, FAILURE, ABORT = range(4)
DONE, BUSY = 0, 1
MOVE_START, EXECUTING = 1, 2
FIXED, FROM_LIST = 0, 1  # TimeMode
ABSOLUTE, RELATIVE = 0, 1

_STATES, _ENDS = ("Done", "Busy"), ("Undefined", "Success", "Failure")


def _said(kind: Kind, initial: Any = 0, words: tuple[str, ...] = (), why_not: str = "it is what the profile does, and cannot be put") -> Field:
    return Field(kind, initial, words, why_not=why_not)


def _put(kind: Kind, initial: Any = 0, words: tuple[str, ...] = ()) -> Field:
    return Field(kind, initial, words, settable=True)


FIELDS: dict[str, Field] = {
    "NumAxes": _said(Kind.LONG, why_not="[profiles] in names.toml lists the motors"),
    "NumPoints": _put(Kind.LONG, 2),
    "CurrentPoint": _said(Kind.LONG),
    "NumPulses": _put(Kind.LONG),
    "NumActualPulses": _said(Kind.LONG),
    "StartPulses": _put(Kind.LONG, 1),
    "EndPulses": _put(Kind.LONG, 1),
    "NumReadbacks": _said(Kind.LONG),
    "TimeMode": _put(Kind.ENUM, FIXED, ("Fixed", "Array")),
    "FixedTime": _put(Kind.DOUBLE, 1.0),
    "Times": _put(Kind.WAVEFORM, ()),
    "Acceleration": _put(Kind.DOUBLE, 0.5),
    "MoveMode": _put(Kind.ENUM, ABSOLUTE, ("Absolute", "Relative")),
    "Build": _put(Kind.ENUM, 0, ("Done", "Build")),
    "BuildState": _said(Kind.ENUM, DONE, _STATES),
    "BuildStatus": _said(Kind.ENUM, UNDEFINED, _ENDS),
    "BuildMessage": _said(Kind.CHARS, ""),
    "Execute": _put(Kind.ENUM, 0, ("Done", "Execute")),
    "ExecuteState": _said(Kind.ENUM, DONE, ("Done", "Move start", "Executing", "Flyback")),
    "ExecuteStatus": _said(Kind.ENUM, UNDEFINED, (*_ENDS, "Abort", "Timeout")),
    "ExecuteMessage": _said(Kind.CHARS, ""),
    "Abort": _put(Kind.ENUM, 0, ("Done", "Abort")),
    "Readback": _put(Kind.ENUM, 0, ("Done", "Readback")),
    "ReadbackState": _said(Kind.ENUM, DONE, _STATES),
    "ReadbackStatus": _said(Kind.ENUM, UNDEFINED, _ENDS),
    "ReadbackMessage": _said(Kind.CHARS, ""),
}
AXIS_FIELDS: dict[str, Field] = {
    "UseAxis": _put(Kind.ENUM, 0, ("No", "Yes")),
    "Positions": _put(Kind.WAVEFORM, ()),
    "Readbacks": _said(Kind.WAVEFORM, ()),
    "FollowingErrors": _said(Kind.WAVEFORM, ()),
}


class BadProfile(Exception):
    """It cannot be built or executed as it is; the text says why, and what to do."""


Row = tuple[float, ...]
Where = Callable[[str], Seen]  # of a motor; raises BadProfile where that is not known


@dataclasses.dataclass(frozen=True)
class Points:
    """What was built."""

    axes: tuple[int, ...]  # from 1, in their order
    motors: tuple[str, ...]
    times_s: Row  # from each point to the next one
    rows: tuple[Row, ...]
    relative: bool
    ramp_s: float

    def from_here(self, where: Where) -> Points:
        """As absolute positions."""
        if not self.relative:
            return self
        here = [_position(where(motor)) for motor in self.motors]
        rows = tuple(tuple(at + by for at, by in zip(here, row)) for row in self.rows)
        return dataclasses.replace(self, rows=rows, relative=False)


@dataclasses.dataclass(frozen=True)
class Trajectory:
    """Rows for `bushd.aio.Client.follow()`, cubic; on the user's scale."""

    motors: tuple[str, ...]
    time_s: Row
    rows: tuple[Row, ...]
    points_s: Row  # when the points of the profile are passed


@dataclasses.dataclass(frozen=True)
class Check:
    """Asks the daemon whether it can be followed; answered by `checked`."""

    who: Any
    trajectory: Trajectory


@dataclasses.dataclass(frozen=True)
class Fly:
    """Asks for a move to the first row, and for the flight; answered by `flying` and `over`."""

    who: Any
    trajectory: Trajectory


@dataclasses.dataclass(frozen=True)
class Abort:
    """Asks for a stop of the flight; answered by `aborted`."""

    by: Putter


def trajectory(points: Points) -> Trajectory:
    """With the runs before and behind it."""
    rows = points.rows
    passed = tuple(itertools.accumulate(points.times_s, initial=0.0))
    first = _speed(rows[0], rows[1], points.times_s[0])
    last = _speed(rows[-2], rows[-1], points.times_s[-1])
    before = _run(rows[0], tuple(-v for v in first), points.ramp_s)
    behind = _run(rows[-1], last, points.ramp_s)
    before_s = before[-1][0] if before else 0.0
    points_s = tuple(before_s + at for at in passed)
    all_rows = [
        *((before_s - at, row) for at, row in reversed(before)),
        *zip(points_s, rows),
        *((points_s[-1] + at, row) for at, row in behind),
    ]
    return Trajectory(points.motors, tuple(at for at, _ in all_rows), tuple(row for _, row in all_rows), points_s)


def _run(beside: Row, speeds: Row, ramp_s: float) -> list[tuple[float, Row]]:
    """Rows from this point on, which is passed with these speeds, to rest; by the time since the point."""
    if ramp_s == 0 or not any(speeds):
        return []
    step_s = ramp_s / RAMP_ROWS
    lead_s = step_s * _LEAD
    run = []
    for number in range(RAMP_ROWS + 1):
        at = number * step_s
        effective_s = lead_s + at - at * at / (2 * ramp_s)  # the way is that with the full speed
        run.append((lead_s + at, tuple(p + v * effective_s for p, v in zip(beside, speeds))))
    return run


def _speed(row: Row, following: Row, time_s: float) -> Row:
    return tuple((b - a) / time_s for a, b in zip(row, following))


class Profile(Variables[Check | Fly | Abort]):
    def __init__(self, name: str, motors: Sequence[str]) -> None:
        self.name = name  # what its variables begin with
        self.motors = tuple(motors)  # M1, M2 and so on
        self.fields: dict[str, Field] = dict(FIELDS)
        for axis in range(1, len(motors) + 1):
            self.fields |= {f"M{axis}{field}": spec for field, spec in AXIS_FIELDS.items()}
        super().__init__(self.fields)
        self.values["NumAxes"] = len(motors)
        self._built: Points | None = None
        self._checking: Points | None = None
        self._flown: tuple[Points, list[Scale]] | None = None  # under way, or flown to its end
        self._points_s: Row = ()
        self._building: list[Any] = []  # tokens of puts
        self._executing: list[Any] = []

    @property
    def executes(self) -> bool:
        return bool(self.values["Execute"])

    # -- clients

    def put(self, field: str, value: Any, by: Putter, where: Where) -> None:
        spec = self.fields[field]
        try:
            if not spec.settable:
                raise BadProfile(spec.why_not)
            self._check_value(field, value)
        except BadProfile as error:
            return self._done(by.token, f"{self.name}{field}: {error}")
        match field:
            case "Build" | "Execute" | "Abort" | "Readback":
                self._command(field, value, by, where)
            case _:
                self._post(field, value)
                self._done(by.token)

    @staticmethod
    def _check_value(field: str, value: Any) -> None:
        values = value if isinstance(value, tuple) else (value,)
        if not all(math.isfinite(one) for one in values):
            raise BadProfile("positions and times are finite numbers")
        if field == "NumPoints" and not 2 <= value <= MOST_POINTS:
            raise BadProfile(f"{value} points; allowed: 2 to {MOST_POINTS}")
        if field == "FixedTime" and not value > 0:
            raise BadProfile(f"{value:g} s from point to point; it is to be above 0")
        if field == "Acceleration" and value < 0:
            raise BadProfile(f"{value:g} s; allowed: 0 and above")

    def _command(self, field: str, value: Any, by: Putter, where: Where) -> None:
        if not value:
            return self._done(by.token)
        if field == "Abort":
            if not self.executes:
                return self._done(by.token)
            return self._out.append(Abort(by))
        if self.values["Build"] or self.executes:
            return self._done(by.token, f"{self.name}{field}: a profile is being {'built' if self.values['Build'] else 'executed'}; wait, or abort it")
        {"Build": self._build, "Execute": self._execute, "Readback": self._read_back}[field](by, where)

    def _build(self, by: Putter, where: Where) -> None:
        self._built = None
        self._begin("Build", BUSY)
        self._building.append(by.token)
        try:
            points = self._points(where)
            made = trajectory(points.from_here(where))
        except BadProfile as error:
            return self.checked(str(error))
        self._checking = points
        self._out.append(Check(by.who, made))

    def _execute(self, by: Putter, where: Where) -> None:
        self._flown = None
        self._clear_readback()
        self._post("CurrentPoint", 0)
        self._begin("Execute", MOVE_START)
        self._executing.append(by.token)
        try:
            if self._built is None:
                raise BadProfile("no profile is built: put Build, and look at BuildStatus")
            points = self._built.from_here(where)
            self._flown = points, [where(motor).scale for motor in points.motors]
        except BadProfile as error:
            return self.over(End.FAULT, str(error))
        made = trajectory(points)
        self._points_s = made.points_s
        self._out.append(Fly(by.who, made))

    def _read_back(self, by: Putter, where: Where) -> None:
        self._clear_readback()
        self._begin("Readback", BUSY)
        if self._flown is None:
            error = "no profile was flown to its end: only then its positions are known, by the steps that were counted"
            return self._end("Readback", FAILURE, error, [by.token])
        points, scales = self._flown
        for axis, scale, asked in zip(points.axes, scales, zip(*points.rows)):
            stood = tuple(scale.user(scale.steps(scale.dial(to)) * scale.resolution) for to in asked)
            self._post(f"M{axis}Readbacks", stood)
            self._post(f"M{axis}FollowingErrors", tuple(at - to for at, to in zip(stood, asked)))
        self._post("NumReadbacks", len(points.rows))
        self._end("Readback", SUCCESS, "", [by.token])

    # -- the daemon

    def checked(self, error: str = "") -> None:
        self._built, self._checking = None if error else self._checking, None
        self._end("Build", FAILURE if error else SUCCESS, error, self._building)

    def flying(self) -> None:
        """The motors stand at the first row, and the daemon has accepted the flight."""
        self._post("ExecuteState", EXECUTING)

    def passed(self, since_s: float) -> None:
        """So long ago the flight was accepted."""
        if self.values["ExecuteState"] == EXECUTING:
            self._post("CurrentPoint", sum(at <= since_s for at in self._points_s))

    def over(self, end: str, reason: str) -> None:
        """`end`: one of `End`."""
        if end == End.REACHED:
            self._post("CurrentPoint", len(self._points_s))
            return self._end("Execute", SUCCESS, "", self._executing)
        self._flown = None
        self._end("Execute", ABORT if end == End.STOPPED else FAILURE, reason or end, self._executing)

    def aborted(self, by: Putter, error: str = "") -> None:
        self._done(by.token, error)

    # -- for the above

    def _points(self, where: Where) -> Points:
        """The points that were put. Raises BadProfile."""
        values = self.values
        count = int(values["NumPoints"])
        axes = tuple(axis for axis in range(1, len(self.motors) + 1) if values[f"M{axis}UseAxis"])
        if not axes:
            raise BadProfile("no axis is used: put M1UseAxis, or that of another one, to Yes")
        if values["NumPulses"]:
            raise BadProfile(f"NumPulses is {values['NumPulses']}: an MCU makes pulses at one position; put 0, and use PCOEnable of a motor")
        for axis in axes:
            self._check_length(f"M{axis}Positions", count)
            where(self.motors[axis - 1])
        times = self._times(count)
        return Points(
            axes=axes,
            motors=tuple(self.motors[axis - 1] for axis in axes),
            times_s=times,
            rows=tuple(zip(*(values[f"M{axis}Positions"][:count] for axis in axes))),
            relative=values["MoveMode"] == RELATIVE,
            ramp_s=float(values["Acceleration"]),
        )

    def _times(self, count: int) -> Row:
        if self.values["TimeMode"] == FIXED:
            return (float(self.values["FixedTime"]),) * (count - 1)
        self._check_length("Times", count - 1)
        times: Row = self.values["Times"][: count - 1]
        short = next((number for number, time in enumerate(times, 1) if not time > 0), None)
        if short is not None:
            raise BadProfile(f"Times: {times[short - 1]:g} s from point {short} to the next one; it is to be above 0")
        return times

    def _check_length(self, field: str, needed: int) -> None:
        has = len(self.values[field])
        if has < needed:
            raise BadProfile(f"{field}: {has} values, {needed} are needed for {self.values['NumPoints']} points")

    def _begin(self, what: str, state: int) -> None:
        self._post(what, 1)
        self._post(f"{what}Message", "")
        self._post(f"{what}Status", UNDEFINED)
        self._post(f"{what}State", state)

    def _end(self, what: str, status: int, message: str, tokens: list[Any]) -> None:
        """Who waits for the end, by whatever variable, has the status and its reason before it."""
        self._post(f"{what}Message", message)
        self._post(f"{what}Status", status)
        self._post(f"{what}State", DONE)
        self._post(what, 0)
        for token in tokens:
            self._done(token, f"{self.name}{what}: {message}" if status != SUCCESS else "")
        tokens.clear()

    def _clear_readback(self) -> None:
        for axis in range(1, len(self.motors) + 1):
            self._post(f"M{axis}Readbacks", ())
            self._post(f"M{axis}FollowingErrors", ())
        self._post("NumReadbacks", 0)
        self._post("ReadbackStatus", UNDEFINED)


def _position(seen: Seen) -> float:
    if seen.user is None:
        raise BadProfile("where it stands is not known, so a profile cannot be relative: set or home it")
    if seen.busy or seen.moving:
        raise BadProfile("it moves, so a profile cannot be relative: wait until it stands")
    return seen.user


def severity(field: str, value: int) -> int:
    """The severity of the alarm that a variable of states and ends has, by its number."""
    if field.endswith("State"):
        return 1 if value else 0
    if field.endswith("Status"):
        return {UNDEFINED: 3, SUCCESS: 0}.get(value, 2)
    return 0


def all_fields(profiles: Iterable[Profile]) -> list[str]:
    return [f"{profile.name}{field}" for profile in profiles for field in profile.fields]
