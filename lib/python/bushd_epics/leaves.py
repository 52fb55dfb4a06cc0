"""Variables that are no fields of a record, by Channel Access: those of a profile, and of a motor's position compare."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import caproto

from . import channels
from .fields import Field, Kind
from .profile import severity
from .record import Putter

Put = Callable[[str, Any, Putter], None]


class Leaves:
    """Made when somebody asks for them."""

    def __init__(self, fields: Mapping[str, Field], values: Mapping[str, Any], put: Put, alarm: Any = None) -> None:
        """`alarm`: of all of them; None: each has that of its value."""
        self._fields = fields
        self._values = values
        self._put = put
        self._alarm = alarm
        self._channels: dict[str, Any] = {}

    def __contains__(self, name: str) -> bool:
        return name in self._fields

    def find(self, name: str) -> Any:
        """Raises KeyError."""
        channel = self._channels.get(name)
        if channel is None:
            spec = self._fields[name]
            alarm = self._alarm or caproto.ChannelAlarm()
            channel = channels.make(spec.kind, self._values[name], spec.words, alarm, _RECORDS[spec.kind])
            if spec.settable:
                channel.putter = lambda value, by: self._put(name, value, by)
            self._channels[name] = channel
            self._show_severity(name, self._values[name])
        return channel

    def show(self, name: str, value: Any) -> None:
        if name in self._channels:
            self._show_severity(name, value)
            self._channels[name].show(value)

    def alarm_has_changed(self) -> None:
        """What is read from now on has it."""
        for channel in self._channels.values():
            channel.take_alarm()

    def describe(self, unit: str, precision: int) -> None:
        """Describes those that are positions of a motor."""
        for name, channel in self._channels.items():
            if self._fields[name].is_position:
                channel.describe(unit, precision, 0.0, 0.0)

    def _show_severity(self, name: str, value: Any) -> None:
        if self._alarm is None and self._fields[name].kind is Kind.ENUM:
            is_bad = severity(name, int(value))
            status = caproto.AlarmStatus.STATE if is_bad else caproto.AlarmStatus.NO_ALARM
            self._channels[name].alarm._data.update(status=status, severity=caproto.AlarmSeverity(is_bad))
            self._channels[name].take_alarm()


_RECORDS = {
    Kind.DOUBLE: "ao",
    Kind.LONG: "longout",
    Kind.ENUM: "bo",
    Kind.WAVEFORM: "waveform",
    Kind.CHARS: "waveform",
}
