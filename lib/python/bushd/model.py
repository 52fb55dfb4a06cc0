"""What the daemon says, as values: results of requests, states of motors and MCUs, health of buses, tables.

All of them are immutable. A number that has a unit says it in its name (`_steps`, `_s`, `_us`), except positions and
distances in the motor's own unit, which is in `unit`.
"""

from __future__ import annotations

import dataclasses
import datetime
import enum
from collections.abc import Iterator, Mapping


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
class MotorResult:
    """What became of one motor of a move."""

    motor: str
    outcome: Outcome
    position: float  # where it stands at the end, in `unit`, on the user's scale
    dial: float  # the same on the dial
    position_steps: int
    unit: str  # "steps" of a motor without one
    precision: int  # decimals of positions for people
    table: TableRef  # by which it has moved
    asked_by: str
    legs: int  # how many its motion had, as planned
    most_steps_per_s: float  # not exceeded by any leg; 0 of what the MCU makes by itself

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
class PlannedLeg:
    """One motor of a planned move; a motor with several legs has one of these for each."""

    motor: str
    steps: int
    duration_s: float  # to its last step
    peak_steps_per_s: float


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
class Motor:
    """The state of one motor. Positions are None while `trust` is `Trust.UNKNOWN`."""

    name: str
    position: float | None  # in `unit`, on the user's scale
    dial: float | None
    position_steps: int | None
    target: float | None  # where it will stand in the end; equal to the position at rest
    target_steps: int | None
    unit: str  # "steps" of a motor without one
    velocity_steps_per_s: float  # signed, of the running step
    moving: bool
    activity: Activity
    enabled: bool  # drivers powered
    switch: bool  # one of its switches is active
    inputs: frozenset[str]  # active ones of "positive", "negative", "home", "step"
    inhibited: Inhibited
    trust: Trust
    uncertain_reason: str  # why the position is not known; "" while it is
    heard_at: datetime.datetime | None  # while `trust` is STALE: when the position was heard
    paused: bool  # it ramps down, or stands, on the way to its target
    held: bool  # no motion begins
    armed_by: str  # while `activity` is ARMING or ARMED: whose request that is; else ""
    line: LineState | None  # while it moves on a line with others
    mcu: str  # "<bus>:<address>"
    output: int
    group: str
    table: TableRef  # in service, for the next move
    description: str
    steps_per_unit: str  # exact: "320" or "1/3"
    negative: bool  # position = offset - dial; otherwise offset + dial
    offset: float  # of the user's scale
    precision: int  # decimals of positions for people
    soft_limits: tuple[float, float] | None  # on the user's scale, low before high

    def __str__(self) -> str:
        where = "unknown" if self.position is None else f"{self.position:.{self.precision}f} {self.unit}"
        return f"{self.name}: {where} ({self.trust.value}), {self.activity.value}"


@dataclasses.dataclass(frozen=True)
class Mcu:
    """The state of one microcontroller."""

    name: str  # "<bus>:<address>"
    bus: str
    address: int
    state: McuState
    detail: str  # cause of OFFLINE or FAULT
    inputs: frozenset[str]  # active ones: of "emergency", "forward", "reverse", "trigger"
    program: str  # that is under way, and where it is: "scan runs, frame 3, without host"; "": none
    boot_number: int  # 0 until the MCU was heard
    tick: int
    tick_ns: int
    emergency_stop: str  # how its motors stop then: "ramp", "immediate" or "disable"
    port: str  # of its bus, that is open; "": none


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
class McuHealth:
    """Counts of one microcontroller, since the daemon's start."""

    mcu: str
    address: int
    unique_id: str  # 16 hexadecimal digits; "" until the MCU was heard
    firmware_version: int
    boot_number: int
    reset_cause: str
    current: int  # of the supply: 0 .. 1023 of what the MCU can measure
    crc_errors: int
    rejected_frames: int
    ramp_downs: int
    timeouts: int
    repeats: int
    missed_ticks: int
    restarts: int
    low_water_ticks: int | None  # the fewest ticks that a moving motor had queued; None: none moved
    rate_ppm: float
    clock_offset_us: float
    two_masters: bool


@dataclasses.dataclass(frozen=True)
class BusHealth:
    """Counts of one bus and its MCUs, since the daemon's start."""

    bus: str
    port_state: str  # "open", or why it is not
    two_masters: bool
    crc_errors: int
    stray_frames: int
    recent_latency_us: int
    start_margin_us: int
    line_bytes: int  # sent and received
    line_bytes_per_s: int  # that the line can carry
    latency: tuple[tuple[int | None, int], ...]  # (below so many us, answers); None: above all bounds
    mcus: tuple[McuHealth, ...]


@dataclasses.dataclass(frozen=True)
class PastMotion:
    """What has moved a motor, or made its position known."""

    at: datetime.datetime  # when it ended
    what: str  # "move", "home", "arm", "jog", "line", "travel", "set", "config" or "confirm"
    who: str  # asked for it
    from_steps: int
    to_steps: int
    outcome: str
    reason: str
    from_text: str  # both as they were shown to people then; "" of a motor without a unit
    to_text: str


@dataclasses.dataclass(frozen=True)
class Setting:
    """A key of a motor that may be changed in operation: its value now and that in `bushd.toml`."""

    motor: str
    key: str
    value: str
    in_file: str


@dataclasses.dataclass(frozen=True)
class Configuration:
    """What may be changed in operation, and what the file says."""

    path: str  # of bushd.toml, on the daemon's PC
    sha256: str  # of its text as the daemon knows it
    settings: tuple[Setting, ...]


@dataclasses.dataclass(frozen=True)
class CamacResponse:
    """What a station of a CAMAC crate has answered to a cycle."""

    x: bool  # it has this command
    q: bool
    data: int  # 24 bits; 0 of functions that do not read


@dataclasses.dataclass(frozen=True)
class CamacResult:
    """What has become of CAMAC cycles."""

    responses: tuple[CamacResponse, ...]  # of the cycles that moved a word, and of the one that ended a block at one address
    tally: int  # words that were moved; of "single" cycles that were made
    requests: int  # stations that raise L afterwards: bit n - 1 is station n


@dataclasses.dataclass(frozen=True)
class ProgramMotor:
    """What a program does to a motor, from where the motor stands; of a repeat without end one pass."""

    motor: str
    least_steps: int  # where it comes to, its beginning included
    most_steps: int
    end_steps: int
    edges: int  # steps that it makes


@dataclasses.dataclass(frozen=True)
class Program:
    """The program of an MCU: what it is, how far it has come, and what it does."""

    mcu: str  # "<bus>:<address>"
    program: str  # its name; "": none, or one that was put before the daemon started
    checksum: str  # CRC-32 of its bytes, 8 hexadecimal digits; "": the MCU has none
    stage: ProgramStage
    reason: str  # why its last run has ended; "": it has not
    without_host: bool  # it goes on when no host is heard
    at_power_on: bool  # it begins by itself when the power comes
    kept: bool  # it is to outlive power cuts
    stored: bool  # and would now
    bytes: int  # of it, or of what has arrived of it
    memory: int  # bytes that a program may have there
    frame: int  # that is carried out, or was last, from 1; 0: none yet
    point: int  # of this frame, if it is a line, from 1
    repeats: int
    duration_s: float  # without the time in which it waits for inputs; this and what follows: of one that this daemon has checked
    pulses: int
    endless: bool  # it repeats without end: what is told is of one pass
    waits_for_inputs: bool
    cut: bool  # there are more frames to carry out than were looked at
    motors: tuple[ProgramMotor, ...]

    def __getitem__(self, motor: str) -> ProgramMotor:
        for one in self.motors:
            if one.motor == motor:
                return one
        raise KeyError(motor)


@dataclasses.dataclass(frozen=True)
class TableEntry:
    """One of the tables that the daemon finds."""

    name: str  # its file's name without ".toml"
    table: TableRef
    fault: str  # why it cannot be used; "": it can
    codes: int
    start_steps_per_s: float
    max_steps_per_s: float


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
