"""Many tabs of one browser, and what tabs cost each other: nothing."""

from browser import BrowserTest, main
from rig import FAR

TABS = 60
AT_ONCE = 12  # opened without waiting for each


class WebMany(BrowserTest):
    def test_with_60_tabs_open_one_more_works(self):
        self.bring_up_web()
        window = self.open_window(self.make_token())
        tabs = []
        for _ in range(TABS // AT_ONCE):
            new = [window.new_page() for _ in range(AT_ONCE)]
            for tab in new:
                tab.on("pageerror", lambda error: self.faults.append(str(error)))
                tab.goto(self.address(), wait_until="commit")
            for tab in new:
                self.wait_for_text(self.row(tab, "a0").get_by_test_id("position"), "0")
            tabs += new
        self.assertEqual(len(tabs), TABS)

        last = self.open_tab("motor/bushd/a0", window=window)
        last.get_by_test_id("goto-input").fill(str(FAR))
        last.get_by_test_id("goto").click()
        self.wait_for_text(last.get_by_test_id("fact-state"), "moving")
        last.keyboard.press("Escape")
        self.wait_for_part(last.get_by_test_id("stop-said"), "Stop: done")
        stands = str(self.positions()["a0"])
        self.assertFalse(self.motors()["a0"]["moving"])
        for tab in (tabs[0], tabs[TABS // 2], tabs[-1], last):
            place = self.row(tab, "a0") if tab is not last else tab
            self.wait_for_text(place.get_by_test_id("position"), stands)
        self.end_programs()
        self.assertEqual(str(self.traced_positions()["a0"]), stands)


if __name__ == "__main__":
    main()
