"""What the daemon says, as values: results of requests, states of motors and MCUs, health of buses, tables.

All of them are immutable. A number that has a unit says it in its name (`_steps`, `_s`, `_us`), except positions and
distances in the motor's own unit, which is in `unit`. What a message tells as it is comes from the bases, in `told`, which is
made of the .lcm files; here is what is told otherwise in Python.
"""

from __future__ import annotations

import dataclasses
import datetime
import enum
from collections.abc import Iterator, Mapping

from . import told


class Outcome(enum.Enum):
    """How a request, or a motor's part in it, has ended."""

    DONE = "done"  # of requests that are not moves
    REACHED = "reached"  # the MCU has run the last tick and the motor stands at the target
    STOPPED = "stopped"  # ramped down on request before the target, or given a new target
    LIMIT = "limit"  # a limit switch stopped it, or a jog came to its soft limit
    LINK = "link"  # the link to the MCU was lost; the position is the last known one
    FAULT = "fault"  # other steps were counted than the table gives, or the MCU failed

    @property
    def succeeded(self) -> bool:
        return self in (Outcome.DONE, Outcome.REACHED)


class Trust(enum.Enum):
    """What a motor's position is worth."""

    UNKNOWN = "unknown"  # the MCU has not reported since it booted: there is no position
    KNOWN = "known"  # every step was counted since the position was set or the motor homed
    RESTORED = "restored"  # as it was kept; the MCU has lost power while the motor stood
    STALE = "stale"  # the MCU is offline; the position is that of `heard_at`
    UNCERTAIN = "uncertain"  # steps may have been lost, or nobody has said where the motor stands


class Activity(enum.Enum):
    """What a motor does."""

    REST = "rest"
    MOVE = "move"
    ARMING = "arming"  # is to wait for the trigger
    ARMED = "armed"  # waits for it
    HOME = "home"
    LOCAL = "local"  # moved by the inputs at its MCU, or by another master


class McuState(enum.Enum):
    """The state of a microcontroller."""

    OFFLINE = "OFFLINE"
    BUSY = "BUSY"
    READY = "READY"
    RUN = "RUN"
    FAULT = "FAULT"


class Inhibited(enum.Enum):
    """The directions that a motor's limit switches inhibit."""

    NONE = ""
    POSITIVE = "positive"
    NEGATIVE = "negative"
    BOTH = "both"


class ProgramStage(enum.Enum):
    """What the program of an MCU does."""

    NONE = "none"  # the MCU has none
    LOADING = "loading"
    LOADED = "loaded"
    WAITS = "waits"  # for the tick with which it begins
    RUNS = "runs"
    PAUSES = "pauses"  # its motors ramp down
    PAUSED = "paused"
    ENDS = "ends"  # its motors ramp down
    ENDED = "ended"
    UNKNOWN = "unknown"  # the MCU is not heard


@dataclasses.dataclass(frozen=True)
class TableRef:
    """Which table it is, in short."""

    name: str
    revision: int  # 0: the table's file tells none
    hash: str  # the first 8 digits of the SHA-256 of what moves a motor


@dataclasses.dataclass(frozen=True)
class Result:
    """How a request has ended."""

    outcome: Outcome
    reason: str  # a sentence that names the motor and the cause


@dataclasses.dataclass(frozen=True)
class MotorResult(told.MotorResult):
    """What became of one motor of a move."""

    outcome: Outcome
    position: float  # where it stands at the end, in `unit`, on the user's scale
    dial: float  # the same on the dial
    table: TableRef  # by which it has moved

    def __str__(self) -> str:
        return f"{self.motor}: {self.outcome.value}, stands at {self.position:.{self.precision}f} {self.unit}"


@dataclasses.dataclass(frozen=True)
class MoveResult(Result):
    """How a move, a homing, a jog or armed moves have ended: `result["theta"].position`."""

    motors: tuple[MotorResult, ...] = ()  # in the request's order; of pseudo-axes before their motors

    def __getitem__(self, motor: str) -> MotorResult:
        for result in self.motors:
            if result.motor == motor:
                return result
        raise KeyError(motor)

    def __iter__(self) -> Iterator[MotorResult]:
        return iter(self.motors)


@dataclasses.dataclass(frozen=True)
class PlannedLeg(told.PlannedLeg):
    """One motor of a planned move; a motor with several legs has one of these for each."""

    duration_s: float  # to its last step


@dataclasses.dataclass(frozen=True)
class MovePlan:
    """What a move would be; nothing has moved."""

    duration_s: float  # from the first tick to the end of the last one
    ticks: int
    frames: int | None  # to the MCUs, for the motion alone; None: too many to be counted
    bytes: int | None  # of these frames on the bus
    limited_by: str | None  # of a line: the motor that makes it take so long
    points_s: tuple[float, ...]  # of a path of at most 2048 points: when each of them is reached
    legs: tuple[PlannedLeg, ...]


@dataclasses.dataclass(frozen=True)
class LineState:
    """A line under way."""

    fraction: float  # 0..1: the share of it that has been made
    left_s: float  # time that the rest of it takes


@dataclasses.dataclass(frozen=True)
class Motor(told.Motor, told.MotorDescription):
    """The state of one motor. Positions are None while `trust` is `Trust.UNKNOWN`."""

    position: float | None  # in `unit`, on the user's scale
    dial: float | None
    position_steps: int | None
    target: float | None  # where it will stand in the end; equal to the position at rest
    target_steps: int | None
    activity: Activity
    switch: bool  # one of its switches is active
    inputs: frozenset[str]  # active ones of "positive", "negative", "home", "step"
    inhibited: Inhibited
    trust: Trust
    heard_at: datetime.datetime | None  # while `trust` is STALE: when the position was heard
    line: LineState | None  # while it moves on a line with others
    mcu: str  # "<bus>:<address>"
    table: TableRef  # in service, for the next move
    soft_limits: tuple[float, float] | None  # on the user's scale, low before high

    def __str__(self) -> str:
        where = "unknown" if self.position is None else f"{self.position:.{self.precision}f} {self.unit}"
        return f"{self.name}: {where} ({self.trust.value}), {self.activity.value}"


@dataclasses.dataclass(frozen=True)
class Mcu(told.McuState, told.McuDescription):
    """The state of one microcontroller."""

    name: str  # "<bus>:<address>"
    state: McuState
    inputs: frozenset[str]  # active ones: of "emergency", "forward", "reverse", "trigger"


@dataclasses.dataclass(frozen=True)
class Status:
    """All motors and MCUs at one time: `status.motors["theta"]`."""

    motors: Mapping[str, Motor]
    mcus: Mapping[str, Mcu]
    at: datetime.datetime  # of the newest part, by the daemon's clock
    run: int  # of the daemon: another one tells of a restart
    sequence: int  # of the newest part; grows within a run
    dropped_messages: int  # that the daemon could not use so far

    def __getitem__(self, motor: str) -> Motor:
        return self.motors[motor]


@dataclasses.dataclass(frozen=True)
class McuHealth(told.McuHealth):
    """Counts of one microcontroller, since the daemon's start."""

    low_water_ticks: int | None  # the fewest ticks that a moving motor had queued; None: none moved


@dataclasses.dataclass(frozen=True)
class BusHealth(told.BusHealth):
    """Counts of one bus and its MCUs, since the daemon's start."""

    latency: tuple[tuple[int | None, int], ...]  # (below so many us, answers); None: above all bounds
    mcus: tuple[McuHealth, ...]


@dataclasses.dataclass(frozen=True)
class PastMotion(told.PastMotion):
    """What has moved a motor, or made its position known."""

    at: datetime.datetime  # when it ended


@dataclasses.dataclass(frozen=True)
class Setting(told.Setting):
    """A key of a motor that may be changed in operation: its value now and that in `bushd.toml`."""

    in_file: str


@dataclasses.dataclass(frozen=True)
class Configuration:
    """What may be changed in operation, and what the file says."""

    path: str  # of bushd.toml, on the daemon's PC
    sha256: str  # of its text as the daemon knows it
    settings: tuple[Setting, ...]


@dataclasses.dataclass(frozen=True)
class CamacResponse(told.CamacResponse):
    """What a station of a CAMAC crate has answered to a cycle."""


@dataclasses.dataclass(frozen=True)
class CamacResult:
    """What has become of CAMAC cycles."""

    responses: tuple[CamacResponse, ...]  # of the cycles that moved a word, and of the one that ended a block at one address
    tally: int  # words that were moved; of "single" cycles that were made
    requests: int  # stations that raise L afterwards: bit n - 1 is station n


@dataclasses.dataclass(frozen=True)
class ProgramMotor(told.ProgramMotor):
    """What a program does to a motor, from where the motor stands; of a repeat without end one pass."""


@dataclasses.dataclass(frozen=True)
class Program(told.Program):
    """The program of an MCU: what it is, how far it has come, and what it does."""

    stage: ProgramStage
    duration_s: float  # without the time in which it waits for inputs; of a program that this daemon has checked
    motors: tuple[ProgramMotor, ...]

    def __getitem__(self, motor: str) -> ProgramMotor:
        for one in self.motors:
            if one.motor == motor:
                return one
        raise KeyError(motor)


@dataclasses.dataclass(frozen=True)
class TableEntry(told.TableEntry):
    """One of the tables that the daemon finds."""

    table: TableRef


@dataclasses.dataclass(frozen=True)
class Table:
    """What a table's file says. To change it: `dataclasses.replace(table, accel=...)`, then `tables.set()`."""

    name: str
    time_unit_ns: int
    accel: tuple[int, ...]  # delays in time units, slow to fast
    decel: tuple[int, ...] = ()  # fast to slow; empty: accel reversed
    cruise: int = 0  # 0: the last of accel
    description: str = ""
    revision: int = 0  # of the table that this one was made from; 0: none
    hash: str = ""  # of that table, 64 hexadecimal digits; "": the table is new
