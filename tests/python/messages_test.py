"""The Python client's messages against those that lcm-gen makes of the same types: fingerprints, and bytes both ways."""

import importlib
import os
import pathlib
import random
import re
import struct
import subprocess
import sys
import tempfile
import unittest

from bushd import messages

TYPES = pathlib.Path(__file__).resolve().parents[2] / "lib/lcm/types"
NUMBERS = {"boolean": "b", "int8_t": "b", "int16_t": "h", "int32_t": "i", "int64_t": "q"}
WORDS = ["", "theta", "a blank", "\u03b8\u00b0", "x" * 300]


def setUpModule():
    """lcm-gen goes by the package that a type names."""
    global lcm_types
    folder = tempfile.TemporaryDirectory()
    unittest.addModuleCleanup(folder.cleanup)
    for path in TYPES.glob("*.lcm"):
        text = re.sub("^package bushd;", "package of_lcm_gen;", path.read_text(encoding="utf-8"))
        (pathlib.Path(folder.name) / path.name).write_text(text, encoding="utf-8")
    made = sorted(str(path) for path in pathlib.Path(folder.name).glob("*.lcm"))
    subprocess.run([os.environ["LCM_GEN"], "--python", "--ppath", folder.name, *made], check=True, capture_output=True)
    sys.path.insert(0, folder.name)
    lcm_types = importlib.import_module("of_lcm_gen")


def names():
    return sorted(path.stem for path in TYPES.glob("*.lcm"))


def any_value(chance, kind):
    if kind in NUMBERS:
        bits = 8 * struct.calcsize(NUMBERS[kind])
        number = chance.choice([0, 1, -1, -(2 ** (bits - 1)), 2 ** (bits - 1) - 1, chance.getrandbits(bits - 1)])
        return bool(number) if kind == "boolean" else number
    if kind == "double":
        return chance.choice([0.0, -0.0, 1.5, -1e300, 5e-324, chance.random()])
    return chance.choice(WORDS) if kind == "string" else any_message(chance, kind)


def any_message(chance, name):
    """As this package has it."""
    kind = getattr(messages, name)
    lengths = {field.count: chance.choice([0, 1, 2, 5]) for field in kind.FIELDS if field.count}
    return kind(**{
        field.name: [any_value(chance, field.kind) for _ in range(lengths[field.count])] if field.count else any_value(chance, field.kind)
        for field in kind.FIELDS if field.name not in lengths
    })


def as_lcm_has_it(message):
    """The same, field by field."""
    other = getattr(lcm_types, type(message).__name__)()
    for field in message.FIELDS:
        value = getattr(message, field.name)
        if field.count:
            setattr(other, field.count, len(value))
        is_struct = hasattr(messages, field.kind)
        made = [as_lcm_has_it(one) if is_struct else one for one in (value if field.count else [value])]
        if not any(field.name == counted.count for counted in message.FIELDS):
            setattr(other, field.name, made if field.count else made[0])
    return other


def values_of(message):
    """Nested tuples, of either."""
    if hasattr(message, "__slots__"):
        return tuple((name, values_of(getattr(message, name))) for name in message.__slots__)
    return tuple(values_of(one) for one in message) if isinstance(message, (list, tuple, map)) else repr(message)


class AsLcmGenHasThem(unittest.TestCase):
    def test_types_fields_constants_and_fingerprints(self):
        self.assertGreater(len(names()), 50)
        for name in names():
            ours, theirs = getattr(messages, name), getattr(lcm_types, name)
            self.assertEqual([field.name for field in ours.FIELDS], list(theirs.__slots__), name)
            self.assertEqual(ours.FINGERPRINT, theirs._get_packed_fingerprint(), name)
            for constant in (word for word in dir(theirs) if word.isupper()):
                self.assertEqual(getattr(ours, constant), getattr(theirs, constant), (name, constant))
            self.assertEqual(ours().encode(), theirs().encode(), name)

    def test_bytes_both_ways(self):
        chance = random.Random(1985)
        for name in names():
            for _ in range(40):
                message = any_message(chance, name)
                payload = message.encode()
                self.assertEqual(as_lcm_has_it(message).encode(), payload, name)
                self.assertEqual(values_of(getattr(messages, name).decode(payload)), values_of(getattr(lcm_types, name).decode(payload)), name)


class Strict(unittest.TestCase):
    def assert_no_message(self, name, payload):
        with self.assertRaises(ValueError):
            getattr(messages, name).decode(payload)

    def test_what_no_encoder_makes_is_none(self):
        whole = messages.stop_t(motors=["theta"]).encode()
        begin = whole[: -len(b"\0\0\0\1\0\0\0\6theta\0")]
        self.assertEqual(messages.stop_t.decode(whole).motors, ["theta"])
        for wrong in (whole + b"\0", whole[:-1], whole[:-1] + b"x", begin + b"\xff\xff\xff\xff", begin + b"\x7f\xff\xff\xff",
                      begin + b"\0\0\0\1\0\0\0\0", begin + b"\0\0\0\1\0\0\0\6t\0eta\0", begin + b"\0\0\0\1\0\0\0\2\xff\0", b"", whole[:8]):
            self.assert_no_message("stop_t", wrong)
        self.assert_no_message("stop_t", messages.jog_t.FINGERPRINT + whole[8:])
        subscribe = messages.subscribe_t(state=True).encode()
        self.assert_no_message("subscribe_t", subscribe[:-1] + b"\2")

    def test_fields_take_what_they_can_say(self):
        self.assertEqual(messages.move_t(kind="ABSOLUTE").kind, messages.move_t.ABSOLUTE)
        for values in ({"nothing": 1}, {"kind": 1.5}, {"motors": 3}, {"speed": "fast"}, {"speed": float("nan")}):
            with self.assertRaises((TypeError, ValueError)):
                messages.move_t(**values)
        with self.assertRaises(ValueError):
            messages.get_table_t(table="a\0b")
        with self.assertRaises(ValueError):
            messages.jog_t(keepalive_ms=2**63).encode()


if __name__ == "__main__":
    unittest.main()
