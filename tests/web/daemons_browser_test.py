"""Daemons that end, come back, are not there at all, or are two, as a browser shows them."""

import re
import signal

from browser import BrowserTest, main
from rig import FAR, program


class WebDaemons(BrowserTest):
    def test_says_why_a_daemon_is_gone_and_comes_back_by_itself(self):
        self.bring_up_web()
        tab = self.open_tab("motor/bushd/a0", self.make_token())
        tab.get_by_test_id("goto-input").fill(str(FAR))
        tab.get_by_test_id("goto").click()
        self.wait_until_travelled(300, "a0")
        stays = self.open_tab("motor/bushd/a0", self.make_token("berta"))
        self.wait_for_text(stays.get_by_test_id("fact-state"), "moving")
        self.bushd.end(signal.SIGKILL)
        self.wait_for_part(tab.get_by_test_id("notice").last, "the daemon has ended")
        self.wait_for_part(tab.get_by_test_id("connection"), "no daemon: bushd")
        self.wait_for_class(tab.get_by_test_id("view-a0"), "old")
        self.wait_for_part(tab.get_by_test_id("age"), "old")
        self.go_to_view(tab, "")
        self.wait_for_part(tab.get_by_test_id("first-start"), "bushd is not connected")
        self.wait_for_part(tab.get_by_test_id("first-start"), re.compile("bushd .*has ended|not running|Start"))
        self.wait_for_class(self.row(tab, "a0"), "old")
        shown = self.row(tab, "a0").get_by_test_id("position").inner_text()  # stays, as what was seen last

        # Ticks that the MCU has are made, then the table brings it to rest.
        self.bushd = self.start_bushd(moves="moves-2.jsonl")
        self.wait_for_text(tab.get_by_test_id("connection"), "connected")
        self.wait_for_class(self.row(tab, "a0"), "old", there=False)
        self.wait_for_text(tab.get_by_test_id("first-start"), "")
        self.wait_until_ready()
        stands = self.positions()["a0"]
        self.wait_for_text(self.row(tab, "a0").get_by_test_id("position"), str(stands))
        self.assertGreaterEqual(stands, int(shown))
        # So does a page that has shown this motor all the time.
        self.wait_for_class(stays.get_by_test_id("view-a0"), "old", there=False)
        self.wait_for_text(stays.get_by_test_id("position"), str(stands))
        self.wait_for_text(stays.get_by_test_id("fact-state"), "at rest")

        # A second time, to pages that have seen the first.
        places = (stays.get_by_test_id("view-a0"), self.row(tab, "a0"))
        self.bushd.end(signal.SIGKILL)
        for place in places:
            self.wait_for_class(place, "old")
        self.bushd = self.start_bushd(moves="moves-3.jsonl")
        self.wait_until_ready()
        self.command("move", "--wait", "a0", "70")
        for place in places:
            self.wait_for_class(place, "old", there=False)
            self.wait_for_text(place.get_by_test_id("position"), str(stands + 70))
        self.go_to_view(tab, "motor/bushd/a1")
        tab.get_by_test_id("by-input").fill("7")
        tab.get_by_test_id("by").click()
        self.wait_for_part(tab.get_by_test_id("notice").last, "move a1 reached")
        self.end_programs()
        traced = self.traced_positions()
        self.assertEqual((traced["a0"], traced["a1"]), (stands + 70, 7))

    def test_without_a_daemon_it_says_what_to_do(self):
        self.write_config()
        self.start_web()
        tab = self.open_tab()
        first = tab.get_by_test_id("first-start")
        self.wait_for_part(first, "bushd is not connected")
        self.wait_for_part(first, "sudo bushctl setup")
        self.wait_for_part(first, str(self.file("control")))
        for view in ("tables", "paths", "health", "buses", "access", "motor/bushd/a0"):
            self.go_to_view(tab, view)
            tab.get_by_role("heading", level=1).wait_for()
        self.go_to_view(tab, "")
        # Then somebody does it.
        self.bushsim = self.start_bushsim()
        self.bushd = self.start_bushd()
        self.wait_for_text(self.row(tab, "a0").get_by_test_id("trust"), "uncertain")
        self.wait_for_text(first, "")
        self.assertFalse(first.is_visible())

    def test_two_daemons_are_on_one_page_and_stop_together(self):
        self.write_config()
        config = self.file("bushd.toml").read_text()
        for here, there in (('"BUSHD"', '"OTHER"'), (self.file("control"), self.file("hutch-control")), (self.file("port"), self.file("hutch-port"))):
            config = config.replace(f"{here}", f"{there}")
        self.file("hutch.toml").write_text(config)
        self.bushsim = self.start_bushsim()
        self.bushd = self.start_bushd()
        command = [program("BUSHSIM"), "--config", self.file("hutch.toml"), "--link", self.file("hutch-port"), "--trace", self.file("hutch.vcd")]
        self.start(command, "hutch-sim.log", urgent=True)
        hutch = self.start_bushd("hutch.jsonl", "hutch.toml")
        self.start_web("--daemon", f"hutch={self.file('hutch-control')}")
        self.wait_until_ready()
        token = self.make_token()
        over = self.open_tab("", token)
        self.wait_for_text(over.get_by_test_id("motor-count"), "16 motors")

        over.get_by_test_id("filter").fill("a0")
        self.wait_for_text(over.get_by_test_id("motor-count"), "2 of 16 motors")
        # Motors of one name: each page, and each row, is of one of them.
        tabs = {name: self.open_tab(f"motor/{name}/a0", token) for name in ("bushd", "hutch")}
        for name, tab in tabs.items():
            tab.get_by_test_id("more-commands").locator("summary").click()
            tab.get_by_test_id("set-input").fill("0")
            tab.get_by_test_id("set").click()
            self.wait_for_text(tab.get_by_test_id("trust"), "known")
        for name, steps in (("bushd", "30"), ("hutch", "-40")):
            tabs[name].get_by_test_id("goto-input").fill(steps)
            tabs[name].get_by_test_id("goto").click()
            self.wait_for_text(tabs[name].get_by_test_id("position"), steps)
        rows = {name: self.row(over, "a0").filter(has=over.locator(f"a[href='#/motor/{name}/a0']")) for name in tabs}
        self.wait_for_text(rows["bushd"].get_by_test_id("position"), "30")
        self.wait_for_text(rows["hutch"].get_by_test_id("position"), "-40")

        for tab in tabs.values():
            tab.get_by_test_id("goto-input").fill(str(FAR))
            tab.get_by_test_id("goto").click()
            self.wait_for_text(tab.get_by_test_id("fact-state"), "moving")
        over.keyboard.press("Escape")
        self.wait_for_text(over.get_by_test_id("stop-said"), re.compile(r"^Stop: bushd: done.*hutch: done"))
        for tab in tabs.values():
            self.wait_for_text(tab.get_by_test_id("fact-state"), "at rest")
        stand = {name: int(tab.get_by_test_id("position").inner_text()) for name, tab in tabs.items()}
        self.assertEqual(stand["bushd"], self.positions()["a0"])

        # One of them ends: nothing of the other is old.
        hutch.end(signal.SIGKILL)
        self.wait_for_part(over.get_by_test_id("connection"), "no daemon: hutch")
        self.wait_for_class(rows["hutch"], "old")
        self.command("move", "--wait", "a0", "5")
        self.wait_for_text(rows["bushd"].get_by_test_id("position"), str(stand["bushd"] + 5))
        self.wait_for_class(rows["bushd"], "old", there=False)
        self.end_programs()
        self.assertEqual(self.traced_positions()["a0"], stand["bushd"] + 5)
        self.assertEqual(self.traced_positions("hutch.vcd")["a0"], stand["hutch"])


if __name__ == "__main__":
    main()
