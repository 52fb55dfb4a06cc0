#!/usr/bin/env python3
"""Example in Python: a scan. A motor stops at equidistant positions, and something is measured at each.

    scan.py theta -2 2 41
    scan.py theta -2 2 41 --dwell-s 0.5

Prints a line per point: position asked for, position reached, value. Ctrl-C ramps the motor down. Where the motor was
before, it is taken back to at the end.
"""

import argparse
import sys
import time

import bushd


def measure(dwell_s):
    """In its place: the detector of the experiment."""
    time.sleep(dwell_s)
    return 0.0


def scan(client, name, first, last, points, dwell_s):
    motor = client.where(name)
    if motor.trust is not bushd.Trust.KNOWN:
        sys.exit(f"scan.py: {name}: {motor.trust.value}: {motor.uncertain_reason}. Home it, or set its position")
    print(f"# {name} [{motor.unit}], reached, value")
    try:
        for i in range(points):
            target = first + (last - first) * i / (points - 1)
            reached = client.move(name, to=target)[name].position
            print(f"{target:.{motor.precision}f} {reached:.{motor.precision}f} {measure(dwell_s):g}", flush=True)
    finally:
        client.move(name, to=motor.position)


def main():
    parser = argparse.ArgumentParser(description="Scans a motor.")
    parser.add_argument("name")
    parser.add_argument("first", type=float)
    parser.add_argument("last", type=float)
    parser.add_argument("points", type=int)
    parser.add_argument("--dwell-s", type=float, default=0.0)
    arguments = parser.parse_args()
    if arguments.points < 2:
        parser.error("at least 2 points")
    try:
        with bushd.connect() as client:
            scan(client, arguments.name, arguments.first, arguments.last, arguments.points, arguments.dwell_s)
    except bushd.BushdError as error:
        sys.exit(f"scan.py: {error}")


if __name__ == "__main__":
    main()
