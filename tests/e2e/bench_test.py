"""tools/bench --latency, by few moves: what it measures is there, and every move has come to its end. Not how long they took."""

import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

from rig import GIVE_UP_S, TOP

MOVES = 5
CASES = [
    "one motor",
    "16 motors of one MCU",
    "line of 2 motors on 2 MCUs",
    "8 motors of 8 MCUs",
    "one motor, bit errors 1e-4 (seed 1)",
    "one motor, adapter latency 4 ms",
    "one motor, adapter latency 16 ms",
]
MS = r" +(\d+\.\d)"


class Bench(unittest.TestCase):
    def test_latency_measures_every_case_and_leaves_nothing(self):
        with tempfile.TemporaryDirectory(prefix="bushd-e2e-") as folder:
            command = [sys.executable, "-B", TOP / "tools" / "benchmarks" / "latency.py", "--moves", str(MOVES)]
            environment = os.environ | {"TMPDIR": folder}
            ran = subprocess.run(command, capture_output=True, text=True, env=environment, timeout=4 * GIVE_UP_S, check=False)
            self.assertEqual(ran.returncode, 0, ran.stdout + ran.stderr)
            self.assertEqual(list(pathlib.Path(folder).iterdir()), [])
        for case in CASES:
            row = re.search(rf"^{re.escape(case)}{6 * MS} +{MOVES} of {MOVES}$", ran.stdout, re.M)
            self.assertIsNotNone(row, f"{case}:\n{ran.stdout}{ran.stderr}")
            figures = [float(figure) for figure in row.groups()]
            # Whatever the machine does, percentiles rise, and a result comes after what it tells of.
            self.assertEqual(figures, sorted(figures[:3]) + sorted(figures[3:]), row[0])
            self.assertGreater(figures[3], 0, row[0])
        self.assertRegex(ran.stdout, rf"(?m)^step scan, one motor: \d+\.\d points/s; {2 * MOVES} of {2 * MOVES} reached$")
        self.assertRegex(ran.stdout, r"(?m)^at rest, 2 MCUs: line busy \d+\.\d\d % \(.*\); bushd \d\.\d{4} s of CPU a second$")
        self.assertRegex(ran.stdout, r"(?m)^collisions on the line, each a sign that this machine was late: (none|\d+ \(.*\))$")


if __name__ == "__main__":
    unittest.main()
