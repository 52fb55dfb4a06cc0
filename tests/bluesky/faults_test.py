"""Daemon and adapter go away in the middle of a scan: the plan fails, and goes on only with positions that are right."""

import signal

from lab import BlueskyTest, main

FAR = 2000


class Faults(BlueskyTest):
    def begin_a_grid_that(self, is_cut):
        """Why the plan failed that was under way to its second point; by then it has one event."""
        import bluesky.plans as bp

        a0, b1 = self.motors_of("a0", "b1")
        self.when_moving("b1", 300, is_cut)
        cause = self.cause_of(bp.grid_scan([], a0, 0, FAR, 3, b1, 0, FAR, 3))
        self.assertEqual(self.read("a0", "b1"), [(0, 0)])
        return cause

    def test_a_killed_daemon_fails_the_plan_and_the_next_one_is_found_again(self):
        import bluesky.plan_stubs as bps

        import bushd
        from bushd.ophyd_async import UntrustedPosition

        self.bring_up_lab()
        a0, b1 = self.motors_of("a0", "b1")
        cause = self.begin_a_grid_that(lambda: self.bushd.send(signal.SIGKILL))
        self.assertIsInstance(cause, bushd.ResultUnknown)
        self.assertIn("the daemon has ended", str(cause))
        self.assertIsInstance(self.cause_of(bps.mv(a0, 1)), bushd.NoDaemon)

        self.bushd = self.start_bushd("moves-after.jsonl")
        self.wait_until_ready()
        # It has not seen how they came to rest.
        for device in (a0, b1):
            with self.assertRaisesRegex(UntrustedPosition, "its position is uncertain"):
                self.in_loop(device.read)
        self.assertIsInstance(self.cause_of(bps.mv(b1, FAR)), UntrustedPosition)
        self.wait_until("b1 to rest", lambda: not self.motors()["b1"]["moving"])
        self.command("confirm", "a0", "b1")
        self.move_after_trouble(bps.mv, a0, 10, b1, FAR)
        self.assertEqual(self.in_loop(b1.read)["b1"]["value"], FAR)
        self.end_programs()
        positions = self.traced_positions()
        self.assertEqual((positions["a0"], positions["b1"]), (10, FAR))

    def test_an_unplugged_adapter_fails_the_plan_and_nothing_is_read_until_it_is_back(self):
        import bluesky.plan_stubs as bps

        import bushd
        from bushd.ophyd_async import UntrustedPosition

        self.bring_up_lab()
        a0, b1 = self.motors_of("a0", "b1")
        cause = self.begin_a_grid_that(lambda: self.bushsim.send(signal.SIGUSR1))
        self.assertIsInstance(cause, bushd.MoveFailed)
        self.assertEqual(cause.result["b1"].outcome, bushd.Outcome.LINK)
        self.wait_until("both MCUs to be OFFLINE", lambda: self.mcu_states() == ["OFFLINE", "OFFLINE"])
        with self.assertRaisesRegex(UntrustedPosition, "b1: its position is stale: MCU hall:2 is offline"):
            self.in_loop(b1.read)
        self.assertIsInstance(self.cause_of(bps.mv(a0, 1)), UntrustedPosition)

        self.bushsim.send(signal.SIGUSR2)
        self.wait_until_ready()
        found = self.in_loop(b1.read)["b1"]["value"]
        self.assertEqual(found, self.positions()["b1"])
        self.move_after_trouble(bps.mv, a0, 10, b1, FAR)
        self.assertEqual(self.in_loop(b1.read)["b1"]["value"], FAR)
        self.end_programs()
        positions = self.traced_positions()
        self.assertEqual((positions["a0"], positions["b1"]), (10, FAR))
        self.assertIn((0, found), self.rests_in_trace("a0", "b1"))

    def test_a_killed_daemon_fails_a_flight_of_which_nothing_is_told(self):
        import bluesky.plan_stubs as bps
        import bluesky.plans as bp

        import bushd
        from bushd.ophyd_async import Path, PathFlyer, UntrustedPosition

        self.bring_up_lab()
        (flyer,) = self.connected(PathFlyer(self.daemon, "flyer"))
        (b1,) = self.motors_of("b1")
        self.when_moving("b1", 300, lambda: self.bushd.send(signal.SIGKILL))

        def plan():
            yield from bps.prepare(flyer, Path(["b1"], [(0.0,), (FAR / 2,), (FAR,)]), wait=True)
            yield from bp.fly([flyer])

        cause = self.cause_of(plan())
        self.assertIsInstance(cause, bushd.ResultUnknown)
        self.assertIn("the daemon has ended", str(cause))
        self.assertEqual([kind for kind, _ in self.documents if kind.startswith("event")], [])

        self.bushd = self.start_bushd("moves-after.jsonl")
        self.wait_until_ready()
        self.wait_until("b1 to rest", lambda: not self.motors()["b1"]["moving"])
        with self.assertRaisesRegex(UntrustedPosition, "its position is uncertain"):
            self.in_loop(b1.read)
        stands = self.positions()["b1"]
        self.assertLess(stands, FAR)
        self.end_programs()
        self.assertEqual(self.traced_positions()["b1"], stands)


if __name__ == "__main__":
    main()
