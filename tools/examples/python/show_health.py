#!/usr/bin/env python3
"""Example in Python: prints how well each MCU does, once a second, until interrupted.

Needs what move_and_wait.py needs.
"""

import argparse

import lcm
from bushd import health_t


def show(_channel, data):
    try:
        health = health_t.decode(data)
    except Exception:  # anybody may send anything
        return
    for mcu in health.mcus:
        low_water = f"{mcu.low_water_ticks} ticks" if mcu.low_water_ticks >= 0 else "none moved"
        print(
            f"{mcu.mcu}: {mcu.crc_errors} CRC errors, {mcu.repeats} repeats, {mcu.ramp_downs} ramp-downs, "
            f"low water {low_water}, crystal {-mcu.rate_ppm:+.1f} ppm",
            flush=True,
        )


def main():
    parser = argparse.ArgumentParser(description="Prints the health of all MCUs.")
    parser.add_argument("--url", default="udpm://239.255.76.67:7667?ttl=0")
    parser.add_argument("--prefix", default="BUSHD")
    parser.add_argument("--count", type=int, default=0, help="end after so many messages")
    arguments = parser.parse_args()
    network = lcm.LCM(arguments.url)
    network.subscribe(arguments.prefix + "_HEALTH", show)
    shown = 0
    while arguments.count == 0 or shown < arguments.count:
        network.handle()
        shown += 1


if __name__ == "__main__":
    main()
