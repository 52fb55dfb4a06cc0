"""The overview in a browser: what it shows of motors, and that nothing looks alive that is not heard."""

import contextlib
import re
import signal

from browser import BrowserTest, main
from rig import FAR, MOTORS

# As the page sees it, by its own clock: when it was told of the MCU of a0, and by how much that took longer than it has ever taken.
NOTE_STATES = """
(() => {
  const Real = WebSocket;
  let leastMs = Infinity;
  window.WebSocket = class extends Real {
    constructor(...given) {
      super(...given);
      this.addEventListener("message", (event) => {
        const told = JSON.parse(event.data);
        if (told.kind !== "state") return;
        const tookMs = performance.now() - told.utime_us / 1000;
        leastMs = Math.min(leastMs, tookMs);
        if (told.mcus.some((mcu) => mcu.mcu === "hall:1")) window.told = { at: performance.now(), lateMs: tookMs - leastMs };
      });
    }
  };
})();
"""
SINCE_TOLD = "() => performance.now() - window.told.at"
OLD_MS = 1000  # the page greys what was not reported for so long ...
LOOKS_EVERY_MS = 250  # ... and looks so often
LATE_MS = 200  # what a state may have waited on its way: it counts as so much older


class WebOverview(BrowserTest):
    def survey(self):
        """All but one: nobody has said where b3 stands."""
        super().survey("a*", "b[0-2]")

    def test_shows_where_motors_stand_and_go_and_what_that_is_worth(self):
        self.bring_up_web()
        tab = self.open_tab()
        a0, b0, b3 = (self.row(tab, name) for name in ("a0", "b0", "b3"))
        self.wait_for_text(a0.get_by_test_id("position"), "0")
        self.wait_for_text(a0.get_by_test_id("unit"), "steps")
        self.wait_for_text(a0.get_by_test_id("trust"), "known")
        self.wait_for_text(b3.get_by_test_id("trust"), "uncertain")
        self.assertEqual(b3.get_by_test_id("reason").inner_text(), self.motors()["b3"]["uncertain_reason"])
        self.assertNotEqual(self.motors()["b3"]["uncertain_reason"], "")
        colours = [row.get_by_test_id("trust").evaluate("node => getComputedStyle(node).color") for row in (a0, b3)]
        self.assertNotEqual(*colours)

        self.command("move", "--wait", "a0", "300", "b0", "-70")
        self.wait_for_text(a0.get_by_test_id("position"), "300")
        self.wait_for_text(b0.get_by_test_id("position"), "-70")
        self.start_move("a0", str(FAR))
        self.wait_for_text(a0.get_by_test_id("target"), f"→ {FAR + 300}")
        self.wait_for_text(a0.get_by_test_id("activity"), "moving")
        self.wait_for_class(a0, "moving")
        self.wait_for_class(b0, "moving", there=False)
        self.command("pause", "a0")
        self.wait_for_part(a0.get_by_test_id("activity"), "paused")
        self.wait_for_text(a0.get_by_test_id("target"), f"→ {FAR + 300}")
        self.command("hold", "a1")
        self.wait_for_part(self.row(tab, "a1").get_by_test_id("activity"), "held")
        self.command("stop")
        self.wait_for_text(a0.get_by_test_id("activity"), "at rest")
        self.wait_for_text(a0.get_by_test_id("target"), "")
        stands = self.positions()["a0"]
        self.wait_for_text(a0.get_by_test_id("position"), str(stands))
        self.assertGreater(stands, 300)
        self.end_programs()
        traced = self.traced_positions()
        self.assertEqual((traced["a0"], traced["b0"]), (stands, -70))

    def test_what_is_not_heard_for_a_second_is_grey_with_its_age(self):
        self.bring_up_web()
        tab = self.open_tab()
        self.wait_for_text(self.row(tab, "a0").get_by_test_id("position"), "0")
        watched = self.open_window().new_page()
        watched.add_init_script(NOTE_STATES)
        watched.clock.install()
        watched.goto(self.address())
        row = self.row(watched, "a0")
        self.wait_for_text(row.get_by_test_id("position"), "0")

        for frozen in (self.bushd, self.web):
            frozen.send(signal.SIGSTOP)
            self.wait_for_class(self.row(tab, "a0"), "old")
            self.assertRegex(self.row(tab, "a0").get_by_test_id("age").inner_text(), r"^1\.\d s old$|^[2-9]\.\d s old$")
            self.wait_for_part(tab.get_by_test_id("trouble"), re.compile(r"MCU hall:[12]: not heard for \d+ s"))
            if frozen is self.web:
                self.wait_for_text(tab.get_by_test_id("connection"), re.compile(r"^silent for \d\.\d s$"))
            frozen.send(signal.SIGCONT)
            self.wait_for_class(self.row(tab, "a0"), "old", there=False)
            self.wait_for_text(self.row(tab, "a0").get_by_test_id("age"), "")
            self.wait_for_text(tab.get_by_test_id("connection"), "connected")
        # Alive again: it shows what comes.
        self.command("move", "--wait", "a0", "40")
        self.wait_for_text(self.row(tab, "a0").get_by_test_id("position"), "40")

        # By the page's own clock, which stands here but for what it is told: to the millisecond.
        watched.reload()
        self.wait_for_text(row.get_by_test_id("position"), "40")
        self.wait_until("the clock to stand soon after a state", lambda: self.stop_clock(watched))
        since = watched.evaluate(SINCE_TOLD)
        watched.clock.run_for(int(OLD_MS - since) - LATE_MS)
        self.wait_for_class(row, "old", there=False)
        watched.clock.run_for(LOOKS_EVERY_MS + LATE_MS + 1)
        self.wait_for_class(row, "old")
        self.wait_for_text(row.get_by_test_id("age"), re.compile(r"^1\.[0-6] s old$"))
        # A browser's clock that is set back makes nothing young.
        watched.clock.set_system_time(0)
        watched.clock.run_for(3000)
        self.wait_for_text(row.get_by_test_id("age"), re.compile(r"^4\.[0-6] s old$"))
        self.bushd.send(signal.SIGCONT)

    def stop_clock(self, tab):
        """And the daemon. False, and both go on: a loaded machine took too long for it."""
        from playwright.sync_api import Error

        self.bushd.send(signal.SIGSTOP)
        with contextlib.suppress(Error):  # the time at which it is to stand is over
            tab.clock.pause_at(tab.evaluate("() => Date.now() + 100") / 1000)
            if tab.evaluate(SINCE_TOLD) < OLD_MS - LOOKS_EVERY_MS and tab.evaluate("() => window.told.lateMs") < LATE_MS:
                return True
        self.bushd.send(signal.SIGCONT)
        tab.clock.resume()
        self.wait_for_class(self.row(tab, "a0"), "old", there=False)
        return False

    def test_filter_order_and_favourites_are_kept_in_the_browser(self):
        self.bring_up_web()
        tab = self.open_tab()
        self.row(tab, "b3").wait_for()
        self.wait_for_text(tab.get_by_test_id("motor-count"), "8 motors")

        def shown():
            return [row.get_attribute("data-motor") for row in tab.locator("[data-motor]").all()]

        for word, names in (("b", ["b0", "b1", "b2", "b3"]), ("a[1-2]", ["a1", "a2"]), ("@group3", ["a3", "b3"]), ("hall:1 0", ["a0"]),
                            ("nothing of this name", [])):
            tab.get_by_test_id("filter").fill(word)
            self.wait_for_text(tab.get_by_test_id("motor-count"), f"{len(names)} of 8 motors")
            self.assertEqual(sorted(shown()), names, word)
        tab.get_by_test_id("filter").fill("")
        tab.get_by_test_id("grouping").select_option("none")
        tab.get_by_test_id("sorting").select_option("name")
        self.wait_for_text(tab.get_by_test_id("motor-count"), "8 motors")
        self.assertEqual(shown(), sorted(MOTORS))
        self.row(tab, "b2").get_by_role("button", name="Favourite: b2").click()
        tab.get_by_test_id("favourites").click()
        self.wait_for_text(tab.get_by_test_id("motor-count"), "1 of 8 motors")
        self.assertEqual(shown(), ["b2"])
        tab.reload()
        self.wait_for_text(tab.get_by_test_id("motor-count"), "1 of 8 motors")
        self.assertEqual(shown(), ["b2"])
        self.assertEqual(self.row(tab, "b2").get_by_role("button", name="Favourite: b2").get_attribute("aria-pressed"), "true")
        # Another browser has another layout.
        other = self.open_tab()
        self.wait_for_text(other.get_by_test_id("motor-count"), "8 motors")


if __name__ == "__main__":
    main()
