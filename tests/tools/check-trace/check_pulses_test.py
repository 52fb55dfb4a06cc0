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


def vcd(times_ns, positive):
    lines = ["$timescale 1 ns $end", "$scope module mcu1 $end", "$var wire 1 ! step0 $end", "$var wire 1 \" dir0 $end"]
    lines += ["$var wire 1 # en $end", "$upscope $end", "$enddefinitions $end", "#0", "0!", f'{int(positive)}"', "1#"]
    for time_ns in times_ns:
        lines += [f"#{time_ns}", "1!", f"#{time_ns + 1000}", "0!"]
    return "\n".join(lines) + "\n"


class CheckPulses(unittest.TestCase):
    def judge(self, times_ns, steps=6, positive=True):
        with tempfile.TemporaryDirectory() as folder:
            folder = pathlib.Path(folder)
            (folder / "t.toml").write_text(TABLE)
            (folder / "trace.vcd").write_text(vcd(times_ns, positive))
            move = {"event": "move", "id": 1, "motor": "x", "bus": "com1", "table_file": str(folder / "t.toml")}
            move |= {"table_sha256": Table("t", tomllib.loads(TABLE)).sha256(), "steps": steps, "from_steps": 5}
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


if __name__ == "__main__":
    unittest.main()
