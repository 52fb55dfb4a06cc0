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

sys.dont_write_bytecode = True  # no caches in the source tree

from answers import line_answers, move_bytes, rest_bytes, run_state, slot_lists, take_over_bytes  # noqa: E402
from c_header import c_header  # noqa: E402
from chosen import IDENTIFY_WINDOWS, LINES, MOVES, RUN_STATES, SLOTS, TABLES, TAKE_OVERS  # noqa: E402
from definitions import frame, identify_window  # noqa: E402
from messages import FRAMES, LAYOUTS, payload_of  # noqa: E402

HERE = pathlib.Path(__file__).resolve().parent


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
    write("moves.csv", ["table", "steps", "tick_ns", "format", "ramp_down_at_tick", "shortest_delay", "displacements"],
          [[*m[:4], "" if m[4] is None else m[4], m[5], move_bytes(*m).hex()] for m in MOVES])
    write("take_overs.csv", ["table", "delay", "fraction", "direction", "tick_ns", "format", "displacements"],
          [[*t, take_over_bytes(*t).hex()] for t in TAKE_OVERS])
    write("run_states.csv", ["table", "steps", "tick_ns", "format", "ramp_down_at_tick", "shortest_delay", "tick", "ticks", "state",
                             "displacements"],
          [[*r[:4], "" if r[4] is None else r[4], *r[5:], field_text([run_state(*r)]), rest_bytes(*r).hex()]
           for r in RUN_STATES])
    write("lines.csv", ["increment", "longest", "first", "last", "made", "fractions", "positions"],
          [[*line, *map(join, line_answers(*line))] for line in LINES])
    write("identify_windows.csv", ["unique_id", "salt", "windows", "window"],
          [[*one, identify_window(bytes.fromhex(one[0]), *one[1:])] for one in IDENTIFY_WINDOWS])
    slots = []
    for slot_count, crossing, values in SLOTS:
        lists, remainder = slot_lists(slot_count, crossing, values)
        slots.append([slot_count, crossing, join(values), ";".join(join(one) for one in lists), remainder])
    write("slots.csv", ["slot_count", "crossing", "displacements", "slots", "remainder"], slots)
    frames = []
    for address, sequence, message, fields in FRAMES:
        kind, layout = LAYOUTS[message]
        frames.append([message, address, kind, sequence, " ".join(f"{k}={field_text(v)}" for k, v in fields.items()),
                       frame(address, kind, sequence, payload_of(layout, fields)).hex()])
    write("frames.csv", ["message", "address", "type", "sequence", "fields", "wire"], frames)
    return files


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
