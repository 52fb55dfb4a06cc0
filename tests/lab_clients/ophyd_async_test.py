#!/usr/bin/env python3
"""ophyd-async's Motor and aioca, which is below it, against the real programs."""

import asyncio
import unittest

from lab import LabTest


class OphydAsync(LabTest):
    def run_async(self, work):
        return asyncio.run(asyncio.wait_for(work(), 100))

    async def motor(self, name):
        from ophyd_async.core import init_devices
        from ophyd_async.epics.motor import Motor

        async with init_devices(timeout=20):
            motor = Motor(f"LAB:{name}", name=name)
        return motor

    def test_a_motor_moves(self):
        self.bring_up_lab()

        async def work():
            motor = await self.motor("theta")
            for to in (2.0, 2.0, -1.0):
                await motor.set(to)
                # The last position has come before the put was answered.
                reading = (await motor.read())["theta"]
                self.assertEqual((reading["value"], reading["alarm_severity"]), (to, 0))
            self.assertEqual(await motor.velocity.get_value(), await motor.max_velocity.get_value())

        self.run_async(work)
        self.end_all()
        self.assertEqual(self.steps_made("theta"), -100)

    def test_a_refused_put_fails_and_the_reading_of_the_motor_is_in_alarm(self):
        """ophyd-async 0.21 drops the failure of a put that aioca reports; aioca itself raises it."""
        import aioca

        self.bring_up_lab()
        self.command("hold", "theta")

        async def work():
            motor = await self.motor("theta")
            with self.assertRaises(aioca.CANothing):
                await aioca.caput("LAB:theta", 5.0, wait=True, timeout=60)
            self.assertEqual((await motor.read())["theta"]["alarm_severity"], 2)

        self.run_async(work)

    def test_a_failed_move_can_be_left_unanswered(self):
        self.bring_up_lab(bridge=["--leave-failed-moves-unanswered"])
        self.command("hold", "theta")

        async def work():
            motor = await self.motor("theta")
            with self.assertRaises(TimeoutError):
                await motor.set(1.0, timeout=3.0)

        self.run_async(work)

    def test_a_fly_scan(self):
        from ophyd_async.core import FlyMotorInfo

        self.bring_up_lab()

        async def work():
            motor = await self.motor("theta")
            await motor.prepare(FlyMotorInfo(start_position=1.0, end_position=3.0, time_for_move=2.0))
            await motor.kickoff()
            await motor.complete()
            self.assertGreater((await motor.read())["theta"]["value"], 3.0)
            self.assertEqual(await motor.velocity.get_value(), 1.0)

        self.run_async(work)


if __name__ == "__main__":
    unittest.main()
