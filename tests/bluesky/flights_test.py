"""Flown paths, lines and groups: the way of the motors, and the pulses on it, in the simulator's trace."""

from lab import BlueskyTest, main

CORNERS = [(0, 0), (120, 0), (120, 40), (0, 40), (0, 80), (120, 80)]


class Flights(BlueskyTest):
    def flyer(self):
        from bushd.ophyd_async import PathFlyer

        (flyer,) = self.connected(PathFlyer(self.daemon, "flyer"))
        return flyer

    def pulses_in_trace(self, mcu):
        """How often the position compare output of the MCU rose."""
        scope = code = None
        rises = 0
        for line in self.file("trace.vcd").read_text(encoding="ascii").splitlines():
            words = line.split()
            if words[:2] == ["$scope", "module"]:
                scope = words[2]
            elif words[:1] == ["$var"] and scope == f"mcu{mcu}" and words[4] == "position_compare":
                code = words[3]
            elif code is not None and line == f"1{code}":
                rises += 1
        self.assertIsNotNone(code, "the trace has no such wire")
        return rises

    def corners_in_trace(self, *names):
        """Where the way of these motors turned: at rest, or without."""
        edges = sorted((edge.time_ns, name, 1 if edge.direction else -1) for name, made in self.traced().items() if name in names for edge in made)
        at = dict.fromkeys(names, 0)
        turns, heading = [tuple(at.values())], None
        for _, name, step in edges:
            if heading not in (None, (name, step)):
                turns.append(tuple(at.values()))
            heading = name, step
            at[name] += step
        return [*turns, tuple(at.values())]

    def test_a_path_is_flown_with_a_pulse_at_each_passage(self):
        import bluesky.plan_stubs as bps
        import bluesky.plans as bp

        from bushd.ophyd_async import Path, Pulses

        self.bring_up_lab()
        flyer = self.flyer()

        def plan():
            path = Path(["a0", "a1"], CORNERS, exact=True, pulses=Pulses("a0", 60))
            yield from bps.prepare(flyer, path, wait=True)
            yield from bp.fly([flyer])

        self.engine(plan())
        (page,) = [document for kind, document in self.documents if kind == "event_page"]
        self.assertEqual(page["data"], {"flyer-a0": [120.0], "flyer-a1": [80.0]})
        # No pulse is set any more.
        self.command("move", "--wait", "a0", "--to", "0")
        self.end_programs()
        self.assertEqual(self.corners_in_trace("a0", "a1"), [*CORNERS, (0, 80)])
        self.assertEqual(self.pulses_in_trace(1), 3)

    def test_a_trajectory_begins_where_it_says(self):
        import bluesky.plan_stubs as bps
        import bluesky.plans as bp

        from bushd.ophyd_async import Trajectory

        self.bring_up_lab()
        flyer = self.flyer()

        def plan():
            rows = [(20.0,), (60.0,), (140.0,)]
            yield from bps.prepare(flyer, Trajectory(["a0"], [0.0, 1.0, 2.0], rows), wait=True)
            yield from bp.fly([flyer])

        self.engine(plan())
        self.end_programs()
        edges = self.traced()["a0"]
        self.assertEqual(self.rests_in_trace("a0")[:2], [(0,), (20,)])
        self.assertEqual(len(edges), 140)
        # From the row at 60 to that at 140 it takes a second, to a tick.
        self.assertAlmostEqual((edges[139].time_ns - edges[59].time_ns) / 1e9, 1.0, delta=0.02)

    def test_a_path_that_is_refused_fails_before_it_is_flown(self):
        import bluesky.plan_stubs as bps

        import bushd
        from bushd.ophyd_async import Path

        self.bring_up_lab(with_units=("a0",))
        flyer = self.flyer()
        cause = self.cause_of(bps.prepare(flyer, Path(["a0"], [(1.0,), (51.0,)]), wait=True))
        self.assertIsInstance(cause, bushd.BushdError)
        self.assertIn("soft limit", str(cause))
        self.assertEqual(self.positions()["a0"], 100)

        def unprepared():
            yield from bps.open_run()
            yield from bps.kickoff(flyer, wait=True)

        self.assertIn("prepare it with a Path", str(self.cause_of(unprepared())))

    def test_pulses_of_a_flight_that_is_not_kicked_off_are_taken_back(self):
        import bluesky.plan_stubs as bps

        from bushd.ophyd_async import Path, Pulses

        self.bring_up_lab()
        flyer = self.flyer()

        def plan():
            yield from bps.stage(flyer, wait=True)
            yield from bps.prepare(flyer, Path(["a0"], [(0,), (100,)], pulses=Pulses("a0", 50)), wait=True)
            yield from bps.unstage(flyer, wait=True)

        self.engine(plan())
        self.command("move", "--wait", "a0", "--to", "100")
        self.end_programs()
        self.assertEqual(self.pulses_in_trace(1), 0)

    def test_an_aborted_flight_is_stopped(self):
        import bluesky.plan_stubs as bps
        import bluesky.plans as bp
        from bluesky.utils import RunEngineInterrupted

        from bushd.ophyd_async import Path

        self.bring_up_lab()
        flyer = self.flyer()
        self.when_moving("a0", 500, self.engine.abort)

        def plan():
            yield from bps.prepare(flyer, Path(["a0"], [(0,), (100000,)]), wait=True)
            yield from bp.fly([flyer])

        with self.assertRaises(RunEngineInterrupted):
            self.engine(plan())
        found = self.motors()["a0"]
        self.assertFalse(found["moving"])
        self.assertLess(found["position_steps"], 5000)
        self.end_programs()
        self.assertEqual(self.traced_positions()["a0"], found["position_steps"])


class Several(BlueskyTest):
    def test_a_group_is_one_device(self):
        import bluesky.plan_stubs as bps
        import bluesky.plans as bp

        from bushd.ophyd_async import MotorGroup

        self.bring_up_lab()
        (group,) = self.connected(MotorGroup(self.daemon, ["a0", "b1"], "group"))
        self.engine(bps.mv(group, {"b1": 30}))
        self.engine(bps.mv(group, (10, 20)))
        self.engine(bp.count([group]))
        self.assertEqual(self.read("group-a0", "group-b1"), [(10, 20)])
        self.engine(bps.mv(group["a0"], -10))
        self.assertEqual(self.in_loop(group.locate), {"setpoint": {"a0": -10, "b1": 20}, "readback": {"a0": -10, "b1": 20}})
        self.assertIsInstance(self.cause_of(bps.mv(group, {"a1": 1})), ValueError)
        self.end_programs()
        self.assertEqual(self.rests_in_trace("a0", "b1"), [(0, 0), (0, 30), (10, 20), (-10, 20)])
        self.assertEqual(self.steps_asked(), [["b1"], ["a0", "b1"], ["a0"]])

    def test_a_line_goes_straight(self):
        import bluesky.plan_stubs as bps

        from bushd.ophyd_async import Line

        self.bring_up_lab()
        (line,) = self.connected(Line(self.daemon, ["a0", "a1"], "line", duration_s=1.0))
        self.engine(bps.mv(line, (400, -100)))
        self.end_programs()
        edges = self.traced()
        self.assertEqual((len(edges["a0"]), len(edges["a1"])), (400, 100))
        self.assertGreaterEqual(edges["a0"][-1].time_ns - edges["a0"][0].time_ns, 900_000_000)
        for number, edge in enumerate(edges["a1"], 1):
            beside = sum(1 for other in edges["a0"] if other.time_ns <= edge.time_ns)
            self.assertAlmostEqual(beside, 4 * number, delta=4)

    def test_a_line_has_a_law_and_a_feed(self):
        import bluesky.plan_stubs as bps

        from bushd.ophyd_async import Line

        self.bring_up_lab()
        (line,) = self.connected(Line(self.daemon, ["a0", "a1"], "line", law="elementary", feed=500.0))
        self.engine(bps.mv(line, (40, -20)))
        self.end_programs()
        times = sorted(edge.time_ns for name in ("a0", "a1") for edge in self.traced()[name])
        self.assertEqual(len(times), 60)
        # One step at a time, 2 ms apart at least; a step lies within 10 us of its time.
        self.assertGreaterEqual(min(after - before for before, after in zip(times, times[1:])), 1_980_000)

    def test_progress_is_told(self):
        self.bring_up_lab()
        (a0,) = self.motors_of("a0")
        told = []

        async def moves():
            status = a0.set(3000)
            status.watch(lambda **update: told.append(update))
            await status

        self.in_loop(moves)
        self.assertGreater(len(told), 3)
        self.assertEqual({(update["initial"], update["target"], update["unit"], update["name"]) for update in told}, {(0, 3000, "steps", "a0")})
        self.assertEqual(sorted(update["current"] for update in told), [update["current"] for update in told])


if __name__ == "__main__":
    main()
