#!/usr/bin/env python3
"""tools/check-pulses finds what is wrong in a trace, and nothing where nothing is."""

import json
import pathlib
import subprocess
import sys
import tempfile
import tomllib
import unittest

TOP = pathlib.Path(__file__).resolve().parents[3]
sys.path.insert(0, str(TOP / "tools"))
from check_trace.motion import Table

TABLE = 'name = "t"\ntime_unit_ns = 100000\naccel = [100, 50, 30]\n'


def vcd(times_ns, positive, begin_ns=0, output=0):
    lines = [f"$comment time 0 is {begin_ns} ns of CLOCK_MONOTONIC $end"]
    lines += ["$timescale 1 ns $end", "$scope module mcu1 $end", f"$var wire 1 ! step{output} $end"]
    lines += [f'$var wire 1 " dir{output} $end']
    lines += ["$var wire 1 # en $end", "$upscope $end", "$enddefinitions $end", "#0", "0!", f'{int(positive)}"', "1#"]
    for time_ns in times_ns:
        lines += [f"#{time_ns}", "1!", f"#{time_ns + 1000}", "0!"]
    return "\n".join(lines) + "\n"


class CheckPulses(unittest.TestCase):
    def judge(self, times_ns, steps=6, positive=True, output=None, traced=0):
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            (folder / "t.toml").write_text(TABLE)
            (folder / "trace.vcd").write_text(vcd(times_ns, positive, output=traced))
            move = {"event": "move", "id": 1, "motor": "x", "bus": "com1", "table_file": str(folder / "t.toml")}
            move |= {"table_sha256": Table("t", tomllib.loads(TABLE)).sha256(), "steps": steps, "from_steps": 5}
            if output is not None:
                move["output"] = output
            result = {"event": "result", "id": 1, "motor": "x", "result": "reached", "position_steps": 5 + steps}
            (folder / "moves.jsonl").write_text(json.dumps(move) + "\n" + json.dumps(result) + "\n")
            command = [sys.executable, "-B", TOP / "tools" / "check-pulses", "--bus", "com1"]
            command += ["--moves", folder / "moves.jsonl", "--trace", folder / "trace.vcd"]
            ran = subprocess.run(command, capture_output=True, text=True, check=False)
            return ran.returncode, ran.stdout + ran.stderr

    # Delays before the steps, of 6: 100 50 30 30 50 100, in units of 0.1 ms.
    exact = [10_000_000, 15_000_000, 18_000_000, 21_000_000, 26_000_000, 36_000_000]

    def test_what_the_table_allows(self):
        self.assertEqual(self.judge(self.exact)[0], 0)
        later = [time + 700_000 * i for i, time in enumerate(self.exact)]
        self.assertEqual(self.judge(later)[0], 0)

    def test_a_step_that_is_early(self):
        for i in range(1, 6):
            times = [time - (2 if j >= i else 0) for j, time in enumerate(self.exact)]
            code, said = self.judge(times)
            self.assertEqual(code, 1, said)
            self.assertIn("ns after the step before; the table allows", said)

    def test_steps_missing_more_and_in_the_other_direction(self):
        self.assertIn("5 of 6 steps", self.judge(self.exact[:-1])[1])
        self.assertIn("no move accounts for", self.judge([*self.exact, 90_000_000])[1])
        self.assertIn("in the other direction", self.judge(self.exact, positive=False)[1])
    def test_an_output_of_a_board(self):
        self.assertEqual(self.judge(self.exact, output=5, traced=5)[0], 0)
        early = [time - (2 if time > 18_000_000 else 0) for time in self.exact]
        self.assertEqual(self.judge(early, output=5, traced=5)[0], 1)
        said = self.judge(self.exact, output=5, traced=4)[1]
        self.assertIn("0 of 6 steps", said)
        self.assertIn("output 4: 6 steps that no move accounts for", said)

    # x makes 6 steps and y 3, each half way between two of x: after 1.5, 3.5 and 5.5 of its run.
    def judge_line(self, late_ns, apart_ms):
        times = {"x": self.exact, "y": [12_500_000, 19_500_000, 31_000_000]}
        begins = {"x": 7_000_000_000, "y": 7_000_000_000 - 3_000_000 + late_ns}
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            (folder / "t.toml").write_text(TABLE)
            events = []
            for number, (motor, of_motor) in enumerate(times.items()):
                begin_ns = begins[motor]
                shift_ns = 0 if motor == "x" else 3_000_000
                text = vcd([time + shift_ns for time in of_motor], True, begin_ns)
                (folder / f"{motor}.vcd").write_text(text)
                steps = len(of_motor)
                line = {"line": 1, "way": 9, "increment": steps, "longest": 6, "direction": 1, "from": 0, "to": 6}
                move = {"event": "move", "id": number, "motor": motor, "bus": motor, "line": line, "steps": steps}
                move |= {"table_file": str(folder / "t.toml"), "from_steps": 0}
                move |= {"table_sha256": Table("t", tomllib.loads(TABLE)).sha256()}
                result = {"event": "result", "id": number, "motor": motor, "result": "reached", "position_steps": steps}
                events += [json.dumps(move), json.dumps(result)]
            (folder / "moves.jsonl").write_text("\n".join(events) + "\n")
            command = [sys.executable, "-B", TOP / "tools" / "check-pulses", "--bus", "x", "--apart-ms", str(apart_ms)]
            command += ["--moves", folder / "moves.jsonl", "--trace", folder / "x.vcd", "--other", f"y={folder}/y.vcd"]
            ran = subprocess.run(command, capture_output=True, text=True, check=False)
            return ran.returncode, ran.stdout + ran.stderr

    def test_a_line(self):
        code, said = self.judge_line(0, 0)
        self.assertEqual(code, 0, said)
        self.assertIn("1 runs of lines, at most 0.5 steps", said)

    def test_a_line_whose_ports_are_farther_apart_than_told(self):
        code, said = self.judge_line(12_000_000, 0)
        self.assertEqual(code, 1, said)
        self.assertIn("off the line; allowed: 1.0", said)
        self.assertEqual(self.judge_line(12_000_000, 12)[0], 0)


if __name__ == "__main__":
    unittest.main()
