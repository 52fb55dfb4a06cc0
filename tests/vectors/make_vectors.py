#!/usr/bin/env python3
"""Makes the golden vectors from the definitions, with exact fractions, sharing no code with the engine.

  make_vectors.py            writes the CSV files beside this script
  make_vectors.py --check    exit code 1 if they differ from what would be written
  make_vectors.py --header F writes them as C arrays, for firmware builds

README.md describes the files.
"""

import argparse
import csv
import io
import pathlib
import sys
import zlib
from fractions import Fraction

HERE = pathlib.Path(__file__).resolve().parent


# --- The definitions ---------------------------------------------------------------------------------------------

class Table:
    """Delays in time units; both sides from slow to fast."""

    def __init__(self, unit_ns, accel, decel=None, cruise=None):
        self.unit_ns = unit_ns
        self.accel = accel
        self.decel = accel if decel is None else decel
        self.cruise = accel[-1] if cruise is None else cruise

    def a(self, i):
        return self.accel[i] if i < len(self.accel) else self.cruise

    def d(self, i):
        return self.decel[i] if i < len(self.decel) else self.cruise

    def move(self, steps):
        return [max(self.a(j - 1), self.d(steps - j), self.cruise) for j in range(1, steps + 1)]

    def crc32(self):
        symmetric = self.decel is self.accel
        numbers = [len(self.accel), 0 if symmetric else len(self.decel), self.cruise]
        data = b"".join(n.to_bytes(2, "little") for n in numbers) + self.unit_ns.to_bytes(4, "little")
        codes = self.accel if symmetric else self.accel + self.decel
        return zlib.crc32(data + b"".join(code.to_bytes(2, "little") for code in codes))

    def parts(self, steps):
        """How many steps of a move are made at the accelerating side's delays, at cruise, and at the decelerating
        side's."""
        kinds = ""
        for j in range(1, steps + 1):
            a, d = self.a(j - 1), self.d(steps - j)
            kinds += "c" if max(a, d) <= self.cruise else "a" if a >= d else "d"
        assert kinds == "".join(sorted(kinds, key="acd".index))
        return kinds.count("a"), kinds.count("c"), kinds.count("d")

    def ramp_down(self, delay):
        """The delays after a step made at `delay`: the fewest steps k with D(k) <= delay."""
        k = 0
        while k < len(self.decel) and self.d(k) > delay:
            k += 1
        return [self.d(i) for i in range(k - 1, -1, -1)]


def position(delays_ns, time_ns, over_ns, fine):
    """In 1/256 step at a time after the beginning; the first delay was over by `over_ns` then."""
    elapsed = time_ns + over_ns
    steps = 0
    for delay in delays_ns:
        if elapsed < delay:
            return steps * 256 + (int(Fraction(elapsed) * 256 / delay) if fine else 0)
        elapsed -= delay
        steps += 1
    return steps * 256


def displacements(delays, unit_ns, tick_ns, fine, over_ns=0, start=0):
    """Signed 1/256 steps of every tick until the last step is made."""
    delays_ns = [delay * unit_ns for delay in delays]
    total = sum(delays_ns) - over_ns
    at, out, n = start, [], 0
    while n * tick_ns < total:
        n += 1
        now = position(delays_ns, n * tick_ns, over_ns, fine)
        out.append(now - at)
        at = now
    return out


def encode_displacements(values, direction, fine):
    if fine:
        return b"".join((value * direction).to_bytes(2, "little", signed=True) for value in values)
    return bytes((0x80 if direction > 0 else 0) | value // 256 for value in values)


def slots_of(displacement, remainder, slot_count, crossing):
    """Slots of one tick's steps, and the remainder after it."""
    direction = -1 if displacement < 0 else 1
    distance = abs(displacement)
    slots = []
    i = 0
    while distance and crossing + 256 * i - remainder * direction <= distance:
        share = Fraction(crossing + 256 * i - remainder * direction, distance)
        slots.append(min(int(share * slot_count), slot_count - 1))
        i += 1
    return slots, remainder + displacement - 256 * len(slots) * direction


def identify_slot(unique_id, salt, slots):
    mask = 0xFFFFFFFF
    value = 2166136261
    for byte in unique_id + salt.to_bytes(2, "little"):
        value = (value ^ byte) * 16777619 & mask
    value = (value ^ value >> 16) * 0x85EBCA6B & mask
    value = (value ^ value >> 13) * 0xC2B2AE35 & mask
    return (value ^ value >> 16) % slots


def cobs(raw):
    out = bytearray()
    for block in raw.split(b"\0"):
        out += bytes([len(block) + 1]) + block
    return bytes(out)


def frame(address, kind, tag, payload):
    raw = bytes([address, kind, tag]) + payload
    raw += zlib.crc32(raw).to_bytes(4, "little")
    assert len(raw) <= 254
    return cobs(raw) + b"\0"


# --- The tables and moves chosen ---------------------------------------------------------------------------------

TABLES = {
    # Readable by hand: delays of a move of five steps are 5 4 3 3 6.
    "small": Table(1000, [5, 4, 3], [6, 3, 2], cruise=3),
    # One code: no ramp at all.
    "flat": Table(40000, [20]),
    # BUSHD-2 like: 238 codes from F_start = 100 Hz to 25 F_start in units of 40 us.
    "bushd2": Table(40000, [250 - i - (2 * i) // 237 for i in range(237)] + [10]),
    # The sides differ in length and shape; cruise slower than the fastest codes; a unit no tick is a multiple of.
    "uneven": Table(777, [5000, 3100, 2400, 2010, 1800, 1650, 1550], [4000, 1500], cruise=1600),
    # Microstepping: short delays, many steps in a tick.
    "micro": Table(200, [400 * 12 // (12 + i) for i in range(60)]),
    # Delays longer than a tick.
    "slow": Table(1000000, [9, 7, 5]),
}

# (table, steps, tick_ns, format, ramp-down at the beginning of tick or None)
MOVES = [
    ("small", 5, 4000, "coarse", None), ("small", 5, 4000, "fine", None), ("small", -5, 4000, "fine", None),
    ("small", 1, 4000, "coarse", None), ("small", -1, 4000, "coarse", None), ("small", 2, 1000, "fine", None),
    ("small", 9, 4000, "fine", 2), ("small", 9, 4000, "coarse", 0),
    ("flat", 1, 2560000, "fine", None), ("flat", 40, 2560000, "coarse", None), ("flat", -41, 2560000, "fine", 7),
    ("bushd2", 1, 2560000, "coarse", None), ("bushd2", 30, 2560000, "fine", None),
    ("bushd2", -31, 2560000, "coarse", None), ("bushd2", 520, 2560000, "coarse", None),
    ("bushd2", 476, 2560000, "coarse", 300),
    ("uneven", 30, 2560000, "fine", None), ("uneven", -30, 1000000, "coarse", None),
    ("uneven", 12, 1000000, "fine", 9), ("uneven", 8, 777777, "fine", None),
    ("micro", 500, 1000000, "coarse", None), ("micro", -499, 1000000, "fine", None),
    ("micro", 500, 1000000, "fine", 9), ("micro", 60, 1000001, "coarse", None),
    ("slow", 6, 2560000, "fine", None), ("slow", -3, 2560000, "coarse", None), ("slow", 6, 2560000, "fine", 5),
]

# (table, delay, fraction, direction, tick_ns, format)
TAKE_OVERS = [
    ("small", 3, 0, 1, 4000, "coarse"), ("small", 6, 255, -1, 4000, "fine"), ("bushd2", 200, 128, 1, 2560000, "fine"),
    ("bushd2", 230, 17, -1, 2560000, "fine"), ("bushd2", 235, 0, 1, 2560000, "coarse"),
    ("uneven", 1600, 99, 1, 2560000, "fine"), ("micro", 100, 200, -1, 1000000, "fine"),
    ("slow", 5, 1, 1, 2560000, "fine"),
]

# (slot_count, crossing, displacements)
SLOTS = [
    (128, 128, [256, -256, 512, 768, -1280, 0]), (256, 128, [256, 1792, -2816]), (128, 128, [256 * 40]),
    (128, 256, [100, 100, 100, -44, -300, -212, 0, 900]), (256, 256, [255, 1, 1, -513, 2600, -2343]),
    (256, 256, [1000, 1000, 1000, -3000]), (128, 256, [256 * 30 + 7, -256 * 30 - 7]),
]

# (table, steps, tick_ns, format, ramp-down at the beginning of tick or None, saved at the beginning of tick, ticks)
RUN_STATES = [
    ("small", 5, 4000, "fine", None, 0, 6), ("small", -5, 4000, "fine", None, 3, 3),
    ("flat", 40, 2560000, "coarse", None, 1, 5), ("flat", -41, 2560000, "fine", 7, 7, 1),
    ("bushd2", 520, 2560000, "fine", None, 0, 100), ("bushd2", 520, 2560000, "coarse", None, 488, 3),
    ("bushd2", 520, 2560000, "fine", None, 170, 190), ("bushd2", 520, 2560000, "fine", None, 488, 190),
    ("bushd2", -476, 2560000, "coarse", 100, 100, 2), ("bushd2", 476, 2560000, "coarse", 100, 104, 40),
    ("uneven", 30, 2560000, "fine", None, 3, 9), ("uneven", -30, 1000000, "coarse", None, 12, 2),
    ("uneven", 12, 1000000, "fine", 9, 9, 9), ("uneven", 8, 777777, "fine", None, 5, 1),
    ("micro", 500, 1000000, "coarse", None, 4, 100), ("slow", 6, 2560000, "fine", 5, 6, 4),
]

# (unique id, salt, slots)
IDENTIFY_SLOTS = [
    ("0000000000000000", 0, 1), ("0000000000000000", 0, 16), ("0000000000000001", 0, 16), ("0000000000000000", 1, 16),
    ("62757368643a0001", 4660, 8), ("62757368643a0002", 4660, 8), ("ffffffffffffffff", 65535, 255),
    ("0102030405060708", 513, 100),
]

ID = [98, 117, 115, 104, 0, 255, 1, 2]

# A payload field: (name, bytes; negative: signed).
LAYOUTS = {
    "identify": (0x01, [("salt", 2), ("slots", 1), ("slot_units", 2)]),
    "configure": (0x02, [("tick_ns", 4), ("format", 1), ("silence_ticks", 2)]),
    "table_begin": (0x03, [("slot", 1), ("accel_count", 2), ("decel_count", 2), ("cruise", 2), ("time_unit_ns", 4),
                           ("revision", 4)]),
    "table_data": (0x04, [("slot", 1), ("offset", 2), ("count", 1), ("codes", [2])]),
    "table_end": (0x05, [("slot", 1), ("crc", 4)]),
    "assign": (0x06, [("motor", 1), ("slot", 1)]),
    "control": (0x07, [("actions", 1)]),
    "set_position": (0x08, [("motor", 1), ("position_steps", -4)]),
    "poll": (0x09, [("count", 1), ("entries", [1, 2])]),
    "sync": (0x0A, [("master", 2), ("mark", 4), ("follows", 1), ("known_mark", 4), ("mark_tick", 4), ("mark_ns", 4)]),
    "ticks": (0x0B, [("epoch", 1), ("flags", 1), ("first_tick", 4), ("count", 1), ("mask", 2), ("delays", [2]),
                     ("displacements", [1])]),
    "table_ticks": (0x0C, [("epoch", 1), ("flags", 1), ("first_tick", 4), ("count", 2), ("entries", "run_state")]),
    "table_run": (0x0D, [("epoch", 1), ("first_tick", 4), ("entries", "table_run")]),
    "emergency": (0x0E, [("how", 1)]),
    "set_address": (0x0F, [("unique_id", [1]), ("address", 1)]),
    "get_tables": (0x10, []),
    "identity": (0x81, [("protocol_version", 1), ("motors", 1), ("firmware_version", 2), ("boot_number", 2),
                        ("slots", 2), ("queue_ticks", 2), ("table_codes", 2), ("capabilities", 2),
                        ("unique_id", [1])]),
    "report": (0x89, [("state", 1), ("faults", 1), ("flags", 1), ("epoch", 1), ("boot_number", 2), ("tick", 4),
                      ("tick_ns", 4), ("mark", 4), ("mark_tick", 4), ("mark_ns", 4), ("rate_ppb", -4), ("moving", 2),
                      ("running", 2), ("inputs", 2), ("bad_frames", 2), ("rejected_frames", 2), ("last_rejection", 1),
                      ("run_downs", 2), ("low_water_ticks", 2), ("islands", 2), ("island_from", 2),
                      ("island_until", 2), ("motor_count", 1), ("motor", [-4, 2])]),
    "tables": (0x90, [("valid", 1), ("held", [4, 4])]),
    "acknowledgement": (0x82, [("status", 1)]),
}

FRAMES = [
    (1, 7, "identify", {"salt": 0, "slots": 1, "slot_units": 0}),
    (0, 7, "identify", {"salt": 4660, "slots": 16, "slot_units": 120}),
    (0, 255, "poll", {"count": 1, "entries": [[2, 50]]}),
    (0, 1, "poll", {"count": 3, "entries": [[1, 50], [2, 260], [255, 65535]]}),
    (1, 1, "configure", {"tick_ns": 2560000, "format": 1, "silence_ticks": 400}),
    (3, 2, "table_begin", {"slot": 2, "accel_count": 238, "decel_count": 0, "cruise": 10, "time_unit_ns": 40000,
                           "revision": 7}),
    (3, 3, "table_data", {"slot": 2, "offset": 120, "count": 4, "codes": [250, 256, 1, 65535]}),
    (3, 4, "table_end", {"slot": 2, "crc": 0xCBF43926}),
    (1, 5, "assign", {"motor": 15, "slot": 7}),
    (1, 6, "control", {"actions": 5}),
    (1, 7, "set_position", {"motor": 0, "position_steps": -310}),
    (0, 41, "sync", {"master": 4660, "mark": 1, "follows": 0, "known_mark": 0, "mark_tick": 0, "mark_ns": 0}),
    (0, 42, "sync", {"master": 4660, "mark": 66051, "follows": 1, "known_mark": 66050, "mark_tick": 100000,
                     "mark_ns": 1280000}),
    (1, 8, "ticks", {"epoch": 3, "flags": 0, "first_tick": 1000, "count": 2, "mask": 0x8003, "delays": [9, 8, 0],
                     "displacements": [0x81, 0x02, 0x80, 0x83, 0x00, 0xFF]}),
    (1, 9, "ticks", {"epoch": 3, "flags": 4, "first_tick": 1002, "count": 3, "mask": 0x0010, "delays": [250],
                     "displacements": [0x80, 0x80, 0x81]}),
    (1, 9, "ticks", {"epoch": 4, "flags": 3, "first_tick": 1002, "count": 1, "mask": 0x0005, "delays": [10, 0],
                     "displacements": [0x00, 0x01, 0x80, 0xFF]}),
    (1, 10, "table_ticks", {"epoch": 4, "flags": 4, "first_tick": 1100, "count": 190,
                            "entries": [[3, 1, 0, 0, 0, 0, 0, 237, 46, 237]]}),
    # Motors that cruise, ramp down in the middle of a step, speed up.
    (1, 11, "table_ticks", {"epoch": 4, "flags": 0, "first_tick": 1290, "count": 300,
                            "entries": [[0, -1, 1, 9, 0, 0, 0, 0, 0, 0], [1, 1, 0, 7, 39999, 12, 200, 237, 0, 201],
                                        [15, 1, 0, 65535, 0, 0, 5, 6, 2147483647, 65535]]}),
    (1, 12, "table_ticks", {"epoch": 5, "flags": 2, "first_tick": 0xFFFFFFFF, "count": 1,
                            "entries": [[7, 1, 1, 0, 1, 0, 0, 0, 0, 0]]}),
    (1, 13, "table_run", {"epoch": 5, "first_tick": 2000, "entries": [[0, 2, 1, 200]]}),
    (1, 14, "table_run", {"epoch": 5, "first_tick": 2000, "entries": [[1, 0, -1, 1], [15, 7, 1, 2147483647]]}),
    (0, 15, "emergency", {"how": 0}),
    (2, 16, "emergency", {"how": 1}),
    (0, 17, "set_address", {"unique_id": ID, "address": 9}),
    (9, 18, "get_tables", {}),
    (1, 7, "identity", {"protocol_version": 2, "motors": 16, "firmware_version": 258, "boot_number": 4660,
                        "slots": 128, "queue_ticks": 256, "table_codes": 2048, "capabilities": 15, "unique_id": ID}),
    (2, 255, "report", {"state": 2, "faults": 0, "flags": 7, "epoch": 3, "boot_number": 4660, "tick": 1001,
                        "tick_ns": 1999999, "mark": 66050, "mark_tick": 990, "mark_ns": 0, "rate_ppb": -48000,
                        "moving": 3, "running": 2, "inputs": 0, "bad_frames": 1, "rejected_frames": 65535,
                        "last_rejection": 6, "run_downs": 0, "low_water_ticks": 117, "islands": 1,
                        "island_from": 1200, "island_until": 1390, "motor_count": 2,
                        "motor": [[-310, 1010], [2147483647, 65535]]}),
    (9, 18, "tables", {"valid": 5, "held": [[0xCBF43926, 7], [0, 0], [1, 4294967295], [0, 0], [0, 0], [0, 0], [0, 0],
                                            [0, 0]]}),
    (1, 6, "acknowledgement", {"status": 8}),
    # The longest payload without a zero, and the longest of zeros.
    (255, 255, "ticks", {"epoch": 255, "flags": 1, "first_tick": 0xFFFFFFFF, "count": 118, "mask": 0x0100,
                         "delays": [257], "displacements": [1] * 236}),
    (0, 0, "ticks", {"epoch": 0, "flags": 0, "first_tick": 0, "count": 236, "mask": 0x0001, "delays": [0],
                     "displacements": [0] * 236}),
]


def run_state_bytes(motor, direction, cruises, since, since_ns, lead, accel_at, accel_end, cruise_left, decel_left):
    head = motor | (0x80 if direction > 0 else 0) | (0 if cruises else 0x40)
    out = since.to_bytes(2, "little")
    if since_ns:
        head |= 0x20
        out += since_ns.to_bytes(4, "little")
    if lead:
        head |= 0x10
        out += lead.to_bytes(2, "little")
    if not cruises:
        for value, width in ((accel_at, 2), (accel_end, 2), (cruise_left, 4), (decel_left, 2)):
            out += value.to_bytes(width, "little")
    return bytes([head]) + out


def table_run_bytes(motor, slot, direction, steps):
    return bytes([motor | slot << 4 | (0x80 if direction > 0 else 0)]) + steps.to_bytes(4, "little")


ENTRIES = {"run_state": run_state_bytes, "table_run": table_run_bytes}


def payload_of(layout, fields):
    out = b""
    for name, width in layout:
        value = fields[name]
        if isinstance(width, int):
            out += value.to_bytes(abs(width), "little", signed=width < 0)
            continue
        if isinstance(width, str):
            out += b"".join(ENTRIES[width](*element) for element in value)
            continue
        for element in value:
            parts = element if isinstance(element, list) else [element]
            out += b"".join(p.to_bytes(abs(w), "little", signed=w < 0) for p, w in zip(parts, width, strict=True))
    return out


# --- The vectors -------------------------------------------------------------------------------------------------

def delays_of(table, steps, tick_ns, stop):
    """Of a move, or of one that is asked to ramp down at the beginning of a tick; and the step that runs then."""
    delays = table.move(steps)
    if stop is None:
        return delays, None
    made = steps_made(table, delays, stop * tick_ns)
    if made == len(delays):
        return delays, None
    return delays[:made + 1] + table.ramp_down(delays[made]), made


def steps_made(table, delays, time_ns):
    return position([d * table.unit_ns for d in delays], time_ns, 0, False) // 256


def move_bytes(name, steps, tick_ns, form, stop):
    table, fine = TABLES[name], form == "fine"
    delays, _ = delays_of(table, abs(steps), tick_ns, stop)
    values = displacements(delays, table.unit_ns, tick_ns, fine)
    assert sum(values) == 256 * len(delays)
    return encode_displacements(values, -1 if steps < 0 else 1, fine)


def run_state(name, steps, tick_ns, form, stop, tick, ticks):
    """The fields of an entry of TABLE_TICKS behind the motor, at the beginning of `tick`, for `ticks` more."""
    table = TABLES[name]
    direction = -1 if steps < 0 else 1
    delays, stopped_at = delays_of(table, abs(steps), tick_ns, stop if stop is not None and stop <= tick else None)
    made = steps_made(table, delays, tick * tick_ns)
    assert made < len(delays)
    since, since_ns = divmod(tick * tick_ns - table.unit_ns * sum(delays[:made]), table.unit_ns)
    if stopped_at is not None:
        # The part of the accelerating side that the ramp-down gave up is empty, and stays named by its end.
        accel_end = table.parts(abs(steps))[0]
        lead = delays[stopped_at] if made == stopped_at else 0
        return [direction, 0, since, since_ns, lead, accel_end, accel_end, 0, len(delays) - max(made, stopped_at + 1)]
    accel, cruise, decel = table.parts(abs(steps))
    left_at_end = delays[steps_made(table, delays, (tick + ticks) * tick_ns):]
    cruises = made >= accel and len(left_at_end) > decel
    return [direction, int(cruises), since, since_ns, 0] + ([0] * 4 if cruises else [
        min(made, accel), accel, min(cruise, max(0, accel + cruise - made)), min(decel, len(delays) - made)])


def rest_bytes(name, steps, tick_ns, form, stop, tick, ticks):
    width = 2 if form == "fine" else 1
    return move_bytes(name, steps, tick_ns, form, stop)[tick * width:(tick + ticks) * width]


def take_over_bytes(name, delay, fraction, direction, tick_ns, form):
    table, fine = TABLES[name], form == "fine"
    over_ns = -(-delay * table.unit_ns * fraction // 256)
    delays = [delay] + table.ramp_down(delay)
    start = fraction if fine else 0
    return encode_displacements(displacements(delays, table.unit_ns, tick_ns, fine, over_ns, start), direction, fine)


def slot_lists(slot_count, crossing, values):
    remainder, lists = 0, []
    for value in values:
        slots, remainder = slots_of(value, remainder, slot_count, crossing)
        lists.append(slots)
    return lists, remainder


def field_text(value):
    if isinstance(value, list):
        return ":".join("/".join(map(str, v)) if isinstance(v, list) else str(v) for v in value)
    return str(value)


def csv_files():
    files = {}

    def write(name, header, rows):
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(header)
        writer.writerows(rows)
        files[name] = text.getvalue()

    def join(values):
        return " ".join(map(str, values))

    write("tables.csv", ["table", "time_unit_ns", "cruise", "accel", "decel", "crc32"],
          [[n, t.unit_ns, t.cruise, join(t.accel), "" if t.decel is t.accel else join(t.decel), t.crc32()] for n, t in TABLES.items()])
    write("moves.csv", ["table", "steps", "tick_ns", "format", "ramp_down_at_tick", "displacements"],
          [[*m[:4], "" if m[4] is None else m[4], move_bytes(*m).hex()] for m in MOVES])
    write("take_overs.csv", ["table", "delay", "fraction", "direction", "tick_ns", "format", "displacements"],
          [[*t, take_over_bytes(*t).hex()] for t in TAKE_OVERS])
    write("run_states.csv", ["table", "steps", "tick_ns", "format", "ramp_down_at_tick", "tick", "ticks", "state",
                             "displacements"],
          [[*r[:4], "" if r[4] is None else r[4], *r[5:], field_text([run_state(*r)]), rest_bytes(*r).hex()]
           for r in RUN_STATES])
    write("identify_slots.csv", ["unique_id", "salt", "slots", "slot"],
          [[*one, identify_slot(bytes.fromhex(one[0]), *one[1:])] for one in IDENTIFY_SLOTS])
    slots = []
    for slot_count, crossing, values in SLOTS:
        lists, remainder = slot_lists(slot_count, crossing, values)
        slots.append([slot_count, crossing, join(values), ";".join(join(one) for one in lists), remainder])
    write("slots.csv", ["slot_count", "crossing", "displacements", "slots", "remainder"], slots)
    frames = []
    for address, tag, message, fields in FRAMES:
        kind, layout = LAYOUTS[message]
        frames.append([message, address, kind, tag, " ".join(f"{k}={field_text(v)}" for k, v in fields.items()),
                       frame(address, kind, tag, payload_of(layout, fields)).hex()])
    write("frames.csv", ["message", "address", "type", "tag", "fields", "wire"], frames)
    return files


# --- The same as C -----------------------------------------------------------------------------------------------

def c_array(kind, name, values):
    lines = [f"static const {kind} {name}[] = {{"]
    line = "   "
    for value in values:
        if len(line) + len(str(value)) > 96:
            lines.append(line)
            line = "   "
        line += f" {value},"
    return "\n".join([*lines, line, "};"])


def c_state(state):
    direction, cruises, *numbers = state
    return f"{{{direction}, {'true' if cruises else 'false'}, {', '.join(f'{n}u' for n in numbers)}}}"


def c_encoder(index, message, fields):
    """A function that makes the payload by the engine's encoder."""
    head = f"static size_t encode_{index}(uint8_t* payload) {{"
    if not fields:
        return f"{head}\n  (void)payload;\n  return 0;\n}}"
    lines = [head]
    if message == "table_data":
        lines.append(f"  static const uint16_t codes[] = {{{', '.join(map(str, fields['codes']))}}};")
        lines.append(f"  return bushd_encode_table_data({fields['slot']}, {fields['offset']}, {fields['count']}, codes, "
                     "payload);")
    elif message == "poll":
        entries = ", ".join(f"{{{address}, {begin}}}" for address, begin in fields["entries"])
        lines.append(f"  static const bushd_poll_entry entries[] = {{{entries}}};")
        lines.append(f"  return bushd_encode_poll(entries, {fields['count']}, payload);")
    elif message == "table_ticks":
        entries = ", ".join(f"{{{entry[0]}, {c_state(entry[1:])}}}" for entry in fields["entries"])
        lines.append(f"  static const bushd_table_ticks_entry entries[] = {{{entries}}};")
        lines.append(f"  return bushd_encode_table_ticks({fields['epoch']}, {fields['flags']}, "
                     f"UINT32_C({fields['first_tick']}), {fields['count']}, entries, {len(fields['entries'])}, payload);")
    elif message == "table_run":
        entries = ", ".join(f"{{{motor}, {slot}, {direction}, {steps}}}"
                            for motor, slot, direction, steps in fields["entries"])
        lines.append(f"  static const bushd_table_run_entry entries[] = {{{entries}}};")
        lines.append(f"  return bushd_encode_table_run({fields['epoch']}, UINT32_C({fields['first_tick']}), entries, "
                     f"{len(fields['entries'])}, payload);")
    elif message == "ticks":
        delays = "delays"
        lines.append(f"  static const uint16_t delays[] = {{{', '.join(map(str, fields['delays']))}}};")
        lines.append("  " + c_array("uint8_t", "displacements", fields["displacements"]).replace("\n", "\n  "))
        lines.append(f"  const size_t head = bushd_encode_ticks_head({fields['epoch']}, {fields['flags']}, "
                     f"UINT32_C({fields['first_tick']}), {fields['count']}, {fields['mask']}, {delays}, payload);")
        lines.append("  memcpy(payload + head, displacements, sizeof displacements);")
        lines.append("  return head + sizeof displacements;")
    else:
        lines.append(f"  bushd_{message} message;")
        lines.append("  memset(&message, 0, sizeof message);")
        for name, value in fields.items():
            if name == "motor" and isinstance(value, list):
                for i, (steps, until) in enumerate(value):
                    lines.append(f"  message.motor[{i}].position_steps = {steps};")
                    lines.append(f"  message.motor[{i}].known_until = {until};")
            elif name == "unique_id":
                lines += [f"  message.unique_id[{i}] = {byte};" for i, byte in enumerate(value)]
            elif message == "tables":
                for i, held in enumerate(fields["held"] if name == "held" else []):
                    lines.append(f"  message.slot[{i}].valid = {'true' if fields['valid'] >> i & 1 else 'false'};")
                    lines.append(f"  message.slot[{i}].crc = UINT32_C({held[0]});")
                    lines.append(f"  message.slot[{i}].revision = UINT32_C({held[1]});")
            elif name == "how":
                lines.append(f"  message.how = {'BUSHD_CUT' if value else 'BUSHD_RAMP_DOWN'};")
            elif name == "follows":
                lines.append(f"  message.follows = {'true' if value else 'false'};")
            elif name == "format":
                lines.append(f"  message.format = {'BUSHD_FORMAT_FINE' if value else 'BUSHD_FORMAT_COARSE'};")
            else:
                lines.append(f"  message.{name} = {value};")
        lines.append(f"  return bushd_encode_{message}(&message, payload);")
    return "\n".join([*lines, "}"])


def c_header():
    out = ["// Made by tests/vectors/make_vectors.py.", ""]
    for name, table in TABLES.items():
        out.append(c_array("uint16_t", f"kAccel_{name}", table.accel))
        if table.decel is not table.accel:
            out.append(c_array("uint16_t", f"kDecel_{name}", table.decel))
    rows = []
    for name, table in TABLES.items():
        decel = f"kAccel_{name}" if table.decel is table.accel else f"kDecel_{name}"
        rows.append(f"    {{{{kAccel_{name}, {len(table.accel)}, NULL, NULL, 0}}, "
                    f"{{{decel}, {len(table.decel)}, NULL, NULL, 0}}, {table.cruise}, {table.unit_ns}}},")
    out += ["static const bushd_table kTables[] = {", *rows, "};", ""]
    out += [c_array("uint32_t", "kTableCrcs", [f"UINT32_C({table.crc32()})" for table in TABLES.values()]), ""]
    numbers = {name: i for i, name in enumerate(TABLES)}

    rows = []
    for i, (name, steps, tick_ns, form, stop) in enumerate(MOVES):
        data = move_bytes(name, steps, tick_ns, form, stop)
        out.append(c_array("uint8_t", f"kMove_{i}", data))
        rows.append(f"    {{&kTables[{numbers[name]}], {abs(steps)}, {-1 if steps < 0 else 1}, {tick_ns}, "
                    f"{'true' if form == 'fine' else 'false'}, {-1 if stop is None else stop}, kMove_{i}, {len(data)}}},")
    out += ["static const move_vector kMoves[] = {", *rows, "};", ""]

    rows = []
    for i, take in enumerate(TAKE_OVERS):
        name, delay, fraction, direction, tick_ns, form = take
        data = take_over_bytes(*take)
        out.append(c_array("uint8_t", f"kTakeOver_{i}", data))
        rows.append(f"    {{&kTables[{numbers[name]}], {delay}, {fraction}, {direction}, {tick_ns}, "
                    f"{'true' if form == 'fine' else 'false'}, kTakeOver_{i}, {len(data)}}},")
    out += ["static const take_over_vector kTakeOvers[] = {", *rows, "};", ""]

    rows = []
    for i, saved in enumerate(RUN_STATES):
        name, steps, tick_ns, form, stop, tick, ticks = saved
        data = rest_bytes(*saved)
        out.append(c_array("uint8_t", f"kRest_{i}", data))
        rows.append(f"    {{&kTables[{numbers[name]}], {abs(steps)}, {-1 if steps < 0 else 1}, {tick_ns}, "
                    f"{'true' if form == 'fine' else 'false'}, {-1 if stop is None else stop}, {tick}, {ticks}, "
                    f"{c_state(run_state(*saved))}, kRest_{i}, {len(data)}}},")
    out += ["static const run_state_vector kRunStates[] = {", *rows, "};", ""]

    rows = [f"    {{{{{', '.join(map(str, bytes.fromhex(unique_id)))}}}, {salt}, {slots}, "
            f"{identify_slot(bytes.fromhex(unique_id), salt, slots)}}}," for unique_id, salt, slots in IDENTIFY_SLOTS]
    out += ["static const identify_slot_vector kIdentifySlots[] = {", *rows, "};", ""]

    rows = []
    for i, (slot_count, crossing, values) in enumerate(SLOTS):
        lists, remainder = slot_lists(slot_count, crossing, values)
        out.append(c_array("int16_t", f"kDisplacements_{i}", values))
        # The slots of all ticks in a row; -1 ends a tick.
        out.append(c_array("int16_t", f"kSlots_{i}", [slot for one in lists for slot in [*one, -1]]))
        rows.append(f"    {{{slot_count}, {crossing}, kDisplacements_{i}, {len(values)}, kSlots_{i}, {remainder}}},")
    out += ["static const slots_vector kSlots[] = {", *rows, "};", ""]

    rows = []
    for i, (address, tag, message, fields) in enumerate(FRAMES):
        kind, layout = LAYOUTS[message]
        wire = frame(address, kind, tag, payload_of(layout, fields))
        out.append(c_encoder(i, message, fields))
        out.append(c_array("uint8_t", f"kWire_{i}", wire))
        rows.append(f"    {{{address}, {kind}, {tag}, encode_{i}, kWire_{i}, {len(wire)}}},")
    out += ["static const frame_vector kFrames[] = {", *rows, "};", ""]
    return "\n".join(out)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--check", action="store_true", help="compare instead of writing")
    parser.add_argument("--header", type=pathlib.Path, metavar="FILE", help="write C arrays")
    arguments = parser.parse_args()
    if arguments.header:
        arguments.header.write_text(c_header(), encoding="utf-8")
        return 0
    status = 0
    for name, text in csv_files().items():
        path = HERE / name
        if not arguments.check:
            path.write_text(text, encoding="utf-8")
        elif not path.exists() or path.read_text(encoding="utf-8") != text:
            print(f"{path}: differs from what {pathlib.Path(__file__).name} makes; run it and look at the difference")
            status = 1
    return status


if __name__ == "__main__":
    sys.exit(main())
