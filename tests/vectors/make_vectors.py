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


def crc16(data):
    crc = 0xFFFF
    for byte in data:
        crc ^= byte << 8
        for _ in range(8):
            crc = ((crc << 1) ^ 0x1021 if crc & 0x8000 else crc << 1) & 0xFFFF
    return crc


def cobs(raw):
    out = bytearray()
    for block in raw.split(b"\0"):
        out += bytes([len(block) + 1]) + block
    return bytes(out)


def frame(address, kind, tag, payload):
    raw = bytes([address, kind, tag]) + payload
    raw += crc16(raw).to_bytes(2, "little")
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

# A payload field: (name, bytes; negative: signed).
LAYOUTS = {
    "identify": (0x01, []),
    "configure": (0x02, [("tick_ns", 4), ("format", 1)]),
    "table_begin": (0x03, [("slot", 1), ("accel_count", 2), ("decel_count", 2), ("cruise", 2), ("time_unit_ns", 4)]),
    "table_data": (0x04, [("slot", 1), ("offset", 2), ("count", 1), ("codes", [2])]),
    "table_end": (0x05, [("slot", 1), ("crc", 2)]),
    "assign": (0x06, [("motor", 1), ("slot", 1)]),
    "control": (0x07, [("actions", 1)]),
    "set_position": (0x08, [("motor", 1), ("position_steps", -4)]),
    "poll": (0x09, []),
    "sync": (0x0A, [("follows", 1), ("mark_tag", 1), ("mark_tick", 4), ("mark_ns", 4)]),
    "ticks": (0x0B, [("epoch", 1), ("flags", 1), ("first_tick", 4), ("count", 1), ("mask", 2), ("delays", [2]),
                     ("displacements", [1])]),
    "identity": (0x81, [("protocol_version", 1), ("motors", 1), ("firmware_version", 2), ("boot_number", 2),
                        ("slots", 2), ("queue_ticks", 2), ("table_codes", 2)]),
    "report": (0x89, [("state", 1), ("faults", 1), ("flags", 1), ("epoch", 1), ("boot_number", 2), ("tick", 4),
                      ("tick_ns", 4), ("mark_tag", 1), ("mark_tick", 4), ("mark_ns", 4), ("moving", 2), ("inputs", 2),
                      ("bad_frames", 2), ("rejected_frames", 2), ("last_rejection", 1), ("motor_count", 1),
                      ("motor", [-4, 2])]),
    "acknowledgement": (0x82, [("status", 1)]),
}

FRAMES = [
    (1, 7, "identify", {}),
    (2, 255, "poll", {}),
    (1, 1, "configure", {"tick_ns": 2560000, "format": 1}),
    (3, 2, "table_begin", {"slot": 2, "accel_count": 238, "decel_count": 0, "cruise": 10, "time_unit_ns": 40000}),
    (3, 3, "table_data", {"slot": 2, "offset": 120, "count": 4, "codes": [250, 256, 1, 65535]}),
    (3, 4, "table_end", {"slot": 2, "crc": 0x29B1}),
    (1, 5, "assign", {"motor": 15, "slot": 7}),
    (1, 6, "control", {"actions": 5}),
    (1, 7, "set_position", {"motor": 0, "position_steps": -310}),
    (0, 41, "sync", {"follows": 0, "mark_tag": 0, "mark_tick": 0, "mark_ns": 0}),
    (0, 42, "sync", {"follows": 1, "mark_tag": 41, "mark_tick": 100000, "mark_ns": 1280000}),
    (1, 8, "ticks", {"epoch": 3, "flags": 0, "first_tick": 1000, "count": 2, "mask": 0x8003, "delays": [],
                     "displacements": [0x81, 0x02, 0x80, 0x83, 0x00, 0xFF]}),
    (1, 9, "ticks", {"epoch": 3, "flags": 10, "first_tick": 1002, "count": 3, "mask": 0x0010, "delays": [250],
                     "displacements": [0x80, 0x80, 0x81]}),
    (1, 9, "ticks", {"epoch": 4, "flags": 7, "first_tick": 1002, "count": 1, "mask": 0x0005, "delays": [10, 0],
                     "displacements": [0x00, 0x01, 0x80, 0xFF]}),
    (1, 7, "identity", {"protocol_version": 1, "motors": 16, "firmware_version": 258, "boot_number": 4660,
                        "slots": 128, "queue_ticks": 256, "table_codes": 2048}),
    (2, 255, "report", {"state": 2, "faults": 0, "flags": 7, "epoch": 3, "boot_number": 4660, "tick": 1001,
                        "tick_ns": 1999999, "mark_tag": 42, "mark_tick": 990, "mark_ns": 0, "moving": 3, "inputs": 0,
                        "bad_frames": 1, "rejected_frames": 65535, "last_rejection": 6, "motor_count": 2,
                        "motor": [[-310, 1010], [2147483647, 65535]]}),
    (1, 6, "acknowledgement", {"status": 8}),
    # The longest payload without a zero, and the longest of zeros.
    (255, 255, "ticks", {"epoch": 255, "flags": 1, "first_tick": 0xFFFFFFFF, "count": 120, "mask": 0x0100, "delays": [],
                         "displacements": [1] * 240}),
    (0, 0, "ticks", {"epoch": 0, "flags": 0, "first_tick": 0, "count": 240, "mask": 0x0001, "delays": [],
                     "displacements": [0] * 240}),
]


def payload_of(layout, fields):
    out = b""
    for name, width in layout:
        value = fields[name]
        if isinstance(width, int):
            out += value.to_bytes(abs(width), "little", signed=width < 0)
            continue
        for element in value:
            parts = element if isinstance(element, list) else [element]
            out += b"".join(p.to_bytes(abs(w), "little", signed=w < 0) for p, w in zip(parts, width, strict=True))
    return out


# --- The vectors -------------------------------------------------------------------------------------------------

def move_bytes(name, steps, tick_ns, form, stop):
    table, fine = TABLES[name], form == "fine"
    delays = table.move(abs(steps))
    if stop is not None:
        made = position([d * table.unit_ns for d in delays], stop * tick_ns, 0, False) // 256
        if made < len(delays):
            delays = delays[:made + 1] + table.ramp_down(delays[made])
    values = displacements(delays, table.unit_ns, tick_ns, fine)
    assert sum(values) == 256 * len(delays)
    return encode_displacements(values, -1 if steps < 0 else 1, fine)


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

    write("tables.csv", ["table", "time_unit_ns", "cruise", "accel", "decel"],
          [[n, t.unit_ns, t.cruise, join(t.accel), join(t.decel)] for n, t in TABLES.items()])
    write("moves.csv", ["table", "steps", "tick_ns", "format", "ramp_down_at_tick", "displacements"],
          [[*m[:4], "" if m[4] is None else m[4], move_bytes(*m).hex()] for m in MOVES])
    write("take_overs.csv", ["table", "delay", "fraction", "direction", "tick_ns", "format", "displacements"],
          [[*t, take_over_bytes(*t).hex()] for t in TAKE_OVERS])
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
    elif message == "ticks":
        delays = "NULL"
        if fields["delays"]:
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
