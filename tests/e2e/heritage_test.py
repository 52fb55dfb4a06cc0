"""The commands of docs/heritage.md, section by section, and what comes of them."""

import json
import os
import pathlib
import re
import subprocess
import sys
import unittest

from rig import TOP, EndToEndTest, Running, program

PAGE = TOP / "docs/heritage.md"
SOCKET = "/tmp/bushd-control"


def sections():
    """By heading: its files by name, and its commands."""
    found = {}
    for section in PAGE.read_text().split("\n## ")[1:]:
        heading, body = section.split("\n", 1)
        files = {}
        for before, text in re.findall(r"([^\n]*)\n\n```toml\n(.*?)```\n", body, re.DOTALL):
            files[re.search(r"`([^`]+)`:$", before)[1]] = text
        consoles = re.findall(r"```console\n(.*?)```\n", body, re.DOTALL)
        commands = [line for text in consoles for line in re.findall(r"^\$ (.*)$", text, re.MULTILINE)]
        # The tests' programs have that from the rig.
        found[heading] = files, [command for command in commands if command != f"export BUSHD_CONTROL={SOCKET}"]
    return found


class Heritage(EndToEndTest):
    def shell(self, command, log):
        self.environment = dict(os.environ, LC_ALL="C.UTF-8")
        folders = [str(pathlib.Path(program(name)).parent) for name in ("BUSHD", "BUSHSIM", "BUSHCTL", "BUSHTAB")]
        path = ":".join([*folders, self.environment["PATH"]])
        return ["env", f"PATH={path}", "bash", "-c", f"cd {self.folder}; exec 2>&1; {command}"], self.file(log)

    def write_files(self, files):
        """As on the page, but for a socket that no other daemon has."""
        for name, text in files.items():
            self.assertIn(f'[control]\npath = "{SOCKET}"\n', text)
            self.file(name).write_text(text.replace(SOCKET, str(self.file("control"))))

    def run_section(self, heading, with_image=""):
        """All its commands; those with & behind them live on. `with_image`: what bushsim is told beside what is shown."""
        files, commands = sections()[heading]
        self.write_files(files)
        for number, command in enumerate(commands):
            if with_image and command.startswith("bushsim "):
                command = command.replace(" &", f" {with_image} &")
            if command.endswith(" &"):
                # exec: a signal reaches the program, not its shell.
                self.before = self.bushctl("status", "--json").returncode == 0 and self.positions()
                running = Running(*self.shell(f"exec {command[:-2]}", f"{number}.log"), urgent=True)
                self.programs.append(running)
                self.wait_for_start(command, running)
                continue
            line, log = self.shell(command, f"{number}.log")
            done = subprocess.run(line, capture_output=True, text=True, timeout=120, stdin=subprocess.DEVNULL)
            log.write_text(done.stdout)
            self.assertEqual(done.returncode, 0, f"{command}\n{done.stdout}")

    def wait_for_start(self, command, running):
        name = command.split()[0]
        if name == "bushsim":
            self.wait_until("bushsim", lambda: "bushsim: ready" in running.said())
        elif name == "bushd":
            self.wait_until("the MCU to be READY", lambda: self.mcu_states() == ["READY"])
        else:
            self.wait_until(command, lambda: self.positions() != self.before or not running.lives())

    def position(self, motor):
        return self.motors()[motor]["position_steps"]

    def test_plc_profiles(self):
        self.run_section("PLC profiles")
        self.wait_until("feed to rest", lambda: self.motors()["feed"]["activity"] == "rest")
        # To 3000, and the envelope on to 6000. There the jog began, and was stopped at once: 500 steps and what it had made by then.
        self.assertGreaterEqual(self.position("feed"), 6500)
        self.assertLess(self.position("feed"), 30000)
        jog = self.programs[-1]
        self.assertRegex(jog.said(), "500 steps after the stop event")

    def test_commutator_boards(self):
        self.moves_motors_of_a_board()

    def test_commutator_board_that_one_can_build(self):
        image = pathlib.Path(os.environ.get("COMMUTATOR_IMAGE", ""))
        if not image.is_file():
            self.skipTest("no image of a commutator board")
        os.symlink(image, self.file(image.name))
        words = f"--mcu 1=atmega328p:{image.name}"
        self.assertIn(f"`{words}`", PAGE.read_text())
        self.moves_motors_of_a_board(words)

    def moves_motors_of_a_board(self, with_image=""):
        self.run_section("Commutator boards", with_image)
        self.wait_until("m5 to come", lambda: self.position("m5") == 300)
        self.assertEqual(self.position("m0"), 400)
        self.assertEqual(self.programs[1].end(), 0)
        self.assertEqual(self.programs[0].end(), 0)
        self.assertIn("step0 400 (at +400), step5 300 (at +300)", self.programs[0].said())
        words = "tools/check-pulses --bus board --moves moves.jsonl --trace board.vcd"
        self.assertIn(words, (TOP / "docs" / "heritage.md").read_text())
        judge, *arguments = words.split()
        judged = subprocess.run(
            [sys.executable, "-B", TOP / judge, *arguments], cwd=self.folder, capture_output=True, text=True, check=False
        )
        self.assertEqual(judged.returncode, 0, judged.stdout + judged.stderr)
        self.assertIn("2 runs, 700 steps", judged.stdout)

    def test_voltage_to_frequency_converter(self):
        self.moves_a_motor_by_a_converter()

    def test_converter_at_a_board_that_one_can_build(self):
        image = pathlib.Path(os.environ.get("CONVERTER_IMAGE", ""))
        if not image.is_file():
            self.skipTest("no image of a board with a converter")
        os.symlink(image, self.file(image.name))
        words = f"--mcu 1=atmega328p:{image.name}"
        self.assertIn(f"`{words}`", PAGE.read_text())
        self.moves_a_motor_by_a_converter(words)

    def moves_a_motor_by_a_converter(self, with_image=""):
        self.run_section("Voltage-to-frequency converter", with_image)
        self.assertEqual((self.position("m0"), self.position("m5")), (400, -150))
        self.assertEqual(self.programs[1].end(), 0)
        self.assertEqual(self.programs[0].end(), 0)
        self.assertIn("step0 400 (at +400), step5 150 (at -150)", self.programs[0].said())
        judge = [sys.executable, "-B", TOP / "tools/check-pulses", "--bus", "board", "--moves", "moves.jsonl", "--trace", "board.vcd"]
        judged = subprocess.run(judge, cwd=self.folder, capture_output=True, text=True, check=False)
        self.assertEqual(judged.returncode, 0, judged.stdout + judged.stderr)
        self.assertIn("2 runs, 550 steps", judged.stdout)

    def test_keypads(self):
        files, commands = sections()["Keypads"]
        self.write_files(files)
        for number, command in enumerate(commands[:2]):
            self.programs.append(Running(*self.shell(f"exec {command[:-2]}", f"{number}.log")))
            self.wait_for_start(command, self.programs[-1])
        line, log = self.shell(f"exec {commands[2]}", "keypad.log")
        with log.open("wb") as shown:
            keypad = subprocess.Popen(line, stdin=subprocess.PIPE, stdout=shown, stderr=shown)
        self.addCleanup(keypad.kill)

        def press(key):
            keypad.stdin.write(key.encode())
            keypad.stdin.flush()

        self.wait_until("the keypad's port", lambda: "0300" in log.read_text())
        press("s")
        self.wait_until("the display", lambda: "0330" in log.read_text())
        press("f")
        self.wait_until("theta to move", lambda: self.position("theta") > 300)
        press("r")
        self.wait_until("theta to come back", lambda: self.position("theta") < 0)
        press("x")
        self.wait_until("theta to rest", lambda: self.motors()["theta"]["activity"] == "rest")
        self.assertEqual(self.motors()["theta"]["trust"], "uncertain")  # neither set nor homed
        press("f")
        self.wait_until("theta to move", lambda: self.motors()["theta"]["moving"])
        # Its port is gone.
        keypad.stdin.close()
        self.assertEqual(keypad.wait(60), 0)
        self.wait_until("theta to rest", lambda: self.motors()["theta"]["activity"] == "rest")
        self.assertTrue(self.programs[1].lives())

    def test_panel_at_an_mcu(self):
        files, commands = sections()["Keypads"]
        self.write_files(files)
        simulate, serve, status = commands[3:]
        line, log = self.shell(f"exec {simulate}", "panel.log")
        with log.open("wb") as shown:
            panel = subprocess.Popen(line, stdin=subprocess.PIPE, stdout=shown, stderr=shown)
        self.addCleanup(panel.kill)
        self.wait_until("bushsim", lambda: "bushsim: ready" in log.read_text())
        self.programs.append(Running(*self.shell(f"exec {serve[:-2]}", "bushd.log")))
        self.wait_for_start(serve, self.programs[-1])

        def press(key):
            panel.stdin.write(key.encode())
            panel.stdin.flush()

        def rests():
            return self.motors()["theta"]["activity"] == "rest"

        press("F")
        self.wait_until("theta to move", lambda: self.position("theta") > 300)
        self.assertEqual(self.motors()["theta"]["activity"], "local")
        shown = subprocess.run(self.shell(status, "")[0], capture_output=True, text=True, check=True, env=self.environment)
        self.assertRegex(shown.stdout, r"theta .* local")
        press("X")
        self.wait_until("theta to rest", rests)
        press("sr")
        self.wait_until("theta to come back", lambda: self.position("theta") < 0)
        press("x")
        self.wait_until("theta to rest", rests)
        self.assertEqual(re.findall(r"^[-0-9]{4}$", log.read_text(), re.MULTILINE), ["0330", "0330"])
        # Nobody types any more.
        press("F")
        self.wait_until("theta to move", lambda: not rests())
        panel.stdin.close()
        self.wait_until("theta to rest", rests)
        panel.terminate()
        self.assertEqual(panel.wait(60), 0)

    def test_one_unipolar_motor_with_chopper(self):
        image = pathlib.Path(os.environ.get("ATMEGA1284P_IMAGE", ""))
        if not image.is_file():
            self.skipTest("no image for the ATmega1284P")
        os.symlink(image, self.file(image.name))
        self.run_section("One unipolar motor with chopper")
        self.assertEqual(self.position("axis"), 2000)
        settings = json.loads(self.bushctl("config", "axis", "--json").stdout)["settings"]
        now = {setting["key"]: setting["value"] for setting in settings}
        self.assertEqual(now["velocity"], "{ min_steps_per_s = 100, max_steps_per_s = 2000, steps_per_s2 = 800 }")
        self.assertEqual(now["currents"], '{ ramp_ma = 1200, cruise_ma = 800, hold_ma = 300, decay = "fast" }')
        for name in (1, 0):
            self.assertEqual(self.programs[name].end(), 0)
        trace = self.file("chopper.vcd").read_text()
        names = dict(re.findall(r"\$var \w+ \d+ (\S+) (\S+)", trace))
        names = {name: code for code, name in names.items()}
        currents = [float(value) for value in re.findall(rf"^r(\S+) {re.escape(names['current0_a'])}$", trace, re.MULTILINE)]
        # The chopper cuts at 1.2 A in the ramps, within 5 %, and the supply of 24 V would drive 9.6 A without it.
        self.assertGreater(max(currents), 0.95 * 1.2)
        self.assertLess(max(currents), 1.05 * 1.2)
        for phase in range(4):
            self.assertGreater(len(re.findall(rf"^1{re.escape(names[f'step{phase}'])}$", trace, re.MULTILINE)), 400)


if __name__ == "__main__":
    unittest.main()
