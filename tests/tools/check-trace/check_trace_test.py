"""tools/check-trace on traces that are right, and on the same traces with one thing wrong."""

import itertools
import json
import random
import unittest

import synthetic
from synthetic import SLOTS, TICK_NS
from trace_case import SLOT_NS, TABLE, CheckTraceTest, OneThingWrong, event


def any_table(chance):
    accel = sorted((chance.randint(1, 300) for _ in range(chance.randint(1, 40))), reverse=True)
    decel = sorted(chance.randint(1, 300) for _ in range(chance.randint(1, 40)))
    table = {"time_unit_ns": chance.randint(21_000, 60_000), "accel": accel, "decel": decel}
    table["cruise"] = chance.randint(1, accel[-1])
    return table


class RightTraces(CheckTraceTest):
    def positions(self, scene, **beside):
        """A file of what the daemon says of its motors, some of them so many steps beside where they are."""
        motors = [{"name": name, "position_steps": steps + beside.get(name, 0)} for name, steps in scene.steps.items()]
        status = self.directory / "status.json"
        status.write_text(json.dumps({"motors": motors}), encoding="utf-8")
        return status

    def burst(self):
        """T_step 385 us: 39 slots. DIR setup 15 us: two slots of a shortened tick."""
        scene = synthetic.Scene(TABLE, self.table_file)
        scene.emission = {"emission": "burst", "step_us": 385, "dir_setup_us": 15}
        scene.burst_slots = 39, 2
        scene.move("theta", 1, 0, 100, 300)
        scene.move("omega", 2, 3, 131, -500, stop_tick=181, move_id=3)
        scene.move("theta", 1, 0, 320, -200, move_id=4)
        return scene

    def test_burst_is_checked_to_its_slots(self):
        self.assert_right(self.burst())

    def test_edge_of_a_burst_in_another_slot_is_found(self):
        scene = self.burst()
        scene.edges[1, 0][100][0] += 2 * SLOT_NS
        self.assert_problem(scene, "theta", "step 101 of 300")

    def by_itself(self):
        """Homing first, a move that meets its limit, local motion in both directions, a move."""
        scene = synthetic.Scene(TABLE, self.table_file)
        scene.autonomous("theta", 1, 0, 20, [-1] * 30 + [1] * 9, sets_to=-5)
        scene.move("theta", 1, 0, 200, 400)
        scene.meets_limit("theta", 100)
        scene.autonomous("theta", 1, 0, 600, [1] * 7 + [-1] * 12)
        scene.move("theta", 1, 0, 700, 300, move_id=2)
        scene.move("omega", 2, 3, 230, -500, move_id=3)
        scene.autonomous("chi", 2, 4, 100, [1, 1, 1])
        return scene

    def test_homing_local_motion_and_limits_are_explained(self):
        scene = self.by_itself()
        result = self.assert_right(scene, "--positions", self.positions(scene))
        self.assertIn("72 steps of homing, of local inputs and of ramps at limit switches", result.stdout)

    def test_a_step_outside_of_local_motion(self):
        scene = self.by_itself()
        scene.edges[1, 0].append([900 * TICK_NS, 1])
        self.assert_problem(scene, "theta", "an edge that no move explains")

    def test_local_motion_that_is_counted_otherwise(self):
        scene = self.by_itself()
        scene.events[-1]["position_steps"] = 4
        self.assert_problem(scene, "chi", "local is said to have moved it by 4 steps, its edges by 3")

    def test_a_limit_that_is_counted_otherwise(self):
        scene = self.by_itself()
        event(scene, result="limit")["position_steps"] += 1
        self.assert_problem(scene, "theta", "steps until its limit, its edges are")

    def test_a_motor_that_goes_on_after_its_limit(self):
        scene = synthetic.Scene(TABLE, self.table_file)
        scene.move("theta", 1, 0, 200, 400)
        scene.meets_limit("theta", 100)
        own = scene.edges[1, 0]
        own += [[own[-1][0] + 2 * (i + 1) * TICK_NS, 1] for i in range(60)]
        scene.events[-1]["position_steps"] += 60
        self.assert_problem(scene, "theta", "goes on for 71 steps after its limit")

    def test_the_wrong_direction_after_a_limit(self):
        scene = self.by_itself()
        scene.edges[1, 0][39 + 105][1] = -1
        self.assert_problem(scene, "theta", "the ramp of move 1 has DIR 0")

    def test_other_emission_is_refused(self):
        scene = self.burst()
        scene.events[0]["emission"] = "thundering"
        self.assertIn("move 1 is emitted thundering, which is not known here", self.assert_unusable(self.check(scene)))

    def test_every_edge_of_both_formats_is_explained(self):
        for fine, moves in itertools.product((True, False), (None, "stream", "table")):
            with self.subTest(fine=fine, moves=moves):
                scene = self.scene(fine, moves)
                made = sum(map(len, scene.edges.values()))
                result = self.assert_right(scene)
                last = result.stdout.splitlines()[-1]
                steps = f"{made} steps commanded, {made} steps made"
                self.assertRegex(last, rf"^4 motors, 2 MCUs, {steps}, max edge error [0-9.]+ us$")
                self.assertIn("slot 0.0 us", result.stdout)

    def test_any_table_and_any_stop_keeps_the_derived_bound(self):
        self.any_tables_and_stops(random.randrange(2**32))

    def test_a_first_step_in_the_first_slot_of_a_later_tick(self):
        self.any_tables_and_stops(2601170235)

    def test_a_late_start_at_speed(self):
        self.any_tables_and_stops(1582628897)

    def any_tables_and_stops(self, seed):
        chance = random.Random(seed)
        for round_number in range(12):
            table = any_table(chance)
            self.write_table(table)
            moves = chance.choice(("stream", "table"))
            scene = synthetic.Scene(table, self.table_file, chance.random() < 0.5, moves)
            tick = 10
            for number in range(3):
                stop = tick + chance.randint(-2, 60) if chance.random() < 0.5 else None
                steps = chance.choice((-1, 1)) * chance.randint(1, 200)
                late_ns = chance.randrange(synthetic.TICK_NS) if chance.random() < 0.3 else 0
                scene.move("m", 1, 5, tick, steps, stop_tick=stop, move_id=number, late_ns=late_ns)
                tick += 200 * 300 * 60_000 // TICK_NS
            if scene.edges[1, 5]:
                with self.subTest(seed=seed, round=round_number):
                    self.assert_right(scene)

    def test_a_stop_waits_for_no_step_that_is_far_away(self):
        table = {"time_unit_ns": 40_000, "accel": [60000, 20000, 13000, 12500, 12000, 3000, 1000, 200]}
        self.write_table(table)
        # The first step takes 2.4 s, the second one 0.8, then come 0.52, 0.5 and 0.48 s.
        ticks_of_s = 1_000_000_000 / TICK_NS
        for fine, moves in itertools.product((True, False), ("stream", "table")):
            for after_s, steps in ((0.5, 0), (1.8, 0), (1.95, 1), (2.6, 1), (2.75, 2), (3.21, 2), (3.8, 4), (4.9, 16)):
                with self.subTest(fine=fine, moves=moves, after_s=after_s):
                    scene = synthetic.Scene(table, self.table_file, fine, moves)
                    scene.move("other", 1, 4, 100, 20, move_id=2)
                    stop = 100 + int(after_s * ticks_of_s)
                    self.assertEqual(scene.move("m", 1, 5, 100, -500, stop_tick=stop), steps)
                    self.assert_right(scene)

    def test_a_stop_before_the_start_makes_no_step(self):
        scene = self.scene()
        self.assertEqual(scene.move("chi", 2, 0, 400, 50, stop_tick=400, move_id=7), 0)
        self.assert_right(scene)

    def test_a_stop_after_the_end_changes_nothing(self):
        scene = self.scene()
        self.assertEqual(scene.move("chi", 2, 0, 400, 20, stop_tick=900, move_id=7), 20)
        self.assert_right(scene)

    def test_changes_of_a_move_follow_each_other(self):
        scene = self.scene()
        self.assertEqual(scene.move("chi", 2, 0, 400, 200, move_id=7), 200)
        self.assertEqual(scene.change("chi", "retarget", 430, 350), 350)
        scene.change("chi", "stop", 440)
        self.assertEqual(scene.change("chi", "retarget", 442, 300), 300)
        self.assert_right(scene)

    def test_a_target_that_is_too_near_is_reached_from_the_other_side(self):
        scene = self.scene()
        scene.move("chi", 2, 0, 400, 300, move_id=7)
        overshot = scene.change("chi", "retarget", 440, 60)
        self.assertGreater(overshot, 60)
        self.assert_problem(scene, "chi", "move 7 turned, and no move to its target follows")
        scene.move("chi", 2, 0, 600, 60 - overshot, move_id=8)
        self.assert_right(scene)

    def test_a_target_before_the_start_is_another_move(self):
        scene = self.scene()
        scene.move("chi", 2, 0, 400, 300, move_id=7)
        self.assertEqual(scene.change("chi", "retarget", 400, 20), 20)
        self.assert_right(scene)

    def test_any_table_and_any_targets(self):
        seed = random.randrange(2**32)
        chance = random.Random(seed)
        for round_number in range(12):
            table = any_table(chance)
            self.write_table(table)
            moves = chance.choice(("stream", "table"))
            scene = synthetic.Scene(table, self.table_file, chance.random() < 0.5, moves)
            scene.move("m", 1, 5, 10, chance.choice((-1, 1)) * chance.randint(1, 200))
            tick = 10
            for _ in range(chance.randint(1, 4)):
                tick += chance.randint(0, 60)
                scene.change("m", "retarget", tick, chance.randint(1, 300))
            if scene.events[-1]["result"] == "turned":
                scene.events[-1]["result"] = "stopped"
            with self.subTest(seed=seed, round=round_number):
                self.assert_right(scene)

    def test_clocks_of_crystals_are_followed(self):
        scene = self.scene()
        scene.rates = {1: 40, 2: 40}
        report = json.loads(self.assert_right(scene, "--json").stdout)
        self.assertLess(report["max_off_slot_us"], 0.01)

    def test_mcus_may_have_different_slots(self):
        scene = self.scene()

        def line(*slots):
            result = self.check(scene, *(word for s in slots for word in ("--slots", s)))
            return next(line for line in result.stdout.splitlines() if "exact slot" in line)

        self.assertEqual(line("128", "1=256", "2=256"), line())
        self.assertNotEqual(line("1=128"), line())
        self.assertEqual(self.check(scene, "--slots", "1=many").returncode, 2)

    def test_positions_of_the_daemon_are_compared(self):
        scene = self.scene()
        self.assert_right(scene, "--positions", self.positions(scene))
        result = self.check(scene, "--positions", self.positions(scene, phi=1))
        self.assertEqual(result.returncode, 1)
        self.assertRegex(result.stdout, r"problem: phi .* at -34 steps, its edges lead to -35")

    def test_json_says_what_the_text_says(self):
        report = json.loads(self.assert_right(self.scene(), "--json").stdout)
        self.assertTrue(report["good"])
        self.assertEqual(report["problems"], [])
        self.assertEqual([row["motor"] for row in report["per_motor"]], ["theta", "phi", "chi", "omega"])


class WrongTraces(OneThingWrong):
    def test_a_missing_edge(self):
        for index in (0, 150, 299, -1):  # first and last of a move, and within one
            with self.subTest(index=index):
                scene = self.scene()
                del scene.edges[1, 0][index]
                number = index + 1 if index >= 0 else 200
                lines = self.assert_problem(scene, "theta", f"step {number} of", "is missing")
                self.assertEqual(len(lines), 1, lines)

    def test_a_missing_edge_of_the_only_motor(self):
        for index in (0, 60, 119):
            with self.subTest(index=index):
                scene = synthetic.Scene(TABLE, self.table_file)
                scene.move("lonely", 1, 0, 100, 120)
                del scene.edges[1, 0][index]
                self.assert_problem(scene, "lonely", f"step {index + 1} of 120", "is missing")

    def test_a_surplus_edge_within_a_move(self):
        self.usual.edges[2, 3].insert(41, [self.usual.edges[2, 3][40][0] + 3 * SLOT_NS, 1])
        self.assertEqual(len(self.assert_problem(self.usual, "omega", "no move explains")), 1)

    def test_a_surplus_edge_outside_of_all_moves(self):
        self.usual.edges[2, 0].append([700 * TICK_NS, 1])
        self.assert_problem(self.usual, "chi", "no move explains")

    def test_an_edge_of_an_output_without_a_motor(self):
        self.usual.edges[2, 9] = [[200 * TICK_NS, 1]]
        self.assert_problem(self.usual, "output 9 of mcu2", "no move explains")

    def test_an_edge_two_ticks_late(self):
        self.usual.edges[1, 15][-1][0] += 2 * TICK_NS
        self.assert_problem(self.usual, "phi", "step 35 of 35", "(+2.00 ticks) from its slot")

    def test_an_edge_two_ticks_late_among_others(self):
        edges = self.usual.edges[1, 0]
        edges[100][0] += 2 * TICK_NS + 2 * SLOT_NS
        edges.sort()
        self.assert_problem(self.usual, "theta", "step 101 of 300", "is missing")
        self.assert_problem(self.usual, "theta", "no move explains")

    def test_an_edge_two_slots_late(self):
        self.usual.edges[2, 3][20][0] += 2 * SLOT_NS
        self.assert_problem(self.usual, "omega", "step 21 of", "+20.0 us")

    def test_table_runs_and_streams_are_told_apart(self):
        for moves, said in (("table", "stream"), ("stream", "table")):
            with self.subTest(moves=moves):
                scene = self.scene(moves=moves)
                for move in scene.events:
                    if move["event"] == "move":
                        move["moves"] = said
                self.assert_problem(scene, "theta", "from its slot")

    def test_an_edge_one_slot_off_but_in_the_tick_before_or_after(self):
        # Delays that are no divisor of the tick, so that some step falls into any slot.
        table = {"time_unit_ns": 1000, "accel": [1000, 601]}
        self.write_table(table)
        for border, shift_slots in ((0, -1), (SLOTS - 1, 1)):
            with self.subTest(border=border):
                scene = synthetic.Scene(table, self.table_file)
                scene.move("theta", 1, 0, 100, 1500)
                edges = scene.edges[1, 0]
                at = next(i for i, (ns, _) in enumerate(edges) if ns % TICK_NS // SLOT_NS == border)
                edges[at][0] += shift_slots * SLOT_NS
                self.assert_problem(scene, "theta", f"step {at + 1} of 1500", "in tick")

    def test_the_wrong_direction(self):
        for edge in self.usual.edges[1, 15]:
            edge[1] = 1
        self.assert_problem(self.usual, "phi", "step 1 of 35", "DIR 1")

    def test_a_direction_that_changes_together_with_the_pulse(self):
        changes = self.usual.changes()
        first = next(time for time, _, address, wire, _ in changes if (address, wire) == (2, "step0"))
        self.usual.raw = sorted((first, *c[1:]) if c[2:4] == (2, "dir0") else c for c in changes)
        self.assert_problem(self.usual, "chi", "DIR changed only 0 ns before")

    def test_en_low_at_an_edge(self):
        at = self.usual.edges[2, 3][30][0]
        self.usual.en_low_ns[2] = [(at - 1000, at + 1000)]
        self.assertEqual(len(self.assert_problem(self.usual, "omega", "EN is low", "step 31")), 1)

    def test_time_that_goes_back(self):
        changes = self.usual.changes()
        at = next(i for i, c in enumerate(changes) if c[2:] == (2, "step3", 1))
        changes[at], changes[at + 60] = changes[at + 60], changes[at]
        self.usual.raw = changes
        self.assert_problem(self.usual, "omega", "after a later change")

    def test_two_motors_swapped(self):
        self.usual.edges[1, 0], self.usual.edges[1, 15] = self.usual.edges[1, 15], self.usual.edges[1, 0]
        self.assert_problem(self.usual, "theta")
        self.assert_problem(self.usual, "phi")

    def test_mcus_30_us_apart(self):
        self.usual.offsets_ns[2] += 30_000
        lines = self.assert_problem(self.usual, "hall:2", "chi, omega", "+30.0 us")
        self.assertEqual(len(lines), 1, lines)

    def test_mcus_19_us_apart_are_allowed(self):
        self.usual.offsets_ns[2] += 19_000
        self.assert_right(self.usual)

    def test_a_clock_worse_than_a_crystal(self):
        self.usual.rates = {1: 3000}
        self.assertEqual(self.check(self.usual).returncode, 1)

    def test_no_edges_at_all(self):
        for edges in self.usual.edges.values():
            edges.clear()
        for motor in ("theta", "phi", "chi", "omega"):
            self.assert_problem(self.usual, motor, "is missing")


if __name__ == "__main__":
    unittest.main()
