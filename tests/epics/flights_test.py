#!/usr/bin/env python3
"""What is asked of the daemon for a profile, in which order, and what a stop at any moment does to it: a fake client."""

import asyncio
import dataclasses
import types
import unittest

from bench import REST
from bushd import NoDaemon, Refused, model
from bushd_epics.compare import Compare
from bushd_epics.events import Post, Speeds
from bushd_epics.flights import Flights
from bushd_epics.people import People
from bushd_epics.profile import Profile
from bushd_epics.record import Putter, Record
from bushd_epics.trigger import Trigger

RESULT = model.MotorResult(
    motor="theta", outcome=model.Outcome.REACHED, position=1.5, dial=1.5, position_steps=150, unit="deg", precision=3,
    table=model.TableRef("own", 1, "12345678"), asked_by="me", legs=1, most_steps_per_s=100.0,
)  # fmt: skip
START = {"theta": 0.0, "phi": 5.0}


async def settle():
    """Whatever can go on has gone on."""
    for _ in range(50):
        await asyncio.sleep(0)


class Motion:
    def __init__(self):
        self.motors = ()  # of its result
        self.ends = asyncio.get_running_loop().create_future()

    async def wait(self, *, check=True):
        outcome = await self.ends
        return model.MoveResult(outcome, "" if outcome is model.Outcome.REACHED else f"it has ended: {outcome.value}", self.motors)


class Client:
    connected = True

    def __init__(self, world, who):
        self.world, self.who = world, who

    async def check_follow(self, motors, time_s, rows, *, cubic):
        self.world.sent.append((self.who, "check", tuple(motors)))
        if self.world.refuses:
            raise Refused(self.world.refuses)

    async def move(self, targets, *, speed, wait):
        return await self._begin("move", (dict(targets), speed))

    async def follow(self, motors, time_s, rows, *, cubic, wait):
        return await self._begin("follow", tuple(motors))

    async def _begin(self, what, of):
        self.world.sent.append((self.who, what, of))
        await self.world.accepts.wait()
        self.world.motions.append(Motion())
        return self.world.motions[-1]

    async def status(self):
        raise NoDaemon("it has gone")

    async def stop(self, *names, wait=True, check=True):
        self.world.sent.append((self.who, "stop", names))

    async def position_compare(self, name, position, *, positive, negative, width_us):
        self.world.sent.append((self.who, "compare", (name, position, positive, negative, width_us)))
        if self.world.refuses:
            raise Refused(self.world.refuses)


    async def arm(self, motors, *, edge, delay_us, speed, while_connected):
        if self.world.refuses:
            raise Refused(self.world.refuses)
        return await self._begin("arm", (dict(motors), edge, delay_us, speed, while_connected))


class World:
    def __init__(self):
        self.sent, self.motions, self.answers, self.shown = [], [], {}, {}
        self.refuses = ""
        self.accepts = asyncio.Event()
        self.accepts.set()
        self.records = {}
        for number, name in enumerate(("theta", "phi", "chi")):
            self.records[name] = record = Record(f"LAB:{name}")
            place = f"@hall:{1 + number // 2} {number % 2}"
            record.observe(dataclasses.replace(REST, place=place), 0.0)
            record.speeds(Speeds(top=25.0, least=1.0, ramp_s=0.2))
        self.posts = []  # of records, and answers
        self.flights = Flights(People(self.connect), self.records, self.deliver)
        self.profile = Profile("LAB:pm1:", ["theta", "phi"])
        self.flights.add(self.profile, self.shown.__setitem__)
        for field, value in (
            ("NumPoints", 3), ("Acceleration", 0.0), ("M1UseAxis", 1), ("M1Positions", (0.0, 1.0, 2.0)), ("M2UseAxis", 1), ("M2Positions", (5.0, 6.0, 5.0)),
        ):  # fmt: skip
            self.put(field, value)

    def deliver(self, record):
        self.posts += [(event.field, event.value) for event in record.take() if isinstance(event, Post)]

    async def connect(self, program):
        return Client(self, program.removeprefix("epics:"))

    def by(self, token, who="me:pc"):
        def answer(error):
            self.answers[token] = error
            self.posts.append(("answer", token))

        return Putter(who=who, token=answer)

    def put(self, field, value, who="me:pc"):
        self.flights.put(self.profile, field, value, self.by(field, who))

    async def built(self):
        self.put("Build", 1)
        await settle()
        assert self.answers["Build"] == "", self.answers
        self.sent.clear()

    def end(self, outcome=model.Outcome.REACHED):
        self.motions[-1].ends.set_result(outcome)

    def whats(self):
        return [what for _, what, _ in self.sent]


class Profiles(unittest.IsolatedAsyncioTestCase):
    async def asyncSetUp(self):
        self.world = World()
        await self.world.built()

    def state(self):
        values = self.world.profile.values
        return values["Execute"], values["ExecuteState"], values["ExecuteStatus"]

    async def test_motors_go_to_the_first_row_and_follow_from_there(self):
        world = self.world
        world.put("Execute", 1)
        await settle()
        self.assertEqual(world.sent, [("me:pc", "move", (START, None))])
        self.assertEqual(self.state(), (1, 1, 0))
        world.end()
        await settle()
        self.assertEqual(world.sent[1:], [("me:pc", "follow", ("theta", "phi"))])
        self.assertEqual((self.state(), world.shown["ExecuteState"], "Execute" in world.answers), ((1, 2, 0), 2, False))
        world.end()
        await settle()
        self.assertEqual((self.state(), world.answers["Execute"]), ((0, 0, 1), ""))
        self.assertFalse(world.flights.flies(world.records["theta"]))

    async def test_the_first_move_keeps_the_least_velo(self):
        self.world.records["phi"].put("VELO", 2.0, Putter(), 0.0)
        self.world.put("Execute", 1)
        await settle()
        self.assertEqual(self.world.sent[0][2], (START, 2.0))

    async def test_what_the_daemon_refuses_fails_the_build(self):
        self.world.refuses = "theta: 9 steps/s more than its table allows"
        self.world.put("Build", 1)
        with self.assertLogs("bushd-epics", "WARNING"):
            await settle()
        self.assertEqual((self.world.shown["BuildStatus"], self.world.shown["BuildMessage"]), (2, self.world.refuses))
        self.assertIn(self.world.refuses, self.world.answers["Build"])

    async def test_who_builds_and_who_executes_has_a_connection_of_his_own(self):
        self.world.put("Execute", 1, who="you:pc")
        await settle()
        self.assertEqual(self.world.sent[0][0], "you:pc")

    async def test_a_first_move_that_does_not_arrive_ends_it(self):
        self.world.put("Execute", 1)
        await settle()
        self.world.end(model.Outcome.LIMIT)
        with self.assertLogs("bushd-epics", "WARNING"):
            await settle()
        self.assertEqual((self.world.whats(), self.state()), (["move"], (0, 0, 2)))
        self.assertEqual(self.world.shown["ExecuteMessage"], "it has ended: limit")

    async def test_an_abort_stops_all_its_motors(self):
        for legs in (1, 2):
            with self.subTest(legs=legs):
                self.world.sent.clear()
                self.world.put("Execute", 1)
                await settle()
                if legs == 2:
                    self.world.end()
                    await settle()
                self.world.put("Abort", 1)
                await settle()
                self.assertEqual(self.world.sent[-1], ("me:pc", "stop", ("theta", "phi")))
                self.world.end(model.Outcome.STOPPED)
                with self.assertLogs("bushd-epics", "WARNING"):
                    await settle()
                self.assertEqual((self.state(), self.world.answers["Abort"]), ((0, 0, 3), ""))
                self.assertEqual(len(self.world.sent), legs + 1)

    async def test_a_stop_between_the_legs_lets_the_second_one_never_begin(self):
        """The first one has arrived before the stop, so the stop finds motors at rest."""
        self.world.put("Execute", 1)
        await settle()
        self.world.end()
        self.world.flights.stop(self.world.records["phi"], self.world.by("STOP", "other:pc"))
        with self.assertLogs("bushd-epics", "WARNING"):
            await settle()
        self.assertEqual((self.world.whats(), self.state()), (["move", "stop"], (0, 0, 3)))
        self.assertEqual(self.world.answers["STOP"], "")

    async def test_a_flight_that_a_stop_may_have_overtaken_is_stopped_once_it_is_accepted(self):
        self.world.put("Execute", 1)
        await settle()
        self.world.accepts.clear()
        self.world.end()
        await settle()
        self.world.flights.stop(self.world.records["theta"], self.world.by("STOP"))
        await settle()
        self.assertEqual(self.world.whats(), ["move", "follow", "stop"])
        self.world.accepts.set()
        await settle()
        self.assertEqual(self.world.whats(), ["move", "follow", "stop", "stop"])

    async def test_a_stop_of_all_lets_nothing_begin(self):
        self.world.put("Execute", 1)
        self.world.flights.no_more()
        with self.assertLogs("bushd-epics", "WARNING"):
            await settle()
        self.assertEqual((self.world.sent, self.state()), ([], (0, 0, 3)))

    async def test_motors_that_are_not_heard_or_not_shown_cannot_be_built(self):
        def fails(why):
            with self.assertLogs("bushd-epics", "WARNING"):
                self.world.put("Build", 1)
            self.assertIn(why, self.world.answers["Build"])

        self.world.records["theta"].fall_silent("bushd is not running", 0.0)
        fails("bushd is not running")
        del self.world.records["theta"]
        fails("no motor of this name")
        self.assertEqual(self.world.sent, [])

    async def test_a_fault_of_the_bridge_ends_it_as_a_failure(self):
        async def broken(self, *arguments, **how):
            raise KeyError("unforeseen")

        self.addCleanup(setattr, Client, "follow", Client.follow)
        Client.follow = broken
        self.world.put("Execute", 1)
        await settle()
        self.world.end()
        with self.assertLogs("bushd-epics", "ERROR"):
            await settle()
        self.assertEqual((self.state(), types.SimpleNamespace(**self.world.shown).ExecuteStatus), ((0, 0, 2), 2))


class Compares(unittest.IsolatedAsyncioTestCase):
    async def asyncSetUp(self):
        self.world = World()
        self.compares = {name: Compare(name) for name in self.world.records}
        for name, record in self.world.records.items():
            self.world.flights.add_beside(record, self.compares[name], lambda field, value: None)

    async def put(self, name, field, value):
        self.world.flights.put(self.compares[name], field, value, self.world.by(name))
        await settle()

    def on(self):
        return [name for name, one in self.compares.items() if one.is_on]

    async def test_an_mcu_compares_for_one_motor(self):
        await self.put("theta", "PCOStartPosition", 2.0)
        await self.put("theta", "PCOEnable", 1)
        self.assertEqual(self.world.sent, [("me:pc", "compare", ("theta", 2.0, True, True, 10))])
        await self.put("chi", "PCOEnable", 1)
        self.assertEqual(self.on(), ["theta", "chi"])
        await self.put("phi", "PCOEnable", 1)
        self.assertEqual(self.on(), ["phi", "chi"])
        await self.put("phi", "PCOEnable", 0)
        self.assertEqual((self.world.sent[-1], self.on()), (("me:pc", "compare", ("phi", 0.0, False, False, 10)), ["chi"]))

    async def test_a_refusal_fails_the_put(self):
        self.world.refuses = "MCU hall:1 has no position compare output"
        with self.assertLogs("bushd-epics", "WARNING"):
            await self.put("theta", "PCOEnable", 1)
        self.assertEqual((self.world.answers["theta"], self.on()), (self.world.refuses, []))


class Triggers(unittest.IsolatedAsyncioTestCase):
    async def asyncSetUp(self):
        self.world = World()
        self.record = self.world.records["theta"]
        self.trigger = Trigger("theta")
        self.values = self.trigger.values
        self.world.flights.add_beside(self.record, self.trigger, lambda field, value: None)
        self.record.put("VELO", 2.0, Putter(), 0.0)
        self.put("_trgDistance", 1.5)

    def put(self, field, value):
        self.world.flights.put(self.trigger, field, value, self.world.by(f"{field} {value}"))

    def whats(self):
        return [what for _, what, _ in self.world.sent]

    async def arm(self):
        self.put("_trgArm", 1)
        await settle()

    async def test_it_waits_as_long_as_the_bridge_lives_and_keeps_velo(self):
        await self.arm()
        self.assertEqual(self.world.sent, [("me:pc", "arm", ({"theta": 1.5}, "rising", 50, 2.0, True))])
        self.record.observe(dataclasses.replace(REST, armed=True), 0.0)
        self.world.flights.look(self.record)
        self.assertEqual((self.values["_trgState"], "_trgArm 1" in self.world.answers), (2, False))
        self.world.end()
        await settle()
        self.assertEqual((self.values["_trgArm"], self.world.answers["_trgArm 1"]), (0, ""))
        self.assertFalse(self.world.flights.flies(self.record))

    async def test_the_last_position_is_told_before_the_end_and_no_state_of_before_makes_it_move_again(self):
        await self.arm()
        moving = dataclasses.replace(REST, user=1.0, dial=1.0, steps=100, moving=True, busy=True)
        self.record.observe(moving, 0.0)
        self.world.deliver(self.record)
        self.world.posts.clear()
        self.world.motions[-1].motors = (RESULT,)
        self.world.end()
        await settle()
        self.assertEqual(self.world.answers["_trgArm 1"], "")
        told = [post for post in self.world.posts if post[0] in ("RBV", "DMOV", "answer")]
        self.assertEqual(told, [("RBV", 1.5), ("DMOV", 1), ("answer", "_trgArm 1")])
        self.record.observe(moving, asyncio.get_running_loop().time())
        self.world.deliver(self.record)
        self.assertEqual((self.record.values["DMOV"], self.record.values["RBV"]), (1, 1.5))

    async def test_stops_take_it_back_at_any_moment(self):
        self.put("_trgArm", 1)
        self.world.flights.no_more()
        with self.assertLogs("bushd-epics", "WARNING"):
            await settle()
        self.assertEqual((self.world.sent, self.values["_trgArm"], self.values["_trgMessage"]), ([], 0, "stopped before it began"))
        self.world.accepts.clear()
        await self.arm()
        self.put("_trgArm", 0)
        await settle()
        self.assertEqual((self.whats(), self.world.answers["_trgArm 0"]), (["arm", "stop"], ""))
        self.world.accepts.set()
        await settle()
        self.assertEqual(self.whats(), ["arm", "stop", "stop"])  # the first one may have overtaken it
        self.world.end(model.Outcome.STOPPED)
        with self.assertLogs("bushd-epics", "WARNING"):
            await settle()
        self.assertEqual((self.values["_trgArm"], self.values["_trgState"]), (0, 0))

    async def test_a_refusal_fails_the_put(self):
        self.world.refuses = "theta is held"
        with self.assertLogs("bushd-epics", "WARNING"):
            await self.arm()
        self.assertEqual((self.world.answers["_trgArm 1"], self.values["_trgMessage"]), (self.world.refuses,) * 2)


if __name__ == "__main__":
    unittest.main()
