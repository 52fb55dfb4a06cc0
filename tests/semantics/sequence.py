"""A sequence of random requests to a lab, each foretold by the model (model.py), and what is asked of motors at rest.
"""
import copy
from fractions import Fraction

from in_motion import InMotion
from laboratory import LONGEST, decimal, expect, make_installation, some_limits, written
from model import Amount, Refused


class Unforeseeable(Exception):
    """It depends on where exactly a motor is."""


class Sequence(InMotion):
    """One lab, and what happens in it."""

    def __init__(self, driver, rng, time_unit_ns, accel):
        self.driver = driver
        self.rng = rng
        self.time_unit_ns = time_unit_ns
        self.slowest = accel[0]
        self.fastest = accel[-1]
        self.kept = rng.random() < 0.7
        self.base = {}  # what the pins have made, less the position; None: it is not known
        self.requests = 0
        self.refusals = 0
        toml, self.motors = make_installation(rng, time_unit_ns)
        where = [{"name": m.name, "mcu_name": f"hall:{i // 2 + 1}", "mcu": i // 2, "output": i % 2}
                 for i, m in enumerate(self.motors)]
        self.connected = rng.random() < 0.9
        for motor in self.motors:
            motor.came = False
        self.state = driver.do("lab", toml=toml, kept=self.kept, motors=where, connect=self.connected)
        for motor in self.motors:
            self.base[motor.name] = 0
            if not self.connected:
                motor.trust = "unconfirmed"
        self.rest()
        self.judge()

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
            expect(seen["held"] == motor.held and not seen["paused"], f"{name}: held, or paused")
            expect(seen["target"] == motor.steps, f"{name} aims at {seen['target']} at rest at {motor.steps}")
            trust = motor.trust_told()
            expect(seen["trust"] == trust, f"{name} is {seen['trust']}, not {trust}: {seen['reason']}")
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
        return Amount(user=written(exact, rng.choice((1, 3, 6))))

    def speed(self, motors):
        rng = self.rng
        if rng.random() < 0.6:
            return {}
        in_steps = rng.random() < 0.5
        scale = 1 if in_steps else min(m.steps_per_unit for m in motors)
        steps_per_s = rng.choice((rng.randint(100, 3000), rng.randint(30, 300), rng.randint(100, 3000)))
        speed = written(Fraction(steps_per_s) / scale, 6)
        if Fraction(speed) <= 0 or rng.random() < 0.03:
            speed = "0.0000000001"
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
        shortest_delays = {}
        refused = None
        for motor in motors:
            base, (first, last) = bases[motor.name]
            try:
                written = Fraction(repr(speed["speed"])) if speed else None
                shortest_delays[motor.name] = motor.shortest_delay(written, speed.get("speed_in_steps", False))
                found = motor.targets(absolute, amounts[motor.name], base)
                self._must_be_within(motor, found, first, last, "is beyond the soft limit")
                at = first if first == last else None
                starts = {legs[0][0] for legs in (motor.legs(at, target, shortest_delays[motor.name]) for target in found)
                          if len(legs) > 1}
                self._must_be_within(motor, starts, first, last, "the start of its last approach, for backlash")
                targets[motor.name] = found
            except Unforeseeable:
                return None
            except Refused as why:
                refused = refused or str(why)
        return request, targets, shortest_delays, refused

    @staticmethod
    def _must_be_within(motor, targets, first, last, refused):
        verdicts = {motor.may_aim(target, first, last) for target in targets}
        if verdicts == {False}:
            raise Refused(refused)
        if verdicts - {True}:
            raise Unforeseeable()

    # Things that happen.
    def act(self):
        acts = [self.move] * 5 + [self.move_in_flight] * 5 + [self.jog] * 4 + [
            self.set_user, self.set_dial, self.set_steps, self.confirm, self.configure, self.configure, self.hold,
            self.restart]
        if self.kept:
            acts += [self.reboot, self.cut]
        self.rng.choice(acts)()
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
        request, targets, shortest_delays, refused = made
        began_us = self.state["now_us"]
        answer = self.ask("move", refused, **request)
        if refused is not None:
            return None
        return motors, targets, shortest_delays, answer["number"], began_us

    def take_target(self, motor, among, at):
        expect(at in among, f"{motor.name} went to {at}, not to {sorted(among)}")
        motor.came = motor.steps != at
        motor.steps = at

    def move(self):
        begun = self.begin()
        if begun is None:
            return
        motors, targets, shortest_delays, number, began_us = begun
        end = self.driver.do("end", number=number)
        expect(end["result"] == "reached", f"{end['result']}: {end['reason']}")
        took_us = end["now_us"] - began_us
        least_us = 0
        most_us = 0
        for i, motor in enumerate(motors):
            before = motor.steps
            at = end["position_steps"][i]
            self.take_target(motor, targets[motor.name], at)
            legs = motor.legs(before, at, shortest_delays[motor.name])
            expect(end["legs"][i] == len(legs), f"{motor.name} made {end['legs'][i]} legs, not {len(legs)}")
            least, most = self.duration_us(before, legs)
            if before != at:
                least += motor.settle_ms * 1000
                most += motor.settle_ms * 1000
            least_us = max(least_us, least)
            most_us = max(most_us, most)
        expect(took_us >= least_us, f"took {took_us} us, less than {least_us} us for its steps at that speed")
        expect(took_us <= most_us + 1_500_000, f"took {took_us} us, more than {most_us} us for its steps")
        self.rest()
        for motor in motors:
            self.came_from_its_side(motor)

    def duration_us(self, at, legs):
        """At least and, but for what lies between legs, at most."""
        least = most = 0
        for target, shortest_delay in legs:
            steps = abs(target - at)
            at = target
            if steps == 0:
                continue
            # The first delay lies before the first step: of the table, or the shortest delay.
            shortest = max(shortest_delay, self.fastest)
            first = max(shortest_delay, self.slowest)
            least += (first + (steps - 1) * shortest) * self.time_unit_ns / 1000
            most += steps * first * self.time_unit_ns / 1000
        return least, most

    def came_from_its_side(self, motor):
        """By the pins: the last steps were in the direction of its backlash."""
        backlash = motor.backlash_steps()
        last = self.seen(motor)["last_direction"]
        if backlash == 0 or last == 0 or not motor.came:
            return
        expect((last > 0) == (backlash > 0), f"{motor.name} came in direction {last} to its target")

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
        for motor in self.motors:
            motor.daemon_restarted(self.kept)

    def hold(self):
        """Until it is released, or a daemon without a state store is started again."""
        some = [m.name for m in self.some()]
        held = self.rng.random() < 0.4
        self.ask("hold" if held else "release", names=some)
        for motor in self.motors:
            if motor.name in some:
                motor.held = held

    def change(self, motor):
        rng = self.rng
        key = rng.choice(("offset", "direction", "soft_limits"))
        if key == "offset":
            value = decimal(rng, 100, 3)
            return key, value, value
        if key == "direction":
            value = rng.random() < 0.5
            return key, value, "negative" if value else "positive"
        if rng.random() < 0.3:
            return key, None, "none"
        value = some_limits(rng, motor)
        return key, value, f"[{value[0]}, {value[1]}]"

    def configure(self):
        """All of it or nothing."""
        rng = self.rng
        motors = [rng.choice(self.motors) for _ in range(rng.choice((1, 1, 2, 3)))]
        changes = [(motor, *self.change(motor)) for motor in motors]
        request = {"changes": [{"motor": m.name, "key": key, "value": text} for m, key, _, text in changes]}
        after = {motor.name: copy.copy(motor) for motor in motors}
        try:
            for motor, key, value, _ in changes:
                after[motor.name].configure(key, value)
        except Refused as why:
            self.ask("configure", str(why), **request)
            return
        answer = self.ask("configure", **request)
        for motor, key, value, _ in changes:
            motor.configure(key, value)
        end = self.driver.do("end", number=answer["number"])
        expect(end["result"] == "done", f"{end['result']}: {end['reason']}")
        told = "beyond its soft limits" in end["reason"]
        expect(told == any(m.is_outside() for m in motors), f"whether it stands beyond its limits: {end['reason']}")

    def set_user(self):
        motor = self.rng.choice(self.motors)
        user = decimal(self.rng, 50, self.rng.choice((0, 2, 4)))
        if not motor.unit:
            return self.set_number(motor, Amount(user=user))
        try:
            copy.copy(motor).set_user(user)
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
        """Sets a number of steps, whatever they are called."""
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
