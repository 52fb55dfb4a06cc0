"""The clock of an MCU where paths alone tell it."""

import pathlib
import sys
import unittest
from types import SimpleNamespace as Some

TOP = pathlib.Path(__file__).resolve().parents[3]
sys.path.insert(0, str(TOP / "tools"))
from check_trace.clock import NO_CLOCK, rough_clock


class RoughClock(unittest.TestCase):
    HOMED = Some(edges=[Some(time_ns=5000)], moves=[], autonomous=[Some(begin_ns=1000)])
    ON_PATH = Some(edges=[Some(time_ns=9000)], moves=[Some(start_tick=3, tick_ns=1000)], autonomous=[])

    def test_the_first_edge_comes_a_tick_behind_the_first_beginning(self):
        self.assertEqual(rough_clock([self.ON_PATH]).at(0), 9000 - 3000 - 1000)

    def test_the_first_motor_may_have_homed_only(self):
        self.assertEqual(rough_clock([self.HOMED, self.ON_PATH]).at(0), 5000 - 1000 - 1000)

    def test_without_edges_there_is_none(self):
        still = Some(edges=[], moves=self.ON_PATH.moves, autonomous=[])
        self.assertIs(rough_clock([still]), NO_CLOCK)


if __name__ == "__main__":
    unittest.main()
