"""A slit of two motors, as a user moves and sees it."""

import json
import unittest

from rig import EndToEndTest

SLIT = """
[[pseudo]]
name = ["gap", "centre"]
unit = "counts"
motors = ["a0", "a1"]
kind = "slit"
soft_limits = [[0, 500], [-1000, 1000]]
precision = 1
"""


class Pseudo(EndToEndTest):
    def where(self, *arguments):
        told = json.loads(self.command("where", *arguments, "--json").stdout)["motors"]
        return {motor["name"]: motor for motor in told}

    def test_a_slit_is_moved_and_shown_like_a_motor(self):
        self.write_config()
        with open(self.file("bushd.toml"), "a", encoding="utf-8") as file:
            file.write(SLIT)
        self.bushsim = self.start_bushsim()
        self.bushd = self.start_bushd()
        self.wait_until_ready()
        self.survey()
        for more in ((), ("--lcm",)):
            with self.subTest(more):
                self.command("move", "gap", "--to", "300", "--wait", *more)
                self.command("move", "centre", "10", "--wait", *more)
                self.command("move", "gap", "--to", "100", "centre", "--to", "10", "--wait", *more)
                seen = self.where("gap", "centre", "a0", "a1")
                self.assertEqual((seen["a0"]["position_steps"], seen["a1"]["position_steps"]), (-40, 60))
                self.assertEqual((seen["gap"]["user_position"], seen["centre"]["user_position"]), (100, 10))
                self.assertEqual((seen["gap"]["unit"], seen["gap"]["trust"]), ("counts", "known"))
                self.assertEqual((seen["gap"]["user_low"], seen["gap"]["user_high"]), (0, 500))
                self.command("move", "gap", "--to", "0", "centre", "--to", "0", "--wait", *more)
        refused = self.bushctl("move", "gap", "--to", "501")
        self.assertEqual(refused.returncode, 1)
        self.assertIn("gap: target 501.0 counts is beyond the soft limit at 500.0 counts", refused.stderr)
        refused = self.bushctl("home", "gap")
        self.assertEqual(refused.returncode, 1)
        self.assertIn("gap is computed from motors a0, a1; name these", refused.stderr)
        status = self.command("status").stdout
        self.assertRegex(status, r"gap +hall:gap +- ")
        self.assertEqual(len(json.loads(self.command("status", "--json").stdout)["mcus"]), 2)
        self.assertEqual(self.bushd.end(), 0)


if __name__ == "__main__":
    unittest.main()
