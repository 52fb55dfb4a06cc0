"""Plans of Bluesky, as they come, on motors of a real daemon: the motors stand where the plan asked, by the events and by the trace."""

import unittest

from lab import SLIT, BlueskyTest, main, without_repeats


class Scans(BlueskyTest):
    def test_a_scan_stands_at_each_point(self):
        import bluesky.plans as bp

        self.bring_up_lab()
        a0, b1 = self.motors_of("a0", "b1")
        self.engine(bp.scan([], a0, 0, 40, b1, 0, -80, num=5))
        points = [(0, 0), (10, -20), (20, -40), (30, -60), (40, -80)]
        self.assertEqual(self.read("a0", "b1"), points)
        self.end_programs()
        self.assertEqual(self.rests_in_trace("a0", "b1"), points)
        self.assertEqual(self.steps_asked(), [["a0", "b1"]] * 5)
        self.assert_started_together()

    def test_a_grid_of_four_motors_starts_together_what_it_sets_together(self):
        import bluesky.plans as bp

        self.bring_up_lab()
        names = ("a0", "a2", "b0", "b3")
        a0, a2, b0, b3 = self.motors_of(*names)
        self.engine(bp.grid_scan([], a0, 0, 10, 2, a2, -4, 8, 3, b0, 0, -12, 3, b3, 0, 20, 2))
        points = [(a, b, c, d) for a in (0, 10) for b in (-4, 2, 8) for c in (0, -6, -12) for d in (0, 20)]
        self.assertEqual(self.read(*names), points)
        self.end_programs()
        # It begins at 0 of all, which is not the first point.
        self.assertEqual(self.rests_in_trace(*names), without_repeats([(0, 0, 0, 0), *points]))
        self.assertEqual(len(self.steps_asked()), len(points))
        self.assertIn(list(names), self.steps_asked())
        self.assert_started_together()

    def test_a_relative_spiral_in_units_comes_back(self):
        import bluesky.plans as bp

        self.bring_up_lab(with_units=("a0", "b1"))
        a0, b1 = self.motors_of("a0", "b1")
        import bluesky.plan_stubs as bps

        self.engine(bps.mv(a0, 2.0, b1, -1.0))
        asked = []
        self.engine.msg_hook = lambda message: message.command == "set" and asked.append((message.obj.name, message.args[0]))
        self.engine(bp.rel_spiral([], a0, b1, 3.0, 3.0, 1.0, 5.0))
        self.engine.msg_hook = None
        read = self.read("a0", "b1")
        at, points = {"a0": 2.0, "b1": -1.0}, []
        for name, position in asked:
            at[name] = position
            points.append((at["a0"], at["b1"]))
        # Both motors are set for each point, so each second entry is one; the last two bring them back.
        self.assertEqual(len(points), 2 * len(read) + 2)
        steps = [(round(100 * x), round(100 * y)) for x, y in points[1::2]]
        self.assertEqual([(round(100 * x), round(100 * y)) for x, y in read], steps[:-1])
        self.assertEqual(steps[-1], (200, -100))
        self.end_programs()
        self.assertEqual(self.rests_in_trace("a0", "b1"), without_repeats([(0, 0), (200, -100), *steps]))
        self.assert_started_together()

    def test_a_pseudo_axis_is_scanned_like_a_motor(self):
        import bluesky.plans as bp

        from bushd.ophyd_async import PseudoAxis

        self.bring_up_lab(with_units=("a0", "a1"), more=SLIT)
        gap, = self.connected(PseudoAxis(self.daemon, "gap", "gap"))
        self.engine(bp.scan([], gap, 0, 2, num=3))
        self.assertEqual(self.read("gap"), [(0,), (1,), (2,)])
        self.end_programs()
        self.assertEqual(self.rests_in_trace("a0", "a1"), [(0, 0), (-50, 50), (-100, 100)])


if __name__ == "__main__":
    main()
