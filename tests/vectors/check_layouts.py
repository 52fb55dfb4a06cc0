#!/usr/bin/env python3
"""Whether docs/protocol.md draws the payloads that messages.py describes, and whether frames.csv would show it if
the engine swapped two of their fields.

A box of a drawing is a line of borders, lines of names, another border and a line of types; the line above it has the
offsets. What cannot be drawn in bytes (`---- ... ----`) is compared by name only where it has parts of its own.
"""
import csv
import pathlib
import re
import sys

from messages import LAYOUTS

HERE = pathlib.Path(__file__).parent
PROTOCOL = HERE.parent.parent / "docs" / "protocol.md"

BY_CODE = {code: (name, layout) for name, (code, layout) in LAYOUTS.items()}
# How lists are drawn: their parts; none: as a size that varies.
PARTS = {
    "codes": [("code_0", 2)],
    "held": [("crc", 4), ("revision", 4)],
    "motor": [("position_steps", -4), ("known_until", 2)],
    "run_state": [("head", 1), ("since", 2), ("cruise", 2), ("since_ns", 4), ("lead", 2), ("accel_at", 2), ("accel_end", 2),
                  ("cruise_left", 4), ("decel_left", 2)],
    "table_run": [("head", 1), ("steps", 4), ("shortest_delay", 2)],
    "line": [("head", 1), ("increment", 4)],
    "entries": [("address", 1), ("begin", 2), ("known", 1), ("room", 1)],
    "unique_id": [("unique_id", 8)],
    "delays": [],
    "displacements": [],
    "bytes": [],
}
SHORTER = {"version": "protocol_version", "firmware": "firmware_version"}  # names in the drawings
# Messages of one byte that are told in words.
WITHOUT_DRAWING = {"control", "emergency", "acknowledgement", "get_tables", "get_program_state"}


def described(layout):
    """(name, width) of all fields, lists by their parts."""
    for name, width in layout:
        if isinstance(width, int):
            yield name, width
        else:
            yield from PARTS[width if isinstance(width, str) else name]


def width_of(text):
    """Bytes of a type, negative if signed; None: a size that varies."""
    if match := re.match(r"([ui])(8|16|32)$", text):
        return int(match[2]) // 8 * (1 if match[1] == "u" else -1)
    if match := re.match(r"(\d+) bytes$", text):
        return int(match[1])
    return None


def boxes(lines):
    """The drawings' cells: (line, offset, name, width), line by line."""
    at = 0
    while at < len(lines):
        number, border = lines[at]
        if not re.match(r" {4}\+-", border):
            at += 1
            continue
        last = next(n for n in range(at + 1, len(lines)) if re.match(r" {4}\+-", lines[n][1]))
        offsets, names, types = lines[at - 1][1], lines[at + 1:last], lines[last + 1][1]
        corners = [n for n, c in enumerate(border) if c == "+"]
        for left, right in zip(corners, corners[1:]):
            if not border[left + 1:right].strip():
                continue  # between two boxes
            name = " ".join(row[left + 1:right].strip() for _, row in names).strip()
            yield (number, re.sub(r"  .*", "", offsets[left:].strip()),
                   re.sub(r"[ -]+", "_", name.lower()), width_of(re.sub(r"  .*", "", types[left:].strip())))
        at = last + 2


def sections(text):
    """By the messages that a heading names: its lines."""
    found = {}
    codes = None
    for number, line in enumerate(text.splitlines(), 1):
        if line.startswith("#"):
            codes = tuple(int(code, 16) for code in re.findall(r"\b([0-9A-F]{2})\b", line)) \
                if line.startswith("### ") else None
        elif codes:
            found.setdefault(codes, []).append((number, line))
    return found


def check_drawings(text):
    problems = []
    drawn_messages = set()
    for codes, lines in sections(text).items():
        drawn = [cell for cell in boxes(lines) if cell[3] is not None]
        expected = []
        for code in codes:
            name, layout = BY_CODE[code]
            if name in WITHOUT_DRAWING:
                continue
            drawn_messages.add(name)
            expected += [(name, *field) for field in described(layout)]
        for (number, _, cell, width), (message, field, wanted) in zip(drawn, expected):
            if (SHORTER.get(cell, cell), width) != (field, wanted):
                problems.append(f"{PROTOCOL.name}:{number}: {message} has {cell} of {width} bytes, but in messages.py "
                                f"it is {field} of {wanted}")
                break
        else:
            if len(drawn) != len(expected):
                problems.append(f"{PROTOCOL.name}: {[BY_CODE[code][0] for code in codes]}: {len(drawn)} fields drawn, "
                                f"{len(expected)} in messages.py")
        end = 0
        for number, offset, cell, width in drawn:
            if not re.match(r"\d+$", offset):
                continue  # of an entry
            if int(offset) not in (0, end):
                problems.append(f"{PROTOCOL.name}:{number}: {cell} begins at {offset}, but what is before it ends at "
                                f"{end}")
            end = int(offset) + abs(width)
    missing = set(LAYOUTS) - drawn_messages - WITHOUT_DRAWING
    return problems + [f"{PROTOCOL.name}: no drawing of {name}" for name in sorted(missing)]


def check_frames(rows):
    """Some frame has different values in any two fields of a message that have one width."""
    problems = []
    for message, (_, layout) in LAYOUTS.items():
        fields = [dict(part.split("=", 1) for part in row["fields"].split())
                  for row in rows if row["message"] == message]
        if not fields:
            problems.append(f"frames.csv: no frame of {message}")
        single = [(name, abs(width)) for name, width in layout if isinstance(width, int)]
        for n, (one, width) in enumerate(single):
            for other, other_width in single[n + 1:]:
                if width == other_width and all(frame.get(one) == frame.get(other) for frame in fields):
                    problems.append(f"frames.csv: {message}: {one} and {other} could be swapped unseen")
    return problems


def main():
    with open(HERE / "frames.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    problems = check_drawings(PROTOCOL.read_text()) + check_frames(rows)
    print("\n".join(problems))
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
