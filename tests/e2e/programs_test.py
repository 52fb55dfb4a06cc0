"""Programs of MCUs by bushctl and Python, down to the steps at the pins."""

import json
import subprocess
import unittest

import bushd
from rig import EndToEndTest

SCAN = """motors = ["a0", "a1"]
[[frame]]
repeat = 3
[[frame]]
line_by = "way.csv"
[[frame]]
wait_s = 0.02
[[frame]]
next = true
[[frame]]
move_to = { a0 = 0 }
"""
WAY = "a0,a1\n40,-20\n40,0\n"
AWAY = 'motors = ["b0"]\n[[frame]]\nrepeat = 0\n[[frame]]\nmove_by = [2000]\n[[frame]]\nmove_by = [-2000]\n[[frame]]\nnext = true\n'
KEPT = """motors = ["a0"]
without_host = true
kept = true
at_power_on = true
range = { a0 = [-10, 50] }
[[frame]]
repeat = 0
[[frame]]
move_by = [50]
[[frame]]
move_by = [-50]
[[frame]]
wait_s = 0.1
[[frame]]
next = true
"""
TOGETHER = 'motors = ["b0"]\n[[frame]]\nmove_by = [150]\n'


class Programs(EndToEndTest):
    def bring_up_programs(self):
        self.bring_up()
        self.survey()
        for name, text in (("scan.toml", SCAN), ("way.csv", WAY), ("away.toml", AWAY), ("together.toml", TOGETHER)):
            self.file(name).write_text(text)

    def program(self, *words):
        return self.command("program", *words).stdout

    def listed(self):
        return {entry["mcu"]: entry for entry in json.loads(self.program("list", "--json"))["programs"]}

    def stage_of(self, program):
        return next((entry["stage"] for entry in self.listed().values() if entry["program"] == program), None)

    def test_the_whole_way_by_bushctl(self):
        self.bring_up_programs()
        self.assertIn("bytes", self.program("put", "scan", self.file("scan.toml"), "--dry-run"))
        self.assertIsNone(self.stage_of("scan"))
        entry = json.loads(self.program("put", "scan", self.file("scan.toml"), "--json"))
        self.assertEqual((entry["program"], entry["memory"], entry["stage"]), ("scan", 8192, "loaded"))
        ways = {way.pop("motor"): way for way in entry["motors"]}
        self.assertEqual(ways, {"a0": {"least_steps": 0, "most_steps": 240, "end_steps": 0, "edges": 480},
                                "a1": {"least_steps": -60, "most_steps": 0, "end_steps": -60, "edges": 60}})
        self.assertEqual(self.listed()[entry["mcu"]]["checksum"], entry["checksum"])
        ran = self.program("run", "scan", "--wait")
        self.assertIn("a0: reached, stands at 0", ran)
        self.assertEqual(self.positions()["a0"], 0)
        self.assertEqual(self.positions()["a1"], -60)
        self.assertEqual(self.stage_of("scan"), "ended")
        self.program("put", "together", self.file("together.toml"))
        self.assertIn("b0: reached", self.program("run", "scan", "together", "--wait"))
        self.assertEqual([self.positions()[name] for name in ("a0", "a1", "b0")], [0, -120, 150])
        self.program("erase", "scan")
        self.assertEqual(self.listed()[entry["mcu"]]["stage"], "none")
        refused = self.bushctl("program", "run", "scan")
        self.assertEqual(refused.returncode, 1)
        self.assertIn("scan", refused.stderr)

    def test_a_program_is_paused_goes_on_and_is_stopped(self):
        self.bring_up_programs()
        said = self.program("put", "away", self.file("away.toml"))
        self.assertIn("without end: this is one pass of what it repeats", said)
        run = self.start_bushctl("program", "run", "away", "--wait")
        self.wait_until("it to run", lambda: self.stage_of("away") == "runs")
        self.assertIn("program away runs, frame", self.command("status").stdout)
        self.assertEqual(self.bushctl("move", "b0", 5).returncode, 1)
        self.assertEqual(self.bushctl("program", "erase", "away").returncode, 1)
        self.command("pause", "b0")
        self.assertEqual(self.stage_of("away"), "paused")
        self.command("resume", "b0")
        self.wait_until("it to go on", lambda: self.stage_of("away") == "runs")
        self.command("stop", "b0", "--wait")
        self.assertEqual(run.process.wait(30), 1)
        self.assertIn("frame", run.said())
        self.assertEqual(self.stage_of("away"), "ended")
        self.command("move", "b0", 5, "--wait")

    def test_the_whole_way_by_python(self):
        self.bring_up_programs()
        with bushd.connect() as client:
            with self.assertRaisesRegex(bushd.Refused, "nobody"):
                client.put_program("wrong", 'motors = ["nobody"]\n[[frame]]\nwait_s = 1\n')
            planned = client.put_program("scan", SCAN, {"way.csv": WAY}, dry_run=True)
            put = client.put_program("scan", SCAN, {"way.csv": WAY})
            self.assertEqual((planned.bytes, planned.motors, put.stage), (put.bytes, put.motors, bushd.ProgramStage.LOADED))
            client.put_program("away", AWAY)
            self.assertEqual(client.run_programs("scan").outcome, bushd.Outcome.REACHED)
            motion = client.run_programs("away", wait=False)
            self.wait_until("b0 to move", lambda: client.where("b0").moving)
            self.wait_until("its MCU to say so", lambda: any(
                mcu.program.startswith("away runs, frame") for mcu in client.status().mcus.values()))
            self.assertEqual(motion.stop().outcome, bushd.Outcome.STOPPED)
            self.assertEqual(client.list_programs()[put.mcu].stage, bushd.ProgramStage.ENDED)
            client.erase_program("scan")
            client.erase_program("away")
            self.assertEqual({one.stage for one in client.list_programs().values()}, {bushd.ProgramStage.NONE})

    def test_a_power_cut_leaves_what_is_kept_and_begins_what_says_so(self):
        self.write_config()
        text = self.file("bushd.toml").read_text()
        self.file("bushd.toml").write_text(text.replace("[[mcu]]\n", "[[mcu]]\nprograms_without_host = true\nprograms_at_power_on = true\n"))
        self.bushsim = self.start_bushsim(options=("--keep", "--console", 1), stdin=subprocess.PIPE)
        self.bushd = self.start_bushd()
        self.wait_until_ready()
        self.survey()
        self.file("kept.toml").write_text(KEPT)
        self.assertIn("outlives power cuts\n", self.program("put", "kept", self.file("kept.toml")))
        self.assertEqual(self.positions()["a0"], 0)
        self.bushsim.process.stdin.write(b"D")
        self.bushsim.process.stdin.flush()
        self.wait_until("it to run by itself", lambda: self.stage_of("kept") == "runs")
        entry = next(entry for entry in self.listed().values() if entry["program"] == "kept")
        self.assertTrue(entry["at_power_on"] and entry["kept"] and entry["stored"] and entry["without_host"])
        self.wait_until("its MCU to be there", lambda: self.motors()["a0"]["trust"] == "uncertain")
        self.command("stop", "a0", "--wait")
        self.program("erase", entry["checksum"])
        self.assertIsNone(self.stage_of("kept"))

    def test_ctrl_c_stops_the_motors_of_the_program_alone(self):
        self.bring_up_programs()
        self.program("put", "away", self.file("away.toml"))
        run = self.start_bushctl("program", "run", "away", "--wait")
        self.wait_until("b0 to move", lambda: self.motors()["b0"]["moving"])
        self.command("move", "a0", 20000)
        self.assertEqual(run.end(2), 130)
        self.assertFalse(self.motors()["b0"]["moving"])
        self.assertTrue(self.motors()["a0"]["moving"])


if __name__ == "__main__":
    unittest.main()
