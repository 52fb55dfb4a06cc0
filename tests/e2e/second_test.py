"""A second daemon on the same channels: it does not start, and says who is there."""

import contextlib
import os
import threading
import unittest

from hostile_test import Wire
from rig import EndToEndTest


class SecondDaemon(EndToEndTest):
    def start_second(self):
        """Beside the first, on the same channels."""
        config = self.file("bushd.toml").read_text()
        self.file("second.toml").write_text(config.replace(str(self.file("control")), str(self.file("control-second"))))
        return self.start_bushd("moves-second.jsonl", "second.toml")

    def test_on_this_machine_is_refused_with_the_number_of_the_first(self):
        self.bring_up()
        second = self.start_second()
        self.assertEqual(second.process.wait(), 1)
        self.assertIn(f"another bushd, pid {self.bushd.process.pid}, serves channels BUSHD_...", second.said())
        self.assertIn("another prefix", second.said())
        self.command("move", "--wait", "a0", "5")

    def test_on_another_machine_is_refused_by_what_the_first_sends(self):
        self.bring_up()
        os.environ["RUNTIME_DIRECTORY"] = str(self.file("elsewhere"))
        second = self.start_second()
        self.assertEqual(second.process.wait(), 1)
        self.assertIn('another bushd, with a bus "hall", sends its state on channels BUSHD_...', second.said())
        self.command("move", "--wait", "a0", "5")

    def test_that_comes_from_elsewhere_is_told_by_the_one_that_runs(self):
        """As when two networks are joined: neither could hear the other when it started."""
        self.bring_up()
        config = self.file("bushd.toml").read_text().replace(str(self.file("control")), str(self.file("other-control")))
        self.file("other.toml").write_text(config.replace('prefix = "BUSHD"', 'prefix = "OTHER"'))
        self.start_bushd("moves-other.jsonl", "other.toml")
        relay = threading.Thread(target=self.relay, args=(b"OTHER_DESCRIPTION", b"BUSHD_DESCRIPTION", 2), daemon=True)
        relay.start()
        self.wait_until("it to be told", lambda: "another bushd, with a bus" in self.bushd.said())
        self.assertIn("another bushd uses channels BUSHD_...", self.command("status").stdout)
        relay.join(120)
        self.assertEqual(self.bushd.said().count("another bushd"), 1)
        self.wait_until("it to be gone", lambda: "is not heard any more" in self.bushd.said())
        self.wait_until("the state", lambda: "another bushd" not in self.command("status").stdout)

    def relay(self, channel, to, messages):
        with contextlib.closing(Wire()) as wire:
            for _ in range(messages):
                wire.send(wire.next(channel), to)

    def test_one_after_the_other_is_welcome(self):
        self.bring_up()
        self.assertEqual(self.bushd.end(), 0)
        self.bushd = self.start_bushd()
        self.wait_until_ready()


if __name__ == "__main__":
    unittest.main()
