"""bushd.devices, of which devices of frameworks are made: what is set together is one request. It needs no framework."""

import asyncio
import pathlib
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "e2e"))

import bushd
from bushd.devices import Daemon, UntrustedPosition
from rig import FAR, EndToEndTest


class Devices(EndToEndTest):
    def with_daemon(self, function):
        """Runs this coroutine function with a Daemon; motors stand at 0."""
        self.bring_up()
        self.survey()

        async def runs():
            daemon = Daemon(self.file("control"))
            try:
                await function(daemon)
            finally:
                await daemon.close()

        asyncio.run(runs())

    def asked(self, what):
        return [event["motors"] for event in self.logged() if event["event"] == "request" and event["request"] == what]

    @staticmethod
    async def over(daemon, step):
        async for _ in daemon.progress(step, *step.targets):
            pass

    def test_what_is_set_before_the_loop_rests_is_one_request(self):
        async def sets(daemon):
            first = daemon.set({"a0": 10})
            for _ in range(10):
                await asyncio.sleep(0)
            self.assertIs(daemon.set({"b1": 20}), first)
            # The same motor once more is another step; the first one begins at once.
            second = daemon.set({"a2": 1, "a0": 10})
            self.assertIsNot(second, first)
            # What becomes of a motor that is given a new target is the daemon's matter.
            await asyncio.gather(self.over(daemon, first), self.over(daemon, second), return_exceptions=True)
            third = daemon.set({"a3": 5})
            self.assertIsNot(third, second)
            await self.over(daemon, third)

        self.with_daemon(sets)
        self.assertEqual(self.asked("move"), [["a0", "b1"], ["a2", "a0"], ["a3"]])
        self.assertEqual(self.positions()["a3"], 5)

    def test_a_question_between_two_motors_keeps_the_step_open(self):
        async def sets(daemon):
            step = daemon.set({"a0": 10})
            await daemon.motor("b1")
            self.assertIs(daemon.set({"b1": 20}), step)
            await self.over(daemon, step)

        self.with_daemon(sets)
        self.assertEqual(self.asked("move"), [["a0", "b1"]])

    def test_a_motor_that_is_stopped_before_it_began_is_not_done(self):
        async def sets(daemon):
            step = daemon.set({"a0": 10, "b1": 20})
            await daemon.stop("a0")
            with self.assertRaisesRegex(bushd.MoveFailed, "a0: stopped before it began"):
                await self.over(daemon, step)
            step.check("b1")
            own = daemon.set({"a0": 10})
            await daemon.stop_own("a0")
            self.assertIsNone(own.task.result())

        self.with_daemon(sets)
        self.assertEqual(self.asked("move"), [["b1"]])
        self.assertEqual((self.positions()["a0"], self.positions()["b1"]), (0, 20))

    def test_who_is_cancelled_ramps_its_motor_down(self):
        async def sets(daemon):
            step = daemon.set({"a0": FAR, "b1": -FAR})
            waits = asyncio.create_task(self.over(daemon, step))
            while not (await daemon.motor("a0")).moving:
                await asyncio.sleep(0.01)
            waits.cancel()
            with self.assertRaises(asyncio.CancelledError):
                await waits
            self.assertEqual([(await daemon.motor(name)).moving for name in ("a0", "b1")], [False, False])

        self.with_daemon(sets)
        self.assertTrue(0 < self.positions()["a0"] < FAR)

    def test_what_is_read_after_a_move_is_where_it_ended(self):
        async def sets(daemon):
            for number in range(20):
                await daemon.status()  # it may be kept, but not over a move
                await self.over(daemon, daemon.set({"a0": 3 * number}))
                self.assertEqual((await daemon.motor("a0")).position_steps, 3 * number)

        self.with_daemon(sets)

    def test_an_uncertain_position_is_not_counted_on(self):
        self.bring_up()

        async def sets():
            daemon = Daemon(self.file("control"))
            step = daemon.set({"a0": 10, "b1": 1})
            with self.assertRaisesRegex(UntrustedPosition, "its position is uncertain"):
                await self.over(daemon, step)
            await self.over(daemon, daemon.set({"a0": 10}, uncertain=True))
            await daemon.close()

        asyncio.run(sets())
        self.assertEqual(self.asked("move"), [["a0"]])


if __name__ == "__main__":
    unittest.main()
