"""The whole, put together from its parts: state and description per MCU, health per bus; the newest of each counts."""

from __future__ import annotations

import operator
from typing import Any

from . import codec, model, told
from .codec import MAX_PARTS, Description, Health, Part, Unread

MOST_PUT_OFF = 16  # states of an MCU


class StatusCollector:
    """Takes snapshots in any order; tells what they are once all parts of the whole are there."""

    def __init__(self) -> None:
        self.states_heard = 0  # so many were used
        self._run: int | None = None
        self._states: dict[int, Part] = {}
        self._unread: dict[int, list[Unread]] = {}  # that came after those
        self._descriptions: dict[int, Part] = {}
        self._healths: dict[int, Part] = {}
        self._made: dict[int, tuple[Part, Part, list[model.Motor]]] = {}  # of what was asked for last

    def add(self, part: Part) -> bool:
        """Whether it is used: a part beyond all configurations, and one older than what is there, is not."""
        if not 0 <= part.part < part.parts <= MAX_PARTS:
            return False
        if part.run != self._run:  # of another daemon
            self._run = part.run
            self._states.clear()
            self._unread.clear()
            self._descriptions.clear()
            self._healths.clear()
        if isinstance(part, Health):
            return self._put(self._healths, part)
        if isinstance(part, Description):
            return self._put(self._descriptions, part)
        self.states_heard += 1
        self._read(part.part)
        return self._put(self._states, part)

    def put_off(self, unread: Unread) -> bool:
        """Whether that is to be read once the whole is asked for: states come more often. What begins anew is not."""
        known = self._states.get(unread.part)
        if known is None or (unread.run, unread.parts) != (self._run, known.parts) or unread.sequence < known.sequence:
            return False
        waiting = self._unread.setdefault(unread.part, [])
        if len(waiting) >= MOST_PUT_OFF:
            return False
        waiting.append(unread)
        self.states_heard += 1
        return True

    def _read(self, index: int) -> None:
        """Reads the newest state among what was put off for this MCU; the others may hold anything."""
        for unread in sorted(self._unread.pop(index, []), key=operator.attrgetter("sequence"), reverse=True):
            state = codec.decode("STATE", unread.content)
            if isinstance(state, Part):
                self._put(self._states, state)
                return

    def _put(self, parts: dict[int, Part], part: Part) -> bool:
        # Maybe of another configuration.
        if parts and next(iter(parts.values())).parts != part.parts:
            parts.clear()
        known = parts.get(part.part)
        if known is not None and part.sequence < known.sequence:
            return False
        parts[part.part] = part
        return True

    @staticmethod
    def _missing(parts: dict[int, Part]) -> int:
        expected = next(iter(parts.values())).parts if parts else 1
        return expected - len(parts)

    def has_motors(self) -> bool:
        complete = self._missing(self._states) == 0 and self._missing(self._descriptions) == 0
        return complete and len(self._states) == len(self._descriptions)

    def has_health(self) -> bool:
        return self._missing(self._healths) == 0

    def is_empty(self) -> bool:
        return not (self._states or self._descriptions or self._healths)

    def missing(self) -> str:
        """What has not come, for people."""
        mcus = max(self._missing(self._states), self._missing(self._descriptions))
        return f"{mcus} MCUs and {self._missing(self._healths)} buses or more are missing"

    def status(self) -> model.Status:
        """Only when it has_motors()."""
        for index in list(self._unread):
            self._read(index)
        motors: dict[str, model.Motor] = {}
        mcus: dict[str, model.Mcu] = {}
        for index, state in sorted(self._states.items()):
            description = self._descriptions[index]
            mcus[state.content.mcu] = _mcu(state.content, description.content)
            for motor in self._motors(index, state, description):
                motors[motor.name] = motor
        newest = max(self._states.values(), key=lambda part: part.sequence)
        return model.Status(
            motors=motors,
            mcus=mcus,
            at=codec.at(newest.utime_us),
            run=newest.run,
            sequence=newest.sequence,
            dropped_messages=newest.content.dropped_messages,
        )

    def _motors(self, index: int, state: Part, description: Part) -> list[model.Motor]:
        """The motors of one MCU; the same objects while the same is told of them."""
        known = self._made.get(index)
        if known is not None and _tell_the_same(known[0], state) and _tell_the_same(known[1], description):
            return known[2]
        described = {motor.name: motor for motor in description.content.motors}
        motors = [_motor(motor, described[motor.name], state.content.mcu) for motor in state.content.motors if motor.name in described]
        self._made[index] = (state, description, motors)
        return motors

    def health(self) -> dict[str, model.BusHealth]:
        """Only when it has_health()."""
        return {part.content.bus: part.content for _, part in sorted(self._healths.items())}


def _tell_the_same(before: Part, part: Part) -> bool:
    """Whether both tell the same of the motors: what was told before is not made anew (messages.py)."""
    old, new = before.content, part.content
    return old.mcu == new.mcu and len(old.motors) == len(new.motors) and all(map(operator.is_, old.motors, new.motors))


def _mcu(state: Any, description: Any) -> model.Mcu:
    return codec.made(
        model.Mcu,
        state,
        name=state.mcu,
        state=model.McuState(state.state),
        inputs=frozenset(state.inputs.split()),
        **codec.told_by(told.McuDescription, description),
    )


def _motor(state: Any, description: Any, mcu: str) -> model.Motor:
    trust = model.Trust(state.trust)
    known = trust is not model.Trust.UNKNOWN
    return codec.made(
        model.Motor,
        state,
        position=state.user_position if known else None,
        dial=state.dial_position if known else None,
        position_steps=state.position_steps if known else None,
        target=state.user_target if known else None,
        target_steps=state.target_steps if known else None,
        activity=model.Activity(state.activity),
        switch=state.input,
        inputs=frozenset(state.inputs.split()),
        inhibited=model.Inhibited(state.inhibited),
        trust=trust,
        heard_at=codec.at(state.heard_utime_us) if trust is model.Trust.STALE else None,
        line=model.LineState(state.line_fraction, state.line_left_s) if state.on_line else None,
        mcu=mcu,
        table=codec.table_ref(description.table),
        soft_limits=(description.user_low, description.user_high) if description.soft_limits else None,
        **codec.told_by(told.MotorDescription, description),
    )
