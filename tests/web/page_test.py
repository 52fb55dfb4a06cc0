"""What a page is told, and what it may ask: by real programs, and edges of the simulator's trace."""

from lab import WebTest, main


class WebPage(WebTest):
    def test_a_page_without_a_token_sees_everything_and_may_stop(self):
        self.bring_up_web()
        page = self.open_page()
        self.assertEqual((page.hello["may_command"], page.hello["may_stop"], page.hello["user"]), (False, True, None))
        page.take_until(lambda: "a0" in page.motors and "a0" in page.descriptions and page.buses)
        self.assertEqual(page.daemons["bushd"]["connected"], True)

        refused = page.result(page.ask("move", kind=1, motors=[{"motor": "a0", "in_steps": True, "steps": 10}]))
        self.assertEqual(refused["phase"], "refused")
        self.assertIn("bushctl web-token", refused["reason"])
        self.assertEqual(page.result(page.ask("get table", table="bushd2-constant"))["detail"]["table"]["name"], "bushd2-constant")

        self.start_move("a0", "200000")
        page.take_until(lambda: page.motors["a0"]["moving"])
        self.assertEqual(page.result(page.ask("stop"))["outcome"], "done")
        page.take_until(lambda: not page.motors["a0"]["moving"])
        position = page.motors["a0"]["position_steps"]
        self.assertEqual(self.positions()["a0"], position)
        self.end_programs()
        self.assertEqual(self.traced_positions()["a0"], position)


if __name__ == "__main__":
    main()
