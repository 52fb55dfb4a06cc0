"""What happens to motors while they move: a part of a sequence (sequence.py)."""
from fractions import Fraction

from laboratory import expect, written
from model import Refused, as_written


class InMotion:
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
        # What is left of it has to last until a change takes effect: 10 ms for the program, 12 ms of an exchange
        # under way, 3 ms of frames, 4 ticks of 2.56 ms, and another exchange where a frame of before is not confirmed.
        if aims[moving.name] == moving.steps or 0.2 * most_s < 0.05:
            return self.finish(motors, targets, number)
        acts = [self.retarget] * 3 + [self.pause] * 3 + [self.stop, self.ask_for_rest]
        if self.kept:
            acts += [self.restart_in_motion, self.reboot_in_motion]
        self.rng.choice(acts)(motors, moving, aims, number)

    @staticmethod
    def hull(motor, aim):
        """Where it is on its way there."""
        places = (motor.steps, aim, aim - motor.backlash_steps())
        return (min(places), max(places))

    def finish(self, motors, targets, number):
        end = self.driver.do("end", number=number)
        expect(end["result"] == "reached", f"{end['result']}: {end['reason']}")
        for motor, at in zip(motors, end["position_steps"]):
            self.take_target(motor, targets[motor.name], at)
        self.rest()

    def retarget(self, motors, moving, aims, number):
        hull = self.hull(moving, aims[moving.name])
        # A relative one counts from the present target.
        made = self.make_move([moving], {moving.name: (aims[moving.name], hull)})
        if made is None:
            return self.finish(motors, {name: {aim} for name, aim in aims.items()}, number)
        request, targets, _, refused = made
        answer = self.ask("move", refused, **request)
        if refused is not None:
            return self.finish(motors, {name: {aim} for name, aim in aims.items()}, number)
        others = [m for m in motors if m is not moving]
        # Nobody knows when a motor that moves on has taken the new target.
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
        self.come_to_rest(motors, {m.name: self.hull(m, aims[m.name]) for m in motors})

    def come_to_rest(self, motors, hulls):
        """Somewhere on its way, as the pins say."""
        self.rest()
        for motor in motors:
            made = self.seen(motor)["pulses"] - self.base[motor.name]
            low, high = hulls[motor.name]
            expect(low <= made <= high, f"{motor.name} has stopped at {made}, not between {low} and {high}")
            motor.steps = made

    def ask_for_rest(self, motors, moving, aims, number):
        """What can be asked at rest only."""
        asks = [lambda: self.ask("configure", "at rest only", changes=[
                    {"motor": moving.name, "key": "soft_limits", "value": "none"}]),
                lambda: self.ask("confirm", "at rest only", names=[moving.name]),
                lambda: self.ask("set", "at rest only", motors=[{"name": moving.name, "steps": 5}]),
                lambda: self.ask("set", "at rest only", motors=[{"name": moving.name, "user": 5}])]
        self.rng.choice(asks)()
        self.finish(motors, {name: {aim} for name, aim in aims.items()}, number)

    def restart_in_motion(self, motors, moving, aims, number):
        self.restart_and_come_to_rest(motors, {m.name: self.hull(m, aims[m.name]) for m in motors})

    def restart_and_come_to_rest(self, motors, hulls):
        """Motors come to rest by themselves, and the MCU has counted."""
        self.driver.do(self.rng.choice(("restart", "cut")))
        self.driver.do("ready")
        self.driver.do("run", s=1.0)
        for motor in self.motors:
            motor.held = motor.held and self.kept
        self.come_to_rest(motors, hulls)

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


    # Pauses.
    def pause(self, motors, moving, aims, number):
        """All of them keep their targets."""
        paused = self.ask("pause", names=[m.name for m in motors])
        end = self.driver.do("end", number=paused["number"])
        expect(end["result"] == "done", f"paused: {end['result']}: {end['reason']}")
        before = self.driver.do("run", s=0.1)
        self.state = self.driver.do("run", s=0.5)
        for motor in motors:
            seen = self.seen(motor)
            expect(seen["pulses"] == before["motors"][motor.name]["pulses"], f"{motor.name} is paused, and moves")
            expect(seen["target"] == aims[motor.name], f"{motor.name} is paused, and aims at {seen['target']}")
            made = seen["pulses"] - self.base[motor.name]
            expect(seen["paused"] or made == aims[motor.name], f"{motor.name} is not paused, at {made}")
        expect(self.seen(moving)["paused"], f"{moving.name} is not paused")
        acts = [self.resume, self.resume, self.resume_held, self.stop]
        if len(motors) == 1:
            acts += [self.retarget_paused] * 2 + ([self.reboot_in_motion] if self.kept else [])
        if self.kept:
            acts.append(self.restart_in_motion)
        self.rng.choice(acts)(motors, moving, aims, number)

    def resume(self, motors, moving, aims, number):
        held = [m for m in motors if m.held and self.seen(m)["paused"]]
        if held:
            self.ask("resume", "it is held", names=[m.name for m in motors])
            self.ask("release", names=[m.name for m in held])
            for motor in held:
                motor.held = False
        self.ask("resume", names=[m.name for m in motors])
        self.finish(motors, {name: {aim} for name, aim in aims.items()}, number)
        for motor in motors:
            self.came_from_its_side(motor)

    def resume_held(self, motors, moving, aims, number):
        self.ask("hold", names=[moving.name])
        moving.held = True
        self.resume(motors, moving, aims, number)

    def retarget_paused(self, motors, moving, aims, number):
        at = self.seen(moving)["pulses"] - self.base[moving.name]
        if self.rng.random() < 0.2:
            # From where it is, or from its target? Nobody has said.
            self.ask("move", "it is paused on its way", to=False, motors=[{"name": moving.name, "steps": 10}])
            return self.resume(motors, moving, aims, number)
        made = self.make_move([moving], {moving.name: (aims[moving.name], (at, at))}, absolute=True)
        if made is None:
            return self.resume(motors, moving, aims, number)
        request, targets, _, refused = made
        answer = self.ask("move", refused, **request)
        if refused is not None:
            return self.resume(motors, moving, aims, number)
        moving.steps = at
        self.finish([moving], targets, answer["number"])
        first = self.driver.do("end", number=number)
        expect(first["result"] == "stopped", f"the move before: {first['result']}")
        self.came_from_its_side(moving)

    # Jogs.
    def jog(self):
        rng = self.rng
        motor = rng.choice(self.motors)
        in_steps = rng.random() < 0.5
        steps_per_s = rng.randint(100, 3000) * rng.choice((-1, 1))
        speed = written(Fraction(steps_per_s) / (1 if in_steps else motor.steps_per_unit), 6)
        if rng.random() < 0.03 or Fraction(speed) == 0:
            speed = "0.0000000001"
        silent = rng.random() < 0.15
        request = {"motor": motor.name, "speed": float(speed), "speed_in_steps": in_steps,
                   "keepalive_ms": rng.randint(100, 400) if silent else 10000}
        try:
            direction = motor.jog(as_written(float(speed)), in_steps)
        except Refused as why:
            self.ask("jog", str(why), **request)
            return
        answer = self.ask("jog", **request)
        limit = motor.farthest(direction)
        acts = [self.jog_on, self.jog_to_the_end, self.jog_and_steps_after, self.jog_back, self.jog_and_pause,
                self.jog_and_move] + ([self.jog_and_restart, self.jog_and_reboot] if self.kept else [])
        act = self.jog_silently if silent else rng.choice(acts)
        act(motor, request, direction, limit, answer["number"])
        self.ask("jog", motor=motor.name, speed=0.0)  # it lets go
        self.rest()

    def run_on(self, motor, limit):
        """For a while. Whether it is far from its limit."""
        self.state = self.driver.do("run", s=self.rng.uniform(0, 1.2))
        made = self.seen(motor)["pulses"] - self.base[motor.name]
        return limit is None or abs(limit - made) > 400

    @staticmethod
    def hull_of_jog(motor, direction, limit):
        far = motor.steps + direction * 10**9 if limit is None else limit
        return (min(motor.steps, far), max(motor.steps, far))

    def jog_ends(self, motor, hull, number, *results):
        """With one of these results, or at its limit; where, the pins say."""
        end = self.driver.do("end", number=number)
        expect(end["result"] in (*results, "limit"), f"{end['result']}: {end['reason']}")
        self.come_to_rest([motor], {motor.name: hull})
        told = end["position_steps"][0]
        expect(told == motor.steps, f"{motor.name} ended at {told}, and its pins at {motor.steps}")
        at_limit = motor.limits is not None and motor.steps in motor.step_limits()
        expect(end["result"] != "limit" or at_limit, f"{motor.name} ended at {told}, where no limit is")
        return end

    def jog_on(self, motor, request, direction, limit, number):
        hull = self.hull_of_jog(motor, direction, limit)
        self.run_on(motor, limit)
        self.ask("jog", motor=motor.name, speed=0.0)
        self.jog_ends(motor, hull, number, "done")

    def jog_to_the_end(self, motor, request, direction, limit, number):
        if limit is None:
            return self.jog_on(motor, request, direction, limit, number)
        for _ in range(60):
            self.state = self.driver.do("run", s=2.0)
            if not self.seen(motor)["moving"]:
                break
            self.ask("jog", **request)
        hull = self.hull_of_jog(motor, direction, limit)
        end = self.jog_ends(motor, hull, number)
        expect(motor.steps == limit, f"{motor.name} has jogged to {motor.steps}, not to {limit}: {end['reason']}")

    def jog_and_steps_after(self, motor, request, direction, limit, number):
        hull = self.hull_of_jog(motor, direction, limit)
        after = self.rng.randint(0, 800)
        self.run_on(motor, limit)
        at = self.seen(motor)["pulses"] - self.base[motor.name]
        self.ask("jog", motor=motor.name, speed=0.0, steps_after=after)
        end = self.jog_ends(motor, hull, number, "done", "stopped")
        if "steps after the stop event at" not in end["reason"] or end["result"] != "done":
            return
        made = abs(motor.steps - at)
        expect(abs(made - after) <= 20, f"{motor.name} made {made} steps, not {after}")

    def jog_back(self, motor, request, direction, limit, number):
        hull = self.hull_of_jog(motor, direction, limit)
        # Where it could stand, it may have ended: then this would be another jog. And one from beyond its limits
        # would be refused until it is within.
        if self.run_on(motor, limit) and self.seen(motor)["moving"] and not motor.is_outside():
            self.ask("jog", **{**request, "speed": -request["speed"]})
            low, high = motor.step_limits() if motor.limits else (-10**9, 10**9)
            hull = (min(low, motor.steps), max(high, motor.steps))
            self.run_on(motor, None)
        self.ask("jog", motor=motor.name, speed=0.0)
        self.jog_ends(motor, hull, number, "done")

    def jog_silently(self, motor, request, direction, limit, number):
        hull = self.hull_of_jog(motor, direction, limit)
        self.driver.do("run", s=3.0)
        end = self.jog_ends(motor, hull, number, "stopped")
        expect(end["result"] == "limit" or "has not renewed" in end["reason"], end["reason"])

    def jog_and_pause(self, motor, request, direction, limit, number):
        """A pause ends it, and whoever holds the key has to let go."""
        hull = self.hull_of_jog(motor, direction, limit)
        self.run_on(motor, limit)
        self.ask(self.rng.choice(("pause", "stop")), names=[motor.name])
        end = self.jog_ends(motor, hull, number, "stopped")
        if end["result"] == "stopped":
            self.ask("jog", "let go first", **request)

    def jog_and_move(self, motor, request, direction, limit, number):
        hull = self.hull_of_jog(motor, direction, limit)
        made = None
        if self.run_on(motor, limit) and self.seen(motor)["moving"] and limit is not None:
            made = self.make_move([motor], {motor.name: (motor.steps, hull)}, absolute=True)
        if made is None:
            self.ask("jog", motor=motor.name, speed=0.0)
            self.jog_ends(motor, hull, number, "done")
            return
        move, targets, _, refused = made
        answer = self.ask("move", refused, **move)
        if refused is not None:
            self.ask("jog", motor=motor.name, speed=0.0)
            self.jog_ends(motor, hull, number, "done")
            return
        self.finish([motor], targets, answer["number"])
        end = self.driver.do("end", number=number)
        expect(end["result"] == "stopped", f"the jog before: {end['result']}: {end['reason']}")

    def jog_and_restart(self, motor, request, direction, limit, number):
        hull = self.hull_of_jog(motor, direction, limit)
        self.run_on(motor, limit)
        self.restart_and_come_to_rest([motor], {motor.name: hull})

    def jog_and_reboot(self, motor, request, direction, limit, number):
        if self.run_on(motor, limit) and self.seen(motor)["moving"]:
            return self.reboot_in_motion([motor], motor, {}, number)
        hull = self.hull_of_jog(motor, direction, limit)
        self.ask("jog", motor=motor.name, speed=0.0)
        self.jog_ends(motor, hull, number, "done")
