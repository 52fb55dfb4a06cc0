#!/usr/bin/env python3
"""A serial port as motion controller, as a user has it: bushd, bushctl, and a drive behind a pty that bushsim plays."""

import pathlib
import re
import signal
import sys
import unittest

from rig import TOP, EndToEndTest, program

CONFIG = """
[lcm]
url = "udpm://239.255.76.67:7667?ttl=0"
[control]
path = "{control}"
[state]
path = ""
[[bus]]
name = "com1"
kind = "serial-pulse"
port = "{port}"
direction_line = "dtr"
inputs = {{ home = "cd", positive = "dsr", negative = "cts" }}
[[group]]
name = "table"
table = "bushd2-constant"
[[motor]]
name = "x"
mcu = "com1"
group = "table"
home = {{ direction = "negative", most_steps = 3000 }}
"""


SECOND = """
[[bus]]
name = "com2"
kind = "serial-pulse"
port = "{port}"
direction_line = "rts"
[[motor]]
name = "y"
mcu = "com2"
group = "table"
"""


def waited_for_a_cpu_ms(pid):
    """All threads of a process, since it began, as Linux counts it."""
    stats = pathlib.Path(f"/proc/{pid}/task").glob("*/schedstat")
    return sum(int(stat.read_text().split()[1]) for stat in stats) / 1e6


class SerialPulse(EndToEndTest):
    def begin(self, *options):
        self.file("bushd.toml").write_text(CONFIG.format(port=self.file("port"), control=self.file("control")))
        self.bushsim = self.start_bushsim(options=options)
        self.bushd = self.start_bushd()
        self.wait_until_online()
        self.command("set", "x", "0")

    def wait_until_online(self):
        self.wait_until("the port to be READY", lambda: self.mcu_states() == ["READY"])

    def x(self):
        return self.motors()["x"]

    def wait_until_beyond(self, steps):
        self.wait_until(f"x to be beyond {steps}", lambda: abs(self.x()["position_steps"]) > steps)

    def end(self):
        """What bushsim says that it made."""
        self.assertEqual(self.bushd.end(), 0, self.bushd.said())
        self.assertEqual(self.bushsim.end(), 0)
        summary = re.search(r"(\d+) steps made: step0 \d+ \(at ([+-]\d+)\).* amid bytes: (\d+)", self.bushsim.said())
        self.assertEqual(summary[3], "0", summary[0])
        return int(summary[1]), int(summary[2])

    def check_pulses(self):
        command = [sys.executable, "-B", TOP / "tools" / "check-pulses", "--bus", "com1"]
        ran = self.run_program(*command, "--moves", self.file("moves.jsonl"), "--trace", self.file("trace.vcd"))
        self.assertEqual(ran.returncode, 0, ran.stdout + ran.stderr)
        print(ran.stdout, end="")

    def test_moves_stops_and_meets_its_limit(self):
        self.begin("--switch", "1.0:1@+2500")
        self.command("move", "--wait", "x", "1203")
        self.assertEqual(self.x()["position_steps"], 1203)
        self.command("move", "--wait", "x", "--to", "-4")
        move = self.start_move("x", "-100000")
        self.wait_until_beyond(1500)
        self.command("stop", "x")
        self.assertEqual(move.process.wait(60), 1)
        stopped = self.x()["position_steps"]
        self.assertGreater(stopped, -20000)
        self.command("move", "--wait", "x", "--to", "0")
        limited = self.bushctl("move", "--wait", "x", "9000")
        self.assertIn("positive end", limited.stdout + limited.stderr)
        self.assertGreaterEqual(self.x()["position_steps"], 2500)
        self.command("move", "--wait", "x", "-100")
        last = self.x()["position_steps"]
        self.assertEqual(self.end()[1], last)
        self.check_pulses()

    def test_homes_to_the_step_of_its_switch(self):
        self.begin("--switch", "1.0:0@-300")
        self.command("home", "--wait", "x")
        self.assertEqual(self.x()["position_steps"], 0)
        self.assertEqual(self.x()["trust"], "known")
        self.assertEqual(self.end()[1], -300)

    def test_unplugged_in_motion_it_says_how_many_steps_may_be_missing(self):
        self.begin()
        move = self.start_move("x", "100000")
        self.wait_until_beyond(1000)
        self.bushsim.send(signal.SIGUSR1)
        self.assertEqual(move.process.wait(60), 1)
        self.bushsim.send(signal.SIGUSR2)
        self.wait_until_online()
        x = self.x()
        self.assertEqual(x["trust"], "uncertain")
        most = int(re.search(r"while (\d+) steps were under way: as many may be missing", self.bushd.said())[1])
        made, position = self.end()
        self.assertLessEqual(abs(position - x["position_steps"]), most)
        self.assertGreater(made, 1000)

    def begin_two(self):
        both = CONFIG.format(port=self.file("port"), control=self.file("control"))
        self.file("bushd.toml").write_text(both + SECOND.format(port=self.file("port2")))
        self.bushsim = self.start_bushsim(options=("--bus", "com1"))
        command = [program("BUSHSIM"), "--config", self.file("bushd.toml"), "--bus", "com2"]
        command += ["--link", self.file("port2"), "--trace", self.file("second.vcd")]
        self.second = self.start(command, "bushsim-second.log", True)
        self.wait_until("the second bushsim to offer its port", lambda: "bushsim: ready" in self.second.said())
        self.bushd = self.start_bushd()
        self.wait_until("the ports to be READY", lambda: self.mcu_states() == ["READY", "READY"])
        for motor in "xy":
            self.command("set", motor, "0")

    def apart_ms(self, said):
        found = re.search(r"the ports were at most ([0-9.]+) ms apart", said)
        self.assertTrue(found, said)
        return float(found[1])

    def test_two_ports_move_along_lines(self):
        self.begin_two()
        apart = []
        for x, y in ((900, 611), (-1500, 40), (7, -700)):
            apart.append(self.apart_ms(self.command("move", "--line", "--wait", "x", x, "y", y).stdout))
        self.assertEqual([self.motors()[name]["position_steps"] for name in "xy"], [-593, -49])
        line = self.start_move("--line", "x", "-40000", "y", "20000")
        self.wait_until_beyond(1500)
        self.assertIn("ms ahead of the slowest port; ports were at most", self.command("status").stdout)
        self.command("stop", "y")
        self.assertEqual(line.process.wait(60), 1)
        apart.append(self.apart_ms(line.said()))
        ends = [self.motors()[name]["position_steps"] for name in "xy"]
        waited_ms = sum(waited_for_a_cpu_ms(each.process.pid) for each in (self.bushd, self.bushsim, self.second))
        self.assertEqual(self.second.end(), 0)
        self.assertEqual(self.end()[1], ends[0])
        self.assertIn(f"(at {ends[1]:+})", self.second.said())
        command = [sys.executable, "-B", TOP / "tools" / "check-pulses", "--bus", "com1", "--moves", self.file("moves.jsonl")]
        command += ["--trace", self.file("trace.vcd"), "--other", f"com2={self.file('second.vcd')}"]
        # What bushd says of its ports is true of when it writes. A virtual drive takes bytes for written when it reads them, which is
        # later by no more than it, or bushd, waited for a CPU meanwhile; and no more than both did in all.
        ran = self.run_program(*command, "--apart-ms", str(max(apart) + waited_ms))
        self.assertEqual(ran.returncode, 0, ran.stdout + ran.stderr)
        print(apart, waited_ms, ran.stdout, end="")

    def test_the_commands_of_the_document(self):
        document = (TOP / "docs" / "heritage.md").read_text()
        block = document.split("<!-- serial-pulse: begin -->")[1].split("<!-- serial-pulse: end -->")[0]
        export, bushsim, bushd, bushctl = [line.strip().rstrip("& ") for line in block.strip().splitlines()]
        config = TOP / "tools" / "examples" / "serial-pulse.toml"
        text = config.read_text()
        self.assertIn(f'path = "{export.removeprefix("export BUSHD_CONTROL=")}"', text)
        self.file("x.toml").write_text(text.replace("/tmp/bushd-com1", str(self.file("port"))).replace("/tmp/bushd-control", str(self.file("control"))))

        def here(command):
            command = command.replace("tools/examples/serial-pulse.toml", str(self.file("x.toml")))
            words = command.replace("/tmp/bushd-com1", str(self.file("port"))).split()
            return [program(words[0].removeprefix("build/release/bin/").upper()), *words[1:]]

        self.bushsim = self.start(here(bushsim), "bushsim.log", True)
        self.wait_until("bushsim to offer its port", lambda: "bushsim: ready" in self.bushsim.said())
        self.bushd = self.start(here(bushd), "bushd.log", True)
        self.wait_until_online()
        ran = self.run_program(*here(bushctl))
        self.assertEqual(ran.returncode, 0, ran.stdout + ran.stderr)
        self.assertEqual(self.x()["trust"], "known")
        self.assertEqual(self.end()[1], -300)


if __name__ == "__main__":
    unittest.main()
