"""What axe-core has to say of each view, light, dark and on a phone: nothing serious."""

from browser import TOP, BrowserTest, main
from rig import FAR

AXE = TOP / "build/axe/node_modules/axe-core/axe.min.js"
LOOKS = {"light": {}, "dark": {"color_scheme": "dark"}, "phone": {"viewport": {"width": 360, "height": 740}, "has_touch": True}}
EXAMINE = """
async () => (await axe.run(document, { resultTypes: ["violations"] })).violations
  .filter((one) => one.impact === "serious" || one.impact === "critical")
  .flatMap((one) => one.nodes.map((node) => `${one.id}: ${node.target.join(" ")}: ${node.failureSummary.split("\\n").slice(1).join("; ")}`))
"""


class WebAccessibility(BrowserTest):
    def examine(self, tab, look, view):
        with self.subTest(look=look, view=view):
            if not tab.evaluate("() => 'axe' in window"):
                # As a debugger does, past the page's policy for scripts.
                tab.evaluate(AXE.read_text())
            self.assertEqual(tab.evaluate(EXAMINE), [])
            wide = tab.evaluate("() => document.documentElement.scrollWidth - document.documentElement.clientWidth")
            self.assertLessEqual(wide, 0)

    def test_no_view_has_a_serious_violation(self):
        self.bring_up_web(kept=True)
        self.command("config", "a0", "soft_limits=-1000,300000")
        self.command("move", "--wait", "a0", "30")
        self.command("hold", "b1")
        self.file("path.csv").write_text("a2, a3\n200, 100\n250, 120\n300, 50\n")
        token = self.make_token()
        for look, options in LOOKS.items():
            tab = self.open_tab("", token, **options)
            self.start_move("a0", "--to", str(FAR))
            self.wait_for_class(self.row(tab, "a0"), "moving")
            self.examine(tab, look, "overview")
            self.go_to_view(tab, "motor/bushd/a0")
            tab.get_by_test_id("more-commands").locator("summary").click()
            tab.get_by_test_id("goto-input").fill("x")
            tab.get_by_test_id("goto").click()
            self.wait_for_part(tab.get_by_test_id("input-error"), "no number")
            tab.get_by_test_id("history").wait_for()
            self.examine(tab, look, "motor")
            tab.keyboard.press("Escape")
            self.wait_for_part(tab.get_by_test_id("stop-said"), "Stop: done")
            self.go_to_view(tab, "tables")
            tab.get_by_test_id("plot-bushd2-scurve").check()
            tab.get_by_test_id("table-bushd2-constant").get_by_role("button").click()
            self.wait_for_text(tab.get_by_test_id("diagnostics"), "good")
            self.examine(tab, look, "tables")
            self.go_to_view(tab, "paths")
            tab.get_by_test_id("path-file").set_input_files(self.file("path.csv"))
            self.wait_for_part(tab.get_by_test_id("path-said"), "3 points")
            self.examine(tab, look, "paths")
            self.go_to_view(tab, "health")
            tab.get_by_test_id("findings").locator("li").first.wait_for()
            self.examine(tab, look, "health")
            self.go_to_view(tab, "buses")
            self.wait_for_part(tab.get_by_test_id("buses"), "Latency of")
            self.examine(tab, look, "buses")
            self.go_to_view(tab, "access")
            self.wait_for_part(tab.get_by_test_id("access-state"), "may command")
            self.examine(tab, look, "access")
            tab.context.close()
        reader = self.open_tab("access")
        self.wait_for_part(reader.get_by_test_id("access-state"), "may read")
        self.examine(reader, "light", "access without a token")

        # Trouble too is told to everybody.
        self.command("estop")
        tab = self.open_tab("", token)
        self.wait_for_part(tab.get_by_test_id("trouble"), "fault")
        self.examine(tab, "light", "overview, in fault")
        self.bushd.end()
        self.wait_for_part(tab.get_by_test_id("first-start"), "bushctl setup")
        self.examine(tab, "light", "overview, without a daemon")
        self.expect_cut()
        self.web.end()
        self.wait_for_text(tab.get_by_test_id("stop-all"), "STOP CANNOT BE SENT")
        self.examine(tab, "light", "overview, without a connection")


if __name__ == "__main__":
    main()
