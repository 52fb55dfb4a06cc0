#!/usr/bin/env python3
"""Example of a client in Python: moves motors as one group and waits until all stand.

Needs the package bushd: python3-bushd, or PYTHONPATH=build/release/lib/python in the source tree. Exit code 0 only if all
motors have reached their targets. Ctrl-C ramps them down.
"""

import argparse
import sys

import bushd


def main():
    parser = argparse.ArgumentParser(description="Moves motors as one group and waits until all stand.")
    parser.add_argument("--socket", metavar="PATH", help="control socket of the daemon, if it is not the usual one")
    parser.add_argument("--lcm", metavar="URL", help="LCM in place of the socket: udpm://239.255.76.67:7667?ttl=0")
    parser.add_argument("--prefix", default="BUSHD", help="of the LCM channels")
    parser.add_argument("words", nargs="+", metavar="NAME DISTANCE", help="motors, and how far, in their units")
    arguments = parser.parse_args()
    names, distances = arguments.words[0::2], arguments.words[1::2]
    if len(names) != len(distances):
        parser.error("every NAME wants its DISTANCE")
    try:
        move = {name: float(distance) for name, distance in zip(names, distances)}
    except ValueError as error:
        parser.error(str(error))

    try:
        with bushd.connect(arguments.socket, lcm=arguments.lcm or False, prefix=arguments.prefix) as client:
            result = client.move(by=move, check=False)
    except bushd.BushdError as error:
        sys.exit(f"move_and_wait.py: {error}")
    print(f"{result.outcome.value}: {result.reason}")
    for motor in result:
        print(f"  {motor}")
    return 0 if result.outcome.succeeded else 1


if __name__ == "__main__":
    sys.exit(main())
