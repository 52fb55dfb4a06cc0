"""Homing with the real programs: a simulated switch, and what the trace says of it."""

import unittest

from rig import EndToEndTest

SWITCH = -300
AT = -50  # the position that the switch shall have


class Homing(EndToEndTest):
    def bring_up_with_switch(self, more="", keys="", switches=(f"1.0@{SWITCH}",)):
        self.write_config()
        config = self.file("bushd.toml")
        home = f'home = {{ direction = "negative", position_steps = {AT}, most_steps = 5000{more} }}'
        config.write_text(config.read_text().replace('name = "a0"\n', f'name = "a0"\n{home}\n{keys}\n'))
        self.bushsim = self.start_bushsim(options=[word for one in switches for word in ("--switch", one)])
        self.bushd = self.start_bushd()
        self.wait_until_ready()

    def assert_stands_where_it_says(self):
        position = self.positions()["a0"]
        self.assertEqual(self.bushsim.end(), 0)
        away = self.traced_positions()["a0"] - SWITCH
        self.assertIn(position - AT - away, (0, 1))

    def test_finds_its_switch(self):
        self.bring_up_with_switch()
        self.assertIn("a0: reached", self.command("home", "--wait", "a0").stdout)
        self.assertIn(self.positions()["a0"] - AT, (-1, 0))
        self.command("move", "--wait", "a0", "--to", 400)
        self.command("home", "--wait", "a0")
        self.command("move", "--wait", "a0", 7)
        self.assert_stands_where_it_says()

    def test_between_limits_of_its_own(self):
        self.bring_up_with_switch(keys="inputs = { positive = 9, negative = 10, home = 11 }",
                                  switches=("1.0:9@+900", "1.0:10@-2000", f"1.0:11@{SWITCH}"))
        self.assertIn("limit", self.bushctl("move", "--wait", "a0", 3000).stdout)
        self.wait_until("its limit to be shown", lambda: self.motors()["a0"]["inputs"] == "positive")
        self.assertEqual(self.motors()["a0"]["inhibited"], "positive")
        self.command("home", "--wait", "a0")
        self.wait_until("its switch to be shown", lambda: self.motors()["a0"]["inputs"] == "home")
        self.assert_stands_where_it_says()

    def test_is_stopped_and_refused(self):
        self.bring_up_with_switch()
        self.command("move", "--wait", "a0", 3000)
        home = self.start_bushctl("home", "--wait", "a0")
        self.wait_until("a0 to be homed", lambda: self.motors()["a0"]["activity"] == "home")
        refused = self.bushctl("move", "a0", 5)
        self.assertEqual(refused.returncode, 1)
        self.assertIn("it is being homed", refused.stderr)
        self.command("stop", "a0", "--wait")
        self.assertEqual(home.process.wait(), 1)
        self.assertIn("stopped", home.said())
        self.assertIn("no home switch configured", self.bushctl("home", "a1").stderr)

    def test_at_start(self):
        self.bring_up_with_switch(", at_start = true")
        self.wait_until("a0 to be homed", lambda: self.motors()["a0"]["position_steps"] in (AT - 1, AT))
        self.wait_until("a0 to rest", lambda: self.motors()["a0"]["activity"] == "rest")
        self.assert_stands_where_it_says()


if __name__ == "__main__":
    unittest.main()
