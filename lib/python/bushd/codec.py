"""Messages as bytes, and what the daemon says as values of `model`.

On a network anybody may send anything. What is not exactly one message of its channel's type, or has a word or a number
in it that no daemon says, is None here.
"""

from __future__ import annotations

import dataclasses
import datetime
import enum
import math
import struct
from collections.abc import Callable
from typing import Any

from . import messages, model

MAX_MESSAGE_BYTES = 60 * 1024  # a longer one would be fragmented on LCM
MAX_PARTS = 4096  # of a whole; more than any configuration has
MAX_DECIMALS = 12

EPOCH = datetime.datetime(1970, 1, 1, tzinfo=datetime.timezone.utc)


class Phase(enum.Enum):
    """Of a reply: REFUSED and nothing more, or ACCEPTED and later exactly one RESULT."""

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

    def __add__(self, more: Detail) -> Detail:
        """With the piece of the list that the next part has."""
        plan, configuration, camac = self.plan, self.configuration, self.camac
        if plan is not None and more.plan is not None:
            plan = dataclasses.replace(plan, legs=plan.legs + more.plan.legs)
        if configuration is not None and more.configuration is not None:
            settings = configuration.settings + more.configuration.settings
            configuration = dataclasses.replace(configuration, settings=settings)
        if camac is not None and more.camac is not None:
            camac = dataclasses.replace(camac, responses=camac.responses + more.camac.responses)
        return Detail(
            motors=self.motors + more.motors,
            plan=plan,
            entries=self.entries + more.entries,
            tables=self.tables + more.tables,
            motions=self.motions + more.motions,
            configuration=configuration,
            camac=camac,
        )


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

    run: int  # 0 with health
    sequence: int
    utime_us: int
    part: int
    parts: int
    content: Any  # mcu_state_t, mcu_description_t; BusHealth


class State(Part):
    pass


class Description(Part):
    pass


class Health(Part):
    pass


Message = Reply | Welcome | State | Description | Health


def encode(message: Any) -> bytes:
    """Raises ValueError for what does not fit: numbers beyond their type, texts with a NUL, too many motors."""
    try:
        payload: bytes = message.encode()
    except struct.error as error:
        raise ValueError(f"a number does not fit the request: {error}") from None
    if len(payload) > MAX_MESSAGE_BYTES:
        raise ValueError(f"the request takes {len(payload)} bytes; at most {MAX_MESSAGE_BYTES} fit a message")
    return payload


def text(value: str) -> str:
    """A text of a request: LCM's strings end at a NUL."""
    if not isinstance(value, str):
        raise TypeError(f"{value!r} is no text")
    if "\0" in value:
        raise ValueError(f"{value!r} has a NUL in it")
    return value


def decode(channel: str, payload: bytes) -> Message | None:
    """`channel` without a prefix."""
    known = _DECODERS.get(channel)
    if known is None or len(payload) > MAX_MESSAGE_BYTES:
        return None
    kind, parse = known
    try:
        message = kind.decode(payload)
        for name in _BOOLEAN_ARRAYS.get(channel, ()):
            setattr(message, name, list(getattr(message, name)))
        # lcm-gen's decoder takes negative counts, texts that are cut off and what is left over; no encoder makes them.
        if message.encode() != payload:
            return None
        return parse(message)
    except (ValueError, OverflowError, IndexError, struct.error):
        return None


# lcm-gen's decoder makes iterators of them, which its encoder cannot take.
_BOOLEAN_ARRAYS = {"CAMAC_REPLY": ("x", "q")}
_STATE_FINGERPRINT: bytes = messages.mcu_state_t._get_packed_fingerprint()


def run_of(channel: str, payload: bytes) -> int | None:
    """Which run of the daemon a STATE is of, from its first fields alone."""
    if channel != "STATE" or len(payload) < 24 or payload[:8] != _STATE_FINGERPRINT:
        return None
    return int.from_bytes(payload[16:24], "big", signed=True)


def at(utime_us: int) -> datetime.datetime:
    return EPOCH + datetime.timedelta(microseconds=utime_us)


def finite(value: float) -> float:
    if not math.isfinite(value):
        raise ValueError(f"{value} is no number that a position or speed can be")
    return value


def precision(decimals: int) -> int:
    if not 0 <= decimals <= MAX_DECIMALS:
        raise ValueError("no number of decimals")
    return decimals


def table_ref(message: Any) -> model.TableRef:
    return model.TableRef(message.name, max(message.revision, 0), message.hash)


def _reply(message: Any, detail: Detail) -> Reply:
    header = message.reply
    phase = Phase(header.phase)
    if not 0 <= header.part < header.parts <= MAX_PARTS:
        raise ValueError("no such part")
    is_result = phase is Phase.RESULT
    return Reply(
        session=header.session,
        client_id=header.client_id,
        number=header.number,
        phase=phase,
        reason=header.reason,
        outcome=model.Outcome(header.outcome) if is_result else None,
        part=header.part,
        parts=header.parts,
        detail=detail if is_result else Detail(),
    )


def _answer(message: Any) -> Reply:
    tables = [table_ref(table) for table in message.tables]
    for index in message.table_of_motor:
        if index < 0:
            raise ValueError("no such table")
    motors = tuple(
        model.MotorResult(
            motor=name,
            outcome=model.Outcome(message.outcomes[i]),
            position=message.user_positions[i],
            dial=message.dial_positions[i],
            position_steps=message.position_steps[i],
            unit=message.units[i],
            precision=precision(message.precisions[i]),
            table=tables[message.table_of_motor[i]],
            asked_by=message.asked_by[i],
            legs=message.legs[i],
            most_steps_per_s=message.most_steps_per_s[i],
        )
        for i, name in enumerate(message.motors)
    )
    return _reply(message, Detail(motors=motors, plan=_plan(message.plan[0]) if message.plan else None))


def _plan(message: Any) -> model.MovePlan:
    counted = message.frames >= 0
    return model.MovePlan(
        duration_s=message.duration_us / 1e6,
        ticks=message.ticks,
        frames=message.frames if counted else None,
        bytes=message.bytes if counted else None,
        limited_by=message.limited_by or None,
        points_s=tuple(us * 1e-6 for us in message.points_us),
        legs=tuple(
            model.PlannedLeg(name, steps, duration_us / 1e6, peak)
            for name, steps, duration_us, peak in zip(
                message.motors, message.steps, message.motor_duration_us, message.peak_steps_per_s
            )
        ),
    )


def _table_answer(message: Any) -> Reply:
    entries = tuple(
        model.TableEntry(
            entry.name, table_ref(entry.table), entry.fault, entry.codes, entry.start_steps_per_s, entry.max_steps_per_s
        )
        for entry in message.entries
    )
    tables = tuple(
        model.Table(
            name=table.name,
            time_unit_ns=table.time_unit_ns,
            accel=tuple(table.accel),
            decel=tuple(table.decel),
            cruise=table.cruise,
            description=table.description,
            revision=table.revision,
            hash=table.hash,
        )
        for table in message.tables
    )
    return _reply(message, Detail(entries=entries, tables=tables))


def _history_answer(message: Any) -> Reply:
    motions = tuple(
        model.PastMotion(
            at=at(motion.utime_us),
            what=motion.what,
            who=motion.who,
            from_steps=motion.from_steps,
            to_steps=motion.to_steps,
            outcome=motion.outcome,
            reason=motion.reason,
            from_text=motion.from_text,
            to_text=motion.to_text,
        )
        for motion in message.motions
    )
    return _reply(message, Detail(motions=motions))


def _configuration_answer(message: Any) -> Reply:
    settings = tuple(
        model.Setting(*words)
        for words in zip(message.setting_motors, message.keys, message.values, message.values_in_file)
    )
    return _reply(message, Detail(configuration=model.Configuration(message.path, message.sha256, settings)))


def _camac_answer(message: Any) -> Reply:
    responses = tuple(
        model.CamacResponse(bool(x), bool(q), data) for x, q, data in zip(message.x, message.q, message.data)
    )
    return _reply(message, Detail(camac=model.CamacResult(responses, message.tally, message.requests)))


def _welcome(message: Any) -> Welcome:
    if message.session == 0:
        raise ValueError("no session")
    return Welcome(message.client_id, message.nonce, message.run, message.session)


def _state(message: Any) -> State:
    # Those that are shown (status.py) are looked at once a whole is asked for; words are checked here.
    at(message.utime_us)
    model.McuState(message.state)
    for motor in message.motors:
        model.Activity(motor.activity)
        model.Inhibited(motor.inhibited)
        model.Trust(motor.trust)
        at(motor.heard_utime_us)
        for value in (motor.user_position, motor.dial_position, motor.user_target, motor.velocity_steps_per_s):
            finite(value)
    return State(message.run, message.sequence, message.utime_us, message.part, message.parts, message)


def _description(message: Any) -> Description:
    for motor in message.motors:
        precision(motor.precision)
        for value in (motor.offset, motor.user_low, motor.user_high):
            finite(value)
    return Description(message.run, message.sequence, message.utime_us, message.part, message.parts, message)


_UNBOUNDED = 2**63 - 1


def _health(message: Any) -> Health:
    bus = model.BusHealth(
        bus=message.bus,
        port_state=message.port_state,
        two_masters=message.two_masters,
        crc_errors=message.crc_errors,
        stray_frames=message.stray_frames,
        recent_latency_us=message.recent_latency_us,
        latency=tuple(
            (None if below == _UNBOUNDED else below, answers)
            for below, answers in zip(message.latency_below_us, message.latency_answers)
        ),
        mcus=tuple(_mcu_health(mcu) for mcu in message.mcus),
    )
    return Health(0, message.sequence, message.utime_us, message.part, message.parts, bus)


def _mcu_health(message: Any) -> model.McuHealth:
    values = {field.name: getattr(message, field.name) for field in dataclasses.fields(model.McuHealth)}
    if message.low_water_ticks < 0:
        values["low_water_ticks"] = None
    return model.McuHealth(**values)


_DECODERS: dict[str, tuple[Any, Callable[[Any], Message]]] = {
    "WELCOME": (messages.welcome_t, _welcome),
    "REPLY": (messages.answer_t, _answer),
    "TABLE_REPLY": (messages.table_answer_t, _table_answer),
    "HISTORY_REPLY": (messages.history_answer_t, _history_answer),
    "CAMAC_REPLY": (messages.camac_reply_t, _camac_answer),
    "CONFIGURATION_REPLY": (messages.configuration_answer_t, _configuration_answer),
    "STATE": (messages.mcu_state_t, _state),
    "DESCRIPTION": (messages.mcu_description_t, _description),
    "HEALTH": (messages.health_t, _health),
}
