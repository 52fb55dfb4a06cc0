"""Half and full step of an MCU with phases, changed in operation by bushctl."""

import tomllib
import unittest

from rig import EndToEndTest


class Phases(EndToEndTest):
    def bring_up_with_phases(self):
        self.write_config(state=self.file("state"))
        config = self.file("bushd.toml")
        config.write_text(config.read_text().replace("address = 1\n", 'address = 1 # unipolar\nsteps = "phases"\n', 1))
        self.bushsim = self.start_bushsim()
        self.bushd = self.start_bushd()
        self.wait_until_ready()
        self.survey()

    def phases_of(self, motor):
        lines = self.command("config", motor).stdout.splitlines()
        return next(line.split()[2:] for line in lines if "phase_sequence" in line)

    def test_half_step_is_a_setting_of_all_motors_of_the_mcu(self):
        self.bring_up_with_phases()
        self.command("move", "--wait", "a0", "40")
        move = self.start_move("a1", "20000")
        refused = self.bushctl("config", "a0", "phase_sequence=half")
        self.assertEqual(refused.returncode, 1)
        self.assertIn("a motor of MCU hall:1 moves", refused.stderr)
        self.command("stop", "a1", "--wait")
        move.process.wait(60)

        changed = self.command("config", "a0", "phase_sequence=half").stdout
        self.assertIn("a0: phase_sequence = half; its position is uncertain until it is set or homed", changed)
        self.assertEqual(self.phases_of("a3"), ["half", "full"])
        refused = self.bushctl("move", "a1", "10")
        self.assertIn("its phases began anew when phase_sequence became half, and was full", refused.stderr)
        self.assertEqual(self.motors()["b0"]["trust"], "known")
        for name in ("a0", "a1"):
            self.command("set", name, "0")
        self.command("move", "--wait", "a0", "40")

        self.command("config", "--save")
        first, second = tomllib.loads(self.file("bushd.toml").read_text())["mcu"]
        self.assertEqual(first["phase_sequence"], "half")
        self.assertNotIn("phase_sequence", second)
        self.assertIn("address = 1 # unipolar\n", self.file("bushd.toml").read_text())
        self.assertNotIn("phase_sequence", self.command("config", "--diff").stdout)

        self.assertEqual(self.bushd.end(), 0)
        self.bushd = self.start_bushd("again.jsonl")
        self.wait_until_ready()
        self.assertEqual(self.phases_of("a0"), ["half", "half"])
        self.command("move", "--wait", "a0", "--to", "0")
        told = {event["phase_sequence"] for event in self.logged("again.jsonl") if event["event"] == "move"}
        self.assertEqual(told, {"half"})


if __name__ == "__main__":
    unittest.main()
