"""First start: bushctl setup writes a configuration from what it finds on a line, and bushctl doctor looks for what is
wrong, with and without a daemon."""

import json
import os
import subprocess
import unittest

from rig import EndToEndTest, program


class Setup(EndToEndTest):
    def setup(self, *arguments):
        return self.bushctl("setup", self.file("port"), "--output", self.file("new.toml"), *arguments)

    def test_what_it_writes_moves_a_motor(self):
        self.write_config()
        self.bushsim = self.start_bushsim()
        ran = self.setup("--baud", 500000)
        self.assertEqual(ran.returncode, 0, ran.stderr)
        self.assertIn("address 2: unique id", ran.stderr)
        checked = self.run_program(program("BUSHD"), "--check-config", self.file("new.toml"))
        self.assertEqual(checked.returncode, 0, checked.stderr)
        self.assertIn("good: 2 motors on 2 MCUs and 1 bus", checked.stdout)
        # A second time it leaves alone what somebody may have edited since.
        before = self.file("new.toml").read_text()
        self.assertIn("commands = false", before)
        refused = self.setup("--baud", 500000)
        self.assertEqual(refused.returncode, 1)
        self.assertIn("is there already, and is left alone; --force replaces it", refused.stderr)
        self.file("new.toml").write_text("mine")
        self.assertEqual(self.setup("--baud", 500000, "--force").returncode, 0)
        self.assertEqual(self.file("new.toml").read_text(), before)
        # In this test the socket lies elsewhere than the default.
        self.file("bushd.toml").write_text(f'{before}\n[control]\npath = "{self.file("control")}"\n[state]\npath = ""\n')
        self.bushd = self.start_bushd()
        self.wait_until_ready()
        self.command("set", "m2-0", 0)
        self.command("move", "--wait", "m2-0", 100)
        self.assertEqual(self.motors()["m2-0"]["position_steps"], 100)

    def test_finds_the_baud_rate_and_writes_nothing_when_asked_to_print(self):
        self.write_config()
        config = self.file("bushd.toml")
        config.write_text(config.read_text().replace("500000", "1000000"))
        self.bushsim = self.start_bushsim()
        ran = self.setup("--dry-run")
        self.assertEqual(ran.returncode, 0, ran.stderr)
        self.assertIn("[[mcu]]", ran.stdout)
        self.assertFalse(self.file("new.toml").exists())

    def test_with_nothing_found_it_explains_and_offers_the_simulated_bus(self):
        master, slave = os.openpty()
        self.addCleanup(os.close, master)
        self.addCleanup(os.close, slave)
        ran = self.bushctl("setup", os.ttyname(slave), "--baud", 500000, "--output", self.file("new.toml"))
        self.assertEqual(ran.returncode, 1)
        for said in ("nobody answers", "no MCU was found", "bushd-sim@demo"):
            self.assertIn(said, ran.stderr)
        self.assertFalse(self.file("new.toml").exists())

    def test_a_port_that_the_daemon_has_is_left_to_it(self):
        self.bring_up()
        ran = self.setup("--baud", 500000)
        self.assertEqual(ran.returncode, 1)
        self.assertIn("is in use by another program; bushd, if it runs, has to be stopped first", ran.stderr)


class Doctor(EndToEndTest):
    def doctor(self, *arguments):
        ran = self.bushctl("doctor", "--config", self.file("bushd.toml"), "--watch-s", 1.5, "--json", *arguments)
        self.assertIn(ran.returncode, (0, 1), ran.stderr)
        told = json.loads(ran.stdout)
        self.assertEqual(ran.returncode == 1, told["errors"] > 0)
        return told["findings"]

    def bad(self, found):
        """By check; of what this machine may have or lack, nothing."""
        return {finding["check"]: finding for finding in found
                if finding["level"] != "ok" and finding["check"] not in ("clock", "disk", "lcm")}

    def test_a_good_lab(self):
        self.bring_up()
        self.survey()
        # Healths are published once a second: the first may be from before the MCUs were heard.
        self.wait_until("doctor to see MCUs", lambda: "mcu" in [finding["check"] for finding in self.doctor()])
        found = self.doctor()
        bad = self.bad(found)
        # A busy machine may hear answers late, which says nothing of the lab.
        if "answers come" in bad.get("bus", {"seen": ""})["seen"]:
            del bad["bus"]
        self.assertEqual(bad, {})
        seen = {finding["check"]: finding["seen"] for finding in found}
        self.assertIn("8 motors on 2 MCUs and 1 bus", seen["configuration"])
        self.assertIn(f"open by bushd (pid {self.bushd.process.pid})", seen["port"])
        self.assertIn("2 online", seen["mcu"])
        self.assertIn("8 motors, all known", seen["position"])
        # People get the same in lines.
        lines = self.bushctl("doctor", "--config", self.file("bushd.toml"), "--watch-s", 1.5).stdout
        self.assertRegex(lines, r"ok +configuration +\S+bushd.toml: 8 motors")
        self.assertRegex(lines, r"\n\d+ errors?, \d+ warnings?\n$")

    def test_asks_at_the_socket_of_the_configuration(self):
        self.bring_up()
        elsewhere = {name: value for name, value in os.environ.items() if name != "BUSHD_CONTROL"}
        ran = subprocess.run([program("BUSHCTL"), "doctor", "--config", self.file("bushd.toml"), "--watch-s", "0"],
                             env=elsewhere, capture_output=True, text=True, check=False)
        self.assertIn(f"ok       socket         {self.file('control')}", ran.stdout)
        self.assertIn("answers by the control socket", ran.stdout)

    def test_motors_that_nobody_has_surveyed(self):
        self.bring_up()
        self.assertIn("is uncertain", self.bad(self.doctor())["position"]["seen"])

    def test_without_a_daemon_and_without_a_configuration(self):
        found = self.bad(self.doctor("--socket", self.file("control")))
        self.assertIn("bushctl setup", found["configuration"]["remedy"])
        self.assertIn("no control socket", found["socket"]["seen"])
        self.assertIn("systemctl", found["daemon"]["remedy"])

    def test_what_is_wrong_is_named(self):
        self.bring_up()
        self.survey()
        config = self.file("bushd.toml")
        good = config.read_text()
        config.write_text(good + "# changed\n")
        self.assertIn("was changed since bushd has read it", self.bad(self.doctor())["daemon"]["seen"])
        config.write_text(good.replace("bushd2-scurve", "missing"))
        self.assertIn('no table "missing"', self.bad(self.doctor())["configuration"]["seen"])
        config.write_text(good)
        self.bushsim.end()
        self.wait_until("the port to be gone", lambda: not self.file("port").exists())
        self.wait_until("the health to tell it", lambda: "bus" in self.bad(self.doctor()))
        found = self.bad(self.doctor())
        self.assertIn("is not there", found["port"]["seen"])
        self.assertIn("the port is not open", found["bus"]["seen"])
        self.assertIn("is offline", found["mcu"]["seen"])

    def test_another_program_on_the_port(self):
        self.write_config(port="port")
        self.bushsim = self.start_bushsim()
        port = os.open(self.file("port"), os.O_RDWR | os.O_NOCTTY)
        self.addCleanup(os.close, port)
        found = self.bad(self.doctor("--socket", self.file("control")))
        self.assertIn(f"(pid {os.getpid()}) has", found["port"]["seen"])


if __name__ == "__main__":
    unittest.main()
