"""Who may, as a browser shows it; and daemons that end, come back, or are not there at all."""

import re
import signal

from browser import REFUSED_TOKEN, BrowserTest, main
from rig import FAR


class WebRights(BrowserTest):
    def test_a_token_is_entered_once_and_ends_when_it_is_revoked(self):
        self.bring_up_page(kept=True)
        tab = self.open_tab("motor/bushd/a0")
        self.wait_for_text(tab.get_by_test_id("rights"), "read only")
        for command in ("goto", "by", "pause", "jog-plus", "jog-minus"):
            self.assertTrue(tab.get_by_test_id(command).is_disabled(), command)
        self.assertTrue(tab.get_by_test_id("stop-motor").is_enabled())

        tab.get_by_test_id("rights").click()
        self.wait_for_part(tab.get_by_test_id("access-state"), "may read, and stop motors")
        self.expected_faults.append(REFUSED_TOKEN)
        tab.get_by_test_id("token").fill("a" * 32)
        tab.get_by_test_id("login").click()
        self.wait_for_part(tab.get_by_role("main").get_by_role("alert"), "token")
        self.wait_for_text(tab.get_by_test_id("rights"), "read only")
        tab.get_by_test_id("token").fill(self.make_token("anna"))
        tab.get_by_test_id("token").press("Enter")
        self.wait_for_text(tab.get_by_test_id("rights"), "anna")
        self.wait_for_part(tab.get_by_test_id("access-state"), "may command, as anna")
        self.assertEqual(tab.get_by_test_id("token").input_value(), "")
        # Scripts cannot read it, and the browser keeps it.
        self.assertEqual(tab.evaluate("() => document.cookie"), "")
        tab.reload()
        self.wait_for_text(tab.get_by_test_id("rights"), "anna")
        self.go_to_view(tab, "motor/bushd/a0")
        tab.get_by_test_id("goto-input").fill("50")
        tab.get_by_test_id("goto").click()
        self.wait_for_text(tab.get_by_test_id("position"), "50")

        tab.get_by_test_id("jog-plus").hover()
        tab.mouse.down()
        self.wait_until("a0 to move", lambda: self.positions()["a0"] > 60)
        self.command("web-token", "--revoke", "anna", "--file", self.file("tokens"))
        self.wait_for_text(tab.get_by_test_id("rights"), "read only")
        self.wait_for_part(tab.get_by_test_id("jog-said"), "ended: ")
        self.wait_until("a0 to rest", lambda: not self.motors()["a0"]["moving"])
        self.assertTrue(tab.get_by_test_id("goto").is_disabled())
        tab.mouse.up()
        stands = self.positions()["a0"]
        self.go_to_view(tab, "access")
        self.wait_for_part(tab.get_by_test_id("access-state"), "may read, and stop motors")
        self.end_programs()
        self.assertEqual(self.traced_positions()["a0"], stands)

    def test_who_forgets_the_token_only_looks(self):
        self.bring_up_page("--stop-without-token", "nobody")
        tab = self.open_tab("access", self.make_token("anna"))
        self.wait_for_text(tab.get_by_test_id("rights"), "anna")
        tab.get_by_test_id("logout").click()
        self.wait_for_text(tab.get_by_test_id("rights"), "read only")
        self.wait_for_part(tab.get_by_test_id("access-state"), "may only read")
        tab.reload()
        self.wait_for_text(tab.get_by_test_id("rights"), "read only")


class WebDaemons(BrowserTest):
    def test_says_why_a_daemon_is_gone_and_comes_back_by_itself(self):
        self.bring_up_page()
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
        self.go_to_view(tab, "motor/bushd/a1")
        tab.get_by_test_id("by-input").fill("7")
        tab.get_by_test_id("by").click()
        self.wait_for_part(tab.get_by_test_id("notice").last, "move a1 reached")
        self.end_programs()
        traced = self.traced_positions()
        self.assertEqual((traced["a0"], traced["a1"]), (stands, 7))

    def test_without_a_daemon_it_says_what_to_do(self):
        self.write_config()
        self.start_web()
        self.start_browser()
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


if __name__ == "__main__":
    main()
