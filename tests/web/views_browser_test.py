"""Paths and health in a browser, and edges of the simulator's trace by what was made there."""

import json
import re

from browser import BrowserTest, main


class WebPaths(BrowserTest):
    def choose(self, tab, text, name="path.csv"):
        self.file(name).write_text(text)
        tab.get_by_test_id("path-file").set_input_files(self.file(name))

    def drop(self, tab, text, name="path.csv"):
        """As a person drags a file from elsewhere onto the page."""
        self.file(name).write_text(text)
        box = tab.get_by_test_id("path-drop").bounding_box()
        at = {"x": box["x"] + box["width"] / 2, "y": box["y"] + box["height"] / 2}
        data = {"items": [], "files": [str(self.file(name))], "dragOperationsMask": 1}  # to copy
        debugger = tab.context.new_cdp_session(tab)
        for kind in ("dragEnter", "dragOver", "drop"):
            debugger.send("Input.dispatchDragEvent", {"type": kind, "data": data, **at})
            self.wait_for_class(tab.get_by_test_id("path-drop"), "over", there=kind == "dragOver")

    def test_a_path_is_planned_run_and_stopped(self):
        self.bring_up_web(kept=True)
        tab = self.open_tab("paths", self.make_token("anna"))
        tab.get_by_test_id("path-file").wait_for()
        said, error = tab.get_by_test_id("path-said"), tab.get_by_test_id("path-error")
        for text, wrong in (("a0, a1\n200, 100\n250, x\n", 'path.csv, line 3: "x", as a1'),
                            ("a0, a1\n200, 100\n250, 120.5\n", "path.csv, line 3, a1: 120.5"),
                            ("a0, a0\n200, 100\n", 'path.csv, line 1: the column "a0" is there twice'), ("nobody\n1\n", "nobody")):
            self.choose(tab, text)
            self.wait_for_part(error, wrong)
            self.assertTrue(tab.get_by_test_id("path-run").is_disabled(), text)

        self.drop(tab, "a0, a1\n200, 100\n250, 120\n300, 50\n")
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
        tab.get_by_test_id("path-pause").click()

        def stands_paused():
            motors = self.motors()
            return all(motors[name]["paused"] and motors[name]["velocity_steps_per_s"] == 0 for name in ("a0", "a1"))

        self.wait_until("a0 and a1 to stand paused", stands_paused)
        paused = self.positions()["a0"]
        tab.get_by_test_id("path-resume").click()
        self.wait_until("a0 to go on", lambda: self.positions()["a0"] > paused + 1000)
        self.assertFalse(tab.get_by_test_id("path-resume").is_visible())
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
        # The second one: it went on from where it was paused, in its direction.
        self.assertEqual({edge.direction for edge in edges["a0"]}, {True})
        # a1 goes up to 120 and comes back to 50.
        self.assertEqual([edge.direction for edge in edges["a1"][:190]], [True] * 120 + [False] * 70)


class WebHealth(BrowserTest):
    def survey(self):
        super().survey("a*", "b[0-2]")  # nobody has said where b3 stands

    def test_what_the_doctor_finds_stands_there_with_its_remedy(self):
        self.bring_up_web()
        tab = self.open_tab("health")
        self.wait_for_text(tab.get_by_test_id("doctor-said"), re.compile(r"^\d+ errors?, \d+ warnings?$"))
        shown = tab.get_by_test_id("findings").locator("li")
        found = {one["check"]: one for one in json.loads(self.bushctl("doctor", "--json").stdout)["findings"]}
        self.assertEqual({row.locator(".check").inner_text() for row in shown.all()}, set(found))
        position = shown.filter(has=tab.locator(".check", has_text="position"))
        self.wait_for_part(position, found["position"]["seen"])
        self.assertIn("b3", found["position"]["seen"])
        self.assertEqual(position.locator(".remedy").inner_text(), found["position"]["remedy"].replace("`", ""))
        # A page that is loaded here has not heard of daemons yet when it would ask.
        tab.reload()
        self.wait_for_text(tab.get_by_test_id("doctor-said"), re.compile(r"^\d+ errors?, \d+ warnings?$"))
        self.wait_for_part(position, found["position"]["seen"])
        # The worst come first.
        levels = [row.locator("strong").inner_text() for row in shown.all()]
        self.assertEqual(levels, sorted(levels, key=["error", "warning", "ok"].index))

        self.command("set", "b3", "0")
        tab.get_by_test_id("doctor").click()
        self.wait_for_part(position, "8 motors, all known")
        self.wait_for_part(tab.get_by_test_id("log"), "b3: position known")

    def test_history_of_all_motors_is_exported(self):
        self.bring_up_web(kept=True)
        self.command("move", "--wait", "a0", "30", "b1", "-7")
        tab = self.open_tab("health")
        self.wait_for_text(tab.get_by_test_id("doctor-said"), re.compile(r"^\d+ errors?, "))
        with tab.expect_download() as download:
            tab.get_by_test_id("all-history-csv").click()
        lines = [line.split(",") for line in download.value.path().read_text(encoding="utf-8").splitlines()]
        self.assertEqual(lines[0][:6], ["time_utc", "motor", "what", "from_steps", "to_steps", "from"])
        moves = {(motor, start, end) for _, motor, what, start, end, *_ in lines[1:] if what == "move"}
        self.assertEqual(moves, {("a0", "0", "30"), ("b1", "0", "-7")})

    def test_buses_and_mcus_are_told_with_their_errors(self):
        self.bring_up_web()
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
