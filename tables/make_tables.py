#!/usr/bin/env python3
"""Makes the shipped tables, byte for byte the same on every run.

    tables/make_tables.py            writes tables/*.toml
    tables/make_tables.py --check    exit code 1 if a file differs from what would be written

Every table follows a law of motion, speed v(t) with v(0) = start speed and x(t) its integral. The
first code is 1 / start speed: the motor makes its first step at the speed that it can start with.
From there on step k of the law falls at the time t_k with x(t_k) = k, and the delay before it is
t_k - t_(k-1). Laws have one free number (an acceleration or a top speed); it is chosen so that the
last delay is exactly the one asked for. Delays are rounded up to whole time units: a motor is
never asked to run faster than the law.
Python standard library only.
"""

import argparse
import math
import pathlib
import sys
import textwrap

# Binary fractions cannot hold most delays: this much of a unit above a whole number is noise.
NOISE_UNITS = 1e-6
BISECTIONS = 200  # more than a double has digits, so the result does not depend on where it starts
CODES_PER_LINE = 16

BUSHD2_UNIT_NS = 40000  # 1 / (250 F_start) with F_start = 100 Hz, the fastest start of BUSHD-2
MICRO_UNIT_NS = 250


def solve(function, low, high):
    """Where the rising `function` crosses zero between low and high."""
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        if function(middle) < 0:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


class ConstantAcceleration:
    """v = v0 + a t, so t_k = (sqrt(v0^2 + 2 a k) - v0) / a, here without the loss of digits."""

    def __init__(self, start_hz, acceleration):
        self.start_hz = start_hz
        self.acceleration = acceleration

    def time_of(self, k):
        v0 = self.start_hz
        return 2 * k / (math.sqrt(v0 * v0 + 2 * self.acceleration * k) + v0)


class QuickBand:
    """Constant acceleration, but `factor` times as much while the speed is within a band.

    v^2 is a broken line over the steps with corners where the band begins and ends.
    """

    def __init__(self, start_hz, acceleration, band_hz, factor):
        low, high = band_hz
        x_low = (low**2 - start_hz**2) / (2 * acceleration)
        x_high = x_low + (high**2 - low**2) / (2 * acceleration * factor)
        self.parts = [
            (0.0, start_hz, acceleration),
            (x_low, low, acceleration * factor),
            (x_high, high, acceleration),
        ]

    def time_of(self, k):
        time = 0.0
        for i, (x, v, a) in enumerate(self.parts):
            end = min(k, self.parts[i + 1][0]) if i + 1 < len(self.parts) else k
            if end > x:
                time += 2 * (end - x) / (math.sqrt(v * v + 2 * a * (end - x)) + v)
        return time


class Shaped:
    """v(t) = v0 + (v1 - v0) s(t / T), with `shape(u)` the integral of s and s(0) = 0, s(1) = 1."""

    def __init__(self, start_hz, steps, top_hz, shape):
        self.start_hz, self.top_hz, self.shape = start_hz, top_hz, shape
        self.duration = steps / (start_hz + (top_hz - start_hz) * shape(1.0))

    def position(self, time):
        u = time / self.duration
        gain = (self.top_hz - self.start_hz) * self.duration
        return self.start_hz * time + gain * self.shape(u)

    def time_of(self, k):
        return solve(lambda time: self.position(time) - k, 0.0, 2 * self.duration)


def smooth_step(u):
    """s = 3 u^2 - 2 u^3: the acceleration begins and ends at zero."""
    u = min(u, 1.0)
    return u**3 - 0.5 * u**4


def exponential(u, k=math.log(5)):
    """s = (1 - e^(-k u)) / (1 - e^(-k)): the acceleration falls to a fifth on the way."""
    return (u + math.expm1(-k * u) / k) / -math.expm1(-k)


def codes_of(make_law, count, unit_ns, start_code, top_code, bounds):
    """`count` codes from start_code to top_code, and the free number of the law that makes them.

    make_law(number) is faster for a greater number; the one that fits lies within `bounds`.
    """
    unit_s = unit_ns * 1e-9
    steps = count - 1  # of the law: the first code is the start

    def last_delay_units(law):
        return (law.time_of(steps) - law.time_of(steps - 1)) / unit_s

    best = solve(lambda p: top_code - last_delay_units(make_law(p)), *bounds)
    law = make_law(best)
    times = [law.time_of(k) for k in range(count)]
    delays = [(b - a) / unit_s for a, b in zip(times, times[1:])]
    codes = [start_code] + [math.ceil(delay - NOISE_UNITS) for delay in delays]
    assert codes[-1] == top_code, codes[-1]
    assert all(a >= b for a, b in zip(codes, codes[1:]))
    assert 1 <= codes[-1] and codes[0] <= 65535
    return codes, best


def bushd2(make_law, bounds):
    """A motion program of BUSHD-2: 238 codes from 250 (F_start) to 10 (25 F_start)."""
    return codes_of(make_law, 238, BUSHD2_UNIT_NS, 250, 10, bounds)


def micro(make_law, count, start_hz, top_hz, bounds):
    start_code = round(1e9 / (start_hz * MICRO_UNIT_NS))
    top_code = round(1e9 / (top_hz * MICRO_UNIT_NS))
    return codes_of(make_law, count, MICRO_UNIT_NS, start_code, top_code, bounds)


def text_of(name, description, comment, unit_ns, codes):
    lines = [f"# {line}" for line in textwrap.wrap(comment, 98)]
    lines.append("# Made by make_tables.py: change it there, or copy this file under a new name.")
    lines.append(f'name = "{name}"')
    lines.append(f'description = "{description}"')
    lines.append(f"time_unit_ns = {unit_ns}")
    lines.append("accel = [")
    for at in range(0, len(codes), CODES_PER_LINE):
        lines.append("  " + ", ".join(map(str, codes[at : at + CODES_PER_LINE])) + ",")
    lines.append("]")
    return "\n".join(lines) + "\n"


def summary(codes, unit_ns):
    start_hz = 1e9 / (codes[0] * unit_ns)
    top_hz = 1e9 / (codes[-1] * unit_ns)
    ramp_ms = sum(codes) * unit_ns * 1e-6
    return f"{start_hz:.0f} to {top_hz:.0f} steps/s in {len(codes)} steps and {ramp_ms:.0f} ms"


def tables():
    """Yields (name, text) of each."""

    def bushd2_text(name, motor, law, codes):
        return text_of(
            name,
            f"{motor}: {summary(codes, BUSHD2_UNIT_NS)}",
            f"BUSHD-2 motion program of 238 codes, 250 = F_start = 100 Hz to 10 = 25 F_start. {law}",
            BUSHD2_UNIT_NS,
            codes,
        )

    accelerations = (1.0, 1e7)  # steps/s^2
    tops = (2000.0, 4000.0)  # steps/s

    codes, a = bushd2(lambda a: ConstantAcceleration(100.0, a), accelerations)
    yield "bushd2-constant", bushd2_text(
        "bushd2-constant",
        "Full-step motor with inertial load, constant acceleration",
        f"Constant acceleration of {a:.0f} steps/s^2: the plain choice for a motor whose torque "
        "hardly falls with speed (200 steps a turn, chopper drive) and whose load is mostly "
        "inertia.",
        codes,
    )

    codes, _ = bushd2(lambda v: Shaped(100.0, 237, v, smooth_step), tops)
    yield "bushd2-scurve", bushd2_text(
        "bushd2-scurve",
        "Full-step motor with a load that swings, S-shaped speed",
        "The speed follows 3 u^2 - 2 u^3 over time, so that acceleration begins and ends at zero: "
        "for a motor with a long arm, a belt or a liquid on it, which a jump of the acceleration "
        "would set swinging.",
        codes,
    )

    codes, _ = bushd2(lambda v: Shaped(100.0, 237, v, exponential), tops)
    yield "bushd2-exponential", bushd2_text(
        "bushd2-exponential",
        "Full-step motor whose torque falls with speed (unipolar, L/R drive)",
        "The acceleration falls exponentially over time, to a fifth at the top: for unipolar "
        "motors on plain L/R drives, whose torque falls with speed; it uses the torque that is "
        "there at low speed.",
        codes,
    )

    codes, a = bushd2(lambda a: QuickBand(100.0, a, (600.0, 1000.0), 4.0), accelerations)
    yield "bushd2-resonance", bushd2_text(
        "bushd2-resonance",
        "Full-step motor that resonates at 600..1000 steps/s, band passed quickly",
        f"Constant acceleration of {a:.0f} steps/s^2, but four times as much from 600 to 1000 "
        "steps/s: for an undamped full-step motor with a mid-range resonance there, which must not "
        "have the time to build up.",
        codes,
    )

    codes, a = micro(
        lambda a: ConstantAcceleration(1000.0, a), 1000, 1000.0, 20000.0, accelerations
    )
    yield "micro16-standard", text_of(
        "micro16-standard",
        "1.8 degree motor at 1/16 step, general use, constant acceleration: "
        + summary(codes, MICRO_UNIT_NS),
        "For a 1.8 degree motor of NEMA 17 or 23 size on a chopper drive at 1/16 step (3200 steps "
        f"a turn), lightly loaded: up to 375 turns/min with {a:.0f} steps/s^2.",
        MICRO_UNIT_NS,
        codes,
    )

    codes, _ = micro(
        lambda v: Shaped(800.0, 1499, v, smooth_step), 1500, 800.0, 25000.0, (20000.0, 40000.0)
    )
    yield "micro32-smooth", text_of(
        "micro32-smooth",
        "1.8 degree motor at 1/32 step, quiet, S-shaped speed: " + summary(codes, MICRO_UNIT_NS),
        "For a 1.8 degree motor of NEMA 17 or 23 size on a chopper drive at 1/32 step (6400 steps "
        "a turn), where quiet running counts (optics, cameras): up to 234 turns/min, acceleration "
        "without jumps.",
        MICRO_UNIT_NS,
        codes,
    )


def main():
    parser = argparse.ArgumentParser(description="Makes the shipped tables.")
    parser.add_argument("--check", action="store_true", help="compare, write nothing")
    options = parser.parse_args()
    directory = pathlib.Path(__file__).resolve().parent
    different = []
    made = set()
    for name, text in tables():
        path = directory / f"{name}.toml"
        made.add(path.name)
        if not options.check:
            path.write_bytes(text.encode())
        elif not path.is_file() or path.read_bytes() != text.encode():
            different.append(path)
    strays = sorted(set(path.name for path in directory.glob("*.toml")) - made)
    for path in different:
        print(f"{path}: differs from what make_tables.py makes; run it", file=sys.stderr)
    for name in strays:
        print(f"{directory / name}: not made by make_tables.py; add it there", file=sys.stderr)
    return 1 if different or strays else 0


if __name__ == "__main__":
    sys.exit(main())
