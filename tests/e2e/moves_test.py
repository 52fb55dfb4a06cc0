"""Moves that go as planned: every edge of them is checked against the tables."""

import csv
import io
import json
import unittest
from fractions import Fraction

from rig import FAR, MOTORS, TABLE_RUNS, TICK_US, TOP, EndToEndTest, program


class Moves(EndToEndTest):
    def check_moves(self, displacement_format, bus_lines=()):
        self.bring_up(displacement_format, bus_lines)
        signs = {name: 1 if i % 3 else -1 for i, name in enumerate(MOTORS)}
        # Shorter than both ramps together, and one step; then with cruise.
        short = {name: signs[name] * (1 + 61 * i) for i, name in enumerate(MOTORS)}
        self.command("move", "--wait", *[word for pair in short.items() for word in pair])
        self.assertEqual(self.positions(), short)
        long = {name: -signs[name] * (900 + 97 * i) for i, name in enumerate(MOTORS)}
        self.command("move", "--wait", *[word for pair in long.items() for word in pair])

        # One of two that move is stopped; the other goes on to its target.
        stopped = self.start_move("a0", FAR)
        other = self.start_move("b1", -5000)
        self.wait_until_travelled(1500, "a0")
        self.command("stop", "a0", "--wait")
        self.assertEqual(stopped.process.wait(), 1)
        self.assertIn("stopped", stopped.said())
        self.assertEqual(other.process.wait(), 0, other.said())

        self.assertGreater(self.positions()["a0"], 1500)
        self.command("move", "--wait", *[word for name in MOTORS for word in (name, "--to", "0")])
        status = self.status()
        self.assertEqual({motor["position_steps"] for motor in status["motors"]}, {0})

        self.assertEqual(self.bushd.end(), 0)
        self.assertEqual(self.bushsim.end(), 0)
        self.assert_one_result_each()
        self.assert_trace_is_right(status)
        results = [event["result"] for event in self.moves() if event["event"] == "result"]
        self.assertEqual(results.count("stopped"), 1)
        self.assertEqual(set(results), {"reached", "stopped"})

    def check_line_made_by_the_mcus(self, displacement_format):
        """Two MCUs, the motors' ways equal: every edge in the slot of its time, until a stop makes ticks of it."""
        self.bring_up(displacement_format)
        self.command("move", "--line", "--wait", "a0", "900", "b0", "-900")
        move = self.start_move("--line", "a0", "20000", "b0", "-20000")
        self.wait_until("a0 to be under way", lambda: self.positions()["a0"] > 2500)
        self.command("stop", "b0")
        self.assertEqual(move.process.wait(), 1)
        status = self.status()
        self.assertEqual(self.positions()["a0"], -self.positions()["b0"])
        self.assertEqual(self.bushd.end(), 0)
        self.assertEqual(self.bushsim.end(), 0)
        self.assertEqual([event["moves"] for event in self.moves() if event["event"] == "move"], ["table"] * 4)
        self.assert_one_result_each()
        self.assert_trace_is_right(status)

    def test_lines_made_by_the_mcus_fine(self):
        self.check_line_made_by_the_mcus("fine")

    def test_lines_made_by_the_mcus_coarse(self):
        self.check_line_made_by_the_mcus("coarse")

    def test_a_line_by_the_elementary_law(self):
        """One motor makes one step at a time, in the order that the paper's function has; the trace is judged edge by edge, too."""
        self.bring_up("fine")
        self.command("move", "--line", "--law", "elementary", "--wait", "a0", "900", "a2", "-400")
        refused = self.bushctl("move", "--line", "--law", "elementary", "a0", "10", "b0", "10")
        self.assertIn("one MCU", refused.stderr)
        status = self.status()
        self.assertEqual(self.bushd.end(), 0)
        self.assertEqual(self.bushsim.end(), 0)
        edges = self.traced()
        made = [name for _, name in sorted((edge.time_ns, name) for name in ("a0", "a2") for edge in edges[name])]
        printed, function = [], 0
        while printed.count("a0") < 900 or printed.count("a2") < 400:
            printed.append("a0" if function >= 0 else "a2")
            function += -400 if function >= 0 else 900
        self.assertEqual(made, printed)
        self.assert_one_result_each()
        self.assert_trace_is_right(status)

    def check_new_targets(self, displacement_format, bus_lines=()):
        self.bring_up(displacement_format, bus_lines)
        first = self.start_move("a0", FAR, "b1", -FAR)
        self.wait_until_travelled(700, "a0", "b1")
        # In reach; behind; and one that stands joins them.
        second = self.start_move("a0", "--to", 5000, "b1", "--to", 300, "b2", "--to", 400)
        self.assertEqual(first.process.wait(), 1)
        self.assertRegex(first.said(), r"a0: was given a new target by command \d+ of bushctl")
        self.assertEqual(second.process.wait(), 0, second.said())
        reached = self.positions()
        self.assertEqual([reached[name] for name in ("a0", "b1", "b2")], [5000, 300, 400])
        # Farther, by steps from the present target; then too near.
        self.start_move("a0", -3000)
        self.wait_until("a0 to be under way", lambda: self.positions()["a0"] < 4700)
        third = self.start_move("a0", -500)
        self.wait_until("a0 to have a new target", lambda: self.motors()["a0"]["target_steps"] == 1500)
        self.wait_until("a0 to have passed 3000", lambda: self.positions()["a0"] < 3000)
        self.command("move", "--wait", "a0", "--to", "2990")
        self.assertEqual(third.process.wait(), 1)
        status = self.status()
        self.assertEqual(self.positions()["a0"], 2990)

        self.assertEqual(self.bushd.end(), 0)
        self.assertEqual(self.bushsim.end(), 0)
        self.assert_one_result_each()
        self.assert_trace_is_right(status)
        targets = [event["target_steps"] for event in self.moves() if event["event"] == "retarget"]
        self.assertEqual(sorted(targets), [300, 1500, 2990, 5000])
        results = [event["result"] for event in self.moves() if event["event"] == "result"]
        self.assertEqual(results.count("turned"), 2)

    def test_motors_follow_a_file_of_times_and_positions(self):
        self.bring_up()
        scan = self.file("scan.csv")
        rows = [(0, 0, 0), (1, 80, -20.25), (1.5, 80, -20.25), (2.5, 0, 30)]
        scan.write_text("# a scan\ntime_s, a0, b1\n" + "".join(f"{t}, {a}, {b}\n" for t, a, b in rows), encoding="utf-8")
        fast = self.bushctl("follow", scan, "--stretch", "0.5")
        self.assertEqual(fast.returncode, 1)
        self.assertRegex(fast.stderr, r"fault: row 1 \(0 s\): a0 is to change at once to 160 steps/s; allowed: 100 steps/s; with times stretched")
        self.assertIn(f"that row is line 3 of {scan}", fast.stderr)
        plan = json.loads(self.command("follow", scan, "--dry-run", "--json").stdout)
        self.assertEqual(plan["duration_us"], 2_500_000)
        self.command("follow", scan, "--wait")
        self.assertEqual(self.positions()["b1"], 30)
        self.command("move", "--wait", "b1", "--to", "0")
        self.command("follow", scan, "--wait", "--interpolation", "cubic", "--stretch", "1.25")
        status = self.status()
        self.assertEqual(self.bushd.end(), 0)
        self.assertEqual(self.bushsim.end(), 0)
        self.assert_one_result_each()
        self.assert_trace_is_right(status)
        # The log has what the file says, computed otherwise: in 2^-32 step, and ns.
        trajectories = [event for event in self.moves() if event["event"] == "trajectory"]
        self.assertEqual([event["interpolation"] for event in trajectories], ["linear", "cubic"])
        for event, stretch in zip(trajectories, (1, Fraction(5, 4))):
            told = [[int(Fraction(str(t)) * 10**9 * stretch), *(int(Fraction(str(p)) * 2**32) for p in at)] for t, *at in rows]
            self.assertEqual(event["rows"], told)

    def test_new_targets_for_moving_motors_fine(self):
        self.check_new_targets("fine")

    def test_new_targets_for_moving_motors_coarse(self):
        self.check_new_targets("coarse")

    def test_new_targets_for_moving_motors_table_runs_fine(self):
        self.check_new_targets("fine", TABLE_RUNS)

    def test_new_targets_for_moving_motors_table_runs_coarse(self):
        self.check_new_targets("coarse", TABLE_RUNS)

    def test_group_moves_and_a_stop_in_flight_fine(self):
        self.check_moves("fine")

    def test_group_moves_and_a_stop_in_flight_coarse(self):
        self.check_moves("coarse")

    def test_group_moves_and_a_stop_in_flight_table_runs_fine(self):
        self.check_moves("fine", TABLE_RUNS)

    def test_group_moves_and_a_stop_in_flight_table_runs_coarse(self):
        self.check_moves("coarse", TABLE_RUNS)

    def test_group_move_starts_in_one_tick(self):
        self.bring_up()
        self.command("move", "--wait", *[word for name in MOTORS for word in (name, "3")])
        self.assertEqual(len({event["start_tick"] for event in self.moves() if event["event"] == "move"}), 1)


class Expansion(EndToEndTest):
    def steps_per_tick(self, edges, expected):
        """Edges counted by tick; the first edge tells where ticks begin."""
        first = next(i for i, count in enumerate(expected) if count != 0)
        # Steps of a coarse tick are spaced evenly: the first of c lies 1 / 2c into it.
        begin_ns = edges[0].time_ns - TICK_US * 1000 * (first + 1 / (2 * abs(expected[first])))
        counts = [0] * len(expected)
        for edge in edges:
            tick = int((edge.time_ns - begin_ns) // (TICK_US * 1000))
            self.assertIn(tick, range(len(counts)), "an edge lies outside of the move")
            counts[tick] += 1 if edge.direction else -1
        return counts

    def test_bushtab_expand_is_what_the_pins_do(self):
        self.bring_up("coarse")
        moves = {"a0": ("bushd2-constant", 1234), "b2": ("bushd2-exponential", -777)}
        for name, (_, steps) in moves.items():
            self.command("move", "--wait", name, steps)
        self.assertEqual(self.bushd.end(), 0)
        self.assertEqual(self.bushsim.end(), 0)
        edges = self.traced()
        for name, (table, steps) in moves.items():
            arguments = ["--table", TOP / "tables" / f"{table}.toml", "--steps", str(steps)]
            arguments += ["--tick-us", str(TICK_US), "--format", "coarse"]
            ran = self.run_program(program("BUSHTAB"), "expand", *arguments)
            self.assertEqual(ran.returncode, 0, ran.stderr)
            octets = [int(row["displacement"]) for row in csv.DictReader(io.StringIO(ran.stdout))]
            expected = [octet & 0x7F if octet & 0x80 else -(octet & 0x7F) for octet in octets]
            self.assertEqual(sum(expected), steps)
            self.assertEqual(self.steps_per_tick(edges[name], expected), expected, name)


if __name__ == "__main__":
    unittest.main()
