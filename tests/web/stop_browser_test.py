"""STOP in a browser: on each view, at once, and without a token on this PC."""

from browser import BrowserTest, main
from rig import FAR

VIEWS = ("", "motor/bushd/a0", "buses", "tables", "paths", "health", "access")


class StopTest(BrowserTest):
    def check_stops_while_a_request_is_under_way(self, views):
        """By Esc and by the button, in turn."""
        self.bring_up_web()
        tab = self.open_tab("motor/bushd/a0", self.make_token())
        stood = 0
        for turn, view in enumerate(views):
            with self.subTest(view):
                self.go_to_view(tab, "motor/bushd/a0")
                tab.get_by_test_id("goto-input").fill(str(FAR))
                tab.get_by_test_id("goto").click()
                self.start_move("b0", str(FAR))
                self.wait_until("a0 to move", lambda: self.positions()["a0"] > stood + 20)
                self.go_to_view(tab, view)
                if turn % 2 == 0:
                    tab.keyboard.press("Escape")
                else:
                    tab.get_by_test_id("stop-all").click()
                self.wait_for_part(tab.get_by_test_id("stop-said"), "Stop: done")
                self.wait_for_part(tab.get_by_test_id("notice").filter(has_text="move a0").last, "stopped")
                motors = self.motors()
                self.assertFalse(motors["a0"]["moving"] or motors["b0"]["moving"])
                self.assertEqual(self.mcu_states(), ["READY", "READY"])
                stood = motors["a0"]["position_steps"]
        asked = [(event["request"], event.get("motors")) for event in self.requests()]
        self.assertEqual(asked, [("move", ["a0"]), ("stop", None)] * len(views))
        stand = self.positions()
        self.end_programs()
        traced = self.traced_positions()
        self.assertEqual((traced["a0"], traced["b0"]), (stand["a0"], stand["b0"]))


class WebStop(StopTest):
    def test_stops_while_a_request_is_under_way(self):
        self.check_stops_while_a_request_is_under_way(("motor/bushd/a0", "tables"))

    def test_stop_and_emergency_stop_need_no_token_on_this_pc(self):
        self.bring_up_web()
        tab = self.open_tab()
        stop, emergency = tab.get_by_test_id("stop-all"), tab.get_by_test_id("estop")
        self.row(tab, "a0").wait_for()
        self.assertEqual(self.row(tab, "a0").get_by_test_id("stop-motor").inner_text(), "Stop")
        looks = [place.evaluate("node => [getComputedStyle(node).backgroundColor, getComputedStyle(node).color].join()")
                 for place in (stop, emergency, self.row(tab, "a0").get_by_test_id("stop-motor"))]
        self.assertEqual(len(set(looks)), 3)

        self.start_move("a0", str(FAR), "b0", str(-FAR))
        self.wait_until_travelled(300, "a0", "b0")
        self.row(tab, "a0").get_by_test_id("stop-motor").click()
        self.wait_until("a0 to rest", lambda: not self.motors()["a0"]["moving"])
        self.assertTrue(self.motors()["b0"]["moving"])
        tab.keyboard.press("Escape")
        self.wait_for_part(tab.get_by_test_id("stop-said"), "Stop: done")
        self.assertFalse(self.motors()["b0"]["moving"])
        stand = self.positions()

        self.start_move("a0", str(FAR), "b0", str(-FAR))
        self.wait_until("both to move", lambda: self.positions()["a0"] > stand["a0"] + 300 and self.positions()["b0"] < stand["b0"] - 300)
        emergency.click()
        self.wait_for_part(tab.get_by_test_id("stop-said"), "Emergency stop: ")
        self.wait_until("both MCUs to have stopped", lambda: self.mcu_states() == ["FAULT", "FAULT"])
        self.wait_for_part(tab.get_by_test_id("trouble"), "MCU hall:1: fault")
        self.wait_for_part(tab.get_by_test_id("trouble"), "MCU hall:2: fault")
        # Whoever may only stop does not clear it.
        self.assertEqual(tab.get_by_test_id("clear-faults").count(), 0)
        commander = self.open_tab(token=self.make_token())
        for mcu in ("hall:1", "hall:2"):
            commander.get_by_role("button", name=f"Clear faults of MCU {mcu}").click()
            self.wait_for_part(commander.get_by_test_id("notice").last, "clear faults")
        self.wait_until_ready()
        self.wait_for_text(tab.get_by_test_id("trouble"), "")
        self.assertEqual([event["request"] for event in self.requests(client="*")], ["stop", "stop", "emergency stop"])
        self.end_programs()
        # No step after the emergency stop's: the same number as the daemon counts.
        traced = self.traced_positions()
        self.assertGreater(traced["a0"], stand["a0"] + 300)

    def test_says_big_that_a_stop_cannot_be_sent(self):
        self.bring_up_web()
        tab = self.open_tab()
        self.row(tab, "a0").wait_for()
        self.expect_cut()
        self.web.end()
        self.wait_for_text(tab.get_by_test_id("stop-all"), "STOP CANNOT BE SENT")
        self.wait_for_part(tab.get_by_test_id("stop-said"), "bushctl stop")
        self.wait_for_text(tab.get_by_test_id("connection"), "not connected")
        self.wait_for_class(self.row(tab, "a0"), "old")

        # Without the right to stop it says so, and Esc is refused.
        self.start_web("--stop-without-token", "nobody", log="nobody.log")
        tab = self.open_tab()
        self.wait_for_part(tab.get_by_test_id("stop-said"), "may not stop")
        self.start_move("a0", "200")
        tab.keyboard.press("Escape")
        self.wait_for_part(tab.get_by_test_id("stop-said"), "refused")
        self.wait_until("a0 to arrive", lambda: self.positions()["a0"] == 200)
        self.assertEqual(self.requests(), [])


class WebStopOnEachView(StopTest):
    def test_stops_while_a_request_is_under_way(self):
        self.check_stops_while_a_request_is_under_way(VIEWS)


if __name__ == "__main__":
    main()
