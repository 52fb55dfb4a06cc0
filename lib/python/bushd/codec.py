"""Messages as bytes, and what the daemon says as values of `model`.

On a network anybody may send anything. What is not exactly one message of its channel's type, or has a word or a number
in it that no daemon says, is None here.
"""

from __future__ import annotations

import dataclasses
import datetime
import enum
import functools
import operator
import struct
from collections.abc import Callable, Iterable
from typing import Any, TypeVar

from . import messages, model
from .messages import finite

MAX_MESSAGE_BYTES = 60 * 1024  # a longer one would be fragmented on LCM
MAX_PARTS = 4096  # of a whole; more than any configuration has
MAX_DECIMALS = 12

T = TypeVar("T")

EPOCH = datetime.datetime(1970, 1, 1, tzinfo=datetime.timezone.utc)


class Phase(enum.Enum):
    """What a reply says: REFUSED and nothing more, or ACCEPTED and later exactly one RESULT."""

    ACCEPTED = messages.reply_header_t.ACCEPTED
    REFUSED = messages.reply_header_t.REFUSED
    RESULT = messages.reply_header_t.RESULT


@dataclasses.dataclass(frozen=True)
class Detail:
    """What a result has beside its outcome: one of these, or nothing."""

    motors: tuple[model.MotorResult, ...] = ()
    plan: model.MovePlan | None = None
    entries: tuple[model.TableEntry, ...] = ()
    tables: tuple[model.Table, ...] = ()
    motions: tuple[model.PastMotion, ...] = ()
    configuration: model.Configuration | None = None
    camac: model.CamacResult | None = None
    programs: tuple[model.Program, ...] = ()

    def __add__(self, more: Detail) -> Detail:
        """With the piece of the list that the next part has."""
        return Detail(**{name: _joined(getattr(self, name), getattr(more, name)) for name in _names(Detail)})


# The list of each whole that comes in pieces.
_LISTS = {model.MovePlan: "legs", model.Configuration: "settings", model.CamacResult: "responses"}


def _joined(whole: Any, piece: Any) -> Any:
    if isinstance(whole, tuple):
        return whole + piece
    if whole is None or piece is None:
        return whole
    name = _LISTS[type(whole)]
    return dataclasses.replace(whole, **{name: getattr(whole, name) + getattr(piece, name)})


@dataclasses.dataclass(frozen=True)
class Reply:
    """An answer, or one part of it."""

    session: int
    client_id: str
    number: int
    phase: Phase
    reason: str
    outcome: model.Outcome | None = None  # of a result
    part: int = 0
    parts: int = 1
    detail: Detail = Detail()


@dataclasses.dataclass(frozen=True)
class Welcome:
    client_id: str
    nonce: int
    run: int
    session: int


@dataclasses.dataclass(frozen=True)
class Part:
    """Which one of the snapshots that together are the whole, with what it says."""

    run: int
    sequence: int
    utime_us: int
    part: int
    parts: int
    content: Any  # mcu_state_t, mcu_description_t; BusHealth


class State(Part):
    pass


class Unread(Part):
    """A State of which only this has been looked at; `content` is the message's bytes."""


class Description(Part):
    pass


class Health(Part):
    pass


Message = Reply | Welcome | State | Description | Health


def encode(message: Any) -> bytes:
    """Raises ValueError for what does not fit: numbers beyond their type, texts with a NUL, too many motors."""
    payload: bytes = message.encode()
    if len(payload) > MAX_MESSAGE_BYTES:
        raise ValueError(f"the request takes {len(payload)} bytes; at most {MAX_MESSAGE_BYTES} fit a message")
    return payload


def is_known(channel: str) -> bool:
    """Whether the daemon has messages of this channel for clients. `channel` without a prefix."""
    return channel in _DECODERS


def decode(channel: str, payload: bytes) -> Message | None:
    """`channel` without a prefix."""
    known = _DECODERS.get(channel)
    if known is None or len(payload) > MAX_MESSAGE_BYTES:
        return None
    kind, parse = known
    try:
        return parse(kind.decode(payload))
    except (ValueError, OverflowError, IndexError):
        return None


_FIRST_FIELDS = struct.Struct(">8sqqqii")  # the fingerprint, and what mcu_state_t begins with


def unread(payload: bytes) -> Unread | None:
    """A STATE, by its first fields alone: reading all of it takes time. None: it is none."""
    if len(payload) < _FIRST_FIELDS.size:
        return None
    fingerprint, utime_us, run, sequence, part, parts = _FIRST_FIELDS.unpack_from(payload)
    return Unread(run, sequence, utime_us, part, parts, payload) if fingerprint == messages.mcu_state_t.FINGERPRINT else None


def at(utime_us: int) -> datetime.datetime:
    return EPOCH + datetime.timedelta(microseconds=utime_us)


def precision(decimals: int) -> int:
    if not 0 <= decimals <= MAX_DECIMALS:
        raise ValueError("no number of decimals")
    return decimals


@functools.cache
def _names(kind: Any) -> tuple[str, ...]:
    return tuple(field.name for field in dataclasses.fields(kind))


@functools.cache
def _taken(kind: Any, of: Any, given: tuple[str, ...]) -> tuple[tuple[str, ...], Callable[[Any], Iterable[Any]], tuple[str, ...]]:
    """What is taken from a message of this type: names, a function that reads them, and which of them are arrays."""
    names = tuple(name for name in _names(kind) if name not in given)
    arrays = tuple(field.name for field in of.FIELDS if field.count and field.name in names)
    # attrgetter makes no tuple of a single name.
    read: Any = operator.attrgetter(*names) if len(names) > 1 else lambda message: [getattr(message, name) for name in names]
    return names, read, arrays


def made(kind: Callable[..., T], message: Any, **others: Any) -> T:
    """One of `model`: what is not among `others` is what the message has by that name. Arrays become tuples."""
    of: Any = type(message)
    names, read, arrays = _taken(kind, of, tuple(others))
    others.update(zip(names, read(message)))
    for name in arrays:
        others[name] = tuple(others[name])
    if len(others) != len(_names(kind)):
        return kind(**others)
    # As its __init__ does, which sets field by field: states of motors have many.
    bare: Any = kind
    value: T = object.__new__(bare)
    value.__dict__.update(others)
    return value


def told_by(kind: Any, message: Any) -> dict[str, Any]:
    """What a message has by the names of one of `told`."""
    of: Any = type(message)
    names, read, _ = _taken(kind, of, ())
    return dict(zip(names, read(message)))


def table_ref(message: Any) -> model.TableRef:
    return made(model.TableRef, message, revision=max(message.revision, 0))


def _reply(message: Any, detail: Detail) -> Reply:
    header = message.reply
    phase = Phase(header.phase)
    if not 0 <= header.part < header.parts <= MAX_PARTS:
        raise ValueError("no such part")
    is_result = phase is Phase.RESULT
    outcome = model.Outcome(header.outcome) if is_result else None
    return made(Reply, header, phase=phase, outcome=outcome, detail=detail if is_result else Detail())


def _answer(message: Any) -> Reply:
    motors = tuple(_motor_result(motor) for motor in message.motors)
    return _reply(message, Detail(motors=motors, plan=_plan(message.plan[0]) if message.plan else None))


def _motor_result(message: Any) -> model.MotorResult:
    return made(
        model.MotorResult,
        message,
        outcome=model.Outcome(message.outcome),
        position=message.user_position,
        dial=message.dial_position,
        precision=precision(message.precision),
        table=table_ref(message.table),
    )


def _plan(message: Any) -> model.MovePlan:
    return made(
        model.MovePlan,
        message,
        duration_s=message.duration_us / 1e6,
        frames=message.frames if message.frames >= 0 else None,
        bytes=message.bytes if message.frames >= 0 else None,
        limited_by=message.limited_by or None,
        points_s=tuple(us * 1e-6 for us in message.points_us),
        legs=tuple(made(model.PlannedLeg, motor, duration_s=motor.duration_us / 1e6) for motor in message.motors),
    )


def _table_answer(message: Any) -> Reply:
    entries = tuple(made(model.TableEntry, entry, table=table_ref(entry.table)) for entry in message.entries)
    return _reply(message, Detail(entries=entries, tables=tuple(made(model.Table, table) for table in message.tables)))


def _history_answer(message: Any) -> Reply:
    motions = tuple(made(model.PastMotion, motion, at=at(motion.utime_us)) for motion in message.motions)
    return _reply(message, Detail(motions=motions))


def _configuration_answer(message: Any) -> Reply:
    settings = tuple(made(model.Setting, setting, in_file=setting.value_in_file) for setting in message.settings)
    return _reply(message, Detail(configuration=made(model.Configuration, message, settings=settings)))


def _camac_answer(message: Any) -> Reply:
    responses = tuple(made(model.CamacResponse, response) for response in message.responses)
    return _reply(message, Detail(camac=made(model.CamacResult, message, responses=responses)))


def _program_answer(message: Any) -> Reply:
    return _reply(message, Detail(programs=tuple(_program(program) for program in message.programs)))


def _program(message: Any) -> model.Program:
    return made(
        model.Program,
        message,
        stage=model.ProgramStage(message.stage),
        duration_s=message.duration_us / 1e6,
        motors=tuple(made(model.ProgramMotor, motor) for motor in message.motors),
    )


def _welcome(message: Any) -> Welcome:
    if message.session == 0:
        raise ValueError("no session")
    return made(Welcome, message)


_checked: dict[int, list[Any]] = {}  # by part: motors of a state that were found right


def _state(message: Any) -> State:
    # Those that are shown (status.py) are looked at once a whole is asked for; words are checked here.
    at(message.utime_us)
    model.McuState(message.state)
    known = _checked.get(message.part, [])
    if len(known) != len(message.motors) or not all(map(operator.is_, known, message.motors)):
        _check_motors(message.motors)
        if 0 <= message.part < MAX_PARTS:
            _checked[message.part] = message.motors
    return made(State, message, content=message)


def _check_motors(motors: list[Any]) -> None:
    for motor in motors:
        model.Activity(motor.activity)
        model.Inhibited(motor.inhibited)
        model.Trust(motor.trust)
        at(motor.heard_utime_us)
        for value in (motor.user_position, motor.dial_position, motor.user_target, motor.velocity_steps_per_s):
            finite(value)


def _description(message: Any) -> Description:
    for motor in message.motors:
        precision(motor.precision)
        for value in (motor.offset, motor.user_low, motor.user_high):
            finite(value)
    return made(Description, message, content=message)


_UNBOUNDED = 2**63 - 1


def _health(message: Any) -> Health:
    latency = tuple((None if each.below_us == _UNBOUNDED else each.below_us, each.answers) for each in message.latency)
    bus = made(model.BusHealth, message, latency=latency, mcus=tuple(_mcu_health(mcu) for mcu in message.mcus))
    return made(Health, message, content=bus)


def _mcu_health(message: Any) -> model.McuHealth:
    queued = message.low_water_ticks
    return made(model.McuHealth, message, low_water_ticks=queued if queued >= 0 else None)


_DECODERS: dict[str, tuple[Any, Callable[[Any], Message]]] = {
    "WELCOME": (messages.welcome_t, _welcome),
    "REPLY": (messages.answer_t, _answer),
    "TABLE_REPLY": (messages.table_answer_t, _table_answer),
    "HISTORY_REPLY": (messages.history_answer_t, _history_answer),
    "CAMAC_REPLY": (messages.camac_reply_t, _camac_answer),
    "PROGRAM_REPLY": (messages.program_reply_t, _program_answer),
    "CONFIGURATION_REPLY": (messages.configuration_answer_t, _configuration_answer),
    "STATE": (messages.mcu_state_t, _state),
    "DESCRIPTION": (messages.mcu_description_t, _description),
    "HEALTH": (messages.health_t, _health),
}
