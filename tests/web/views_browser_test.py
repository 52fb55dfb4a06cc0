"""Tables, paths and health in a browser, and edges of the simulator's trace by what was made there."""

import json
import re

from browser import BrowserTest, main
from rig import MOTORS, TICK_US, program

# The checker's limit of the speed from one step to the next is 2; the first delays of this table are 250, 172, 114, 92.
SHIPPED = "bushd2-constant"
TOO_FAST = (1, 114)  # index, code: as short as its neighbour allows


class WebTables(BrowserTest):
    def test_a_table_is_edited_checked_saved_and_used_from_the_next_move_on(self):
        self.file("tables").mkdir()
        ran = self.run_program(program("BUSHTAB"), "--dir", self.file("tables"), "copy", SHIPPED, "own")
        self.assertEqual(ran.returncode, 0, ran.stdout + ran.stderr)
        self.bring_up_page()
        tab = self.open_tab("tables", self.make_token("anna"))
        row = tab.get_by_test_id("table-own")
        self.wait_for_part(tab.get_by_test_id(f"table-{SHIPPED}"), "group0")
        self.assertFalse(tab.get_by_test_id("tables-plot").is_visible())
        for name in ("own", "bushd2-scurve"):
            tab.get_by_test_id(f"plot-{name}").check()
            self.wait_for_part(tab.get_by_test_id("tables-plot"), name)

        row.get_by_role("button", name="Edit own").click()
        diagnostics, diff = tab.get_by_test_id("diagnostics"), tab.get_by_test_id("diff")
        self.wait_for_text(diagnostics, "good")
        index, code = tab.get_by_test_id("code-index"), tab.get_by_test_id("code")
        index.fill(str(TOO_FAST[0]))
        index.press("Enter")
        self.assertEqual(code.input_value(), "172")
        code.fill("1")  # beyond its neighbour
        code.press("Enter")
        self.assertEqual(code.input_value(), str(TOO_FAST[1]))
        self.wait_for_part(tab.get_by_test_id("table-said"), "its neighbours allow 114 to 250")
        self.wait_for_part(diagnostics, "speed_ratio")
        self.wait_for_part(diff, "1 changes")
        index.fill("100")
        index.press("Enter")
        diagnostics.get_by_role("button", name=f"accel[{TOO_FAST[0]}]").click()  # leads to its place
        self.assertEqual((index.input_value(), code.input_value()), tuple(map(str, TOO_FAST)))
        tab.get_by_test_id("undo").click()
        self.wait_for_text(diagnostics, "good")
        self.assertEqual(code.input_value(), "172")
        tab.get_by_test_id("redo").click()
        self.wait_for_part(diagnostics, "speed_ratio")
        tab.get_by_test_id("undo").click()
        code.fill("150")
        code.press("Enter")
        self.wait_for_text(diagnostics, "good")

        tab.get_by_test_id("save-table").click()
        self.wait_for_part(tab.get_by_test_id("notice").last, "set table own done")
        self.wait_for_part(row.locator("td").nth(1), "2")
        self.assertEqual(self.motors()["a0"]["table"]["name"], SHIPPED)
        tab.get_by_role("combobox", name="Group").select_option("group0")
        tab.get_by_test_id("use-table").click()
        self.wait_for_part(tab.get_by_test_id("table-said"), "group group0 has own@2")
        self.wait_for_part(row, "group0")
        self.wait_until("a0 to have it", lambda: self.motors()["a0"]["table"]["name"] == "own")
        self.command("move", "--wait", "a0", "300", "a1", "300")
        self.end_programs()
        edges = self.traced()
        self.assertEqual((len(edges["a0"]), len(edges["a1"])), (300, 300))
        # After the first step 150 units of 40 us, where the shipped table has 172; each edge is at one of 16 places of its tick.
        times_us = [edge.time_ns / 1000 for edge in edges["a0"][:3]]
        for (early, late), delay in zip(zip(times_us, times_us[1:]), (150, 114)):
            self.assertAlmostEqual(late - early, 40 * delay, delta=TICK_US / 16)

    def test_who_only_looks_changes_no_table(self):
        self.bring_up_page()
        tab = self.open_tab("tables")
        tab.get_by_test_id(f"table-{SHIPPED}").get_by_role("button", name=f"Edit {SHIPPED}").click()
        self.wait_for_text(tab.get_by_test_id("diagnostics"), "good")
        for command in ("save-table", "use-table"):
            self.assertTrue(tab.get_by_test_id(command).is_disabled(), command)


class WebPaths(BrowserTest):
    def choose(self, tab, text, name="path.csv"):
        self.file(name).write_text(text)
        tab.get_by_test_id("path-file").set_input_files(self.file(name))

    def test_a_path_is_planned_run_and_stopped(self):
        self.bring_up_page(kept=True)
        tab = self.open_tab("paths", self.make_token("anna"))
        tab.get_by_test_id("path-file").wait_for()
        said, error = tab.get_by_test_id("path-said"), tab.get_by_test_id("path-error")
        for text, wrong in (("a0, a1\n200, 100\n250, x\n", 'path.csv, line 3: "x", as a1'),
                            ("a0, a1\n200, 100\n250, 120.5\n", "path.csv, line 3, a1: 120.5"),
                            ("a0, a0\n200, 100\n", 'path.csv, line 1: the column "a0" is there twice'), ("nobody\n1\n", "nobody")):
            self.choose(tab, text)
            self.wait_for_part(error, wrong)
            self.assertTrue(tab.get_by_test_id("path-run").is_disabled(), text)

        self.choose(tab, "a0, a1\n200, 100\n250, 120\n300, 50\n")
        self.wait_for_part(said, "3 points of a0, a1: ")
        self.wait_for_text(error, "")
        planned_s = float(re.search(r": ([\d.]+) s", said.inner_text())[1])
        self.assertEqual(tab.get_by_test_id("plane").get_attribute("aria-label"), "Path of 3 points in the plane of a0 (steps) and a1 (steps)")
        self.wait_for_part(tab.get_by_test_id("plane-legend"), "steps/s")
        self.assertEqual(self.positions()["a0"], 0)
        tab.get_by_test_id("path-run").click()
        self.wait_for_part(tab.get_by_test_id("notice").last, "path path.csv reached")
        self.assertEqual((self.positions()["a0"], self.positions()["a1"]), (300, 50))

        self.choose(tab, "a0, a1\n100000, 100\n200000, 50000\n")
        self.wait_for_part(said, "2 points of a0, a1: ")
        tab.get_by_test_id("path-run").click()
        self.wait_until("a0 to go", lambda: self.positions()["a0"] > 1000)
        tab.get_by_test_id("path-stop").click()
        self.wait_for_part(tab.get_by_test_id("notice").last, re.compile("path path.csv stopped|stop a0, a1 done"))
        self.wait_until("a0 and a1 to rest", lambda: not any(self.motors()[name]["moving"] for name in ("a0", "a1")))
        stand = self.positions()
        self.end_programs()
        edges = self.traced()
        traced = self.traced_positions()
        self.assertEqual((traced["a0"], traced["a1"]), (stand["a0"], stand["a1"]))
        # The first path: as long as was foretold, to the last figure that is shown, and a tick at each end.
        first = [edge.time_ns for edge in edges["a0"][:300]]
        self.assertLessEqual((first[-1] - first[0]) / 1e9, planned_s + 0.005 + 0.00512)
        self.assertGreater((first[-1] - first[0]) / 1e9, planned_s / 2)
        # a1 goes up to 120 and comes back to 50.
        self.assertEqual([edge.direction for edge in edges["a1"][:190]], [True] * 120 + [False] * 70)


class WebHealth(BrowserTest):
    def survey(self):
        for name in MOTORS:
            if name != "b3":
                self.command("set", name, "0")

    def test_what_the_doctor_finds_stands_there_with_its_remedy(self):
        self.bring_up_page()
        tab = self.open_tab("health")
        self.wait_for_text(tab.get_by_test_id("doctor-said"), re.compile(r"^\d+ errors?, \d+ warnings?$"))
        shown = tab.get_by_test_id("findings").locator("li")
        # b3 is one of whom nobody has said where it stands.
        found = {one["check"]: one for one in json.loads(self.bushctl("doctor", "--json").stdout)["findings"]}
        self.assertEqual({row.locator(".check").inner_text() for row in shown.all()}, set(found))
        position = shown.filter(has=tab.locator(".check", has_text="position"))
        self.wait_for_part(position, found["position"]["seen"])
        self.assertIn("b3", found["position"]["seen"])
        self.assertEqual(position.locator(".remedy").inner_text(), found["position"]["remedy"].replace("`", ""))
        # The worst come first.
        levels = [row.locator("strong").inner_text() for row in shown.all()]
        self.assertEqual(levels, sorted(levels, key=["error", "warning", "ok"].index))

        self.command("set", "b3", "0")
        tab.get_by_test_id("doctor").click()
        self.wait_for_part(position, "8 motors, all known")
        self.wait_for_part(tab.get_by_test_id("log"), "b3: position known")

    def test_history_of_all_motors_is_exported(self):
        self.bring_up_page(kept=True)
        self.command("move", "--wait", "a0", "30", "b1", "-7")
        tab = self.open_tab("health")
        self.wait_for_text(tab.get_by_test_id("doctor-said"), re.compile(r"^\d+ errors?, "))
        with tab.expect_download() as download:
            tab.get_by_test_id("all-history-csv").click()
        lines = [line.split(",") for line in open(download.value.path(), encoding="utf-8").read().splitlines()]
        self.assertEqual(lines[0][:6], ["time_utc", "motor", "what", "from_steps", "to_steps", "from"])
        moves = {(motor, start, end) for _, motor, what, start, end, *_ in lines[1:] if what == "move"}
        self.assertEqual(moves, {("a0", "0", "30"), ("b1", "0", "-7")})

    def test_buses_and_mcus_are_told_with_their_errors(self):
        self.bring_up_page()
        tab = self.open_tab("buses")
        buses = tab.get_by_test_id("buses")
        self.wait_for_part(buses, "bus hall")
        for name in ("hall:1", "hall:2"):
            row = buses.get_by_role("row").filter(has_text=name)
            self.wait_for_part(row, "READY")
            self.wait_for_part(row, "now")
        self.wait_for_part(buses, re.compile(r"Latency of \d+ answers"))
        self.bushsim.end()
        self.wait_for_part(buses.get_by_role("row").filter(has_text="hall:1"), "OFFLINE")
        self.go_to_view(tab, "")
        self.wait_for_part(tab.get_by_test_id("trouble"), "MCU hall:1: offline")


if __name__ == "__main__":
    main()
