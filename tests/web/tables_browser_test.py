"""Tables in a browser, and edges of the simulator's trace by what was made there."""

import bisect
import itertools
import tomllib

from browser import TOP, BrowserTest, main
from rig import TICK_US, program

# The checker's limit of the speed from one step to the next is 2; the first delays of this table are 250, 172, 114, 92.
SHIPPED = "bushd2-constant"
TOO_FAST = (1, 114)  # index, code: as short as its neighbour allows
EDITED = (1, 150)
SLOTS = 256  # of a tick, of the simulated MCU


def edges_us(delays_us):
    """Edges of a long move from rest by these delays, from the beginning of its first tick on.

    The MCU follows a stream of fine displacements (docs/protocol.md, TICKS). They connect places at the ends of ticks: where the table
    has the motor then, evenly from one step to the next, rounded down to 1/256 step. In between the MCU goes evenly, and it makes a step
    at the beginning of the slot in which it gets there. Where a delay is longer than a tick, that is 0.1 ms off the table's own time.
    """
    ends_us = list(itertools.accumulate(delays_us))

    def place(time_us):
        made = bisect.bisect_right(ends_us, time_us)
        begun_us = ends_us[made - 1] if made > 0 else 0
        return 256 * made + 256 * (time_us - begun_us) // delays_us[made]

    edges = []
    for begin_us in range(0, ends_us[-1] - TICK_US, TICK_US):
        here, there = place(begin_us), place(begin_us + TICK_US)
        for step in range(here // 256 + 1, there // 256 + 1):
            slot = min((256 * step - here) * SLOTS // (there - here), SLOTS - 1)
            edges.append(begin_us + slot * TICK_US // SLOTS)
    return edges


class WebTables(BrowserTest):
    def copy_shipped(self):
        self.file("tables").mkdir()
        ran = self.run_program(program("BUSHTAB"), "--dir", self.file("tables"), "copy", SHIPPED, "own")
        self.assertEqual(ran.returncode, 0, ran.stdout + ran.stderr)

    def edit(self, tab, name):
        tab.get_by_test_id(f"table-{name}").get_by_role("button", name=f"Edit {name}").click()
        self.wait_for_text(tab.get_by_test_id("diagnostics"), "good")

    def select(self, tab, index):
        """Returns the field of its code."""
        place = tab.get_by_test_id("code-index")
        place.fill(str(index))
        place.press("Enter")
        return tab.get_by_test_id("code")

    def set_code(self, tab, index, to):
        code = self.select(tab, index)
        code.fill(str(to))
        code.press("Enter")

    def use(self, tab, group):
        tab.get_by_role("combobox", name="Group").select_option(group)
        tab.get_by_test_id("use-table").click()

    def table_of(self, motor):
        table = self.motors()[motor]["table"]
        return table["name"], table["revision"]

    def test_a_table_is_edited_checked_saved_and_used_from_the_next_move_on(self):
        self.copy_shipped()
        self.bring_up_web()
        tab = self.open_tab("tables", self.make_token("anna"))
        row = tab.get_by_test_id("table-own")
        self.wait_for_part(tab.get_by_test_id(f"table-{SHIPPED}"), "group0")
        self.assertFalse(tab.get_by_test_id("tables-plot").is_visible())
        for name in ("own", "bushd2-scurve"):
            tab.get_by_test_id(f"plot-{name}").check()
            self.wait_for_part(tab.get_by_test_id("tables-plot"), name)
        self.edit(tab, "own")
        self.check_edits(tab)

        tab.get_by_test_id("save-table").click()
        self.wait_for_part(tab.get_by_test_id("notice").last, "set table own done")
        self.wait_for_part(row.locator("td").nth(1), "2")
        self.assertEqual(self.table_of("a0"), (SHIPPED, 0))
        self.use(tab, "group0")
        self.wait_for_part(tab.get_by_test_id("table-said"), "group group0 has own@2")
        self.wait_for_part(row, "group0")
        self.assertEqual(self.table_of("a0"), ("own", 2))
        self.command("move", "--wait", "a0", "300", "a1", "300")

        # Who only looks changes no table.
        reader = self.open_tab("tables")
        self.edit(reader, "own")
        for command in ("save-table", "use-table"):
            self.assertTrue(reader.get_by_test_id(command).is_disabled(), command)
        self.end_programs()
        edges = self.traced()
        self.assertEqual((len(edges["a0"]), len(edges["a1"])), (300, 300))
        codes = tomllib.loads((TOP / "tables" / f"{SHIPPED}.toml").read_text())["accel"]
        codes[EDITED[0]] = EDITED[1]
        expected_us = edges_us([40 * code for code in codes[:30]])
        begin_ns = edges["a0"][0].time_ns - 1000 * expected_us[0]
        self.assertEqual([edge.time_ns - begin_ns for edge in edges["a0"][:len(expected_us)]], [1000 * us for us in expected_us])

    def check_edits(self, tab):
        """By typing; EDITED stays."""
        diagnostics = tab.get_by_test_id("diagnostics")
        code = self.select(tab, TOO_FAST[0])
        self.assertEqual(code.input_value(), "172")
        code.fill("1")  # beyond its neighbour
        code.press("Enter")
        self.assertEqual(code.input_value(), str(TOO_FAST[1]))
        self.wait_for_part(tab.get_by_test_id("table-said"), "its neighbours allow 114 to 250")
        self.wait_for_part(diagnostics, "speed_ratio")
        self.wait_for_part(tab.get_by_test_id("diff"), "1 changes")
        self.select(tab, 100)
        diagnostics.get_by_role("button", name=f"accel[{TOO_FAST[0]}]").click()  # leads to its place
        self.assertEqual((tab.get_by_test_id("code-index").input_value(), code.input_value()), tuple(map(str, TOO_FAST)))
        tab.get_by_test_id("undo").click()
        self.wait_for_text(diagnostics, "good")
        self.assertEqual(code.input_value(), "172")
        tab.get_by_test_id("redo").click()
        self.wait_for_part(diagnostics, "speed_ratio")
        tab.get_by_test_id("undo").click()
        self.set_code(tab, *EDITED)
        self.wait_for_text(diagnostics, "good")

    def test_the_editor_compares_with_what_is_in_service_now(self):
        self.copy_shipped()
        self.bring_up_web()
        tab = self.open_tab("tables", self.make_token("anna"))
        diff = tab.get_by_test_id("diff")
        self.edit(tab, "own")
        self.wait_for_text(diff, "As revision 1")  # that nobody has
        self.use(tab, "group0")
        self.wait_for_text(diff, "As revision 1, in service")
        self.set_code(tab, *EDITED)
        self.wait_for_text(diff, "1 changes against revision 1, in service")
        tab.get_by_test_id("save-table").click()
        self.wait_for_part(tab.get_by_test_id("table-editor"), "own, revision 2")
        self.wait_for_text(diff, "1 changes against revision 1, in service")
        self.use(tab, "group0")
        self.wait_for_text(diff, "As revision 2, in service")
        # Each group has its own, and other people may change it.
        self.command("table", "use", "group1", "own@1")
        tab.get_by_role("combobox", name="Group").select_option("group1")
        self.wait_for_text(diff, "1 changes against revision 1, in service")
        self.command("table", "use", "group1", "own@2")
        self.wait_for_text(diff, "As revision 2, in service")
        for group in ("group0", "group1"):
            self.command("table", "use", group, SHIPPED)
        self.wait_for_text(diff, "As revision 2")

        # One that is saved under another name is another table.
        tab.get_by_test_id("save-name").fill("mine")
        tab.get_by_test_id("save-table").click()
        mine = tab.get_by_test_id("table-mine")
        self.wait_for_part(tab.get_by_test_id("table-said"), "Saved;")
        self.edit(tab, "mine")
        self.wait_for_part(tab.get_by_test_id("table-editor"), "mine, revision 1")
        self.use(tab, "group0")
        self.wait_for_part(mine, "group0")
        self.wait_for_text(diff, "As revision 1, in service")
        self.assertEqual(self.table_of("b0"), ("mine", 1))
        self.assertNotIn("group0", tab.get_by_test_id("table-own").inner_text())

    def test_a_point_is_dragged_and_its_neighbours_give_way(self):
        self.bring_up_web()
        tab = self.open_tab("tables")
        self.edit(tab, SHIPPED)
        codes = tomllib.loads((TOP / "tables" / f"{SHIPPED}.toml").read_text())["accel"]
        dragged = len(codes) // 2
        plot = tab.get_by_test_id("edit-plot").locator(".u-over")
        plot.scroll_into_view_if_needed()
        box = plot.bounding_box()
        x = box["x"] + dragged / (len(codes) - 1) * box["width"]
        tab.mouse.move(x, box["y"] + box["height"] / 2)
        tab.mouse.down()
        self.assertEqual(tab.get_by_test_id("code-index").input_value(), str(dragged))
        self.assertEqual(tab.get_by_test_id("code").input_value(), str(codes[dragged]))

        def drag_to(share):
            """`share` of the plot's height, from its top. Returns the code that is shown."""
            tab.mouse.move(x, box["y"] + share * box["height"], steps=3)
            return int(tab.get_by_test_id("code").input_value())

        slow = drag_to(0.9)
        self.assertGreater(slow, codes[dragged])
        fast = drag_to(0.1)
        self.assertLess(fast, codes[dragged])
        slow_again = drag_to(0.9)
        self.assertEqual(slow_again, slow)
        tab.mouse.up()
        # Before it those that were faster are as slow as it, and what the pointer passed meanwhile is forgotten.
        changed = [max(code, slow) if i < dragged else min(code, slow) for i, code in enumerate(codes)]
        changed[dragged] = slow
        count = sum(one != other for one, other in zip(codes, changed))
        self.assertGreater(count, 1)
        self.wait_for_part(tab.get_by_test_id("diff"), f"{count} changes")
        for index in (0, dragged - 1, dragged, dragged + 1, len(codes) - 1):
            self.assertEqual(self.select(tab, index).input_value(), str(changed[index]), index)
        # However often it moved, it is one change.
        tab.get_by_test_id("undo").click()
        self.wait_for_part(tab.get_by_test_id("diff"), "As revision")
        self.assertTrue(tab.get_by_test_id("undo").is_disabled())


if __name__ == "__main__":
    main()
