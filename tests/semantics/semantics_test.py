#!/usr/bin/env python3
"""Random sequences of requests to a lab of bushd (driver.cpp), each foretold by the model (model.py): whether it is
accepted, and where all motors stand in the end, in steps, on the dial and for users, what that is worth, and that
their pins have turned them there.

    semantics_test.py --seed 7 --sequences 100    the same each time; `fresh`: a seed that nobody has tried
"""
import argparse
import os
import random
import sys
import tomllib

from laboratory import TABLE, TABLES, Driver, Wrong
from sequence import Sequence


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", default="fresh")
    parser.add_argument("--sequences", type=int, default=100)
    parser.add_argument("--acts", type=int, default=15, help="in each sequence")
    parser.add_argument("--story", type=int, default=12, help="so many lines of what led to what is wrong")
    parser.add_argument("--driver", default=os.environ.get("BUSHD_SEMANTICS_DRIVER"))
    arguments = parser.parse_args()
    first = int.from_bytes(os.urandom(4)) if arguments.seed == "fresh" else int(arguments.seed)
    table = tomllib.loads((TABLES / (TABLE + ".toml")).read_text())
    print(f"semantics_test.py --seed {first} --sequences {arguments.sequences} --acts {arguments.acts}")
    driver = Driver(arguments.driver)
    requests = refusals = 0
    for seed in range(first, first + arguments.sequences):
        driver.log.clear()
        try:
            sequence = Sequence(driver, random.Random(seed), table["time_unit_ns"], table["accel"])
            for _ in range(arguments.acts):
                sequence.act()
        except Wrong as wrong:
            print("\n".join(driver.log[-arguments.story:]))
            print(f"WRONG: {wrong}\nAgain: semantics_test.py --seed {seed} --sequences 1 --acts {arguments.acts}")
            return 1
        requests += sequence.requests
        refusals += sequence.refusals
    print(f"{arguments.sequences} sequences, {requests} requests, {refusals} of them refused, all as foretold")
    return driver.close()


if __name__ == "__main__":
    sys.exit(main())
