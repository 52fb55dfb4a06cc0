"""The tables, moves, states and messages that vectors are made of."""

from definitions import Table

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

# (table, steps, tick_ns, format, ramp-down at the beginning of tick or None, shortest_delay)
MOVES = [
    ("small", 5, 4000, "coarse", None, 0), ("small", 5, 4000, "fine", None, 0), ("small", -5, 4000, "fine", None, 0),
    ("small", 1, 4000, "coarse", None, 0), ("small", -1, 4000, "coarse", None, 0), ("small", 2, 1000, "fine", None, 0),
    ("small", 9, 4000, "fine", 2, 0), ("small", 9, 4000, "coarse", 0, 0),
    ("flat", 1, 2560000, "fine", None, 0), ("flat", 40, 2560000, "coarse", None, 0), ("flat", -41, 2560000, "fine", 7, 0),
    ("bushd2", 1, 2560000, "coarse", None, 0), ("bushd2", 30, 2560000, "fine", None, 0),
    ("bushd2", -31, 2560000, "coarse", None, 0), ("bushd2", 520, 2560000, "coarse", None, 0),
    ("bushd2", 476, 2560000, "coarse", 300, 0),
    ("uneven", 30, 2560000, "fine", None, 0), ("uneven", -30, 1000000, "coarse", None, 0),
    ("uneven", 12, 1000000, "fine", 9, 0), ("uneven", 8, 777777, "fine", None, 0),
    ("micro", 500, 1000000, "coarse", None, 0), ("micro", -499, 1000000, "fine", None, 0),
    ("micro", 500, 1000000, "fine", 9, 0), ("micro", 60, 1000001, "coarse", None, 0),
    ("slow", 6, 2560000, "fine", None, 0), ("slow", -3, 2560000, "coarse", None, 0), ("slow", 6, 2560000, "fine", 5, 0),
    ("small", 9, 4000, "fine", None, 4), ("small", -9, 4000, "coarse", None, 9), ("bushd2", 520, 2560000, "fine", None, 60),
    ("bushd2", -520, 2560000, "coarse", 300, 251), ("uneven", 30, 2560000, "fine", None, 1900),
    ("micro", 500, 1000000, "coarse", None, 150), ("slow", 6, 2560000, "fine", 5, 6),
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

# (table, steps, tick_ns, format, ramp-down at the beginning of tick or None, shortest_delay, saved at the beginning of tick, ticks)
RUN_STATES = [
    ("small", 5, 4000, "fine", None, 0, 0, 6), ("small", -5, 4000, "fine", None, 0, 3, 3),
    ("flat", 40, 2560000, "coarse", None, 0, 1, 5), ("flat", -41, 2560000, "fine", 7, 0, 7, 1),
    ("bushd2", 520, 2560000, "fine", None, 0, 0, 100), ("bushd2", 520, 2560000, "coarse", None, 0, 488, 3),
    ("bushd2", 520, 2560000, "fine", None, 0, 170, 190), ("bushd2", 520, 2560000, "fine", None, 0, 488, 190),
    ("bushd2", -476, 2560000, "coarse", 100, 0, 100, 2), ("bushd2", 476, 2560000, "coarse", 100, 0, 104, 40),
    ("uneven", 30, 2560000, "fine", None, 0, 3, 9), ("uneven", -30, 1000000, "coarse", None, 0, 12, 2),
    ("uneven", 12, 1000000, "fine", 9, 0, 9, 9), ("uneven", 8, 777777, "fine", None, 0, 5, 1),
    ("micro", 500, 1000000, "coarse", None, 0, 4, 100), ("slow", 6, 2560000, "fine", 5, 0, 6, 4),
    ("bushd2", 520, 2560000, "fine", None, 60, 200, 190), ("bushd2", -520, 2560000, "coarse", 100, 60, 104, 40),
    ("bushd2", 520, 2560000, "coarse", None, 60, 600, 1000), ("uneven", 30, 2560000, "fine", None, 1900, 3, 9),
]

# (increment, longest, first and last step of the run); fractions of a step are taken in turn
LINES = [
    (0, 5, 0, 5), (1, 1, 0, 1), (5, 5, 0, 5), (1, 2, 0, 2), (3, 7, 0, 7), (4, 7, 0, 7), (7, 20, 0, 20), (1, 20, 0, 20), (19, 20, 0, 20),
    (1000003, 2147483647, 1072, 1090), (2147483646, 2147483647, 1073741820, 1073741827),
    (1, 2147483647, 1073741822, 1073741825), (2147483647, 2147483647, 2147483640, 2147483647),
]

# (unique id, salt, windows)
IDENTIFY_WINDOWS = [
    ("0000000000000000", 0, 1), ("0000000000000000", 0, 16), ("0000000000000001", 0, 16), ("0000000000000000", 1, 16),
    ("62757368643a0001", 4660, 8), ("62757368643a0002", 4660, 8), ("ffffffffffffffff", 65535, 255),
    ("0102030405060708", 513, 100),
]
