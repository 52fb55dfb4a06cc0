"""tools/check-trace on motions that are planned without an end, or far beyond the end of the trace."""

import contextlib
import importlib.machinery
import importlib.util
import io
import itertools
import sys
import unittest
from unittest import mock

import synthetic
from synthetic import TICK_NS
from trace_case import TABLE, TOP, CheckTraceTest

sys.path.insert(0, str(TOP / "tools"))
from check_trace import clock, motion, trajectories

LOADER = importlib.machinery.SourceFileLoader("check_trace_program", str(TOP / "tools" / "check-trace"))
CHECK_TRACE = importlib.util.module_from_spec(importlib.util.spec_from_loader(LOADER.name, LOADER))
LOADER.exec_module(CHECK_TRACE)


class WithoutEnd(CheckTraceTest):
    """Motions that are planned for 2^31 steps, of which the trace has few. Only those are worked out."""

    FAR = 2**31 - 1

    def one(self, made, moves=None, **more):
        """A motor that cruises when its trace ends."""
        scene = synthetic.Scene(TABLE, self.table_file, True, moves)
        scene.move("theta", 1, 0, 100, made + 200)
        del scene.edges[1, 0][made:]
        move = scene.events[0]
        move.update({"steps": self.FAR, **more})
        return scene

    def work_of(self, scene, *more):
        """Exit code and output of a check in this process, and how many delays or rows it has looked up."""
        self.write(scene)
        looked = itertools.count()
        most = 200 * sum(map(len, scene.edges.values()))

        def counted(function):
            def call(*arguments):
                self.assertLess(next(looked), most, "it works out more than the trace has")
                return function(*arguments)

            return call

        said = io.StringIO()
        with contextlib.ExitStack() as patches:
            for owner, name in ((motion.Table, "delay_from_start"), (motion.Table, "delay_before_end"), (trajectories.Trajectory, "at")):
                patches.enter_context(mock.patch.object(owner, name, counted(getattr(owner, name))))
            patches.enter_context(mock.patch.object(sys, "argv", ["check-trace", "--moves", str(self.moves), "--trace", str(self.trace), *more]))
            patches.enter_context(contextlib.redirect_stdout(said))
            code = CHECK_TRACE.main()
        return code, said.getvalue().splitlines()

    def test_a_jog_goes_on_when_the_trace_ends(self):
        for moves in ("stream", "table"):
            scene = self.one(400, moves)
            del scene.events[1:]
            code, said = self.work_of(scene)
            self.assertEqual((code, said[0]), (1, "problem: theta (hall:1, output 0): move 1 has no result"))
            self.assertNotIn("problem", said[1])
            self.assertIn("400 steps commanded, 400 steps made", said[-1])

    def test_a_missing_step_of_it_is_found(self):
        scene = self.one(400)
        del scene.events[1:], scene.edges[1, 0][150]
        code, said = self.work_of(scene)
        self.assertRegex(said[1], f"step 151 of {self.FAR} of move 1 is missing")
        self.assertNotIn("problem", said[2])

    def test_a_jog_meets_its_limit(self):
        scene = synthetic.Scene(TABLE, self.table_file)
        scene.move("theta", 1, 0, 100, 600)
        scene.meets_limit("theta", 400)
        scene.events[0]["steps"] = self.FAR
        scene.move("theta", 1, 0, 900, -20, move_id=2)
        self.assertEqual(self.work_of(scene)[0], 0)

    def test_a_link_is_lost_meanwhile(self):
        scene = self.one(400)
        scene.events[-1].update({"result": "link", "position_steps": 390})
        code, said = self.work_of(scene)
        self.assertIn("move 1 ended as 'link'", said[0])
        self.assertNotIn("problem", said[1])

    def test_a_stop_of_it_that_the_log_has_lost(self):
        scene = self.one(400)
        scene.events[-1].update({"result": "stopped", "position_steps": 400})
        code, said = self.work_of(scene)
        self.assertIn(f"move 1 ended at 400 steps, by the table it ends at {self.FAR}", said[0])
        self.assertNotIn("problem", said[1])

    def test_many_moves_that_meet_their_limit(self):
        """Work grows with the edges, not with edges times moves."""
        scene = synthetic.Scene(TABLE, self.table_file)
        for number in range(100):
            scene.move("theta", 1, 0, 100 + 100 * number + number**2 % 53, 40 if number % 2 else -40, move_id=number)
            scene.meets_limit("theta", 20)
        edges = len(scene.edges[1, 0])
        looked = itertools.count()
        bus_ns = clock.Clock.bus_ns

        def counted(*arguments):
            self.assertLess(next(looked), 8 * edges, "it looks at each edge again for each move")
            return bus_ns(*arguments)

        with mock.patch.object(clock.Clock, "bus_ns", counted):
            code, said = self.work_of(scene)
        self.assertEqual(code, 0, said[:4])

    def test_a_line_goes_on_when_the_trace_ends(self):
        scene = self.one(400, "table", line={"way": 1, "increment": self.FAR, "longest": self.FAR, "direction": 1, "from": 0, "to": self.FAR})
        motor = {"motor": "theta", "increment": self.FAR, "table_file": self.table_file, "table_sha256": synthetic.sha256_of(TABLE), "shortest_delay": 0}
        scene.events[:] = [{"event": "line", "way": 1, "longest": self.FAR, "motors": [motor]}, scene.events[0]]
        code, said = self.work_of(scene)
        self.assertEqual((code, said[0]), (1, "problem: theta (hall:1, output 0): move 1 has no result"))
        self.assertNotIn("problem", said[1])
        self.assertIn("400 steps commanded, 400 steps made", said[-1])

    def test_a_trajectory_goes_on_when_the_trace_ends(self):
        # 20 steps a second for three years; a tick of them has an edge in its middle or none.
        whole = 10**8
        rows = [[0, 0], [whole * 10**9, 20 * whole * 2**32]]
        scene = self.one(400, trajectory={"trajectory": 1, "column": 0})
        scene.events[:] = [{"event": "trajectory", "trajectory": 1, "interpolation": "linear", "rows": rows, "closed": True}, scene.events[0]]
        scene.edges[1, 0] = [[100 * TICK_NS + 50_000_000 * n + 25_000_000, 1] for n in range(400)]
        code, said = self.work_of(scene)
        self.assertEqual(said[0], "problem: theta (hall:1, output 0): move 1 has no result")


if __name__ == "__main__":
    unittest.main()
