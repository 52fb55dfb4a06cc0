#!/usr/bin/env python3
"""The motors of a daemon as records: ones that are gone, faults of the bridge itself, and a stop of all."""

import asyncio
import itertools
import types
import unittest
from unittest import mock

from bench import REST
from bushd import NoDaemon
from bushd_epics import daemon as module
from bushd_epics.daemon import Daemon


class Shown:
    def post(self, record, event): ...

    def alarm(self, record, event): ...

    def appear(self, record): ...

    def held(self, record, held): ...


def told(*names):
    """A status with these motors, all as at rest at 0."""
    motors = {name: types.SimpleNamespace(name=name, mcu="hall:1", held=False) for name in names}
    return types.SimpleNamespace(motors=motors, mcus={"hall:1": types.SimpleNamespace(address=1)})


class Records(unittest.IsolatedAsyncioTestCase):
    async def asyncSetUp(self):
        seen = module.motor.seen
        module.motor.seen = lambda motor: REST
        self.addCleanup(setattr, module.motor, "seen", seen)
        self.daemon = Daemon(None, lambda name: f"LAB:{name}", Shown())

    async def test_a_motor_that_is_gone_is_invalid_until_it_is_back(self):
        self.daemon._take(told("theta", "phi"), 0.0)
        self.daemon._take(told("theta"), 1.0)
        values = self.daemon.records["phi"].values
        self.assertEqual((values["SEVR"], values["AMSG"]), (3, "not in bushd.toml any more"))
        self.assertEqual(self.daemon.records["theta"].values["SEVR"], 0)
        self.daemon._take(told("theta", "phi"), 2.0)
        self.assertEqual(values["SEVR"], 0)

    async def test_a_fault_of_the_bridge_makes_all_invalid_and_it_goes_on(self):
        self.daemon._take(told("theta"), 0.0)
        rounds = []

        async def follow():
            rounds.append(None)
            if len(rounds) == 1:
                raise KeyError("unforeseen")
            await asyncio.Event().wait()

        self.daemon._follow = follow
        with self.assertLogs("bushd-epics", "ERROR") as log:
            running = asyncio.create_task(self.daemon.run())
            while not rounds:
                await asyncio.sleep(0)
            await asyncio.sleep(0)
        self.assertIn("KeyError", log.output[0])
        self.assertEqual(self.daemon.records["theta"].values["SEVR"], 3)
        while len(rounds) < 2:
            await asyncio.sleep(module.AGAIN_AFTER_S / 10)
        running.cancel()
        await asyncio.gather(running, return_exceptions=True)

    async def test_a_daemon_that_has_gone_is_looked_for_twice_a_second_or_oftener_however_long_it_is_gone(self):
        """On a clock that the pauses between tries wind."""
        self.daemon._take(told("theta"), 0.0)
        now, tries = 0.0, []

        async def sleep(delay_s):
            nonlocal now
            now += delay_s
            if now > 60:
                raise asyncio.CancelledError

        async def connect(socket, program):
            tries.append(now)
            raise NoDaemon("there is none")

        with mock.patch.object(module, "connect", connect), mock.patch.object(asyncio, "sleep", sleep), self.assertLogs("bushd-epics", "WARNING") as log:
            with self.assertRaises(asyncio.CancelledError):
                await self.daemon._keep_following()
        self.assertLessEqual(max(later - one for one, later in itertools.pairwise([*tries, 60.0])), 0.5)
        self.assertEqual((len(log.output), self.daemon.records["theta"].values["SEVR"]), (1, 3))

    async def test_it_ends_when_nobody_looks_any_more_whether_it_is_silent(self):
        async def follow():
            await asyncio.Event().wait()

        async def fails():
            raise KeyError("unforeseen")

        self.daemon._follow = follow
        self.daemon._watch_silence = fails
        running = asyncio.create_task(self.daemon.run())
        for _ in range(20):
            await asyncio.sleep(0)
        self.assertTrue(running.done(), "positions would stay as they are, and valid")
        self.assertIsNotNone(running.exception())

    async def test_the_daemon_is_asked_to_stop_all_before_records_are(self):
        self.daemon._take(told("theta"), 0.0)
        order = []

        class Client:
            connected = True

            async def stop(self, *names):
                order.append(names)

            async def status(self):
                return told()

        self.daemon._people.spare = Client()
        self.daemon.records["theta"].external = True  # another client moves it
        await self.daemon.stop_all("me:pc")
        await self.daemon._asks.finish()
        self.assertEqual(order, [(), ("theta",)])


if __name__ == "__main__":
    unittest.main()
