"""A serial port that is missing or goes away: the daemon stays, says so, and goes on when the port is back."""

import os
import signal
import unittest

from rig import FAR, OUTWARD, TABLE_RUNS, EndToEndTest


class Port(EndToEndTest):
    def wait_until_offline(self):
        self.wait_until("both MCUs to be OFFLINE", lambda: self.mcu_states() == ["OFFLINE", "OFFLINE"])
        for mcu in self.status()["mcus"]:
            self.assertIn(str(self.file("port")), mcu["detail"])

    def test_missing_at_the_start(self):
        self.write_config()
        self.bushd = self.start_bushd()
        self.wait_until_offline()
        self.assertIn(f"{self.file('port')}: cannot be opened: No such file", self.bushd.said())
        self.assertEqual({(motor["trust"], motor["position_steps"]) for motor in self.motors().values()},
                         {("unknown", None)})
        refused = self.bushctl("move", "a0", "5")
        self.assertEqual(refused.returncode, 1)
        self.assertIn(f"a0: MCU hall:1 is offline: port {self.file('port')}: cannot be opened", refused.stderr)

        self.start_bushsim()
        self.wait_until_ready()
        self.command("move", "--wait", "a0", "5")
        self.assertEqual(self.bushd.end(), 0)

    def test_ends_while_the_port_is_missing(self):
        self.write_config()
        bushd = self.start_bushd()
        self.wait_until_offline()
        self.assertEqual(bushd.end(signal.SIGTERM), 0)

    def test_lost_in_motion_and_back_with_mcus_that_booted_again(self):
        self.bring_up()
        before = {mcu["mcu"]: mcu["boot_number"] for mcu in self.status()["mcus"]}
        move = self.start_move("a0", FAR, "b1", -FAR)
        self.wait_until_travelled(300, "a0", "b1")
        self.bushsim.end(signal.SIGKILL)  # takes the port with it
        self.assertEqual(move.process.wait(), 1)
        self.assertIn("a0: link, stands at", move.said())
        self.assertIn("b1: link, stands at", move.said())
        self.assertIn(str(self.file("port")), move.said())
        self.wait_until_offline()
        self.assertIn(f"bus hall: port {self.file('port')} lost", self.bushd.said())
        self.assert_one_result_each()

        self.start_bushsim("trace-after.vcd")
        self.wait_until_ready()
        status = self.status()
        for mcu in status["mcus"]:
            self.assertNotEqual(mcu["boot_number"], before[mcu["mcu"]])
        self.assertEqual({motor["trust"] for motor in status["motors"]}, {"uncertain"})
        refused = self.bushctl("move", "a0", "5")
        self.assertEqual(refused.returncode, 1)
        self.assertIn("a0: its position is uncertain", refused.stderr)

        self.command("set", "a0", "-4000")
        self.assertEqual(self.motors()["a0"]["position_steps"], -4000)
        self.assertEqual(self.motors()["a0"]["trust"], "known")
        self.assertEqual(self.motors()["a1"]["trust"], "uncertain")
        self.command("move", "--wait", "a0", "--to", "-3995")
        self.assertEqual(self.motors()["a0"]["position_steps"], -3995)
        self.assertEqual(self.bushd.end(), 0)

    def check_unplugged(self, bus_lines=(), port="port", links=("port",)):
        self.bring_up(bus_lines=bus_lines, port=port, links=links)
        self.survey()
        before = [mcu["boot_number"] for mcu in self.status()["mcus"]]
        move = self.start_outward()
        self.bushsim.send(signal.SIGUSR1)
        self.assertEqual(move.process.wait(), 1)
        lost = f"port {self.file(links[0])} lost"
        self.wait_until("the port to be lost", lambda: lost in self.bushd.said())
        results = {event["motor"]: event["result"] for event in self.moves() if event["event"] == "result"}
        self.assertEqual(results, dict.fromkeys(OUTWARD, "link"))
        # The log tells it before clients are told.
        self.wait_until("clients to be told", lambda: self.mcu_states() == ["OFFLINE", "OFFLINE"])
        stale = self.motors()
        for name in OUTWARD:
            self.assertEqual(stale[name]["trust"], "stale")
            self.assertIn("may have run on", stale[name]["uncertain_reason"])
            self.assertGreater(stale[name]["heard_utime_us"], 0)

        self.bushsim.send(signal.SIGUSR2)
        self.wait_until_ready()
        found = self.positions()
        corrected = {event["motor"]: event for event in self.moves() if event["event"] == "corrected"}
        for name in OUTWARD:
            self.assertEqual(corrected[name]["from_steps"], stale[name]["position_steps"])
            self.assertEqual(corrected[name]["position_steps"], found[name])
            self.assertIn(f"{name}: stands at {found[name]}, not at", self.bushd.said())
        self.assertIn(f"port {self.file(links[-1])} opened", self.bushd.said())
        self.assertEqual([mcu["boot_number"] for mcu in self.status()["mcus"]], before)
        self.assert_way_back_shows_no_step_lost()

    def test_unplugged_in_motion_the_motors_stand_where_the_mcus_counted(self):
        self.check_unplugged()

    def test_unplugged_in_table_runs_the_motors_stand_where_the_mcus_counted(self):
        self.check_unplugged(TABLE_RUNS)

    def test_unplugged_in_motion_and_back_under_another_name(self):
        self.check_unplugged(port="tty[0-9]", links=("tty3", "tty0"))

    def test_unplugged_in_table_runs_and_back_under_another_name(self):
        self.check_unplugged(TABLE_RUNS, port="tty[0-9]", links=("tty3", "tty0"))

    def test_back_under_another_name(self):
        self.write_config(port="tty[0-9]")
        self.bushd = self.start_bushd()
        self.wait_until("the daemon to look", lambda: f"{self.file('tty[0-9]')}: no port matches" in self.bushd.said())
        bushsim = self.start_bushsim(link="tty3")
        self.wait_until_ready()
        self.assertIn(f"port {self.file('tty3')} opened", self.bushd.said())
        self.command("move", "--wait", "a0", "5")
        bushsim.end()
        self.wait_until("the port to be lost", lambda: f"port {self.file('tty3')} lost" in self.bushd.said())
        # What is there under the first name is no port any more: the next that opens is taken.
        self.file("tty3").write_text("a file")
        self.start_bushsim("trace-after.vcd", link="tty7")
        self.wait_until_ready()
        self.assertIn(f"port {self.file('tty7')} opened", self.bushd.said())
        self.command("set", "a0", "5")
        self.command("move", "--wait", "a0", "--to", "0")
        self.assertEqual(self.bushd.end(), 0)

    def test_a_foreign_device_under_a_lower_name(self):
        self.write_config(port="tty[0-9]")
        master, slave = os.openpty()
        self.file("tty0").symlink_to(os.ttyname(slave))
        self.start_bushsim(link="tty3")
        self.bushd = self.start_bushd()
        self.wait_until_ready()
        silent = f"{self.file('tty0')}: nothing of this bus has answered within 5 s; trying {self.file('tty3')}"
        self.assertIn(silent, self.bushd.said())
        self.assertEqual({mcu["port"] for mcu in self.status()["mcus"]}, {str(self.file("tty3"))})
        self.assertRegex(self.command("status").stdout, rf"BUS +PORT\nhall +{self.file('tty3')}\n")
        doctor = self.bushctl("doctor", "--config", self.file("bushd.toml"))
        self.assertIn(f"hall: {self.file('tty3')}", doctor.stdout)
        self.command("move", "--wait", "a0", "5")
        self.assertEqual(self.bushd.end(), 0)
        os.close(slave)
        os.close(master)

    def test_no_serial_port_at_all(self):
        self.write_config()
        self.file("port").write_text("a file")
        self.bushd = self.start_bushd()
        self.wait_until_offline()
        self.assertIn("is no serial port", self.bushd.said())
        self.file("port").unlink()
        self.start_bushsim()
        self.wait_until_ready()

    def test_in_use_by_another_daemon(self):
        self.bring_up()
        config = self.file("bushd.toml").read_text()
        config = config.replace(str(self.file("control")), str(self.file("control-second")))
        self.file("second.toml").write_text(config.replace('"BUSHD"', '"SECOND"'))
        second = self.start_bushd("moves-second.jsonl", "second.toml")
        self.wait_until("the second daemon to complain", lambda: "trying again" in second.said())
        self.assertIn(str(self.file("port")), second.said())
        self.assertEqual(second.end(), 0)
        self.wait_until_ready()
        self.command("move", "--wait", "a0", "5")


if __name__ == "__main__":
    unittest.main()
