"""Positions over power cuts, with the real programs and a real disk."""

import signal
import unittest

from rig import EndToEndTest


class State(EndToEndTest):
    def switch_on(self):
        self.bushsim = self.start_bushsim()
        self.bushd = self.start_bushd()
        self.wait_until_ready()
        self.wait_until("positions to be there", lambda: "unknown" not in self.trust().values())

    def cut_power(self):
        for running in (self.bushd, self.bushsim):
            running.process.send_signal(signal.SIGKILL)
            running.process.wait()

    def trust(self):
        return {name: motor["trust"] for name, motor in self.motors().items()}

    def bring_up_with_store(self):
        self.write_config(state=self.file("state"))
        self.switch_on()
        self.survey()

    def test_at_rest_they_are_restored(self):
        self.bring_up_with_store()
        self.command("move", "--wait", "a0", "500")
        self.command("move", "--wait", "a1", "20")
        stood = self.positions()
        self.cut_power()
        self.switch_on()
        self.assertEqual(set(self.trust().values()), {"restored"})
        self.assertEqual(self.positions(), stood)
        self.command("confirm", "a0")
        self.assertEqual(self.trust()["a0"], "known")
        history = self.command("history", "a0").stdout
        self.assertIn("reached", history)
        self.assertIn("confirm", history)

    def test_in_motion_they_are_uncertain(self):
        self.bring_up_with_store()
        self.command("move", "a0", "100000")
        self.wait_until_travelled(500, "a0")
        self.cut_power()
        self.switch_on()
        self.assertEqual(self.trust()["a0"], "uncertain")
        refused = self.bushctl("move", "a0", "5")
        self.assertEqual(refused.returncode, 1)
        self.assertIn("restarted while it moved; last known: ", refused.stderr)
        self.command("move", "--wait", "a1", "5")

    def test_a_folder_that_cannot_be_used_is_refused(self):
        self.write_config(state="/dev/null/state")
        bushd = self.start_bushd()
        self.assertEqual(bushd.process.wait(), 1)
        self.assertIn("/dev/null/state", bushd.said())

    def test_two_daemons_do_not_share_a_folder(self):
        self.bring_up_with_store()
        config = self.file("bushd.toml").read_text()
        config = config.replace(str(self.file("control")), str(self.file("control-second")))
        self.file("second.toml").write_text(config.replace('prefix = "BUSHD"', 'prefix = "SECOND"'))
        second = self.start_bushd("moves-second.jsonl", "second.toml")
        self.assertEqual(second.process.wait(), 1)
        self.assertIn("in use by another bushd", second.said())


if __name__ == "__main__":
    unittest.main()
