#!/usr/bin/env python3
"""Writes the hand-made inputs of the fuzz targets firmware_core, _avr and _lm3s6965 into their corpora.

    tests/fuzz/firmware_core_seeds.py

An input is a programme of operations (core_programme.h, Op; what firmware_core_avr.cpp adds). Run this again when payloads or
operations change: an input that the MCU refuses from its first frame on reaches nothing.
"""
import pathlib
import struct
import sys
import zlib

sys.path.append(str(pathlib.Path(__file__).parents[1] / "vectors"))
from messages import FRAMES, LAYOUTS, payload_of  # noqa: E402

CORPORA = pathlib.Path(__file__).parent / "corpus"
TICK_NS = 2_560_000
(IDENTIFY, CONFIGURE, TABLE_BEGIN, TABLE_DATA, TABLE_END, ASSIGN, CONTROL, SET_POSITION, POLL, SYNC, TICKS,
 TABLE_TICKS, TABLE_RUN, EMERGENCY, SET_ADDRESS, TABLES, INPUTS, EMISSION, HOME, LOCAL, TRIGGER,
 POSITION_COMPARE, MOTOR_INPUTS, LINE_RUN, TRAVEL, CURRENTS, LINE_TRIGGER, VELOCITY, OUTPUTS, PROGRAM_PUT, PROGRAM,
 PROGRAM_STATE) = range(1, 0x21)
FINE, REPLACE, START = 1, 2, 4
EMERGENCY_PIN, FORWARD, REVERSE = 1, 2, 4


def noise(data):
    return bytes([0, len(data)]) + data


def passes(ticks):
    return b"".join(bytes([1, min(15, ticks - at)]) for at in range(0, ticks, 15))


def frame(type_, payload=b"", broadcast=False, later=0):
    return bytes([3, broadcast, type_, later, len(payload)]) + payload


def ticks(flags, first, mask, delays, displacements, epoch=0):
    motors = bin(mask).count("1")
    width = "h" if flags & FINE else "B"
    return (bytes([4, epoch, flags, first, len(displacements) // motors, mask])
            + struct.pack(f"<{motors}H", *delays)
            + struct.pack(f"<{len(displacements)}{width}", *displacements))


def sync(mark, later_share=0, later_ticks=0):
    return struct.pack("<BBHB", 5, 4 * mark, later_share, later_ticks & 0xFF)


def table_end(bank):
    return bytes([6, bank])


def table_run(first, *entries, epoch=0):
    """Entries: (bank, direction, steps < 256), for the motors from 0 on."""
    return (bytes([8, epoch, first, len(entries) - 1])
            + b"".join(bytes([bank | (0x80 if direction > 0 else 0), steps]) for bank, direction, steps in entries))


def pins(motors, system=0, current=0):
    return struct.pack("<BHBH", 9, motors, system, current)


def trigger_edge(share=1000):
    return struct.pack("<Bh", 10, share)


def sample(share, current):
    return struct.pack("<BHH", 11, share, current)


def work(pieces):
    return bytes([12, pieces])


RESET = bytes([13])


def pace(turns):
    return bytes([14, turns])


def rest(ticks):
    """Below 240, or a multiple of 64 up to 1024."""
    return bytes([15, ticks if ticks < 240 else 239 + ticks // 64])


def poll(*addresses):
    return frame(POLL, bytes([len(addresses)]) + b"".join(struct.pack("<BHBB", a, 10, 0, 255) for a in addresses), True)


def configure(fine):
    return frame(CONFIGURE, struct.pack("<IBH", TICK_NS, fine, 400))


def in_step():
    first = struct.pack("<HIBIII", 0, 0, 0, 0, 0, 0)
    return frame(SYNC, first, True) + passes(4) + sync(1) + passes(2) + sync(1)


def table(bank=0, codes=(250, 200, 150, 100), cruise=100, unit_ns=4000):
    return (frame(TABLE_BEGIN, struct.pack("<BHHHII", bank, len(codes), 0, cruise, unit_ns, 1))
            + frame(TABLE_DATA, struct.pack(f"<BHB{len(codes)}H", bank, 0, len(codes), *codes))
            + table_end(bank))


def assign(*motors, bank=0):
    return b"".join(frame(ASSIGN, bytes([m, bank])) for m in motors)


def inputs(positive=0, negative=0, cuts=0, inverted=0, debounce=1, system_inverted=0, emergency=0, overcurrent=0,
           keep=0):
    return frame(INPUTS, struct.pack("<HHHHBBBHB", positive, negative, cuts, inverted, debounce, system_inverted,
                                     emergency, overcurrent, keep))


def emission(mode, sequence=0, hold=0, step_us=250, settle_us=0, setup_us=0, pulse_us=0):
    return frame(EMISSION, struct.pack("<BBBHHHH", mode, sequence, hold, step_us, settle_us, setup_us, pulse_us))


def home(motor, direction, most=200, slow_steps=40, slow_delay=300, position=-5):
    return frame(HOME, struct.pack("<BbIHIHi", motor, direction, most, 0, slow_steps, slow_delay, position))


def entries(*motors):
    return b"".join(struct.pack("<BI", m | 0x80, 30 + m) for m in motors)


def line(increments, longest, begun):
    """A line of the motors from 0 on; negative: back."""
    return struct.pack("<BHIII", 0, 0, longest, begun, longest - begun) + b"".join(
        struct.pack("<BI", m | (0x80 if n > 0 else 0), abs(n)) for m, n in enumerate(increments))


def line_run(*increments, first=16, longest=90, begun=0):
    """`first` counts from boot."""
    return frame(LINE_RUN, struct.pack("<BI", 0, first) + line(increments, longest, begun))


def line_trigger(number, edge, delay_us, *increments, longest=90, begun=0):
    return frame(LINE_TRIGGER, struct.pack("<BBI", number, edge, delay_us) + line(increments, longest, begun))


def trigger(number, edge, delay_us, runs):
    return frame(TRIGGER, struct.pack("<BBI", number, edge, delay_us) + runs)


def travel(number, kind, edge=0, sensor=0, steps=0, delay_us=0, wait_us=0):
    return frame(TRAVEL, struct.pack("<BBBbBBIII", number, kind, 0, 1 if kind else 0, edge, sensor, steps, delay_us, wait_us))


def program(frames, flags=0):
    """A program of motors 0 and 1, loaded and committed."""
    text = struct.pack("<BBH", 1, flags, 3) + 2 * struct.pack("<Bii", 0, -300, 300) + frames + b"\0"
    half = len(text) // 2
    return (frame(PROGRAM_PUT, struct.pack("<HH", 0, len(text)) + text[:half])
            + frame(PROGRAM_PUT, struct.pack("<HH", half, len(text)) + text[half:]) + program_action(1, 0, zlib.crc32(text)))


def program_action(action, number=0, value=0):
    return frame(PROGRAM, struct.pack("<BBI", action, number, value))


SCAN = (struct.pack("<BH", 8, 2) + struct.pack("<BHBHH", 3, 3, 0, 0, 2) + struct.pack("<4i", 40, -11, 0, 20)
        + struct.pack("<BI", 7, 9000) + struct.pack("<BI", 5, 12000) + struct.pack("<BBBI", 6, 1, 1, 40000)
        + struct.pack("<BHiHiH", 1, 3, 5, 0, -5, 120) + b"\x09")

# Until input 1 of a motor, with a ramp-down, and back, 9 steps after it is not active any more.
UNTIL = (struct.pack("<BHBBIiH", 11, 1, 1, 1, 0, 200, 0) + struct.pack("<BHBBIiH", 11, 1, 1, 0, 9, -200, 120))


def ready(fine=0, before=b""):
    return (pins(0) + configure(fine) + before + in_step() + table() + assign(0, 1, 2, 3)
            + frame(CONTROL, b"\1") + passes(2))


MOVE = {0: ticks(START, 2, 3, (150, 150), (0x81, 0x82, 0x81, 0x83, 2, 2, 2, 2, 0x82, 0x82)),
        1: ticks(START | FINE, 2, 3, (150, 150), (250, 300, 512, 700, -256, 511))}
MORE = {0: ticks(0, 7, 3, (0, 0), (0x81, 1)), 1: ticks(FINE, 3, 3, (0, 0), (256, -128))}
REPLACEMENT = ticks(REPLACE | FINE, 4, 1, (0,), (128, 64), epoch=1)

# The limits of motor 0 are the inputs 0 and 1.
SHUTTER = inputs(positive=1, negative=1) + frame(MOTOR_INPUTS, bytes([0, 0, 1, 0]))
# One for each golden frame, as tests/vectors tells them: none comes behind what another one has changed.
REPLY = 0x80


def golden():
    seen = {}
    for address, _, name, fields in FRAMES:
        type_, layout = LAYOUTS[name]
        if type_ >= REPLY:
            continue
        seen[name] = seen.get(name, 0) + 1
        yield (f"golden-{name}-{seen[name]}",
               ready(0) + frame(type_, payload_of(layout, fields), broadcast=address == 0) + passes(15) + poll(7))


SEEDS = {
    **dict(golden()),
    "noise": noise(bytes(range(256))[:200]),
    "identify": frame(IDENTIFY, struct.pack("<HBH", 7, 4, 100), True),
    "ready-coarse": ready(0),
    "ready-fine": ready(1),
    "move-coarse": ready(0) + MOVE[0] + work(2) + MORE[0] + passes(15),
    "move-fine": ready(1) + MOVE[1] + passes(2) + MORE[1] + passes(15),
    "replace": ready(1) + MOVE[1] + passes(1) + REPLACEMENT + passes(12),
    "queue-ends": ready(1) + MOVE[1] + passes(30) + poll(7),
    "queue-too-far": ready(1) + ticks(START | FINE, 60, 1, (150,), (256, 256)) + passes(3) + poll(7),
    "sync-off": ready(1) + passes(3) + sync(1, 30000, 1) + passes(4) + sync(1, 0, -3) + passes(4),
    "two-masters": ready(1) + sync(1) + bytes([5, 3, 0, 0, 0]) + sync(1) + bytes([5, 3, 0, 0, 0]) + poll(7),
    "disable": ready(1) + MOVE[1] + frame(CONTROL, b"\2") + passes(20) + frame(CONTROL, b"\2") + poll(7),
    "set-position": ready(0) + frame(SET_POSITION, struct.pack("<Bi", 1, -1000)) + MOVE[0] + passes(20),
    "set-address": frame(SET_ADDRESS, b"fuzz\0\0\0\0" + b"\x09", True) + poll(9) + frame(TABLES),
    "table-run": ready(0) + table_run(3, (0, 1, 90), (0, -1, 5)) + passes(20) + frame(EMERGENCY, b"\0", True)
                 + passes(10) + frame(CONTROL, b"\4") + table_run(3, (0, -1, 9)) + passes(20),
    "table-run-stopped": ready(1) + table_run(9, (0, 1, 250), (0, -1, 250)) + passes(18) + frame(EMERGENCY, b"\0", True)
                         + passes(12) + poll(7),
    "table-ticks": ready(0) + bytes([7, 0, START, 2, 8, 13]) + struct.pack("<BHHHIH", 0xC0, 0, 0, 3, 40, 3) + passes(12),
    "limits": ready(0, inputs(positive=7)) + MOVE[0] + passes(3) + pins(1) + passes(15) + poll(7),
    "limits-cut": ready(1, inputs(positive=7, negative=7, cuts=7, debounce=0)) + MOVE[1] + passes(4) + pins(3)
                  + passes(5) + MOVE[1] + passes(4),
    "emergency-input": ready(1, inputs(emergency=1, system_inverted=1)) + pins(0, 1) + MOVE[1] + passes(3) + pins(0)
                       + passes(15) + frame(CONTROL, b"\4"),
    "overcurrent": ready(1, inputs(overcurrent=500)) + MOVE[1] + passes(3) + pins(0, 0, 900) + passes(9)
                   + pins(0) + frame(CONTROL, b"\5") + passes(3),
    "local": ready(0, frame(LOCAL, b"\3\0")) + passes(4) + pins(0, FORWARD) + passes(20) + pins(0) + passes(12)
             + pins(0, REVERSE) + passes(9) + pins(0, FORWARD | REVERSE) + passes(15),
    "local-kept": frame(LOCAL, b"\1\0") + inputs(keep=1) + configure(0) + in_step() + table() + assign(0) + frame(CONTROL, b"\1") + RESET + passes(3)
                  + pins(0, FORWARD) + passes(12) + pins(0) + passes(9),
    "home": ready(0, inputs(negative=1)) + home(0, -1) + passes(12) + pins(1) + passes(15) + pins(0) + passes(9)
            + pins(1) + passes(15) + poll(7),
    "home-behind-a-limit": ready(0, inputs(positive=1, negative=1) + frame(MOTOR_INPUTS, bytes([0, 1, 2, 3]))) + home(0, -1)
                           + passes(12) + pins(4) + passes(12) + pins(0) + passes(9) + pins(8) + passes(15) + pins(0) + passes(9)
                           + pins(8) + passes(15) + poll(7),
    "home-given-up": ready(0, inputs(negative=1)) + home(0, -1) + passes(9) + home(0, -1, 0) + passes(15),
    "trigger": ready(0) + trigger(1, 1, 5000, entries(0, 2)) + passes(3) + trigger_edge() + passes(20)
               + trigger(1, 1, 5000, entries(0, 2)) + trigger(2, 2, 50, entries(1)) + trigger_edge(-30000)
               + passes(15) + trigger(3, 1, 1_650_000, entries(0)) + frame(TRIGGER, bytes(6)),
    "travel": ready(0, SHUTTER) + pins(2) + passes(2) + travel(1, 2, 0, 0, 9, 0, 3000) + passes(9) + pins(0) + passes(9) + pins(1)
              + passes(12) + pins(0) + passes(12) + pins(2) + passes(9) + poll(7),
    "travel-at-edges": ready(0, SHUTTER) + travel(1, 2, 1, 0, 5, 30000, 60000) + passes(2) + trigger_edge() + passes(15) + pins(1)
                       + passes(15) + pins(2) + passes(15) + trigger_edge() + passes(9) + travel(0, 0) + passes(9),
    "step-with-sensor": ready(0) + travel(1, 1, 0, 3, 1, 0, 30000) + passes(6) + pins(8) + passes(9) + travel(1, 1, 0, 3, 1, 0, 30000)
                        + travel(2, 1, 0, 3, 1, 0, 30000) + passes(15),
    "line-run": ready(0) + line_run(90, -31, 1) + passes(60) + frame(EMERGENCY, b"\0", True) + passes(30)
                + frame(CONTROL, b"\4") + line_run(90, first=110) + passes(60),
    "line-run-replaced": ready(1) + line_run(90, -89) + passes(15) + REPLACEMENT + passes(40),
    "line-trigger": ready(0) + line_trigger(1, 1, 5000, 90, -31, 1) + passes(3) + trigger_edge() + passes(60)
                    + line_trigger(1, 1, 5000, 90) + line_trigger(2, 2, 50, 40, 90) + line_run(9, longest=9, first=90)
                    + trigger(0, 0, 0, b"") + passes(2) + line_run(9, longest=9, first=110) + passes(15),
    "line-run-into-limit": ready(1, inputs(positive=3)) + line_run(70, 90, 90, first=20, begun=9) + passes(25) + pins(2)
                           + passes(60),
    "position-compare": ready(0) + frame(POSITION_COMPARE, struct.pack("<BBiII", 0, 3, 3, 700, 4000)) + MOVE[0] + passes(20),
    "program": ready(0) + program(SCAN) + program_action(2, 1, 20) + passes(80) + pins(2) + passes(90) + frame(PROGRAM_STATE) + poll(7),
    "program-paused": ready(1) + program(SCAN) + program_action(2, 1, 20) + passes(20) + program_action(4) + passes(40)
                      + program_action(5) + passes(30) + program_action(3, 0, 1) + passes(9) + program_action(0) + program_action(2, 2, 200),
    "program-alone": ready(0, inputs(positive=1)) + program(SCAN, 1) + program_action(2, 1, 20) + passes(15) + sync(1, 30000, 1) + passes(15)
                     + pins(1) + passes(60) + program_action(2, 2, 140) + frame(EMERGENCY, b"\0", True) + passes(30),
    "program-until": ready(1) + program(UNTIL) + program_action(2, 1, 20) + passes(40) + pins(2) + passes(30) + pins(0) + passes(60)
                     + frame(PROGRAM_STATE) + poll(7),
    "emergency-that-disables": ready(1, inputs(emergency=3)) + MOVE[1] + passes(3) + pins(0, 1) + passes(9) + pins(0)
                               + frame(CONTROL, b"\4") + frame(CONTROL, b"\1") + MOVE[1] + passes(3) + frame(EMERGENCY, b"\2", True) + passes(9),
    "burst": ready(0, emission(1)) + MOVE[0] + passes(12),
    "common-dir": ready(0, emission(2)) + MOVE[0] + passes(12),
    "staggered": ready(0, emission(3, settle_us=60)) + MOVE[0] + passes(12),
    "common-dir-staggered": ready(0, emission(5, settle_us=60)) + MOVE[0] + passes(12),
    "common-dir-staggered-measured": ready(0, emission(5)) + b"".join(
        sample(4096 * at, 500 + at % 2) + passes(1) for at in range(12)) + sample(40000, 900)
                          + sample(60000, 501) + passes(15) + sample(100, 500) + passes(15) + MOVE[0] + passes(9),
    "staggered-measured": ready(0, emission(3)) + b"".join(
        sample(4096 * at, 500 + at % 2) + passes(1) for at in range(12)) + sample(40000, 900)
                          + sample(60000, 501) + passes(15) + sample(100, 500) + passes(15) + MOVE[0] + passes(9),
    "phases": ready(1, emission(4, 2, 1)) + ticks(START | FINE, 2, 1, (0,), (250, 600, -512, 128)) + passes(60),
    "kept": ready(1, emission(4, 1)) + RESET + configure(1) + in_step() + frame(CONTROL, b"\1") + passes(2)
            + passes(2) + ticks(START | FINE, 2, 1, (0,), (256, -512)) + passes(9),
}

CODES = tuple(range(400, 300, -1))
FORGET_TABLES = frame(CONTROL, b"\x08")

# Operations of targets with a port of their own; they replay the others too.
SEEDS_AVR = {
    "kept-written": ready(1, table(1, CODES, 350)) + rest(1024) + RESET + frame(TABLES) + passes(3),
    "kept-changed": ready(1) + rest(896) + table(1, CODES, 350) + rest(160) + inputs(positive=3) + rest(640) + RESET,
    "tables-forgotten": ready(1, table(1, CODES, 350)) + rest(30) + passes(2) + FORGET_TABLES + table(2) + passes(9),
    "paced": ready(1) + pace(1) + MOVE[1] + passes(1) + MORE[1] + poll(7) + poll(7) + pace(3) + passes(15),
    "answer-waits": ready(1) + poll(7) + noise(bytes(range(1, 200))) + poll(7) + work(15) + noise(bytes(255)) + passes(2),
    "answer-is-sent": ready(1) + poll(7) + work(3) + pace(2) + MOVE[1] + poll(7) + work(9) + frame(TABLES) + passes(3),
}

# Many codes: the walk compares 32 bytes at a time.
SEEDS_LM3S6965 = {
    "kept-written": ready(1, b"".join(table(bank, CODES, 350) for bank in range(1, 4))) + rest(1024) + RESET + frame(TABLES),
    "kept-changed": ready(1) + rest(896) + table(1, CODES, 350) + rest(160) + inputs(positive=3) + rest(640) + RESET,
}

if __name__ == "__main__":
    for target, seeds in {"firmware_core": SEEDS, "firmware_core_avr": SEEDS_AVR,
                          "firmware_core_lm3s6965": SEEDS_LM3S6965}.items():
        for name, programme in seeds.items():
            (CORPORA / target / name).write_bytes(programme)
