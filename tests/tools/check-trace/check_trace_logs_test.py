"""tools/check-trace with logs and files that are wrong, and what it says where it cannot check."""

import pathlib
import re
import sqlite3
import subprocess
import sys
import unittest

import synthetic
from trace_case import TABLE, TOP, OneThingWrong, event


class WrongLogs(OneThingWrong):
    def test_a_result_that_the_table_denies(self):
        self.usual.events[-1]["position_steps"] += 1
        self.assert_problem(self.usual, "theta", "ended at 101 steps, by the table it ends at 100")

    def test_a_move_without_a_result(self):
        self.usual.events.pop()
        self.assert_problem(self.usual, "theta", "move 4 has no result")

    def test_a_move_with_two_results(self):
        self.usual.events.append(self.usual.events[-1])
        self.assert_problem(self.usual, "theta", "more than one result")

    def test_a_move_that_a_fault_ended(self):
        self.usual.events[-1]["result"] = "link"
        self.assert_problem(self.usual, "theta", "ended as 'link'")

    def test_a_stopped_move_that_is_called_reached(self):
        event(self.usual, event="result", motor="omega")["result"] = "reached"
        self.assert_problem(self.usual, "omega", "yet its result is 'reached'")

    def test_another_target_than_the_motor_was_given(self):
        self.usual.move("chi", 2, 0, 400, 300, move_id=7)
        self.usual.change("chi", "retarget", 430, 200)
        self.usual.events[-2]["target_steps"] += 1
        self.assert_problem(self.usual, "chi", "ended at 201 steps, by the table it ends at 202")

    def test_a_position_lost_between_two_moves(self):
        event(self.usual, event="move", id=4)["from_steps"] += 2
        self.assert_problem(self.usual, "theta", "starts from 302 steps")

    def test_a_position_that_was_set_between_two_moves(self):
        move = event(self.usual, event="move", id=4)
        move["from_steps"] -= 1000
        event(self.usual, event="result", id=4)["position_steps"] -= 1000
        self.assert_problem(self.usual, "theta", "starts from -700 steps")
        self.usual.events.insert(self.usual.events.index(move), {"event": "set", "motor": "theta", "position_steps": move["from_steps"]})
        self.assert_right(self.usual)

    def test_a_move_that_starts_before_the_one_before_has_ended(self):
        event(self.usual, event="move", id=4)["start_tick"] = 150
        self.assert_problem(self.usual, "theta", "starts in tick 150")

    def test_input_that_cannot_be_read_is_named(self):
        self.write(self.scene())
        other = self.trace.read_text(encoding="ascii").replace("1 ns", "10 ps", 1)
        for name, text in {
            "cut.jsonl": '{"event":"mo',
            "odd.jsonl": '{"event":"dance"}\n',
            "empty.jsonl": "",
            "no.vcd": "hello\n",
            "none.vcd": "",
            "unit.vcd": other,
            "missing.jsonl": None,
        }.items():
            with self.subTest(name=name):
                bad = self.directory / name
                if text is not None:
                    bad.write_text(text, encoding="utf-8")
                moves, trace = (self.moves, bad) if bad.suffix == ".vcd" else (bad, self.trace)
                said = self.assert_unusable(self.run_tool("--moves", moves, "--trace", trace))
                self.assertRegex(said, rf"^check-trace: .*{re.escape(name)}")

    def test_a_table_that_is_missing_is_named(self):
        pathlib.Path(self.table_file).unlink()
        self.assertIn("test.toml", self.assert_unusable(self.check(self.usual)))

    def test_a_table_that_has_changed_since_is_found_in_its_history(self):
        before = pathlib.Path(self.table_file).read_text(encoding="utf-8")
        self.write_table({"time_unit_ns": 40_000, "accel": [200, 100]})
        with sqlite3.connect(self.directory / ".history.sqlite") as history:
            history.execute("CREATE TABLE revision (name TEXT, number INTEGER, text TEXT)")
            history.execute("INSERT INTO revision VALUES ('other', 9, 'no table')")
        self.assertIn(synthetic.sha256_of(TABLE), self.assert_unusable(self.check(self.usual)))
        with sqlite3.connect(self.directory / ".history.sqlite") as history:
            history.execute("INSERT INTO revision VALUES ('test', 1, ?)", [before])
        self.assert_right(self.usual)


class OutputTest(unittest.TestCase):
    def run_to(self, output, *arguments):
        command = [sys.executable, "-B", TOP / "tools" / "check-trace", *arguments]
        return subprocess.run(command, stdout=output, stderr=subprocess.PIPE, text=True, check=False)

    def test_a_full_disk_is_an_error_that_is_told(self):
        for arguments in (["--help"], ["--version"]):
            with open("/dev/full", "wb") as full:
                ran = self.run_to(full, *arguments)
            self.assertEqual(ran.returncode, 1)
            self.assertIn("cannot write to standard output: No space left on device", ran.stderr)

    def test_names_do_not_steer_the_terminal(self):
        ran = self.run_to(subprocess.PIPE, "--moves", "a\x1b[31m\u202e", "--trace", "b")
        self.assertEqual(ran.returncode, 2)
        self.assertIn("a\\x1b[31m\\u202e: No such file", ran.stderr)


if __name__ == "__main__":
    unittest.main()
