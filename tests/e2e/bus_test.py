"""Emergency stop, health, and what bushctl does on a line by itself."""

import json
import unittest

from rig import FAR, TABLE_RUNS, EndToEndTest, program


class EmergencyStop(EndToEndTest):
    def check(self, *bus_lines):
        self.bring_up(bus_lines=bus_lines)
        move = self.start_move("a0", FAR, "b1", -FAR)
        self.wait_until_travelled(600, "a0", "b1")
        self.command("estop")
        self.assertEqual(move.process.wait(), 1)
        self.assertIn("a0: stopped, stands at", move.said())
        self.assertIn("emergency stop", move.said())
        self.assertEqual(self.mcu_states(), ["FAULT", "FAULT"])
        refused = self.bushctl("move", "a1", "5")
        self.assertEqual(refused.returncode, 1)
        self.assertIn("bushctl clear", refused.stderr)
        # A new daemon does not lift it.
        self.assertEqual(self.bushd.end(), 0)
        self.bushd = self.start_bushd("moves-after.jsonl")
        self.wait_until("both MCUs to show their fault", lambda: self.mcu_states() == ["FAULT", "FAULT"])
        self.command("clear")
        self.wait_until_ready()
        positions = self.positions()
        self.bushd.end()
        self.bushsim.end()
        self.assertEqual(self.traced_positions(), positions)

    def test_ramps_down(self):
        self.check()

    def test_immediate_stop_of_table_runs(self):
        self.check(*TABLE_RUNS, 'emergency_stop = "immediate"')


class Health(EndToEndTest):
    def test_is_shown_as_table_and_json(self):
        self.bring_up()
        self.command("move", "--wait", "a0", "300")
        table = self.command("health").stdout
        self.assertIn("hall:1", table)
        self.assertIn("LOW WATER", table)
        lines = self.command("health", "--json", "--watch", "--count", "2").stdout.splitlines()
        first, second = (json.loads(line) for line in lines)
        self.assertLess(first["sequence"], second["sequence"])
        bus = second["buses"][0]
        self.assertEqual(bus["port_state"], "open")
        self.assertGreater(sum(column["answers"] for column in bus["latency"]), 0)
        self.assertEqual([mcu["mcu"] for mcu in bus["mcus"]], ["hall:1", "hall:2"])
        for mcu in bus["mcus"]:
            self.assertRegex(mcu["unique_id"], "^[0-9a-f]{16}$")


class Line(EndToEndTest):
    def line(self, command, *arguments):
        return self.bushctl(command, self.file("port"), "--baud", 500000, *arguments)

    def scanned(self):
        ran = self.line("scan", "--json")
        self.assertEqual(ran.returncode, 0, ran.stderr)
        return {mcu["unique_id"]: mcu["address"] for mcu in json.loads(ran.stdout)["mcus"]}

    def test_scan_latency_and_addresses(self):
        self.write_config()
        self.bushsim = self.start_bushsim()
        ids = self.scanned()
        self.assertEqual(sorted(ids.values()), [1, 2])
        tested = json.loads(self.line("latency-test", "--count", 20, "--json").stdout)
        self.assertEqual(tested["asked"], 20)
        self.assertEqual(sum(column["answers"] for column in tested["latency"]), tested["answered"])
        self.assertLessEqual(tested["min_us"], tested["median_us"])
        second = next(name for name, address in ids.items() if address == 2)
        taken = self.line("address", second, 1)
        self.assertEqual(taken.returncode, 1)
        self.assertIn("address 1 is that of", taken.stderr)
        self.assertEqual(self.line("address", second, 9).returncode, 0)
        self.assertEqual(self.scanned()[second], 9)
        nobody = self.line("address", "00ffee0011223344", 7)
        self.assertEqual(nobody.returncode, 1)
        self.assertIn("no MCU with unique id", nobody.stderr)
        self.assertEqual(self.line("address", "xyz", 7).returncode, 2)

    def test_a_doubled_address_is_found_and_mended(self):
        self.write_config()
        command = [program("BUSHSIM"), "--config", self.file("bushd.toml"), "--link", self.file("port")]
        bushsim = self.start([*command, "--doubled", "1"], "bushsim.log", True)
        self.wait_until("bushsim to offer its port", lambda: "bushsim: ready" in bushsim.said())
        ids = self.scanned()
        self.assertEqual(sorted(ids.values()), [1, 1, 2])
        self.assertIn("address 1 is that of 2 MCUs", self.line("scan").stdout)
        twin = next(name for name, address in ids.items() if address == 1)
        self.assertEqual(self.line("address", twin, 3).returncode, 0)
        self.assertEqual(sorted(self.scanned().values()), [1, 2, 3])
        self.start_bushd()
        self.wait_until_ready()

    def test_a_port_of_the_daemon_is_left_alone(self):
        self.bring_up()
        for command in (("scan",), ("latency-test",), ("address", "00ffee0011223344", 7)):
            ran = self.line(*command)
            self.assertEqual(ran.returncode, 1)
            self.assertIn("in use by another program", ran.stderr)
        self.command("move", "--wait", "a0", "5")


if __name__ == "__main__":
    unittest.main()
