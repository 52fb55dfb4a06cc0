"""CAMAC cycles by bushctl, over both transports, down to the steps of a motor."""

import json
import random
import signal
import time
import unittest

import bushd
from rig import EndToEndTest, program

CRATE = """
[[crate]]
number = 1
[[crate.module]]
station = 5
type = "bushd-2"
f_start_hz = 100
motors = ["a0", "b0"]
"""
STEPS = 601
SLOT_NS = 20_000


class Camac(EndToEndTest):
    def bring_up_crate(self):
        self.write_config()
        with self.file("bushd.toml").open("a") as config:
            config.write(CRATE)
        self.bushsim = self.start_bushsim()
        self.bushd = self.start_bushd()
        self.wait_until_ready()
        self.survey()

    def cycle(self, *words):
        return json.loads(self.command("camac", *words, "--json").stdout)

    def test_a_program_moves_a_motor(self):
        self.bring_up_crate()
        self.assertEqual(self.cycle(5, 1, 16, 0), {"x": True, "q": True, "data": 0, "lam": False})
        self.assertEqual(self.cycle(9, 0, 0), {"x": False, "q": False, "data": 0, "lam": False})
        self.command("camac", "load", 5, 0, "bushd2-constant", "--steps", 300)
        for more, motor, steps in ((), "a0", 300), (("--lcm",), "b0", -300):
            number = 0 if motor == "a0" else 0x81
            self.cycle(5, 2, 16, hex(0x60 | number), *more)
            self.cycle(5, 0, 26, *more)
            self.wait_until("LAM", lambda: self.cycle(5, 0, 8, *more)["q"])
            self.assertEqual(self.motors()[motor]["position_steps"], steps)
            self.assertEqual(self.cycle(5, 3, 0, *more)["data"], 0x10)
            self.assertTrue(self.cycle(5, 0, 8, *more)["lam"])
            self.cycle(5, 0, 10, *more)
        self.assertEqual(self.bushd.end(), 0)
        self.assert_one_result_each()

    def test_a_program_goes_on_without_the_computer(self):
        """The daemon is killed behind F26. Where each step belongs follows from the codes alone, which rise and fall."""
        self.write_config(state=self.file("state"))
        text = self.file("bushd.toml").read_text().replace("[[mcu]]", "[[mcu]]\nprograms_without_host = true")
        self.file("bushd.toml").write_text(text + CRATE + "without_computer = true\n")
        self.bushsim = self.start_bushsim()
        self.bushd = self.start_bushd()
        self.wait_until_ready()
        self.survey()
        chance = random.Random(1985)
        codes = [chance.randrange(25, 225) for _ in range(238)]
        with bushd.connect() as client:
            client.camac([(5, 1, 16, 0)])
            client.camac([(5, 0, 16, byte) for byte in [STEPS % 256, STEPS // 256, *codes]], mode="q-stop")
        self.cycle(5, 2, 16, 0x60)
        began = self.command("camac", 5, 0, 26)
        self.wait_until("a0 to move", lambda: self.motors()["a0"]["position_steps"] > 20)
        self.assertEqual(self.bushd.end(signal.SIGKILL), -signal.SIGKILL, began.stdout)
        delays_ns = [40_000 * codes[min(step, STEPS - 1 - step, 237)] for step in range(STEPS)]
        time.sleep(sum(delays_ns) / 1e9 + 0.5)
        self.bushd = self.start_bushd("again.jsonl")
        self.wait_until("LAM", lambda: self.bushctl("camac", 5, 0, 8, "--json").returncode == 0 and self.cycle(5, 0, 8)["q"])
        self.assertEqual(self.motors()["a0"]["position_steps"], STEPS)
        self.assertEqual(self.cycle(5, 3, 0)["data"], 0x10 | STEPS % 4 << 8)
        self.assertEqual(self.bushd.end(), 0)
        self.assertEqual(self.bushsim.end(), 0)
        made_ns = [edge.time_ns for edge in self.traced()["a0"]]
        self.assertEqual(len(made_ns), STEPS)
        due_ns = made_ns[0]
        for step in range(1, STEPS):
            due_ns += delays_ns[step]
            self.assertAlmostEqual(made_ns[step], due_ns, delta=SLOT_NS, msg=f"step {step}")

    def test_a_program_in_c_does_too(self):
        self.run_on_crate("ESONE_PROGRAM", "205")

    def test_a_program_in_fortran_does_too(self):
        self.run_on_crate("ESONE_PROGRAM_FORTRAN")

    def run_on_crate(self, name, *arguments):
        self.bring_up_crate()
        ran = self.run_program(program(name), *arguments)
        self.assertEqual(ran.returncode, 0, ran.stderr)
        self.assertEqual(self.motors()["a0"]["position_steps"], 205)
        self.assertEqual(self.bushd.end(), 0)
        self.assert_one_result_each()

    def test_programs_are_dumped_and_loaded(self):
        self.bring_up_crate()
        self.command("camac", "load", 5, 2, "bushd2-constant", "--steps", 513)
        memory = json.loads(self.command("camac", "dump", 5, "--json").stdout)["memory"]
        self.assertEqual(len(memory), 1024)
        self.assertEqual(memory[512:514], [1, 2])
        self.assertEqual(memory[514], 250)
        table = self.command("camac", "dump", 5, "--page", 2, "--f-start", 100).stdout
        self.assertIn("time_unit_ns = 40000", table)
        self.assertEqual(len(self.command("camac", "dump", 5).stdout.splitlines()), 64)
        self.python_reads(memory)
        for words, why in (
            (("5", "0"), "allowed: camac N A F"),
            (("5", "0", "x"), "x is no number 0..31"),
            (("5", "0", "40"), "40 is no number 0..31"),
        ):
            ran = self.bushctl("camac", *words)
            self.assertEqual(ran.returncode, 2, ran.stderr)
            self.assertIn(why, ran.stderr)
        ran = self.bushctl("camac", "--crate", "2", "5", "0", "0")
        self.assertEqual(ran.returncode, 1)
        self.assertIn("there is no crate 2", ran.stderr)
        ran = self.bushctl("camac", "load", "5", "0", "nobody")
        self.assertEqual(ran.returncode, 1)
        ran = self.bushctl("camac", "dump", "6")
        self.assertEqual(ran.returncode, 1)
        self.assertIn("X = 0", ran.stderr)

    def python_reads(self, memory):
        for how in ({}, {"lcm": True}):
            with bushd.connect(**how) as client:
                begun = client.camac([(5, 1, 16, 0), (9, 0, 0)])
                self.assertEqual(begun, bushd.CamacResult((bushd.CamacResponse(True, True, 0), bushd.CamacResponse(False, False, 0)), 2, 0))
                read = client.camac([(5, 0, 0)], mode="q-stop", count=1024)
                self.assertEqual([response.data for response in read.responses], memory)
                self.assertEqual(client.camac([(4, 0, 0)], mode="scan", count=20, last=(6, 15)).tally, 4)
                with self.assertRaisesRegex(bushd.Refused, "there is no crate 2"):
                    client.camac([(5, 0, 0)], crate=2)


if __name__ == "__main__":
    unittest.main()
