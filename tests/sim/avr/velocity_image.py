"""The pulses of the image for the ATmega1284P against "Stepper motor controller, part 3", each in its slot of 20 us.

    velocity_image.py SIM_AVR_TEST

runs it with BUSHD_VELOCITY_TRACE and judges what it has written (velocity_test.cpp says in which form). The model is the
document's: an interrupt every 25 us with STCNT and URCNT, VC, VR, A, VMIN and T = 2560000 / |VC|. What docs/protocol.md adds is
here in its words: inputs count from the third reading on, a release at once; a turn waits for the next tick; a limit makes VR 0.
"""

import collections
import math
import sys

import traces

INTERVAL = 25_000
FORWARD, REVERSE, LIMIT = 2, 4, 256
# A slot's interrupt waits for others: 35 cycles of the longest, and 59 once a tick, at 16 MHz; the clock's reading of the SYNC
# is good to 10 us.
LATE_NS = 16_000


class Buttons:
    """Readings of the inputs, one a tick; what they ask of the motors in the tick after that."""

    def __init__(self):
        self.wish, self.readings, self.held = 0, 0, False

    def read(self, pins):
        wish = bool(pins & FORWARD) - bool(pins & REVERSE)
        if wish != self.wish:
            self.wish, self.readings, self.held = wish, 0, False
        if wish and self.readings < 3:
            self.readings += 1
            self.held = self.readings == 3
        return self.wish if self.held else 0


class Motor:
    def __init__(self, vmin, v, a):
        self.VMIN, self.V, self.A = vmin, v, a
        self.runs = False

    def begin(self):
        self.VC, self.VR = 0, 0
        self.T = self.period()
        self.STCNT, self.URCNT = self.T, 625
        self.since = 0  # of the running interval, at the beginning of the tick
        self.runs = True

    def period(self):
        return max(1, 2_560_000 // max(abs(self.VC), self.VMIN))

    def tick(self, length):
        """(time in the tick, sign) of each step."""
        steps, at = [], INTERVAL - self.since
        while at <= length:
            sign = (self.VC > 0) - (self.VC < 0)
            if self.STCNT == 1 and steps and sign == -steps[0][1]:
                self.since = 0
                break
            self.STCNT -= 1
            if self.STCNT == 0:
                self.STCNT = self.T
                if sign:
                    steps.append((at, sign))
            self.URCNT -= 1
            if self.URCNT == 0:
                self.URCNT = 625
                if self.VC != self.VR:
                    self.VC = min(self.VC + self.A, self.VR) if self.VC < self.VR else max(self.VC - self.A, self.VR)
                    self.T = self.period()
            at += INTERVAL
        else:
            self.since = length - (at - INTERVAL)
        self.runs = (self.VC, self.VR) != (0, 0)
        return steps


def predicted(run):
    """(motor, slot since tick 0, sign) of all steps."""
    buttons, hit, out = Buttons(), False, []
    pins, changes = 0, collections.deque(run["inputs"])
    motors = {m: Motor(*settings) for m, settings in run["motor"].items()}
    last = run["inputs"][-1][0] + 2000
    for read_in in range(run["inputs"][0][0] - 2, last):
        while changes and changes[0][0] <= read_in:
            pins = changes.popleft()[1]
        wish = buttons.read(pins)
        for number, motor in motors.items():
            # A limit inhibits its direction until the motor has moved away with the switch inactive.
            at_limit = number == 0 and bool(pins & LIMIT)
            if number == 0:
                heading = 0 if not motor.runs else motor.VC or motor.VR
                if at_limit and heading > 0:
                    hit = True
                elif not at_limit and heading < 0:
                    hit = False
            wanted = 0 if wish > 0 and number == 0 and (at_limit or hit) else wish * motor.V
            if wanted and not motor.runs:
                motor.begin()
            if not motor.runs:
                continue
            motor.VR = wanted
            for at, sign in motor.tick(run["tick"]):
                slot = min(at * run["slots"] // run["tick"], run["slots"] - 1)
                out.append((number, (read_in + 1) * run["slots"] + slot, sign))
    return out


def run_of(trace):
    run = {"motor": {}, "inputs": [], "step": [], "counted": {}}
    for word, numbers in trace:
        if word in ("tick", "slots"):
            run[word] = numbers[0]
        elif word == "motor":
            run["motor"][numbers[0]] = numbers[1:]
        elif word == "counted":
            run["counted"][numbers[0]] = numbers[1]
        elif word == "at":
            run["begin"] = numbers[1] - numbers[0] * run["tick"]
        elif word != "end":
            run[word].append(tuple(numbers))
    return run


def judge(run):
    expected, latest = predicted(run), 0
    for motor, steps in run["counted"].items():
        assert steps == sum(sign for m, _, sign in expected if m == motor), f"motor {motor} has counted {steps}"
    for motor in run["motor"] if run["step"] else ():
        made = [(ns, sign) for m, ns, sign in run["step"] if m == motor]
        due = [(slot, sign) for m, slot, sign in expected if m == motor]
        for i, ((ns, sign), (slot, expected_sign)) in enumerate(zip(made, due)):
            due_ns = run["begin"] + math.floor(slot * run["tick"] / run["slots"])
            late = ns - due_ns
            assert sign == expected_sign and abs(late) <= LATE_NS, \
                f"motor {motor}, step {i}: {sign} at {ns}, the model has {expected_sign} at {due_ns}, {late} ns before"
            latest = max(latest, abs(late))
        assert len(made) == len(due), f"motor {motor}: {len(made)} steps, the model makes {len(due)}"
        assert sum(sign for _, sign in made) == run["counted"][motor]
    return len(expected), latest


def main(program):
    runs = [run_of(trace) for trace in traces.recorded_by(program, "VelocityOfTheImage.*", "BUSHD_VELOCITY_TRACE")]
    assert len(runs) == 5, f"{len(runs)} traces"
    for run in runs:
        steps, latest = judge(run)
        signs = {sign for *_, sign in predicted(run)}
        assert steps > 1000 and signs == {-1, 1}, run["motor"]
        print(f"{steps} steps, each within {latest / 1000:.1f} us of its slot's beginning")


if __name__ == "__main__":
    main(sys.argv[1])
