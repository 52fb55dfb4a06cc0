"""What the end-to-end tests share: the real programs in a folder and a network of their own.

A test waits for what it can see (a state, a line of a log, the end of a process), for as long as a slow machine may
need. The daemon and the simulated MCUs, however, live by the clock, as with a real bus: queues hold 0.3 s of motion,
and where the daemon does not get to run for that long, MCUs run down. So these two go before other programs.

Programs come from the environment (CMakeLists.txt); their network is made by tests/tools/with-loopback-multicast.
"""

import contextlib
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import tomllib
import unittest

TOP = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(TOP / "tools"))
from check_trace.trace import Trace  # a VCD reader that shares no code with what is tested

GIVE_UP_S = 120
TICK_US = 2560
TABLES = ["bushd2-constant", "bushd2-scurve", "bushd2-exponential", "bushd2-resonance"]
# a0 .. a3 on MCU 1, b0 .. b3 on MCU 2, each with another table. By name: (address, output).
MOTORS = {f"{'ab'[address - 1]}{output}": (address, output) for address in (1, 2) for output in range(4)}
FAR = 200_000  # 80 s: a move of so many steps is under way until something ends it
# Moving both ways, on both MCUs, by all four tables.
OUTWARD = {"a0": FAR, "a1": -FAR, "a2": FAR, "b1": FAR, "b3": -FAR}
TABLE_RUNS = ['moves = "table"']  # for a bus, in place of streams

# Children must reach the network of this test only, and the one that the configuration says.
os.environ.pop("LCM_DEFAULT_URL", None)


def program(name):
    return os.environ[name]


def configuration(port, displacement_format="fine", bus_lines=(), control="", lcm_lines=(), state=""):
    lines = ['[lcm]\nurl = "udpm://239.255.76.67:7667?ttl=0"\nprefix = "BUSHD"', *lcm_lines]
    lines += [f'[control]\npath = "{control}"', f'[state]\npath = "{state}"']
    lines += [f'[[bus]]\nname = "hall"\nport = "{port}"\nbaud = 500000\ntick_us = {TICK_US}']
    lines += [f'format = "{displacement_format}"', *bus_lines]
    lines += [f'[[mcu]]\nbus = "hall"\naddress = {address}' for address in (1, 2)]
    lines += [f'[[group]]\nname = "group{i}"\ntable = "{table}"' for i, table in enumerate(TABLES)]
    for name, (address, output) in MOTORS.items():
        lines += [f'[[motor]]\nname = "{name}"\nmcu = "hall:{address}"\noutput = {output}\ngroup = "group{output}"']
    return "\n".join(lines) + "\n"


def delays_before_end_us(table):
    """The shipped table's delays on the way down, the last one first."""
    content = tomllib.loads((TOP / "tables" / f"{table}.toml").read_text())
    decel = content["decel"][::-1] if "decel" in content else content["accel"]
    return [code * content["time_unit_ns"] / 1000 for code in decel]


def go_first(pid):
    """Before whatever else this PC does. A nice value counts among the processes of one session only (autogroups)."""
    try:
        os.sched_setscheduler(pid, os.SCHED_RR, os.sched_param(1))
    except PermissionError:
        with contextlib.suppress(PermissionError):
            os.setpriority(os.PRIO_PROCESS, pid, -15)


class Running:
    """A program under way; what it says goes to a file. `urgent`: before others, where that is allowed."""

    def __init__(self, command, log, urgent=False, env=None, stderr=None, stdin=subprocess.DEVNULL):
        """`stderr`: where that goes in place of the file."""
        self._log = log
        with open(log, "wb") as file:
            errors = file if stderr is None else stderr
            self.process = subprocess.Popen(command, stdin=stdin, stdout=file, stderr=errors, env=env)
        if urgent:
            go_first(self.process.pid)

    def wait_until_written(self):
        """Threads of bushd write lines: when they sleep, all that was told before is in its file."""
        give_up_s = time.monotonic() + GIVE_UP_S
        while any(self._threads_at_work()) and time.monotonic() < give_up_s:
            time.sleep(0.001)

    def _threads_at_work(self):
        for task in pathlib.Path(f"/proc/{self.process.pid}/task").glob("*/stat"):
            with contextlib.suppress(FileNotFoundError, ProcessLookupError):
                name, state = re.fullmatch(r"\d+ \((.*)\) (\S).*", task.read_text().strip()).groups()
                yield name == "lines" and state not in "SZX"

    def said(self):
        self.wait_until_written()
        return self._log.read_text(encoding="utf-8", errors="replace")

    def lives(self):
        return self.process.poll() is None

    def send(self, number):
        self.process.send_signal(number)

    def end(self, number=signal.SIGTERM):
        """Its exit code after this signal."""
        self.send(number)
        return self.process.wait(GIVE_UP_S)


class EndToEndTest(unittest.TestCase):
    def run(self, result=None):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="bushd-e2e-"))
        # For clients: the daemon of this test, and no other of this machine.
        os.environ["BUSHD_CONTROL"] = str(self.folder / "control")
        os.environ["RUNTIME_DIRECTORY"] = str(self.folder)
        self.programs = []
        result = result if result is not None else self.defaultTestResult()
        bad_before = len(result.failures) + len(result.errors)
        try:
            super().run(result)
        finally:
            for running in self.programs:
                running.process.kill()
                running.process.wait()
        if len(result.failures) + len(result.errors) > bad_before:
            self._show_files()
        shutil.rmtree(self.folder)
        return result

    def _show_files(self):
        for file in sorted([*self.folder.glob("*.log"), *self.folder.glob("*.jsonl")]):
            text = file.read_text(encoding="utf-8", errors="replace")
            print(f"--- {self.id()}: {file.name}", *text.splitlines()[-40:], sep="\n", file=sys.stderr)

    # -- programs

    def file(self, name):
        return self.folder / name

    def start(self, command, log, urgent=False, stdin=subprocess.DEVNULL):
        running = Running(command, self.file(log), urgent, stdin=stdin)
        self.programs.append(running)
        return running

    def write_config(self, displacement_format="fine", bus_lines=(), port="port", lcm_lines=(), state=""):
        text = configuration(self.file(port), displacement_format, bus_lines, self.file("control"), lcm_lines, state)
        self.file("bushd.toml").write_text(text)

    def start_bushsim(self, trace="trace.vcd", link="port", options=(), stdin=subprocess.DEVNULL):
        command = [program("BUSHSIM"), "--config", self.file("bushd.toml"), "--link", self.file(link), *map(str, options)]
        bushsim = self.start([*command, "--trace", self.file(trace)], f"bushsim-{len(self.programs)}.log", True, stdin)
        self.wait_until("bushsim to offer its port", lambda: "bushsim: ready" in bushsim.said())
        return bushsim

    def start_bushd(self, moves="moves.jsonl", config="bushd.toml"):
        command = [program("BUSHD"), "--config", self.file(config), "--move-log", self.file(moves)]
        return self.start(command, f"bushd-{len(self.programs)}.log", True)

    def bring_up(self, displacement_format="fine", bus_lines=(), port="port", links=("port",), lcm_lines=()):
        """`links`: the port's names, each time it is plugged in; `port` is how the configuration calls it."""
        self.write_config(displacement_format, bus_lines, port, lcm_lines)
        more = [word for link in links[1:] for word in ("--link", self.file(link))]
        self.bushsim = self.start_bushsim(link=links[0], options=more)
        self.bushd = self.start_bushd()
        self.wait_until_ready()

    def survey(self):
        """Somebody says that all motors stand at 0."""
        for name in MOTORS:
            self.command("set", name, "0")

    def run_program(self, *command):
        return subprocess.run(command, capture_output=True, text=True, timeout=GIVE_UP_S, check=False)

    def bushctl(self, *arguments):
        return self.run_program(program("BUSHCTL"), *map(str, arguments))

    def command(self, *arguments):
        """A bushctl command that must succeed."""
        ran = self.bushctl(*arguments)
        self.assertEqual(ran.returncode, 0, f"bushctl {arguments}: {ran.stdout}{ran.stderr}")
        return ran

    def start_bushctl(self, *arguments):
        return self.start([program("BUSHCTL"), *map(str, arguments)], f"bushctl-{len(self.programs)}.log")

    def start_move(self, *arguments):
        """bushctl move --wait, accepted and under way."""
        move = self.start_bushctl("move", "--wait", *arguments)
        self.wait_until("the move to be accepted", lambda: "accepted" in move.said() or not move.lives())
        self.assertTrue(move.lives(), move.said())
        return move

    def start_outward(self):
        """All of OUTWARD at full speed."""
        move = self.start_move(*[word for pair in OUTWARD.items() for word in pair])
        self.wait_until_travelled(600, *OUTWARD)
        return move

    # -- what can be seen

    def wait_until(self, what, holds):
        give_up_s = time.monotonic() + GIVE_UP_S
        while not holds():
            if time.monotonic() > give_up_s:
                self.fail(f"waited {GIVE_UP_S} s in vain for {what}; the last state: {self.status()}")
            time.sleep(0.02)

    def status(self):
        """As `bushctl status --json` has it; None if no daemon answers."""
        ran = self.bushctl("status", "--json")
        return json.loads(ran.stdout) if ran.returncode == 0 else None

    def motors(self):
        """The daemon's motors by name."""
        status = self.status()
        self.assertIsNotNone(status, "bushd is silent")
        return {motor["name"]: motor for motor in status["motors"]}

    def mcu_states(self):
        status = self.status()
        return None if status is None else [mcu["state"] for mcu in status["mcus"]]

    def positions(self):
        return {name: motor["position_steps"] for name, motor in self.motors().items()}

    def wait_until_ready(self):
        self.wait_until("both MCUs to be READY", lambda: self.mcu_states() == ["READY", "READY"])

    def wait_until_travelled(self, steps, *names):
        def travelled():
            motors = self.motors()
            return all(motors[name]["moving"] and abs(motors[name]["position_steps"]) >= steps for name in names)

        self.wait_until(f"{names} to be {steps} steps under way", travelled)

    def logged(self, log="moves.jsonl"):
        for running in self.programs:
            running.wait_until_written()
        return [json.loads(line) for line in self.file(log).read_text().splitlines()]

    def moves(self, log="moves.jsonl"):
        """What motors did, without who asked for it, and without runs that missed their start, as on a loaded machine: they made no step."""
        events = [event for event in self.logged(log) if event["event"] not in ("request", "requests")]
        late = {event["id"] for event in events if event["event"] == "result" and event["result"] == "late"}
        return [event for event in events if event.get("id") not in late]

    def assert_one_result_each(self, log="moves.jsonl"):
        events = self.moves(log)
        started = sorted((event["motor"], event["id"]) for event in events if event["event"] == "move")
        ended = sorted((event["motor"], event["id"]) for event in events if event["event"] == "result")
        self.assertEqual(started, ended)

    def traced(self, trace="trace.vcd"):
        """Edges by motor; only after bushsim has ended."""
        edges = Trace(self.file(trace)).edges
        return {name: edges.get(place, []) for name, place in MOTORS.items()}

    def traced_positions(self, trace="trace.vcd"):
        edges = self.traced(trace)
        return {name: sum(1 if edge.direction else -1 for edge in edges[name]) for name in MOTORS}

    def assert_way_back_shows_no_step_lost(self, moves="moves.jsonl", trust="known"):
        """Motors that went OUTWARD and were ended by a fault: they stand where the trace leads to, and their tables
        brought them to rest there; so they get back to where they began. Ends all programs."""
        found = self.motors()
        self.assertEqual({motor["trust"] for motor in found.values()}, {trust})
        self.assertEqual({motor["moving"] for motor in found.values()}, {False})
        # Each against its former direction, so that in the trace the two can be told apart.
        self.command("move", "--wait", *[word for name in OUTWARD for word in (name, "--to", "0")])
        self.assertEqual(set(self.positions().values()), {0})
        self.assertEqual(self.bushd.end(), 0)
        self.assertEqual(self.bushsim.end(), 0)

        edges = self.traced()
        for name, motor in found.items():
            outward = OUTWARD.get(name, FAR) > 0
            out = [edge for edge in edges[name] if edge.direction == outward]
            back = [edge for edge in edges[name] if edge.direction != outward]
            self.assertEqual(motor["position_steps"], len(out) if outward else -len(out), name)
            self.assertEqual(len(back), len(out), name)
            if name in OUTWARD:
                self.assertGreater(len(out), 600)
                self.assert_ran_down_by_table(out, motor["table"]["name"])
                self.assert_ran_down_by_table(back, motor["table"]["name"])
        self.assert_one_result_each(moves)

    def assert_ran_down_by_table(self, edges, table):
        """The times of the last steps before the end, against the table: each edge may lie a tick off."""
        delays_us = delays_before_end_us(table)
        end_us = edges[-1].time_ns / 1000
        before_us = 0
        for step, delay_us in enumerate(delays_us[: len(delays_us) - 1]):
            before_us += delay_us
            made_us = end_us - edges[-2 - step].time_ns / 1000
            self.assertAlmostEqual(made_us, before_us, delta=2 * TICK_US, msg=f"{table}, {step + 1} steps before")

    def assert_trace_is_right(self, positions):
        """Every edge lies where the tables say, and as many were made as bushctl said: positions."""
        self.file("status.json").write_text(json.dumps(positions))
        command = [sys.executable, "-B", TOP / "tools" / "check-trace", "--moves", self.file("moves.jsonl")]
        ran = self.run_program(*command, "--trace", self.file("trace.vcd"), "--positions", self.file("status.json"))
        self.assertEqual(ran.returncode, 0, ran.stdout + ran.stderr)
        summary = re.search(r"(\d+) steps commanded, (\d+) steps made", ran.stdout)
        self.assertEqual(summary[1], summary[2], ran.stdout)
        self.assertGreater(int(summary[2]), 0)
