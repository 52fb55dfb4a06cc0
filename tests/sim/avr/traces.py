"""Traces that tests of sim_avr_test write for a checker: lines of a word and whole numbers, from `tick` to `end` for each run."""

import os
import pathlib
import subprocess
import tempfile


def recorded_by(program, tests, variable):
    """Runs these tests (a filter of gtest), which write to the file that the environment variable names.

    Returns a list of (word, [number, ...]) for each run that has ended: a test may begin one that is not judged."""
    with tempfile.TemporaryDirectory() as folder:
        trace = pathlib.Path(folder) / "trace"
        subprocess.run([program, f"--gtest_filter={tests}", "--gtest_brief=1"], check=True,
                       env=os.environ | {variable: str(trace)})
        lines = trace.read_text().splitlines()
    runs, run = [], []
    for line in lines:
        word, *numbers = line.split()
        if word == "tick":
            run = []
        run.append((word, [int(n) for n in numbers]))
        if word == "end":
            runs.append(run)
    return runs
