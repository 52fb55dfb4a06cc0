"""What tests of tools/check-trace share: traces of which one thing may be changed, and the tool."""

import json
import pathlib
import subprocess
import sys
import tempfile
import unittest

import synthetic
from synthetic import SLOTS, TICK_NS

TOP = pathlib.Path(__file__).resolve().parents[3]
SLOT_NS = TICK_NS // SLOTS
TABLE = {
    "name": "test",
    "time_unit_ns": 40_000,
    "accel": [250, 172, 114, 92, 79, 70, 64, 59, 55, 52, 49, 47, 45, 43, 42, 40, 39, 30, 20, 20, 20, 15],
}


def event(scene, **named):
    """The first one of its log with these values."""
    return next(event for event in scene.events if named.items() <= event.items())


class CheckTraceTest(unittest.TestCase):
    def setUp(self):
        directory = tempfile.TemporaryDirectory()
        self.addCleanup(directory.cleanup)
        self.directory = pathlib.Path(directory.name)
        self.table_file = str(self.directory / "test.toml")
        self.moves, self.trace = self.directory / "moves.jsonl", self.directory / "trace.vcd"
        self.write_table(TABLE)

    def write_table(self, table):
        with open(self.table_file, "w", encoding="utf-8") as file:
            for key, value in table.items():
                print(f"{key} = {json.dumps(value)}", file=file)

    def scene(self, fine=True, moves=None):
        """Two MCUs, four motors, both directions, a second move, one stopped in flight."""
        scene = synthetic.Scene(TABLE, self.table_file, fine, moves)
        scene.move("theta", 1, 0, 100, 300)
        scene.move("phi", 1, 15, 100, -35)
        scene.move("chi", 2, 0, 130, 1, move_id=2)
        scene.move("omega", 2, 3, 131, 500, stop_tick=181, move_id=3)
        scene.move("theta", 1, 0, 320, -200, move_id=4)
        return scene

    def write(self, scene):
        scene.write_moves(self.moves)
        scene.write_trace(self.trace)

    def check(self, scene, *more):
        self.write(scene)
        return self.run_tool("--moves", self.moves, "--trace", self.trace, *more)

    def run_tool(self, *arguments):
        command = [sys.executable, "-B", TOP / "tools" / "check-trace", *arguments]
        return subprocess.run(command, capture_output=True, text=True, check=False)

    def assert_right(self, scene, *more):
        result = self.check(scene, *more)
        self.assertEqual(result.returncode, 0, result.stdout + result.stderr)
        return result

    def assert_unusable(self, result):
        """Nothing was checked; returns what the tool says of it."""
        self.assertEqual(result.returncode, 2, result.stdout + result.stderr)
        self.assertNotIn("Traceback", result.stderr)
        return result.stderr

    def assert_problem(self, scene, *parts):
        """One line of output names all of `parts`."""
        result = self.check(scene)
        self.assertEqual(result.returncode, 1, result.stdout + result.stderr)
        lines = [line for line in result.stdout.splitlines() if line.startswith("problem: ")]
        self.assertTrue(any(all(part in line for part in parts) for line in lines), result.stdout)
        self.assertNotIn("Traceback", result.stderr)
        return lines


class OneThingWrong(CheckTraceTest):
    """The usual trace and its log, of which each test changes one thing."""

    def setUp(self):
        super().setUp()
        self.usual = self.scene()
