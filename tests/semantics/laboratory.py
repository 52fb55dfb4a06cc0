"""The lab at the other end of a pipe (driver.cpp), and what is in it: made up at random, for bushd.toml and the model.
"""
import json
import subprocess
from decimal import Decimal
from fractions import Fraction
from pathlib import Path

from model import Motor

TABLE = "bushd2-constant"
TABLES = Path(__file__).resolve().parents[2] / "tables"
LONGEST = 600  # steps of a move
SCALES = ("1", "400", "1000/3", "400/1.25", "36000/7", "2.5", "0.3", "1e3")


class Wrong(Exception):
    pass


def expect(condition, what):
    if not condition:
        raise Wrong(what)


def written(value, digits):
    """To so many digits, as people write it."""
    return str(Decimal(round(value * 10**digits)).scaleb(-digits))


class Driver:
    def __init__(self, program):
        self.process = subprocess.Popen([program, "--gtest_brief=1"], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                        text=True)
        self.log = []

    def do(self, what, **more):
        line = json.dumps({"do": what, **more})
        self.log.append(line)
        self.process.stdin.write(line + "\n")
        self.process.stdin.flush()
        for answer in self.process.stdout:
            if answer.startswith("@ "):
                self.log.append(answer.rstrip()[:2000])
                found = json.loads(answer[2:])
                expect(not found["failed"], "the lab failed: " + "".join(self.log[-3:]))
                return found
            self.log.append(answer.rstrip())
        raise Wrong("the lab has ended")

    def close(self):
        self.process.stdin.close()
        self.process.stdout.read()  # what it says at its end
        return self.process.wait()


def decimal(rng, most, digits):
    """A number as people write it."""
    return str(Decimal(rng.randint(-most * 10**digits, most * 10**digits)).scaleb(-digits))


def some_limits(rng, motor):
    return tuple(written(Fraction(steps) / motor.steps_per_unit, 4)
                 for steps in (-rng.randint(1, 900), rng.randint(1, 900)))


def _unit_keys(rng, motor):
    scale = rng.choice(SCALES)
    parts = [Fraction(part) for part in scale.split("/")]
    motor.unit = True
    motor.steps_per_unit = parts[0] / (parts[1] if len(parts) > 1 else 1)
    text = f"unit = \"mm\"\nsteps_per_unit = \"{scale}\"\n"
    if rng.random() < 0.5:
        motor.negative = True
        text += "direction = \"negative\"\n"
    if rng.random() < 0.6:
        offset = decimal(rng, 100, 3)
        motor.offset = Fraction(offset)
        text += f"offset = {offset}\n"
    if rng.random() < 0.6:
        low, high = some_limits(rng, motor)
        motor.limits = (Fraction(low), Fraction(high))
        text += f"soft_limits = [{low}, {high}]\n"
    if rng.random() < 0.3:
        speed = written(Fraction(rng.randint(60, 3000)) / motor.steps_per_unit, 4)
        motor.max_speed = Fraction(speed)
        text += f"max_speed = {speed}\n"
    return text


def _backlash_keys(rng, motor):
    text = ""
    if rng.random() < 0.3:
        motor.settle_ms = rng.randint(1, 400)
        text += f"settle_ms = {motor.settle_ms}\n"
    if rng.random() < 0.5:
        return text
    steps = rng.choice((-1, 1)) * rng.choice((rng.randint(1, 20), rng.randint(20, 200)))
    backlash = written(Fraction(steps) / motor.steps_per_unit, 6 if motor.unit else 0)
    motor.backlash = Fraction(backlash)
    if motor.backlash_steps() == 0:  # too few digits
        motor.backlash = Fraction(0)
        return text
    text += f"backlash = {backlash}\n"
    if rng.random() < 0.5:
        speed = written(Fraction(rng.randint(80, 2000)) / motor.steps_per_unit, 4)
        motor.backlash_speed = Fraction(speed)
        text += f"backlash_speed = {speed}\n"
    return text


def make_installation(rng, time_unit_ns):
    """Four motors on two MCUs: bushd.toml, and the motors of the model."""
    manner = rng.choice(("moves = \"stream\"", "moves = \"table\"", "frames = \"ticks\""))
    text = ("[[bus]]\nname = \"hall\"\nport = \"/dev/null\"\nbaud = 500000\ntick_us = 2560\n"
            f"format = \"{rng.choice(('fine', 'coarse'))}\"\n{manner}\n"
            f"[[group]]\nname = \"axes\"\ntable = \"{TABLE}\"\n"
            "[[mcu]]\nbus = \"hall\"\naddress = 1\n[[mcu]]\nbus = \"hall\"\naddress = 2\n")
    motors = []
    for i in range(4):
        motor = Motor(f"m{i + 1}", time_unit_ns=time_unit_ns)
        text += (f"[[motor]]\nname = \"{motor.name}\"\nmcu = \"hall:{i // 2 + 1}\"\noutput = {i % 2}\n"
                 "group = \"axes\"\n")
        if rng.random() >= 0.2:
            text += _unit_keys(rng, motor)
        text += _backlash_keys(rng, motor)
        motor.is_as_written()
        motors.append(motor)
    return text, motors
