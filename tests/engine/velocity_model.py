"""The velocity loop as "Stepper motor controller, part 3" describes it, against that of the engine, step by step.

    velocity_model.py VELOCITY_TRACE

The model keeps to the document's words: an interrupt every 25 us with software timers STCNT and URCNT, the flag UPD, and a
main program that makes VC and T of VR when it sees the flag. BUSHD_SEED repeats a run.
"""

import os
import random
import subprocess
import sys


class Document:
    """All that changes while it runs has the document's name."""

    def __init__(self, a, vmin):
        self.A, self.VMIN = a, vmin
        self.VC = self.VR = 0
        self.T = self.period()
        self.STCNT, self.URCNT, self.UPD = self.T, 625, False

    def period(self):
        return max(1, 2560000 // max(abs(self.VC), self.VMIN))

    def interrupt(self):
        phase = 0
        self.STCNT -= 1
        if self.STCNT == 0:
            self.STCNT = self.T
            phase = 1 if self.VC > 0 else -1 if self.VC < 0 else 0
        self.URCNT -= 1
        if self.URCNT == 0:
            self.URCNT, self.UPD = 625, True
        return phase

    def main_program(self):
        if not self.UPD:
            return
        self.UPD = False
        if self.VC != self.VR:
            down = self.VR < self.VC
            self.VC += -self.A if down else self.A
            if (self.VC < self.VR) if down else (self.VC > self.VR):
                self.VC = self.VR
            self.T = self.period()


def expected(change, least, script):
    model, at, lines = Document(change, least), 0, []
    for intervals, wanted in script:
        model.VR = wanted
        for _ in range(intervals):
            phase = model.interrupt()
            model.main_program()
            if phase:
                lines.append(f"{at} {phase}")
            at += 1
        lines.append(f"= {model.VC} {model.T}")
    return lines


def made(program, change, least, script):
    text = f"{change} {least}\n" + "".join(f"{intervals} {wanted}\n" for intervals, wanted in script)
    return subprocess.run([program], input=text, check=True, capture_output=True, text=True).stdout.splitlines()


def compare(program, change, least, script):
    for number, (one, other) in enumerate(zip(made(program, change, least, script), expected(change, least, script), strict=True)):
        assert one == other, f"line {number}: {one}, the model says {other}; change {change}, least {least}, {script}"


def check_the_documents_figures(program):
    """1000 steps/s are a step every 40 intervals, and 500 steps/s^2 reach them in 2 s, which is 128 updates."""
    lines = made(program, 500, 100 * 64, [(128 * 625, 64000), (4000, 64000), (256 * 625, -64000)])
    ends = [line for line in lines if line[0] == "="]
    assert ends == ["= 64000 40", "= 64000 40", "= -64000 40"], ends
    last = [int(line.split()[0]) for line in lines[:lines.index("= 64000 40", lines.index("= 64000 40") + 1)] if line[0] != "="][-50:]
    assert all(b - a == 40 for a, b in zip(last, last[1:])), last


def main(program):
    check_the_documents_figures(program)
    seed = int(os.environ.get("BUSHD_SEED", random.randrange(2**32)))
    print(f"BUSHD_SEED={seed}", flush=True)
    choose = random.Random(seed)
    for _ in range(30):
        least = choose.choice([40, 64, 6400, choose.randrange(40, 200000)])
        change = choose.choice([1, 500, choose.randrange(1, 50000), 0x7FFFFF])
        speed = choose.choice([6400, 192000, 0x7FFFFF])
        script = [(choose.randrange(1, 20000), choose.choice([0, speed, -speed, choose.randrange(-speed, speed + 1)]))
                  for _ in range(8)]
        compare(program, change, least, script)


if __name__ == "__main__":
    main(sys.argv[1])
