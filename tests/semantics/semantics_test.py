#!/usr/bin/env python3
"""Random sequences of requests to a lab of bushd (driver.cpp), each foretold by the model (model.py): whether it is
accepted, and where all motors stand in the end, in steps, on the dial and for users, what that is worth, and that
their pins have turned them there.

    semantics_test.py --seed 7 --sequences 100    the same each time; `fresh`: a seed that nobody has tried
"""
import argparse
import json
import os
import random
import subprocess
import sys
import tomllib
from decimal import Decimal
from fractions import Fraction
from pathlib import Path

from model import Amount, Motor, Refused

TABLE = "bushd2-constant"
TABLES = Path(__file__).resolve().parents[2] / "tables"
LONGEST = 600  # steps of a move
SCALES = ("1", "400", "1000/3", "400/1.25", "36000/7", "2.5", "0.3", "1e3")


class Wrong(Exception):
    pass


def expect(condition, what):
    if not condition:
        raise Wrong(what)


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


class Sequence:
    """One lab, and what happens in it."""

    def __init__(self, driver, rng, time_unit_ns, accel):
        self.driver = driver
        self.rng = rng
        self.time_unit_ns = time_unit_ns
        self.slowest = accel[0]
        self.fastest = accel[-1]
        self.kept = rng.random() < 0.7
        self.motors = []
        self.base = {}  # what the pins have made, less the position; None: it is not known
        self.requests = 0
        self.refusals = 0
        toml = self._toml()
        where = [{"name": m.name, "mcu_name": f"hall:{i // 2 + 1}", "mcu": i // 2, "output": i % 2}
                 for i, m in enumerate(self.motors)]
        self.connected = rng.random() < 0.9
        self.state = driver.do("lab", toml=toml, kept=self.kept, motors=where, connect=self.connected)
        for motor in self.motors:
            self.base[motor.name] = 0
            if not self.connected:
                motor.trust = "unconfirmed"
        self.rest()
        self.judge()

    def _toml(self):
        rng = self.rng
        manner = rng.choice(("moves = \"stream\"", "moves = \"table\"", "frames = \"ticks\""))
        text = ("[[bus]]\nname = \"hall\"\nport = \"/dev/null\"\nbaud = 500000\ntick_us = 2560\n"
                f"format = \"{rng.choice(('fine', 'coarse'))}\"\n{manner}\n"
                f"[[group]]\nname = \"axes\"\ntable = \"{TABLE}\"\n"
                "[[mcu]]\nbus = \"hall\"\naddress = 1\n[[mcu]]\nbus = \"hall\"\naddress = 2\n")
        for i in range(4):
            motor = Motor(f"m{i + 1}", time_unit_ns=self.time_unit_ns)
            text += (f"[[motor]]\nname = \"{motor.name}\"\nmcu = \"hall:{i // 2 + 1}\"\noutput = {i % 2}\n"
                     "group = \"axes\"\n") + self._keys(motor)
            self.motors.append(motor)
        return text

    def _keys(self, motor):
        rng = self.rng
        if rng.random() < 0.2:
            return ""
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
            motor.offset = motor.file_offset = Fraction(offset)
            text += f"offset = {offset}\n"
        if rng.random() < 0.6:
            low, high = (self._written(Fraction(steps) / motor.steps_per_unit, 4)
                         for steps in (-rng.randint(1, 900), rng.randint(1, 900)))
            motor.limits = (Fraction(low), Fraction(high))
            text += f"soft_limits = [{low}, {high}]\n"
        if rng.random() < 0.3:
            speed = self._written(Fraction(rng.randint(60, 3000)) / motor.steps_per_unit, 4)
            motor.max_speed = Fraction(speed)
            text += f"max_speed = {speed}\n"
        return text

    @staticmethod
    def _written(value, digits):
        return str(Decimal(round(value * 10**digits)).scaleb(-digits))

    # What is seen.
    def seen(self, motor):
        return self.state["motors"][motor.name]

    def judge(self, whole=True):
        """Motors at rest are where the model says, and their pins have turned them there."""
        for motor in self.motors:
            seen = self.seen(motor)
            name = motor.name
            expect(not seen["moving"], f"{name} moves")
            expect(seen["steps"] == motor.steps, f"{name} is at {seen['steps']} steps, not at {motor.steps}")
            expect(seen["target"] == motor.steps, f"{name} aims at {seen['target']} at rest at {motor.steps}")
            expect(seen["trust"] == motor.trust_told(), f"{name} is {seen['trust']}, not {motor.trust}: {seen['reason']}")
            self._same(name, "dial", seen["dial"], motor.dial(motor.steps))
            self._same(name, "user", seen["user"], motor.user(motor.steps))
            if self.base[name] is not None:
                made = seen["pulses"] - self.base[name]
                expect(made == motor.steps, f"{name} is at {motor.steps}, and its pins have turned it to {made}")

    @staticmethod
    def _same(name, what, seen, exact):
        error = abs(Fraction(seen) - exact)
        expect(error <= Fraction(1, 10**13) * max(1, abs(exact)), f"{name}: {what} {seen}, not {float(exact)}")

    def rest(self):
        self.state = self.driver.do("run", s=0.25)  # the disk has time, too

    # What is asked.
    def ask(self, what, refused=None, **more):
        """`refused`: part of the reason that must come, None: none may."""
        self.requests += 1
        answer = self.driver.do("ask", request=what, **more)
        self.state = answer
        if refused is None:
            expect(answer["phase"] != "refused", f"refused: {answer['reason']}")
        else:
            self.refusals += 1
            expect(answer["phase"] == "refused", f"not refused for: {refused}")
            expect(refused in answer["reason"], f"refused for another reason than '{refused}': {answer['reason']}")
        return answer

    def amount(self, motor, absolute, base):
        """A distance, or a position, mostly near; some of them make no sense."""
        rng = self.rng
        steps = rng.randint(-LONGEST, LONGEST)
        if motor.limits is not None and rng.random() < 0.3:
            steps = rng.choice(motor.step_limits()) + rng.randint(-2, 2) - base
        if rng.random() < 0.02:
            steps = rng.choice((0, 2**32 - 10**6, -2**33))
        steps = base + steps if absolute else steps
        if rng.random() < 0.4:
            return Amount(steps=steps)
        if not motor.unit:
            return Amount(user=str(steps) + ("" if rng.random() < 0.9 else ".5"))
        exact = motor.user(steps) if absolute else motor.dial(steps) * (-1 if motor.negative else 1)
        if rng.random() < 0.2:  # a tie, where it can be written
            exact += Fraction(1, 2) / motor.steps_per_unit
        return Amount(user=self._written(exact, rng.choice((1, 3, 6))))

    def speed(self, motors):
        rng = self.rng
        if rng.random() < 0.6:
            return {}
        in_steps = rng.random() < 0.5
        scale = 1 if in_steps else min(m.steps_per_unit for m in motors)
        steps_per_s = rng.choice((rng.randint(100, 3000), rng.randint(30, 300), rng.randint(100, 3000)))
        speed = self._written(Fraction(steps_per_s) / scale, 6)
        if Fraction(speed) <= 0 or rng.random() < 0.03:
            speed = "0.00001"
        return {"speed": float(speed), "speed_in_steps": in_steps}

    def make_move(self, motors, bases, absolute=None):
        """A request and what must come of it: targets by name, or the part of a reason; None for a target beyond the
        limit of a motor that is beyond it."""
        rng = self.rng
        if absolute is None:
            absolute = rng.random() < 0.5
        speed = self.speed(motors)
        amounts = {m.name: self.amount(m, absolute, bases[m.name][0]) for m in motors}
        request = {"to": absolute, "motors": [{"name": m.name, **amounts[m.name].as_json()} for m in motors], **speed}
        targets = {}
        floors = {}
        refused = None
        for motor in motors:
            base, (first, last) = bases[motor.name]
            try:
                written = Fraction(repr(speed["speed"])) if speed else None
                floors[motor.name] = motor.floor(written, speed.get("speed_in_steps", False))
                found = motor.targets(absolute, amounts[motor.name], base)
                verdicts = {motor.may_aim(target, first, last) for target in found}
                if verdicts == {False}:
                    raise Refused("is beyond the soft limit")
                if verdicts != {True}:
                    return None
                targets[motor.name] = found
            except Refused as why:
                refused = refused or str(why)
        return request, targets, floors, refused

    # Things that happen.
    def act(self):
        rng = self.rng
        acts = [self.move] * 5 + [self.move_in_flight] * 4 + [self.set_user, self.set_dial, self.set_steps, self.confirm,
                                                              self.restart]
        if self.kept:
            acts += [self.reboot, self.cut]
        rng.choice(acts)()
        self.rest()
        self.judge()

    def some(self):
        return self.rng.sample(self.motors, self.rng.choice((1, 1, 1, 2, 4)))

    def at_rest(self, motors):
        return {m.name: (m.steps, (m.steps, m.steps)) for m in motors}

    def begin(self):
        """A move from rest, or nothing: then it was refused as it had to be."""
        motors = self.some()
        made = self.make_move(motors, self.at_rest(motors))
        if made is None:
            return None
        request, targets, floors, refused = made
        began_us = self.state["now_us"]
        answer = self.ask("move", refused, **request)
        if refused is not None:
            return None
        return motors, targets, floors, answer["number"], began_us

    def take_target(self, motor, among, at):
        expect(at in among, f"{motor.name} went to {at}, not to {sorted(among)}")
        motor.steps = at

    def move(self):
        begun = self.begin()
        if begun is None:
            return
        motors, targets, floors, number, began_us = begun
        end = self.driver.do("end", number=number)
        expect(end["result"] == "reached", f"{end['result']}: {end['reason']}")
        took_us = end["now_us"] - began_us
        least_us = 0
        most_us = 0
        for motor, at in zip(motors, end["position_steps"]):
            steps = abs(at - motor.steps)
            self.take_target(motor, targets[motor.name], at)
            if steps == 0:
                continue
            # The first delay lies before the first step: of the table, or the floor.
            floor = max(floors[motor.name], self.fastest)
            first = max(floor, self.slowest)
            least_us = max(least_us, (first + (steps - 1) * floor) * self.time_unit_ns / 1000)
            most_us = max(most_us, steps * first * self.time_unit_ns / 1000)
        expect(took_us >= least_us, f"took {took_us} us, less than {least_us} us for its steps at that speed")
        expect(took_us <= most_us + 1_000_000, f"took {took_us} us, more than {most_us} us for its steps")
        self.rest()

    def move_in_flight(self):
        """A move, and something while it is on its way for certain."""
        begun = self.begin()
        if begun is None:
            return
        motors, targets, _, number, _ = begun
        if any(len(found) > 1 for found in targets.values()):
            return self.finish(motors, targets, number)
        aims = {m.name: next(iter(targets[m.name])) for m in motors}
        moving = max(motors, key=lambda m: abs(aims[m.name] - m.steps))
        most_s = abs(aims[moving.name] - moving.steps) * self.fastest * self.time_unit_ns * 1e-9
        self.state = self.driver.do("run", s=self.rng.uniform(0, 0.8 * most_s))
        if aims[moving.name] == moving.steps:
            return self.finish(motors, targets, number)
        acts = [self.retarget] * 3 + [self.stop, self.ask_for_rest]
        if self.kept:
            acts += [self.restart_in_motion, self.reboot_in_motion]
        self.rng.choice(acts)(motors, moving, aims, number)

    def finish(self, motors, targets, number):
        end = self.driver.do("end", number=number)
        expect(end["result"] == "reached", f"{end['result']}: {end['reason']}")
        for motor, at in zip(motors, end["position_steps"]):
            self.take_target(motor, targets[motor.name], at)
        self.rest()

    def retarget(self, motors, moving, aims, number):
        hull = (min(moving.steps, aims[moving.name]), max(moving.steps, aims[moving.name]))
        # A relative one counts from the present target.
        made = self.make_move([moving], {moving.name: (aims[moving.name], hull)})
        if made is None:
            return self.finish(motors, {name: {aim} for name, aim in aims.items()}, number)
        request, targets, _, refused = made
        answer = self.ask("move", refused, **request)
        if refused is not None:
            return self.finish(motors, {name: {aim} for name, aim in aims.items()}, number)
        others = [m for m in motors if m is not moving]
        # Of a motor that moves on, nobody knows when it has taken the new target.
        end = self.driver.do("end", number=answer["number"])
        expect(end["result"] == "reached", f"{end['result']}: {end['reason']}")
        first = self.driver.do("end", number=number)
        expect(first["result"] == "stopped", f"the move before: {first['result']}")
        self.take_target(moving, targets[moving.name], end["position_steps"][0])
        for motor in others:
            motor.steps = aims[motor.name]
        self.rest()

    def stop(self, motors, moving, aims, number):
        self.ask("stop", names=[m.name for m in motors])
        end = self.driver.do("end", number=number)
        expect(end["result"] == "stopped", f"{end['result']}: {end['reason']}")
        self.come_to_rest(motors, aims)

    def come_to_rest(self, motors, aims):
        """Somewhere on its way, as the pins say."""
        self.rest()
        for motor in motors:
            made = self.seen(motor)["pulses"] - self.base[motor.name]
            low, high = sorted((motor.steps, aims[motor.name]))
            expect(low <= made <= high, f"{motor.name} has stopped at {made}, not between {low} and {high}")
            motor.steps = made

    def ask_for_rest(self, motors, moving, aims, number):
        """What can be asked at rest only."""
        asks = [lambda: self.ask("confirm", "at rest only", names=[moving.name]),
                lambda: self.ask("set", "at rest only", motors=[{"name": moving.name, "steps": 5}]),
                lambda: self.ask("set", "at rest only", motors=[{"name": moving.name, "user": 5}])]
        self.rng.choice(asks)()
        self.finish(motors, {name: {aim} for name, aim in aims.items()}, number)

    def restart_in_motion(self, motors, moving, aims, number):
        """Motors come to rest by themselves, and the MCU has counted."""
        self.driver.do(self.rng.choice(("restart", "cut")))
        self.driver.do("ready")
        self.driver.do("run", s=1.0)
        self.come_to_rest(motors, aims)

    def reboot_in_motion(self, motors, moving, aims, number):
        mcu = self.motors.index(moving) // 2
        self.driver.do("reboot", mcu=mcu)
        self.driver.do("end", number=number)
        self.driver.do("ready")
        self.driver.do("run", s=1.0)
        self.rest()
        for motor in self.motors:
            on_it = self.motors.index(motor) // 2 == mcu
            if not on_it:
                if motor in motors:
                    motor.steps = aims[motor.name]
                continue
            before = motor.trust
            may_have_moved = motor in motors
            # One that was there, or had arrived, may have been at rest on the disk, or not yet.
            seen = self.seen(motor)
            doubt = seen["trust"] == "uncertain" and not seen["reason"].startswith("it has been neither")
            if may_have_moved and motor is not moving and not doubt:
                may_have_moved = False
                motor.steps = aims[motor.name]
            motor.mcu_restarted(may_have_moved)
            if may_have_moved:
                motor.steps = self.seen(motor)["steps"]  # seen last
                self.base[motor.name] = None
            elif before == "unconfirmed":
                motor.steps = self.seen(motor)["steps"]

    def reboot(self):
        mcu = self.rng.randrange(2)
        self.driver.do("reboot", mcu=mcu)
        self.driver.do("run", s=0.1)
        self.driver.do("ready")
        self.rest()
        for motor in self.motors[2 * mcu:2 * mcu + 2]:
            motor.mcu_restarted(False)

    def restart(self):
        self.driver.do("restart")
        self.driver.do("ready")
        self.rest()
        for motor in self.motors:
            motor.daemon_restarted(self.kept)

    def cut(self):
        self.driver.do("cut")
        self.driver.do("ready")
        self.rest()

    def set_user(self):
        motor = self.rng.choice(self.motors)
        user = decimal(self.rng, 50, self.rng.choice((0, 2, 4)))
        if not motor.unit:
            return self.set_number(motor, Amount(user=user))
        try:
            Motor(**vars(motor)).set_user(user)
        except Refused as why:
            self.ask("set", str(why), motors=[{"name": motor.name, "user": float(user)}])
            return
        self.ask("set", motors=[{"name": motor.name, "user": float(user)}])
        self.rest()
        motor.set_user(user)

    def set_dial(self):
        motor = self.rng.choice(self.motors)
        dial = decimal(self.rng, 3, self.rng.choice((0, 2, 4)))
        if not motor.unit:
            return self.set_number(motor, Amount(user=dial), dial=True)
        self.ask("set", motors=[{"name": motor.name, "user": float(dial)}], dial=True)
        self.put(motor, motor.steps_of_dial(Fraction(dial)))

    def set_steps(self):
        self.set_number(self.rng.choice(self.motors), Amount(steps=self.rng.randint(-700, 700)))

    def set_number(self, motor, amount, **more):
        """Of steps, whatever they are called."""
        entry = {"name": motor.name, **amount.as_json()}
        try:
            # On the dial it is rounded like any other number.
            if more and amount.user is not None:
                steps = {motor.steps_of_dial(Fraction(amount.user))}
            else:
                steps = motor.steps_of_position(amount)
        except Refused as why:
            self.ask("set", str(why), motors=[entry], **more)
            return
        self.ask("set", motors=[entry], **more)
        self.put(motor, steps.pop())

    def put(self, motor, steps):
        self.rest()
        motor.set_steps(steps)
        self.base[motor.name] = self.seen(motor)["pulses"] - steps

    def confirm(self):
        motor = self.rng.choice(self.motors)
        self.ask("confirm", names=[motor.name])
        self.rest()
        motor.confirm()
        self.base[motor.name] = self.seen(motor)["pulses"] - motor.steps


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
