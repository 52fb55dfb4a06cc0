"""A motor in a browser: what is asked of it there, and edges of the simulator's trace."""

import re

from browser import BrowserTest, main
from rig import FAR


class WebMotor(BrowserTest):
    def test_goes_where_it_is_told_and_history_names_who(self):
        self.bring_up_web(kept=True)
        tab = self.open_tab("motor/bushd/a0", self.make_token("anna"))
        position = tab.get_by_test_id("position")
        self.wait_for_text(position, "0")
        tab.get_by_test_id("goto-input").fill("300")
        tab.get_by_test_id("goto").click()
        self.wait_for_text(position, "300")
        self.wait_for_part(tab.get_by_test_id("notice").last, "move a0 reached")
        tab.get_by_test_id("by-input").fill("20")
        tab.get_by_test_id("by-input").press("Enter")
        self.wait_for_text(position, "320")
        self.wait_for_text(tab.get_by_test_id("fact-state"), "at rest")
        tab.get_by_test_id("by-minus").click()
        self.wait_for_text(position, "300")
        self.wait_for_text(tab.get_by_test_id("fact-state"), "at rest")

        tab.get_by_test_id("goto-input").fill("a lot")
        tab.get_by_test_id("goto").click()
        self.wait_for_part(tab.get_by_test_id("input-error"), '"a lot" is no number')

        history = tab.get_by_test_id("history")
        self.wait_for_part(history.locator("tbody tr").nth(0).locator("td").nth(2), "320 steps")  # read again after each motion
        rows = [[cell.inner_text() for cell in row.locator("td").all()] for row in history.locator("tbody tr").all()]
        moves = [(what, start, end, outcome) for _, what, start, end, outcome, who in rows if "web:anna@" in who]
        self.assertEqual([(start, end) for _, start, end, _ in moves],
                         [("320 steps", "300 steps"), ("300 steps", "320 steps"), ("0 steps", "300 steps")])
        self.assertEqual({outcome.partition(":")[0] for *_, outcome in moves}, {"reached"})
        self.end_programs()
        directions = [edge.direction for edge in self.traced()["a0"]]
        self.assertEqual(directions, [True] * 320 + [False] * 20)
        self.assertEqual([event["steps"] for event in self.moves() if event["event"] == "move"], [300, 20, -20])

    def test_stop_of_this_motor_leaves_others_alone(self):
        self.bring_up_web()
        tab = self.open_tab("motor/bushd/a0", self.make_token())
        tab.get_by_test_id("goto-input").fill(str(FAR))
        tab.get_by_test_id("goto").click()
        self.start_move("b0", str(FAR))
        self.wait_until_travelled(300, "a0", "b0")
        place = tab.get_by_test_id("ramp-mark")  # where it is in its table
        place.wait_for(state="visible")
        tab.get_by_test_id("stop-motor").click()
        self.wait_for_text(tab.get_by_test_id("fact-state"), "at rest")
        place.wait_for(state="hidden")
        self.wait_for_part(tab.get_by_test_id("notice").last, re.compile("move a0 stopped|stop a0 done"))
        motors = self.motors()
        self.assertEqual((motors["a0"]["moving"], motors["b0"]["moving"]), (False, True))
        stands = motors["a0"]["position_steps"]
        self.wait_for_text(tab.get_by_test_id("position"), str(stands))

        # Pause and resume, of this one too.
        tab.get_by_test_id("goto").click()
        self.wait_until("a0 to go on", lambda: self.motors()["a0"]["position_steps"] > stands + 300)
        tab.get_by_test_id("pause").click()
        self.wait_for_part(tab.get_by_test_id("fact-state"), "paused")
        self.assertTrue(self.motors()["b0"]["moving"])
        tab.get_by_test_id("resume").click()
        self.wait_for_text(tab.get_by_test_id("fact-state"), "moving")
        self.command("stop", "a0")
        self.wait_for_text(tab.get_by_test_id("fact-state"), "at rest")
        stands = self.positions()["a0"]
        b0_went_on_from = self.motors()["b0"]["position_steps"]
        self.assertEqual([(event["request"], event["motors"]) for event in self.requests()],
                         [("move", ["a0"]), ("stop", ["a0"]), ("move", ["a0"]), ("pause", ["a0"]), ("resume", ["a0"])])
        self.end_programs()
        traced = self.traced_positions()
        self.assertEqual(traced["a0"], stands)
        self.assertGreater(traced["b0"], b0_went_on_from)

    def test_position_is_set_and_confirmed_without_a_step(self):
        self.bring_up_web(kept=True)
        # Somebody has moved the motor's cable to another output, say: the daemon is told that nobody knows.
        self.start_move("a1", str(FAR))
        self.wait_until_travelled(300, "a1")
        self.bushsim.end()
        self.bushsim = self.start_bushsim("trace-2.vcd")
        self.wait_until_ready()
        tab = self.open_tab("motor/bushd/a1", self.make_token())
        self.wait_for_text(tab.get_by_test_id("trust"), "uncertain")
        self.wait_for_part(tab.get_by_test_id("reason"), "restarted while it moved")
        self.wait_for_text(tab.get_by_test_id("position"), str(self.positions()["a1"]))
        tab.get_by_test_id("by-input").fill("5")
        tab.get_by_test_id("by").click()
        self.wait_for_part(tab.get_by_test_id("notice").last, "its position is uncertain")
        tab.get_by_test_id("more-commands").locator("summary").click()
        stood = self.positions()["a1"]
        tab.get_by_test_id("confirm").click()
        self.wait_for_text(tab.get_by_test_id("trust"), "known")
        self.assertEqual(self.positions()["a1"], stood)
        tab.get_by_test_id("set-input").fill("1234")
        tab.get_by_test_id("set").click()
        self.wait_for_text(tab.get_by_test_id("position"), "1234")
        self.assertEqual((self.motors()["a1"]["position_steps"], self.motors()["a1"]["trust"]), (1234, "known"))
        tab.get_by_test_id("by").click()
        self.wait_for_text(tab.get_by_test_id("position"), "1239")
        self.end_programs()
        self.assertEqual(self.traced_positions("trace-2.vcd")["a1"], 5)

    def test_settings_say_what_differs_from_the_file(self):
        self.bring_up_web(kept=True)
        tab = self.open_tab("motor/bushd/a0", self.make_token())
        limits = tab.get_by_test_id("setting-soft_limits")
        limits.get_by_role("textbox").fill("-100,250")
        limits.get_by_role("button", name="Change soft_limits").click()
        self.wait_for_part(limits, "differs")
        self.wait_for_part(tab.locator(".ruler"), "250")
        tab.get_by_test_id("goto-input").fill("251")
        tab.get_by_test_id("goto").click()
        self.wait_for_part(tab.get_by_test_id("notice").last, "limit")
        reader = self.open_tab("motor/bushd/a0")
        self.wait_for_part(reader.get_by_test_id("setting-soft_limits"), "differs")
        self.assertTrue(reader.get_by_test_id("setting-soft_limits").get_by_role("textbox").is_disabled())
        tab.get_by_test_id("goto-input").fill("250")
        tab.get_by_test_id("goto").click()
        self.wait_for_text(tab.get_by_test_id("position"), "250")
        self.end_programs()
        self.assertEqual(self.traced_positions()["a0"], 250)


if __name__ == "__main__":
    main()
