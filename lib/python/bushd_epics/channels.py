# mypy: allow-subclassing-any
"""Process variables as caproto has them. Their values are those of records; a put goes to whoever owns it, never straight to the value."""

from __future__ import annotations

import time
from collections.abc import Callable, Coroutine
from typing import Any

import caproto
from caproto import ChannelType
from caproto._backend import backend  # what caproto's own channels convert with
from caproto._data import SubscriptionUpdate
from caproto._dbr import _channel_type_by_name, native_type
from caproto._utils import ConversionDirection

from . import alarms, values
from .alarms import Alarm
from .fields import Kind, Value
from .profile import MOST_POINTS
from .record import Putter

LONG_TEXT = 512
MOST_CHARS = 256
EPOCH_S = 631152000  # seconds of EPICS begin in 1990
EVENTS = caproto.SubscriptionType.DBE_VALUE | caproto.SubscriptionType.DBE_LOG | caproto.SubscriptionType.DBE_ALARM

PutFunction = Callable[[Value, Putter], None]


class BadPut(Exception):
    """A put whose value is none of its variable's."""


class Channel:
    """What the classes below have in common; beside one of caproto's."""

    putter: PutFunction | None = None  # None: it is read only
    reason: Callable[[], str] | None = None  # of its alarm, in full
    told: Callable[[], None] | None = None  # called when its value, its alarm or what is said of its value has changed

    def get_field(self, field: str) -> Any:
        """NAME.VAL of a variable that is no record."""
        if field != "VAL":
            raise KeyError(field)
        return self

    def set_value(self: Any, value: Any) -> None:
        self._data["value"] = value
        seconds, nanoseconds = divmod(time.time_ns(), 1_000_000_000)
        self._data["timestamp"] = caproto.TimeStamp(seconds - EPOCH_S, nanoseconds)
        self.tell_again()

    def tell_again(self: Any) -> None:
        """All who watch it; its alarm, or what is said of its value, may have changed alone. Filters, which some could watch it through, are not served."""
        self._content.clear()
        for queue, syncs in self._queues.items():
            for types in syncs.values():
                for name, specs in types.items():
                    if specs:
                        made = values.ready(self, name)
                        metadata, value = (None, made) if made is not None else at_once(self._read(_channel_type_by_name[name]))
                        queue.put_nowait(SubscriptionUpdate(tuple(specs), metadata, value, EVENTS, None))
        if self.told is not None:
            self.told()

    def take_alarm(self: Any) -> None:
        """What is read from now on has it; who watches VAL and RBV is told by what follows."""
        self._content.clear()
        if self.told is not None:
            self.told()

    def alarm_now(self: Any) -> Alarm:
        alarm = self.alarm
        if alarm.severity == caproto.AlarmSeverity.NO_ALARM:
            return alarms.NONE
        reason = self.reason() if self.reason is not None else str(alarm.alarm_string)
        return Alarm(alarms.Status(int(alarm.status)), alarms.Severity(int(alarm.severity)), reason)

    def show(self, value: Value) -> None:
        self.set_value(value)

    def read_put(self: Any, command: Any) -> Value:
        """The value that a client puts. Raises BadPut."""
        source = native_type(command.data_type)
        if source is ChannelType.ENUM:
            source = ChannelType.INT  # 16 bits as well; the number of the word
        text = source in (ChannelType.STRING, ChannelType.CHAR) and not (source is ChannelType.CHAR and self.data_type is not ChannelType.STRING)
        to = ChannelType.STRING if text else ChannelType.DOUBLE
        try:
            converted = backend.convert_values(
                values=command.data,
                from_dtype=source,
                to_dtype=to,
                string_encoding="latin-1",
                direction=ConversionDirection.FROM_WIRE,
            )
            value = converted if isinstance(converted, (str, bytes)) else converted[0]
            if isinstance(value, bytes):
                value = value.decode("latin-1")
            taken: Value = self.to_value(value if text else float(value))
            return taken
        except (LookupError, ValueError, TypeError, OverflowError, caproto.CaprotoError) as error:
            raise BadPut(f"no value of this field: {error}") from None

    def to_value(self, value: str | float) -> Value:
        return float(value)


class Double(Channel, caproto.ChannelDouble):
    def describe(self, unit: str, precision: int, low: float, high: float) -> None:
        """`low`, `high`: limits of puts; both 0: there are none."""
        limits = {f"{end}_{kind}_limit": value for kind in ("ctrl", "disp") for end, value in (("lower", low), ("upper", high))}
        now = {"units": unit[:8], "precision": precision, **limits}
        if any(self._data.get(key) != value for key, value in now.items()):
            self._data.update(now)
            self.tell_again()


class Long(Channel, caproto.ChannelInteger):
    def to_value(self, value: str | float) -> Value:
        return _whole(value, 2**31)


class Short(Channel, caproto.ChannelShort):
    def to_value(self, value: str | float) -> Value:
        return _whole(value, 2**15)


class Enum(Channel, caproto.ChannelEnum):
    def show(self, value: Value) -> None:
        self.set_value(self.enum_strings[int(value)])

    def to_value(self, value: str | float) -> Value:
        if isinstance(value, str) and value in self.enum_strings:
            return list(self.enum_strings).index(value)
        number = _whole(value, 16)
        if not 0 <= number < len(self.enum_strings):
            raise ValueError(f"{number}; allowed: {', '.join(self.enum_strings)}")
        return number


class Text(Channel, caproto.ChannelString):
    def to_value(self, value: str | float) -> Value:
        return str(value)


class Doubles(Channel, caproto.ChannelDouble):
    """A waveform."""

    def get_field(self, field: str) -> Any:
        """Clients of profiles put PROC after the array, which has been taken then already."""
        if field != "PROC":
            return super().get_field(field)
        processed = Short(value=0)
        processed.putter = _take
        return processed

    def show(self, value: Any) -> None:
        self.set_value(list(value))

    def read_put(self, command: Any) -> Any:
        source = native_type(command.data_type)
        try:
            values = backend.convert_values(
                values=command.data,
                from_dtype=source,
                to_dtype=ChannelType.STRING if source is ChannelType.STRING else ChannelType.DOUBLE,
                string_encoding="latin-1",
                direction=ConversionDirection.FROM_WIRE,
            )
            numbers = tuple(float(one) for one in values)
        except (LookupError, ValueError, TypeError, OverflowError, caproto.CaprotoError) as error:
            raise BadPut(f"no numbers: {error}") from None
        if len(numbers) > self.max_length:
            raise BadPut(f"{len(numbers)} values; it holds {self.max_length}")
        return numbers

    def describe(self, unit: str, precision: int, low: float, high: float) -> None:
        self._data.update(units=unit[:8], precision=precision)


class Chars(Channel, caproto.ChannelChar):
    def show(self, value: Value) -> None:
        self.set_value(str(value).encode("latin-1", "replace")[: MOST_CHARS - 1].decode("latin-1"))


def _take(value: Value, by: Putter) -> None:
    """A put that nothing more comes of."""
    by.token("")


def _whole(value: str | float, limit: int) -> int:
    number = float(value)
    if number != int(number) or not -limit <= number < limit:
        raise ValueError(f"{value} is no whole number that it holds")
    return int(number)


def make(kind: Kind, value: Any, words: tuple[str, ...], alarm: Any, record_type: str) -> Any:
    how = {"alarm": alarm, "reported_record_type": record_type}
    match kind:
        case Kind.DOUBLE:
            return Double(value=float(value), precision=0, units="", **how)
        case Kind.LONG:
            return Long(value=int(value), **how)
        case Kind.SHORT:
            return Short(value=int(value), **how)
        case Kind.ENUM:
            return Enum(value=words[int(value)], enum_strings=list(words), **how)
        case Kind.WAVEFORM:
            return Doubles(value=list(value), precision=3, units="", max_length=MOST_POINTS, **how)
        case Kind.CHARS:
            made = Chars(value="", max_length=MOST_CHARS, string_encoding="latin-1", **how)
            made.show(value)
            return made
    return Text(value=str(value), long_string_max_length=LONG_TEXT, **how)


def at_once(coroutine: Coroutine[Any, Any, Any]) -> Any:
    """The result of what does not wait: what is told in one order is heard in that order."""
    try:
        coroutine.send(None)
    except StopIteration as end:
        return end.value
    coroutine.close()
    raise RuntimeError("a channel has waited while it was read")
