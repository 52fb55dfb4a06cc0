#!/usr/bin/env python3
"""The order of what is asked of the daemon by several users, whose connections are made slowly or answer slowly: a fake client."""

import asyncio
import unittest

from bench import REST
from bushd import model
from bushd_epics import events
from bushd_epics.asks import NEVER_BEGAN, Asks
from bushd_epics.people import MOST, People
from bushd_epics.record import Putter, Record


async def settle():
    """Whatever can go on has gone on."""
    for _ in range(50):
        await asyncio.sleep(0)


class Motion:
    def __init__(self, targets):
        self.targets = targets
        self.over = asyncio.Event()
        self.outcome = model.Outcome.REACHED

    async def wait(self, *, check=True):
        await self.over.wait()
        return model.MoveResult(self.outcome, "a reason", tuple(result(name, at, self.outcome) for name, at in self.targets.items()))


def result(name, at, outcome):
    return type("Result", (), {"motor": name, "outcome": outcome, "position": at, "dial": at, "position_steps": round(at * 100)})()


class Client:
    def __init__(self, world, who):
        self.world, self.who, self.connected, self.closed = world, who, True, False

    async def close(self):
        self.closed, self.connected = True, False

    async def move(self, targets, *, speed, wait):
        self.world.sent.append((self.who, "move", dict(targets)))
        motion = Motion(targets)
        self.world.motions.append(motion)
        await self.world.accepts.get(self.who, self.world.open).wait()
        return motion

    async def stop(self, *names, wait=True, check=True):
        self.world.sent.append((self.who, "stop", names))

    async def hold(self, name):
        self.world.sent.append((self.who, "hold", name))
        await self.world.accepts.get(self.who, self.world.open).wait()

    def jog(self, name, speed, *, check):
        return Jog(self, name)

    async def status(self):
        return type("Status", (), {"motors": {}})()


class Jog:
    def __init__(self, client, name):
        self.client, self.name, self.done = client, name, False

    async def begin(self):
        self.client.world.sent.append((self.client.who, "jog", self.name))
        await self.client.world.accepts.get(self.client.who, self.client.world.open).wait()
        return self

    async def end(self):
        self.client.world.sent.append((self.client.who, "end", self.name))
        self.done = True

    @property
    def result(self):
        outcome = model.Outcome.STOPPED
        return model.MoveResult(outcome, "", (result(self.name, 0.0, outcome),))


class World:
    """`sent`: (user, what, of what), in the order in which it went out."""

    def __init__(self):
        self.open = asyncio.Event()
        self.open.set()
        self.connects = {}  # by user: once set, a connection is made
        self.accepts = {}  # by user: once set, the daemon accepts what was sent
        self.made, self.sent, self.motions, self.answers = [], [], [], {}
        self.people = People(self.connect)
        self.records = {name: Record(f"LAB:{name}") for name in ("theta", "phi")}
        self.asks = Asks(self.people, {record: name for name, record in self.records.items()}, self.deliver)
        for record in self.records.values():
            record.observe(REST, 0.0)
            self.deliver(record)

    async def connect(self, program):
        who = program.removeprefix("epics:")
        await self.connects.get(who, self.open).wait()
        self.made.append(Client(self, who))
        return self.made[-1]

    def deliver(self, record):
        for event in record.take():
            if isinstance(event, events.Ask):
                self.asks.start(record, event)
            elif isinstance(event, events.Done):
                assert event.token not in self.answers, "a put is answered twice"
                self.answers[event.token] = event.error

    def put(self, name, field, value, who, token=None):
        record = self.records[name]
        record.put(field, value, Putter(who=who, circuit=who, token=token or (who, field)), asyncio.get_running_loop().time())
        self.deliver(record)


class Order(unittest.IsolatedAsyncioTestCase):
    async def asyncSetUp(self):
        self.world = World()

    def slow(self, *users):
        self.world.connects.update({who: asyncio.Event() for who in users})

    async def connected(self, who):
        self.world.connects[who].set()
        await settle()

    async def test_two_first_asks_of_a_user_make_one_connection(self):
        self.slow("a")
        self.world.put("theta", "VAL", 1.0, "a", 1)
        self.world.put("phi", "VAL", 2.0, "a", 2)
        await settle()
        await self.connected("a")
        self.assertEqual(len(self.world.made), 1)
        self.assertEqual([ask[2] for ask in self.world.sent], [{"theta": 1.0}, {"phi": 2.0}])

    async def test_a_stop_over_a_ready_connection_cancels_a_move_whose_connection_is_being_made(self):
        await self.world.people.client("b")
        self.slow("a")
        self.world.put("theta", "VAL", 5.0, "a")
        await settle()
        self.world.put("theta", "STOP", 1, "b")
        await settle()
        self.assertEqual(self.world.sent, [("b", "stop", ("theta",))])
        await self.connected("a")
        self.assertEqual(self.world.sent, [("b", "stop", ("theta",))])
        self.assertEqual(self.world.answers, {("a", "VAL"): NEVER_BEGAN, ("b", "STOP"): ""})
        self.assertEqual(self.world.records["theta"].values["DMOV"], 1)

    async def test_who_stops_first_waits_for_no_connection_of_his_own(self):
        await self.world.people.client("a")
        self.slow("b")
        self.world.put("theta", "VAL", 5.0, "a")
        await settle()
        self.world.put("theta", "STOP", 1, "b")
        await settle()
        self.assertEqual(self.world.sent, [("a", "move", {"theta": 5.0}), ("a", "stop", ("theta",))])

    async def test_a_move_that_a_stop_may_have_overtaken_is_stopped_once_it_is_accepted(self):
        for who in "ab":
            await self.world.people.client(who)
        self.world.accepts["a"] = asyncio.Event()
        self.world.put("theta", "VAL", 5.0, "a")
        await settle()
        self.world.put("theta", "STOP", 1, "b")
        await settle()
        self.assertEqual(self.world.sent[1:], [("b", "stop", ("theta",))])
        self.world.put("theta", "VAL", 7.0, "a", "next")
        await settle()
        self.assertEqual(len(self.world.sent), 2)  # it is not to be stopped by what was meant for the first one
        self.world.accepts["a"].set()
        await settle()
        self.assertEqual(self.world.sent[2:], [("a", "stop", ("theta",)), ("a", "move", {"theta": 7.0})])

    async def test_a_stop_of_the_same_user_is_sent_once_and_the_next_target_counts(self):
        await self.world.people.client("a")
        self.world.accepts["a"] = asyncio.Event()
        self.world.put("theta", "VAL", 5.0, "a", 1)
        await settle()
        self.world.put("theta", "STOP", 1, "a", 2)
        self.world.put("theta", "VAL", 7.0, "a", 3)
        await settle()
        self.world.accepts["a"].set()
        await settle()
        self.assertEqual([what for _, what, _ in self.world.sent], ["move", "stop", "move"])

    async def test_targets_of_two_users_are_sent_in_the_order_of_their_puts(self):
        await self.world.people.client("b")
        self.slow("a")
        self.world.put("theta", "VAL", 5.0, "a")
        await settle()
        self.world.put("theta", "VAL", 7.0, "b")
        self.world.put("phi", "VAL", 1.0, "b", "another motor")
        await settle()
        self.assertEqual(self.world.sent, [("b", "move", {"phi": 1.0})])
        await self.connected("a")
        self.assertEqual(self.world.sent[1:], [("a", "move", {"theta": 5.0}), ("b", "move", {"theta": 7.0})])
        record = self.world.records["theta"]
        self.assertEqual((record.values["VAL"], [job.target for job in record.jobs.values()]), (7.0, [7.0]))

    async def test_a_stop_of_all_cancels_what_was_not_sent(self):
        await self.world.people.client("b")
        self.slow("a")
        self.world.put("theta", "VAL", 5.0, "a", 1)
        self.world.put("phi", "VAL", 5.0, "a", 2)
        await settle()
        await self.world.asks.stop_all("b")
        await self.connected("a")
        self.assertEqual(self.world.sent, [("b", "stop", ())])
        self.assertEqual(self.world.answers, {1: NEVER_BEGAN, 2: NEVER_BEGAN})

    async def test_a_stop_cancels_no_hold(self):
        await self.world.people.client("b")
        self.slow("a")
        self.world.records["theta"].hold(True, Putter(who="a", token="hold"))
        self.world.deliver(self.world.records["theta"])
        self.world.put("theta", "VAL", 1.0, "b")
        await settle()
        self.world.put("theta", "STOP", 1, "b")
        await self.connected("a")
        self.assertEqual([what for _, what, _ in self.world.sent], ["stop", "hold"])
        self.assertEqual(self.world.answers["hold"], "")

    async def test_a_jog_that_is_ended_before_it_is_accepted_ends(self):
        for accepted in (False, True):
            with self.subTest(accepted=accepted):
                world = self.world = World()
                world.accepts["a"] = asyncio.Event()
                if not accepted:
                    self.slow("a")
                world.put("theta", "JOGF", 1, "a", 1)
                await settle()
                world.put("theta", "JOGF", 0, "a", 2)
                await settle()
                if not accepted:
                    await self.connected("a")
                world.accepts["a"].set()
                await asyncio.wait_for(world.asks.finish(), 10)
                self.assertEqual([what for _, what, _ in world.sent], ["jog", "end"] if accepted else [])
                self.assertEqual((world.answers, world.records["theta"].values["DMOV"]), ({1: "", 2: ""}, 1))

    async def test_what_fails_unexpectedly_is_answered(self):
        client = await self.world.people.client("a")

        def fail(name):
            raise RuntimeError("no")

        client.hold = fail
        self.world.records["theta"].hold(True, Putter(who="a", token="hold"))
        with self.assertLogs("bushd-epics"):
            self.world.deliver(self.world.records["theta"])
            await settle()
        self.assertTrue(self.world.answers["hold"])


class Faults(unittest.IsolatedAsyncioTestCase):
    """Faults of the bridge itself: a put is answered nevertheless."""

    async def asyncSetUp(self):
        self.world = World()

    async def test_a_stop_that_fails_by_a_fault_of_the_bridge_fails_as_a_put(self):
        async def stop(*names, wait=True, check=True):
            raise KeyError("unforeseen")

        self.world.put("theta", "VAL", 1.0, "a")
        await settle()
        self.world.made[0].stop = stop
        with self.assertLogs("bushd-epics", "ERROR"):
            self.world.put("theta", "STOP", 1, "a", "stop")
            await settle()
        self.assertIn("unforeseen", self.world.answers["stop"])

    async def test_the_end_of_a_jog_that_fails_by_one_is_logged(self):
        async def end(jog):
            jog.done = True
            raise KeyError("unforeseen")

        before, Jog.end = Jog.end, end
        self.addCleanup(setattr, Jog, "end", before)
        self.world.put("theta", "JOGF", 1, "a")
        await settle()
        with self.assertLogs("bushd-epics", "ERROR"):
            self.world.put("theta", "JOGF", 0, "a", "end")
            await settle()
        await self.world.asks.finish()


class Connections(unittest.IsolatedAsyncioTestCase):
    async def asyncSetUp(self):
        self.world = World()

    async def test_one_that_the_daemon_has_closed_is_made_anew(self):
        first = await self.world.people.client("a")
        self.assertIs(await self.world.people.client("a"), first)
        first.connected = False
        second = await self.world.people.client("a")
        self.assertTrue(first.closed)
        self.assertIsNot(second, first)

    async def test_there_are_no_more_than_a_few_and_who_is_at_work_keeps_his(self):
        self.world.people.begin("first")
        first = await self.world.people.client("first")
        for number in range(2 * MOST):
            await self.world.people.client(f"user {number}")
        open_ones = [client for client in self.world.made if not client.closed]
        self.assertEqual(len(open_ones), MOST)
        self.assertIn(first, open_ones)

    async def test_nothing_is_kept_of_who_is_not_at_work(self):
        self.world.put("theta", "PROC", 1, "a")
        self.world.people.begin("a")
        self.world.people.begin("a")
        self.world.people.end("a")
        self.assertEqual(self.world.people._at_work, {"a": 1})
        self.world.people.end("a")
        self.assertEqual(self.world.people._at_work, {})


if __name__ == "__main__":
    unittest.main()
