"""Jogs by a browser: whatever takes the hand or the page away ends them."""

import os
import re
import signal

from browser import BrowserTest, main
from cable import Cable

SPEED = 500  # steps/s: reached and left within some steps by each of the tables
KEEPALIVE_MS = 400  # of the page
# From when the daemon takes a stop until the motor ramps down: of 2 MCUs of 16 motors, at this rate and tick (docs/performance.md,
# "Time of a stop").
STOP_MS = 45
END_MS = 500


class WebJog(BrowserTest):
    def hold(self, tab, motor, button="jog-plus"):
        """The pointer holds the button, and the motor moves."""
        tab.get_by_test_id("jog-speed").fill(str(SPEED))
        tab.get_by_test_id(button).hover()
        tab.mouse.down()
        self.wait_until(f"{motor} to move", lambda: abs(self.positions()[motor]) > SPEED)  # for longer than its keepalive time

    def wait_for_rest(self, motor):
        self.wait_until(f"{motor} to rest", lambda: self.motors()[motor]["activity"] == "rest")

    def last_of_history(self, motor):
        page = self.open_page()
        return page.result(page.ask("get history", motor=motor))["detail"]["history"]["motions"][0]

    def test_ends_when_the_button_is_let_go_and_when_the_page_is_left(self):
        self.bring_up_web(kept=True)
        token = self.make_token()
        window = self.open_window(token)

        def let_go(tab):
            tab.mouse.up()
            self.wait_for_part(tab.get_by_test_id("jog-said"), "Hold a button")

        def look_elsewhere(tab):
            # As with people: playwright has all pages think that they have the focus.
            other = window.new_page()
            for page in (tab, other):
                window.new_cdp_session(page).send("Emulation.setFocusEmulationEnabled", {"enabled": False})
            other.bring_to_front()
            self.wait_for_part(tab.get_by_test_id("jog-said"), re.compile("ended: the (window lost the focus|page is hidden)"))

        def close(tab):
            tab.close()

        def kill(tab):
            for pid in self.browser_processes("renderer"):
                os.kill(pid, signal.SIGKILL)

        def go_to_another_view(tab):
            self.go_to_view(tab, "health")
            tab.get_by_test_id("health").wait_for()

        # "done": the page has said that it ends; "stopped": the daemon has seen that its client is gone.
        for motor, button, leave, outcomes in (("a0", "jog-plus", let_go, {"done"}), ("a1", "jog-minus", look_elsewhere, {"done"}),
                                               ("a2", "jog-plus", go_to_another_view, {"done"}),
                                               ("a3", "jog-plus", close, {"done", "stopped"}), ("b0", "jog-minus", kill, {"stopped"})):
            with self.subTest(leave.__name__):
                tab = self.open_tab(f"motor/bushd/{motor}", window=window)
                self.hold(tab, motor, button)
                leave(tab)
                self.wait_for_rest(motor)
                ended = self.last_of_history(motor)
                self.assertIn(ended["outcome"], outcomes, ended)
                self.assertNotIn(f"{KEEPALIVE_MS} ms", ended["reason"])  # nobody had to wait for that
                self.assertIn("web:anna@", ended["who"])
        stand = self.positions()
        self.end_programs()
        self.assertEqual(self.traced_positions(), stand)
        self.assertLess(stand["a1"], -SPEED)
        self.assertLess(stand["b0"], -SPEED)

    def test_ends_when_the_browser_takes_the_finger_for_something_else(self):
        """As where the page is scrolled or zoomed, or a palm lies on the tablet."""
        self.bring_up_web(kept=True)
        tab = self.open_tab("motor/bushd/a0", self.make_token(), has_touch=True)
        tab.get_by_test_id("jog-speed").fill(str(SPEED))
        button = tab.get_by_test_id("jog-plus")
        button.scroll_into_view_if_needed()
        box = button.bounding_box()
        debugger = tab.context.new_cdp_session(tab)
        at = {"x": box["x"] + box["width"] / 2, "y": box["y"] + box["height"] / 2}
        debugger.send("Input.dispatchTouchEvent", {"type": "touchStart", "touchPoints": [at]})
        self.wait_until("a0 to move", lambda: self.positions()["a0"] > SPEED)
        button.evaluate("node => node.addEventListener('pointerup', () => { window.wasLetGo = true; }, { capture: true })")
        debugger.send("Input.dispatchTouchEvent", {"type": "touchCancel", "touchPoints": []})
        self.wait_for_rest("a0")
        self.wait_for_part(tab.get_by_test_id("jog-said"), "Hold a button")
        self.assertFalse(tab.evaluate("() => 'wasLetGo' in window"))
        ended = self.last_of_history("a0")
        self.assertEqual(ended["outcome"], "done", ended)  # the page has said so
        stands = self.positions()["a0"]
        self.end_programs()
        self.assertEqual(self.traced_positions()["a0"], stands)

    def test_ends_when_the_browser_is_frozen_and_does_not_go_on_when_it_wakes(self):
        self.bring_up_web(kept=True)
        tab = self.open_tab("motor/bushd/a0", self.make_token())
        self.hold(tab, "a0")
        self.freeze_browser()
        stands = self.assert_ends_by_silence("a0")

        self.wake_browser()
        self.wait_for_part(tab.get_by_test_id("jog-said"), "ended: ")
        # It still holds the button, and may say what it likes: what it has said was taken before this is.
        self.ask_for_something()
        tab.mouse.up()
        # A new hold begins a new jog.
        tab.get_by_test_id("jog-plus").hover()
        tab.mouse.down()
        self.wait_until("a0 to move again", lambda: self.positions()["a0"] > stands)
        tab.mouse.up()
        self.wait_for_rest("a0")
        self.assertEqual(self.begun("a0"), [0, stands])
        self.assert_ended_in_time("a0", stands)

    def test_ends_when_the_network_is_cut_and_what_that_held_back_begins_nothing(self):
        self.bring_up_web(kept=True)
        cable = Cable(self.port)
        self.addCleanup(cable.close)
        server, self.port = self.port, cable.port
        tab = self.open_tab("motor/bushd/a0", self.make_token())
        self.port = server
        self.hold(tab, "a0")
        cable.cut()
        self.ask_for_something()  # so what was passed on has been taken
        stands = self.assert_ends_by_silence("a0")
        self.wait_for_part(tab.get_by_test_id("jog-said"), "ended: ")
        tab.mouse.up()
        # It has not been silent for so long yet that the page would not send this.
        tab.mouse.down()
        self.wait_for_part(tab.get_by_test_id("jog-said"), "while held")
        # What is older than 2 s when it comes is refused.
        self.wait_for_text(tab.get_by_test_id("connection"), re.compile("^silent for ([2-9]|[1-9][0-9])"))
        tab.mouse.up()

        cable.mend()
        self.wait_for_text(tab.get_by_test_id("connection"), "connected")
        # This is the last that the page has said.
        tab.get_by_test_id("stop-motor").click()
        self.wait_for_part(tab.get_by_test_id("notice").last, "stop a0 done")
        self.assertEqual((self.begun("a0"), self.positions()["a0"]), ([0], stands))
        self.assert_ended_in_time("a0", stands)

    def ask_for_something(self):
        """Answered: bushd-web has taken what came before it."""
        page = self.open_page()
        self.assertEqual(page.result(page.ask("get history", motor="a0"))["phase"], "result")

    def begun(self, motor):
        """From where it moved."""
        return [event["from_steps"] for event in self.moves() if event["event"] == "move" and event["motor"] == motor]

    def assert_ends_by_silence(self, motor):
        """No renewal is sent any more. What the trace says of the time: the first step of b0 is asked for after that."""
        self.command("move", "--wait", "b0", "1")
        self.wait_for_rest(motor)
        ended = self.last_of_history(motor)
        self.assertEqual(ended["outcome"], "stopped")
        self.assertIn(f"{KEEPALIVE_MS} ms", ended["reason"])
        return self.positions()[motor]

    def assert_ended_in_time(self, motor, stood):
        """The first jog, which ended at `stood`, by edges. Ends all programs."""
        self.end_programs()
        edges = self.traced()
        mark_ns = edges["b0"][0].time_ns
        jog = [edge.time_ns for edge in edges[motor][:stood]]
        cruise_ns = 1e9 / SPEED
        # An edge may lie a time unit of the format off.
        ramp_ns = max(early for early, late in zip(jog, jog[1:]) if late - early < 1.05 * cruise_ns)
        self.assertGreater(ramp_ns, mark_ns)  # it was the silence that has ended it
        self.assertLessEqual((ramp_ns - mark_ns) / 1e6, KEEPALIVE_MS + STOP_MS)
        self.assertLessEqual((jog[-1] - mark_ns) / 1e6, END_MS)

    def test_arrow_keys_move_while_they_are_held(self):
        self.bring_up_web()
        tab = self.open_tab("motor/bushd/a0", self.make_token())
        tab.get_by_test_id("jog-speed").fill(str(SPEED))
        tab.get_by_test_id("goto-input").focus()
        tab.keyboard.press("ArrowRight")  # in a field it moves the cursor
        tab.get_by_test_id("jog-speed").blur()
        tab.locator("h1").click()
        tab.keyboard.down("ArrowLeft")
        self.wait_until("a0 to move", lambda: self.positions()["a0"] < -SPEED)
        tab.keyboard.up("ArrowLeft")
        self.wait_for_rest("a0")
        stands = self.positions()["a0"]
        # The one that begins it and the one that ends it; renewals are not in the log.
        self.assertEqual([event["request"] for event in self.requests()], ["jog", "jog"])

        # Esc stops it, and the key that is still held does not begin anew.
        tab.keyboard.down("ArrowRight")
        self.wait_until("a0 to move", lambda: self.positions()["a0"] > stands)
        tab.keyboard.press("Escape")
        self.wait_for_rest("a0")
        tab.keyboard.down("ArrowRight")  # as it repeats
        self.wait_for_part(tab.get_by_test_id("stop-said"), "done")
        tab.keyboard.up("ArrowRight")
        self.assertFalse(self.motors()["a0"]["moving"])
        stands = self.positions()["a0"]
        self.end_programs()
        self.assertEqual(self.traced_positions()["a0"], stands)
        self.assertEqual({edge.direction for edge in self.traced()["a0"]}, {False, True})


if __name__ == "__main__":
    main()
