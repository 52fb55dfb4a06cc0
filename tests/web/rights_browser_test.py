"""Who may, as a browser shows it."""

from browser import REFUSED_TOKEN, BrowserTest, main


class WebRights(BrowserTest):
    def test_a_token_is_entered_once_and_ends_when_it_is_revoked(self):
        self.bring_up_web(kept=True)
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
        self.bring_up_web("--stop-without-token", "nobody")
        tab = self.open_tab("access", self.make_token("anna"))
        self.wait_for_text(tab.get_by_test_id("rights"), "anna")
        tab.get_by_test_id("logout").click()
        self.wait_for_text(tab.get_by_test_id("rights"), "read only")
        self.wait_for_part(tab.get_by_test_id("access-state"), "may only read")
        tab.reload()
        self.wait_for_text(tab.get_by_test_id("rights"), "read only")


if __name__ == "__main__":
    main()
