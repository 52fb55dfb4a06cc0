"""How motions of plans end otherwise than at their target: pause, abort, stop, refusal; the plan is told, and no position is wrong."""

import asyncio

from lab import BlueskyTest, main, without_repeats

FAR = 2000
POINTS = [0, FAR, 2 * FAR]


class Ends(BlueskyTest):
    def test_a_paused_scan_goes_on_and_stands_at_each_point(self):
        import bluesky.plans as bp
        from bluesky.utils import RunEngineInterrupted

        self.bring_up_lab()
        a0, b1 = self.motors_of("a0", "b1")
        self.when_moving("a0", FAR + 300, self.engine.request_pause)
        with self.assertRaises(RunEngineInterrupted):
            self.engine(bp.scan([], a0, 0, 2 * FAR, b1, 0, -2 * FAR, num=3))
        paused = self.motors()
        self.assertEqual({motor["moving"] for motor in paused.values()}, {False})
        self.assertTrue(FAR < paused["a0"]["position_steps"] < 2 * FAR)
        self.engine.resume()
        self.assertEqual(self.read("a0", "b1"), [(at, -at) for at in POINTS])
        self.end_programs()
        rests = self.rests_in_trace("a0", "b1")
        stood = paused["a0"]["position_steps"], paused["b1"]["position_steps"]
        # Both are stopped at once: one request for all that was set together.
        self.assertEqual(rests, [(0, 0), (FAR, -FAR), stood, (2 * FAR, -2 * FAR)])
        self.assertEqual(self.stops_asked(), [["a0", "b1"]])

    def test_an_aborted_scan_leaves_motors_where_the_trace_says(self):
        import bluesky.plans as bp
        from bluesky.utils import RunEngineInterrupted

        self.bring_up_lab()
        a0, b1 = self.motors_of("a0", "b1")
        self.when_moving("a0", 300, self.engine.abort)
        with self.assertRaises(RunEngineInterrupted):
            self.engine(bp.scan([], a0, 100, 2 * FAR, b1, 0, -2 * FAR, num=3))
        self.assertEqual(self.read("a0"), [(100,)])
        found = self.motors()
        self.assertEqual({(motor["moving"], motor["trust"]) for motor in found.values()}, {(False, "known")})
        self.assertLess(found["a0"]["position_steps"], FAR)
        self.end_programs()
        self.assertEqual(self.traced_positions(), {name: motor["position_steps"] for name, motor in found.items()})

    def test_what_the_daemon_refuses_fails_the_plan_with_its_reason(self):
        import bluesky.plan_stubs as bps

        import bushd

        self.bring_up_lab(with_units=("a0",))
        a0, b1 = self.motors_of("a0", "b1")
        refused = self.cause_of(bps.mv(b1, 100, a0, 51))
        self.assertIsInstance(refused, bushd.Refused)
        self.assertIn("a0: target 51.0000 mm is beyond the soft limit at 50.0000 mm", refused.reason)
        self.assertEqual(set(self.positions().values()), {0})
        with self.assertRaisesRegex(bushd.Refused, "beyond the soft limit"):
            self.in_loop(a0.check_value, 51)
        self.in_loop(a0.check_value, 49)
        self.end_programs()
        self.assertEqual(sum(self.traced_positions().values()), 0)

    def test_a_stop_in_a_plan_fails_who_waits_for_this_motor_alone(self):
        import bluesky.plan_stubs as bps

        import bushd

        self.bring_up_lab()
        a0, b1 = self.motors_of("a0", "b1")
        ended = {}

        def plan():
            ended["a0"] = yield from bps.abs_set(a0, 20 * FAR, group="far")
            ended["b1"] = yield from bps.abs_set(b1, FAR, group="near")
            yield from bps.wait_for([lambda: self.until_travelled("a0", 300)])
            yield from bps.stop(a0)
            yield from bps.wait("near")

        failed = self.cause_of(plan())
        self.assertIsInstance(failed, bushd.MoveFailed)
        self.assertEqual(failed.result["a0"].outcome, bushd.Outcome.STOPPED)
        self.assertFalse(ended["a0"].success)
        self.wait_until("b1 to rest", lambda: not self.motors()["b1"]["moving"])
        found = self.positions()
        self.end_programs()
        self.assertEqual(self.traced_positions(), found)
        self.assertEqual(self.stops_asked()[0], ["a0"])

    async def until_travelled(self, name, steps):
        while abs((await self.daemon.motor(name)).position_steps) < steps:
            await asyncio.sleep(0.01)

    def test_the_end_of_a_plan_asks_nothing_of_motors_at_rest(self):
        import bluesky.plan_stubs as bps

        self.bring_up_lab()
        (a0,) = self.motors_of("a0")
        other = self.start_move("b3", 100000)  # of somebody else
        self.engine(bps.mv(a0, 10))
        self.assertEqual(self.stops_asked(), [])
        self.assertTrue(other.lives())

    def test_time_runs_out_and_the_motor_is_stopped(self):
        import bluesky.plan_stubs as bps

        self.bring_up_lab()
        (a0,) = self.motors_of("a0")
        self.assertIsInstance(self.cause_of(self.in_time(a0)), TimeoutError)
        found = self.positions()["a0"]
        self.assertFalse(self.motors()["a0"]["moving"])
        self.end_programs()
        self.assertEqual(self.traced_positions()["a0"], found)

    def in_time(self, motor):
        from bluesky import Msg

        yield Msg("set", motor, 100 * FAR, timeout=0.5, group="a")
        yield Msg("wait", None, group="a")


class Trusted(BlueskyTest):
    def test_an_uncertain_position_is_not_read_unless_that_is_wanted(self):
        import bluesky.plan_stubs as bps

        from bushd.ophyd_async import Motor, UntrustedPosition

        self.bring_up()
        self.start_engine()
        strict, lenient = self.connected(Motor(self.daemon, "a0", "strict"), Motor(self.daemon, "a0", "lenient", uncertain=True))
        for asked in (strict.read, strict.locate):
            with self.assertRaisesRegex(UntrustedPosition, "a0: its position is uncertain: it has been neither set nor homed"):
                self.in_loop(asked)
        self.assertIsInstance(self.cause_of(bps.mv(strict, 10)), UntrustedPosition)
        self.assertEqual(self.steps_asked(), [])
        reading = self.in_loop(lenient.read)["lenient"]
        self.assertEqual((reading["value"], reading["alarm_severity"]), (0, 2))
        self.assertIn("neither set nor homed", reading["message"])
        self.assertEqual(self.in_loop(strict.read_configuration)["strict-trust"]["value"], "uncertain")
        self.survey()
        self.engine(bps.mv(strict, 10))
        self.assertEqual(self.in_loop(strict.read)["strict"]["value"], 10)

    def test_a_device_that_is_not_there_is_told_when_it_connects(self):
        from ophyd_async.core import NotConnectedError

        self.bring_up_lab()
        with self.assertRaisesRegex(NotConnectedError, 'no motor "nobody"; there are: a0, a1'):
            self.motors_of("nobody")
        self.end_programs()
        with self.assertRaisesRegex(NotConnectedError, "bushd is not running"):
            self.motors_of("a0")


if __name__ == "__main__":
    main()
