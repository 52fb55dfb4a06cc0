#!/usr/bin/env python3
"""Random cycles of a crate with BUSHD-1 and BUSHD-2, and random events of their motors: the model foretells X, Q, data,
LAM and what is asked of the motors, for each.

    modules_test.py --driver PROGRAM [--seed N|fresh] [--cycles N]
"""
import argparse
import os
import random
import subprocess
import sys

from model import Laboratory

COMMANDS = [(0, 0), (0, 1), (0, 2), (0, 3), (8, 0), (10, 0), (16, 0), (16, 1), (16, 2), (24, 0), (26, 0)]


def weighted(random_, choices):
    return random_.choices([choice for choice, _ in choices], [weight for _, weight in choices])[0]


def cycle(random_):
    kind = random_.random()
    station = random_.choice([5, 7])
    if kind < 0.03:  # anything at all
        return [f"naf {random_.randrange(32)} {random_.randrange(16)} {random_.randrange(32)} {random_.randrange(2**26)}"]
    if kind < 0.09:  # the controller, seldom Z
        n, a, f = weighted(random_, [((28, 8, 26), 1), ((28, 9, 26), 3), ((30, 9, 26), 2), ((30, 9, 24), 4), ((30, 9, 27), 2),
                                     ((30, 10, 24), 1), ((30, 10, 26), 1), ((30, 10, 27), 1), ((30, 11, 27), 2), ((30, 3, 0), 2)])
        return [f"naf {n} {a} {f} 0"]
    if kind < 0.2:  # a program, or a part of one
        return program(random_, station)
    f, a = weighted(random_, [(command, 4 if command in ((26, 0), (0, 3), (16, 2)) else 2) for command in COMMANDS])
    data = random_.randrange(2**24)
    if (f, a) == (16, 1):
        data = random_.choice([0, 1, 2, 240, 252, 254, 255, 256, 496, 1020, 1022, 1023, data])
    if (f, a) == (16, 2) and random_.random() < 0.8:
        data |= random_.choice([0x70, 0x50, 0x10, 0x3F])
    return [f"naf {station} {a} {f} {data}"]


def program(random_, station):
    steps = weighted(random_, [(0, 1), (1, 2), (2, 2), (3, 3), (6, 3), (126, 1), (127, 1), (300, 1), (random_.randrange(65536), 1)])
    start = 0 if station == 7 else 256 * random_.randrange(4)
    header = [steps % 256, steps // 256] if station == 5 else [steps % 256, 0, random_.randrange(256), random_.randrange(120)]
    falls = sorted((random_.randrange(256) for _ in range(random_.choice([1, 2, 4, 12]))), reverse=True)
    rises = sorted(random_.randrange(256) for _ in range(random_.choice([0, 0, 2, 5])))
    lines = [f"naf {station} 1 16 {start}"]
    for byte in header + [value for code in falls + rises for value in ([code] if station == 5 else [0, code])]:
        lines.append(f"naf {station} 0 16 {byte}")
    return lines


def event(random_):
    what = weighted(random_, [("answer", 8), ("ends", 1), ("status", 1), ("accept", 1), ("limits", 5), ("step_done", 2),
                              ("step_not_done", 1), ("run_step_done", 10), ("run_ends", 4), ("stands", 1)])
    bits = weighted(random_, [(0, 20), (1, 1), (2, 1), (4, 1), (8, 1), (random_.randrange(16), 1)])
    arguments = {"answer": [random_.choice([0, 1, 1, 1, 2, 5, 100, 70000]), bits], "ends": [bits, random_.choice([0, 0, 1, 30])],
                 "status": [random_.randrange(32), bits],
                 "accept": [int(random_.random() < 0.9)], "limits": random_.choice([[0, 0], [0, 0], [1, 0], [0, 1], [1, 1]])}
    return " ".join(str(word) for word in [what, *arguments.get(what, [])])


def travel(random_):
    """A shutter that goes there and back as it should, broken off somewhere now and then."""
    steps, left, synchronous = random_.randrange(1, 6), random_.random() < 0.5, random_.random() < 0.3
    control = random_.randrange(64) & ~8 | 64 | (8 if left else 0) | (128 if synchronous else 0)
    lines = ["naf 7 0 24 0", "stands", f"limits {int(left)} {int(not left)}", f"naf 7 2 16 {control}", "naf 7 1 16 0"]
    for byte in [steps, 0, 100, 0] + [value for code in range(steps, 0, -1) for value in (code, 0)]:
        lines.append(f"naf 7 0 16 {byte}")
    lines.append("naf 7 0 26 0")
    for to_left in (left, not left):
        lines += ["run_step_done", "limits 0 0", *["run_step_done"] * (steps - 1), f"limits {int(not to_left)} {int(to_left)}", "run_ends",
                  "naf 7 3 0 0"]
    return lines if random_.random() < 0.6 else lines[:random_.randrange(len(lines))]


def inputs(seed, cycles):
    random_ = random.Random(seed)
    made = 0
    while made < cycles:
        if random_.random() < 0.01:
            yield from travel(random_)
        if random_.random() < 0.4:
            yield event(random_)
            continue
        for line in cycle(random_):
            made += 1
            yield line


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--driver", default=os.environ.get("BUSHD_CAMAC_DRIVER"))
    parser.add_argument("--seed", default="1985")
    parser.add_argument("--cycles", type=int, default=100_000)
    arguments = parser.parse_args()
    seed = int.from_bytes(os.urandom(6), "big") if arguments.seed == "fresh" else int(arguments.seed)
    print(f"seed {seed}: modules_test.py --seed {seed} --cycles {arguments.cycles}")
    lines = list(inputs(seed, arguments.cycles))
    told = subprocess.run([arguments.driver], input="\n".join(lines) + "\n", capture_output=True, text=True, check=True)
    answers = told.stdout.splitlines()
    laboratory = Laboratory()
    asked = {}
    for place, line in enumerate(lines):
        foretold = laboratory.carry_out(line)
        if place >= len(answers) or answers[place] != foretold:
            for earlier in range(max(0, place - 30), place):
                print(f"{lines[earlier]:40} {answers[earlier]}")
            sys.exit(f"input {place + 1}: {line}\n  model  {foretold}\n  module {answers[place] if place < len(answers) else 'nothing'}")
        for word in foretold.split()[4:]:
            if word.isalpha():
                asked[word] = asked.get(word, 0) + 1
    print(f"{len(lines)} inputs; asked of the motors: {asked}")
    missing = {"move", "stop", "step", "travel", "halt"} - set(asked)
    if missing and arguments.cycles >= 10_000:
        sys.exit(f"the sequence has never asked for: {sorted(missing)}")


if __name__ == "__main__":
    main()
