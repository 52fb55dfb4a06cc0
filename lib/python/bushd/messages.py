"""The messages of LCM, and their bytes: a class for each file in `types`, which says its fields and constants.

    message = messages.stop_t(motors=["theta"])
    messages.stop_t.decode(message.encode()).motors

Fields that count the elements of an array are set by `encode()`.
"""

from __future__ import annotations

import functools
import itertools
import math
import operator
import pathlib
import re
import struct
from collections.abc import Callable, Iterable, Iterator
from typing import TYPE_CHECKING, Any

TYPES = pathlib.Path(__file__).parent / "types"
FORMATS = {"boolean": "b", "int8_t": "b", "int16_t": "h", "int32_t": "i", "int64_t": "q", "double": "d"}

_SIZE = struct.Struct(">I")
# Told again and again, mostly as before, of each MCU: their motors, which are the rest of the message, are not read again then.
REPEATED = ("mcu_state_t", "mcu_description_t")
MOST_REMEMBERED = 256
MOST_TEXTS = 4096
LONGEST_KNOWN_TEXT = 32  # bytes: names of motors, and words


class Field:
    """One member of a struct. `count`: the field that tells how many elements the array has; "": it is none."""

    def __init__(self, kind: str, name: str, count: str) -> None:
        self.kind = kind
        self.name = name
        self.count = count

    def default(self) -> Any:
        if self.count:
            return []
        if self.kind in FORMATS:
            return {"boolean": False, "double": 0.0}.get(self.kind, 0)
        return "" if self.kind == "string" else _CLASSES[self.kind]()

    def checked(self, value: Any) -> Any:
        return [self._checked(one) for one in value] if self.count else self._checked(value)

    def _checked(self, value: Any) -> Any:
        """Raises TypeError for what is of another type, ValueError for what no message can say."""
        if self.kind == "string":
            return text(value)
        if self.kind == "double":
            return finite(float(value))
        if self.kind == "boolean":
            return bool(value)
        return operator.index(value) if self.kind in FORMATS else value

    def signature(self) -> list[bytes]:
        """What of it counts for the fingerprint, as lcm-gen has it."""
        primitive = [_counted(self.kind)] if self.kind in FORMATS or self.kind == "string" else []
        dimension = b"\1\1" + _counted(self.count) if self.count else b"\0"  # one, of variable size
        return [_counted(self.name), *primitive, dimension]


class Message:
    """Base of all types. A number may be given by the name of its constant: `messages.move_t(kind="ABSOLUTE")`."""

    __slots__ = ()
    FIELDS: tuple[Field, ...]
    FINGERPRINT: bytes

    def __init__(self, **values: Any) -> None:
        """Raises TypeError and ValueError for values that are none of their fields'."""
        for field in self.FIELDS:
            value = values.pop(field.name) if field.name in values else field.default()
            if isinstance(value, str) and value.isupper() and field.kind in FORMATS:
                value = getattr(type(self), value)
            setattr(self, field.name, field.checked(value))
        if values:
            raise TypeError(f"{type(self).__name__} has no {', '.join(values)}")

    def encode(self) -> bytes:
        """Raises ValueError for what does not fit."""
        try:
            return b"".join([self.FINGERPRINT, *self._encoded()])
        except struct.error as error:
            raise ValueError(f"a number does not fit: {error}") from None

    @classmethod
    def decode(cls, data: bytes) -> Any:
        """Raises ValueError if it is not exactly one message of this type."""
        if data[:8] != cls.FINGERPRINT:
            raise ValueError(f"no {cls.__name__}")
        try:
            message, end = _reader(_CLASSES[cls.__name__])(data, 8)
        except struct.error as error:
            raise ValueError(str(error)) from None
        if end != len(data):
            raise ValueError(f"{len(data) - end} bytes too many")
        return message

    def _encoded(self) -> Iterator[bytes]:
        lengths = {field.count: len(getattr(self, field.name)) for field in self.FIELDS if field.count}
        for field in self.FIELDS:
            value = lengths.get(field.name, getattr(self, field.name))
            values: Any = value if field.count else [value]
            if field.kind in FORMATS:
                yield struct.pack(f">{len(values)}{FORMATS[field.kind]}", *values)
            elif field.kind == "string":
                for one in values:
                    coded = one.encode()
                    yield _SIZE.pack(len(coded) + 1) + coded + b"\0"
            else:
                for one in values:
                    yield from one._encoded()


def text(value: str) -> str:
    """LCM's strings end at a NUL."""
    if not isinstance(value, str):
        raise TypeError(f"{value!r} is no text")
    if "\0" in value:
        raise ValueError(f"{value!r} has a NUL in it")
    return value


def finite(value: float) -> float:
    if not math.isfinite(value):
        raise ValueError(f"{value} is no number that a position or speed can be")
    return value


# -- reading: what no encoder makes is a ValueError or a struct.error


@functools.cache
def _reader(cls: Any) -> Callable[[bytes, int], tuple[Any, int]]:
    """A function of Python for each type, as that of a dataclass is made: states come often, and have many fields."""
    lines = ["def read(data, at):", "m = new(cls)"]
    several = _read_rest if cls.__name__ in REPEATED else _read_several
    known: dict[str, Any] = {"cls": cls, "new": cls.__new__, "text": _read_text, "several": several, "array": _read_array, "boolean": _boolean}
    for numbers, group in itertools.groupby(cls.FIELDS, lambda field: field.kind in FORMATS and not field.count):
        fields = list(group)
        if numbers:
            layout = struct.Struct(">" + "".join(FORMATS[field.kind] for field in fields))
            unpack = f"unpack{len(lines)}"
            known[unpack] = layout.unpack_from
            lines.append(f"{', '.join(f'm.{field.name}' for field in fields)}, = {unpack}(data, at); at += {layout.size}")
            lines += [f"m.{field.name} = boolean(m.{field.name})" for field in fields if field.kind == "boolean"]
            continue
        for field in fields:
            if field.kind in FORMATS:
                lines.append(f"m.{field.name}, at = array(data, at, m.{field.count}, {FORMATS[field.kind]!r})")
                if field.kind == "boolean":
                    lines.append(f"m.{field.name} = tuple(map(boolean, m.{field.name}))")
                continue
            element = "text" if field.kind == "string" else field.kind
            if element != "text":
                known[element] = _reader(_CLASSES[element])
            lines.append(f"m.{field.name}, at = {f'several({element}, data, at, m.{field.count})' if field.count else f'{element}(data, at)'}")
    exec("\n ".join([*lines, "return m, at"]), known)
    read: Callable[[bytes, int], tuple[Any, int]] = known["read"]
    return read


_known_texts: dict[bytes, str] = {}


def _read_text(data: bytes, at: int) -> tuple[str, int]:
    begin = at + 4
    (size,) = _SIZE.unpack_from(data, at)
    coded = data[begin : begin + size]
    if len(coded) == size and coded in _known_texts:
        return _known_texts[coded], begin + size
    if size == 0 or len(coded) != size or coded.find(b"\0") != size - 1:
        raise ValueError("a text that does not end where it should")
    read = coded[:-1].decode()
    if size <= LONGEST_KNOWN_TEXT:
        if len(_known_texts) >= MOST_TEXTS:
            _known_texts.clear()
        _known_texts[coded] = read
    return read, begin + size


def _read_array(data: bytes, at: int, count: int, layout: str) -> tuple[tuple[Any, ...], int]:
    layout = f">{_valid(count)}{layout}"
    return struct.unpack_from(layout, data, at), at + struct.calcsize(layout)


def _read_several(read: Callable[[bytes, int], tuple[Any, int]], data: bytes, at: int, count: int) -> tuple[list[Any], int]:
    values = []
    for _ in range(_valid(count)):
        value, at = read(data, at)
        values.append(value)
    return values, at


_remembered: dict[tuple[bytes, int], tuple[list[Any], int]] = {}


def _read_rest(read: Callable[[bytes, int], tuple[Any, int]], data: bytes, at: int, count: int) -> tuple[list[Any], int]:
    """As _read_several. Where these bytes were read before the elements are the same ones, so nobody may change them."""
    key = (data[:8] + data[at:], count)
    known = _remembered.get(key)
    if known is None:
        if len(_remembered) >= MOST_REMEMBERED:
            _remembered.clear()
        values, end = _read_several(read, data, at, count)
        known = _remembered[key] = (values, end - at)
    return list(known[0]), at + known[1]


def _valid(count: int) -> int:
    if count < 0:
        raise ValueError(f"an array of {count} elements")
    return count


def _boolean(value: int) -> bool:
    if value not in (0, 1):
        raise ValueError(f"a boolean is {value}")
    return value == 1


# -- the types


def _counted(word: str) -> bytes:
    return bytes([len(word)]) + word.encode()


def _hash(fields: Iterable[Field]) -> int:
    """lcm-gen's, of a struct alone."""
    value = 0x12345678
    for byte in b"".join(part for field in fields for part in field.signature()):
        signed = value - 2**64 if value >> 63 else value  # its shift to the right keeps the sign
        value = (((value << 8) ^ (signed >> 55)) + byte) % 2**64
    return value


def _fingerprint(cls: type[Message]) -> bytes:
    """With those of the structs in it; none is in itself."""
    inner = sum(int.from_bytes(_CLASSES[field.kind].FINGERPRINT, "big") for field in cls.FIELDS if field.kind in _CLASSES)
    whole = (_hash(cls.FIELDS) + inner) % 2**64
    return ((whole << 1) % 2**64 | whole >> 63).to_bytes(8, "big")


def _define(name: str, texts: dict[str, str]) -> None:
    """After those that it contains."""
    members: list[Field] = []
    constants: dict[str, Any] = {}
    for member in re.sub(r"//[^\n]*", "", texts[name]).split("{")[1].rstrip().rstrip("}").split(";"):
        if words := re.fullmatch(r"\s*const \w+ (.+)", member, re.DOTALL):
            constants.update((key.strip(), int(value, 0)) for key, value in (one.split("=") for one in words[1].split(",")))
        elif words := re.fullmatch(r"\s*(\w+)\s+(\w+)(?:\[(\w+)\])?\s*", member):
            members.append(Field(words[1], words[2], words[3] or ""))
        elif member.strip():
            raise ValueError(f"{name}: {member.strip()}")
    for field in members:
        if field.kind in texts and field.kind not in _CLASSES:
            _define(field.kind, texts)
    attributes = {"__slots__": [field.name for field in members], "FIELDS": tuple(members), **constants}
    cls: Any = type(name, (Message,), attributes)
    cls.FINGERPRINT = _fingerprint(cls)
    _CLASSES[name] = cls


_CLASSES: dict[str, Any] = {}


def _define_all() -> None:
    texts = {path.stem: path.read_text(encoding="utf-8") for path in TYPES.glob("*.lcm")}
    for name in sorted(texts):
        if name not in _CLASSES:
            _define(name, texts)


_define_all()
globals().update(_CLASSES)

if TYPE_CHECKING:

    def __getattr__(name: str) -> Any: ...
