#!/usr/bin/env python3
"""Example in Python: prints how well each MCU does, once a second, until interrupted. Needs what move_and_wait.py needs."""

import argparse
import itertools
import sys
import time

import bushd


def show(health):
    for bus in health.values():
        for mcu in bus.mcus:
            low_water = "none moved" if mcu.low_water_ticks is None else f"{mcu.low_water_ticks} ticks"
            print(
                f"{mcu.mcu}: {mcu.crc_errors} CRC errors, {mcu.repeats} repeats, {mcu.ramp_downs} ramp-downs, "
                f"low water {low_water}, crystal {-mcu.rate_ppm:+.1f} ppm",
                flush=True,
            )


def main():
    parser = argparse.ArgumentParser(description="Prints the health of all MCUs.")
    parser.add_argument("--lcm", metavar="URL", help="LCM in place of the control socket")
    parser.add_argument("--prefix", default="BUSHD", help="of the LCM channels")
    parser.add_argument("--count", type=int, default=0, help="end after so many times")
    arguments = parser.parse_args()
    with bushd.connect(lcm=arguments.lcm or False, prefix=arguments.prefix) as client:
        for count in itertools.count(1):
            show(client.health())
            if count == arguments.count:
                return
            time.sleep(1)


if __name__ == "__main__":
    try:
        main()
    except KeyboardInterrupt:
        pass
    except bushd.BushdError as error:
        sys.exit(f"show_health.py: {error}")
