"""The scenario of tools/demo: starts bushsim and bushd, moves 32 motors, has every edge checked."""

import argparse
import json
import os
import pathlib
import re
import signal
import subprocess
import sys
import time

TOP = pathlib.Path(__file__).resolve().parent.parent
BIN = TOP / "build" / "release" / "bin"
RUNS = TOP / "build" / "demo"
CHIPS = {  # image, and what runs it
    "atmega2560": ("avr/firmware/ports/atmega2560/bushd-atmega2560-500000.elf", "an ATmega2560 in simavr"),
}
RUNS_KEPT = 3

GROUPS = {
    "goniometer": "bushd2-constant",
    "slits": "bushd2-scurve",
    "monochromator": "bushd2-exponential",
    "filters": "bushd2-resonance",
}
MOTORS = [f"m{number:02}" for number in range(1, 33)]
MOTORS_PER_MCU = 16
STOPPED = "m07"
ON_LINE = {"m01": 9000, "m06": -4321, "m25": 6500, "m31": -777}  # of both MCUs, and each with another table
START_TIMEOUT_S = 20
STAGE_TIMEOUT_S = 60
END_TIMEOUT_S = 10

sys.dont_write_bytecode = True


class Failure(Exception):
    pass


def program(name):
    return os.environ.get(name.upper(), BIN / name)


def group_of(motor):
    # Four neighbours to a group, so that each group has motors on both MCUs.
    return list(GROUPS)[MOTORS.index(motor) // 4 % len(GROUPS)]


def configuration(options, port):
    # Not a control socket: that of a daemon of this machine stays as it is.
    lines = ["[lcm]", f'url = "{options.url}"', "", "[control]", 'path = ""', "", "[state]", 'path = ""', "", "[[bus]]", 'name = "hall"', f'port = "{port}"']
    # What an image has to deal with at once, when sixteen motors start, must fit into a tick.
    tick_us = 10240 if options.mcu in CHIPS else 2560
    lines += ["baud = 500000", f"tick_us = {tick_us}", f'format = "{options.format}"', ""]
    for address in (1, 2):
        lines += ["[[mcu]]", 'bus = "hall"', f"address = {address}", ""]
    for group, table in GROUPS.items():
        lines += ["[[group]]", f'name = "{group}"', f'table = "{table}"', ""]
    for index, motor in enumerate(MOTORS):
        mcu, output = 1 + index // MOTORS_PER_MCU, index % MOTORS_PER_MCU
        lines += ["[[motor]]", f'name = "{motor}"', f'mcu = "hall:{mcu}"', f"output = {output}"]
        lines += [f'group = "{group_of(motor)}"', ""]
    return "\n".join(lines)


class View:
    """What moves: a table that is drawn over itself in a terminal, a line a second elsewhere."""

    BAR = 6

    def __init__(self):
        self._tty = sys.stdout.isatty() and os.environ.get("TERM", "dumb") != "dumb"
        self._full, self._empty = "█░" if "utf" in (sys.stdout.encoding or "").lower() else "#."
        self._begin_s = time.monotonic()
        self._legs = {}  # motor: (from, to)
        self._drawn = 0
        self._next_line_s = 0

    def stage(self, text):
        print(f"\n{text}", flush=True)
        self._drawn = 0
        self._next_line_s = 0

    def show(self, motors, last=False):
        if self._tty:
            self._draw(motors)
        elif last or (time.monotonic() >= self._next_line_s and any(m["moving"] for m in motors)):
            self._next_line_s = time.monotonic() + 1
            self._print_line(motors)

    def _print_line(self, motors):
        moving = [motor for motor in motors if motor["moving"]]
        to_go = sum(abs(motor["target_steps"] - motor["position_steps"]) for motor in moving)
        some = "  ".join(f"{m['name']} {m['position_steps']:+6d}" for m in motors if m["output"] % 8 == 6)
        passed_s = time.monotonic() - self._begin_s
        print(f"  {passed_s:5.1f} s  {len(moving):2} moving, {to_go:6d} steps to go  {some}", flush=True)

    def _cell(self, motor):
        position, target = motor["position_steps"], motor["target_steps"]
        begin, end = self._legs.get(motor["name"], (position, None))
        if end != target:
            begin = position
        self._legs[motor["name"]] = (begin, target)
        part = (position - begin) / (target - begin) if target != begin else 1
        full = round(self.BAR * part)
        bar = self._full * full + self._empty * (self.BAR - full)
        return f"{motor['name']} {bar if motor['moving'] else ' ' * self.BAR} {position:+7d}"

    def _draw(self, motors):
        if self._drawn:
            print(f"\033[{self._drawn}A", end="")
        columns = [[m for m in motors if m["group"] == group] for group in GROUPS]
        lines = ["  " + "".join(f"{group:20}" for group in GROUPS).rstrip()]
        for row in zip(*columns):
            lines.append("  " + "  ".join(self._cell(motor) for motor in row))
        print("".join(f"{line}\033[K\n" for line in lines), end="", flush=True)
        self._drawn = len(lines)


class Demo:
    def __init__(self, options):
        self._options = options
        self._view = View()
        self._processes = {}
        RUNS.mkdir(parents=True, exist_ok=True)
        self.directory = RUNS / f"{time.strftime('%Y%m%d-%H%M%S')}-{os.getpid()}"
        self.directory.mkdir()

    def file(self, name):
        return self.directory / name

    # -- processes

    def start(self, name, *arguments):
        with open(self.file(f"{name}.log"), "wb") as log:
            command = [program(name), *map(str, arguments)]
            self._processes[name] = subprocess.Popen(command, stdout=log, stderr=subprocess.STDOUT)

    def still_run(self):
        for name, process in self._processes.items():
            if process.poll() is not None:
                raise Failure(f"{name} ended with exit code {process.returncode}")

    def end(self, name):
        """Politely: bushd ramps down, bushsim writes the rest of its trace."""
        process = self._processes.pop(name)
        process.terminate()
        try:
            if process.wait(END_TIMEOUT_S) != 0:
                raise Failure(f"{name} ended with exit code {process.returncode}")
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
            raise Failure(f"{name} did not end within {END_TIMEOUT_S} s of SIGTERM") from None

    def clean_up(self):
        for process in self._processes.values():
            process.kill()
            process.wait()

    def bushctl(self, *arguments):
        command = [program("bushctl"), *arguments, "--url", self._options.url]
        return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)

    def status(self):
        """The daemon's state, or None if it did not answer."""
        text = self.bushctl("status", "--json").communicate()[0]
        try:
            return json.loads(text)
        except ValueError:
            return None

    # -- the scenario

    def bring_up(self):
        port = self.file("port")
        config = self.file("bushd.toml")
        config.write_text(configuration(self._options, port), encoding="utf-8")
        mcu = []
        if self._options.mcu in CHIPS:
            image = TOP / "build" / CHIPS[self._options.mcu][0]
            mcu = ["--mcu", f"2={self._options.mcu}:{image}"]
        self.start("bushsim", "--config", config, "--link", port, "--trace", self.file("trace.vcd"), *mcu)
        self.wait_until("bushsim to offer its port", port.is_symlink)
        self.start("bushd", "--config", config, "--move-log", self.file("moves.jsonl"))
        self.wait_until("both MCUs to be READY", self._ready)

    def _ready(self):
        status = self.status()
        if status is None or len(status["motors"]) != len(MOTORS):
            return False
        return all(mcu["state"] == "READY" for mcu in status["mcus"])

    def wait_until(self, what, holds):
        give_up_s = time.monotonic() + START_TIMEOUT_S
        while not holds():
            self.still_run()
            if time.monotonic() > give_up_s:
                raise Failure(f"waited {START_TIMEOUT_S} s in vain for {what}")
            time.sleep(0.05)

    def stage(self, text, commands):
        """Runs bushctl commands (delay_s, exit code, arguments) side by side and shows what moves."""
        self._view.stage(text)
        begin_s = time.monotonic()
        waiting = sorted(commands)
        running = []
        while waiting or running:
            self.still_run()
            passed_s = time.monotonic() - begin_s
            if passed_s > STAGE_TIMEOUT_S:
                raise Failure(f"the moves did not end within {STAGE_TIMEOUT_S} s")
            while waiting and waiting[0][0] <= passed_s:
                _, code, arguments = waiting.pop(0)
                running.append((self.bushctl(*arguments), code, arguments))
            for entry in [entry for entry in running if entry[0].poll() is not None]:
                self._check_end(*entry)
                running.remove(entry)
            status = self.status()
            if status is not None:
                self._view.show(status["motors"])
            time.sleep(0.05)
        self._view.show(self.status_at_rest()["motors"], last=True)

    @staticmethod
    def _check_end(process, code, arguments):
        said = process.communicate()[0].strip()
        if process.returncode != code:
            command = " ".join(arguments)
            raise Failure(f"'bushctl {command}' ended with {process.returncode}, not {code}: {said}")

    def status_at_rest(self):
        status = None

        def at_rest():
            nonlocal status
            status = self.status()
            return status is not None and not any(motor["moving"] for motor in status["motors"])

        self.wait_until("all motors to be at rest", at_rest)
        return status

    def run(self):
        short = {motor: (-1) ** i * (40 + 13 * i) for i, motor in enumerate(MOTORS)}
        long = {motor: (-1) ** (i // 2) * (6000 + 2711 * i % 14000) for i, motor in enumerate(MOTORS)}
        long[STOPPED] = 30000

        def pairs(steps, motors):
            return [str(word) for motor in motors for word in (motor, steps[motor])]

        text = f"short moves: 32 motors in one group start, {min(map(abs, short.values()))} to"
        text += f" {max(map(abs, short.values()))} steps, both directions"
        self.stage(text, [(0, 0, ["move", "--wait", *pairs(short, MOTORS)])])

        commands = []
        for i, group in enumerate(GROUPS):
            members = [motor for motor in MOTORS if group_of(motor) == group and motor != STOPPED]
            commands.append((i, 0, ["move", "--wait", *pairs(long, members)]))
        commands.append((1.5, 1, ["move", "--wait", STOPPED, str(long[STOPPED])]))
        commands.append((5, 0, ["stop", STOPPED]))
        text = f"long moves: a group start for each of the four tables; {STOPPED} is stopped in flight"
        self.stage(text, commands)

        text = f"a straight line: {len(ON_LINE)} motors of both MCUs make the same shares of their ways at any time"
        self.stage(text, [(0, 0, ["move", "--line", "--wait", *pairs(ON_LINE, ON_LINE)])])

        home = [word for motor in MOTORS for word in (motor, "--to", "0")]
        self.stage("all 32 motors back to 0, in one group start", [(0, 0, ["move", "--wait", *home])])

    def cpu_percent(self):
        """The share that bushd takes, over its whole life."""
        stat = pathlib.Path(f"/proc/{self._processes['bushd'].pid}/stat").read_text(encoding="ascii")
        fields = stat.rsplit(")", 1)[1].split()
        hertz = os.sysconf("SC_CLK_TCK")
        used_s = (int(fields[11]) + int(fields[12])) / hertz
        lived_s = time.clock_gettime(time.CLOCK_BOOTTIME) - int(fields[19]) / hertz
        return 100 * used_s / lived_s

    def bring_down(self):
        status = self.status_at_rest()
        self.file("status.json").write_text(json.dumps(status), encoding="utf-8")
        print(f"\nbushd used {self.cpu_percent():.1f} % of a core", flush=True)
        self.end("bushd")
        self.end("bushsim")

    def check(self):
        print("checking every edge of the trace against the tables", flush=True)
        command = [sys.executable, TOP / "tools" / "check-trace", "--moves", self.file("moves.jsonl")]
        command += ["--trace", self.file("trace.vcd"), "--positions", self.file("status.json")]
        if self._options.mcu in CHIPS:
            command += ["--slots", "2=128"]
        result = subprocess.run(command, capture_output=True, text=True, check=False)
        self.file("check.log").write_text(result.stdout + result.stderr, encoding="utf-8")
        lines = result.stdout.splitlines()
        print("".join(f"  {line}\n" for line in lines[:-1]) + result.stderr, end="")
        if result.returncode != 0:
            raise Failure(f"check-trace found problems: {lines[-1] if lines else 'see above'}")
        expected = rf"{len(MOTORS)} motors, 2 MCUs, (\d+) steps commanded, \1 steps made, max edge error .*"
        if not re.fullmatch(expected, lines[-1]):
            raise Failure(f"not all was moved or checked: {lines[-1]}")
        moves = [json.loads(line) for line in self.file("moves.jsonl").read_text().splitlines()]
        stopped = {event["motor"] for event in moves if event.get("result") == "stopped"}
        if stopped != {STOPPED}:
            raise Failure(f"stopped were {sorted(stopped)}, to be stopped was {STOPPED}")
        on_line = {event["motor"] for event in moves if "line" in event and event["event"] == "move"}
        if on_line != set(ON_LINE):
            raise Failure(f"on a line were {sorted(on_line)}, to be on one were {sorted(ON_LINE)}")
        return lines[-1]

    def print_logs(self):
        for log in sorted(self.directory.glob("*.log")):
            print(f"--- the end of {log.relative_to(TOP)}", file=sys.stderr)
            text = log.read_text(encoding="utf-8", errors="replace")
            print("\n".join(text.splitlines()[-20:]), file=sys.stderr)


def forget_old_runs():
    """A trace has tens of megabytes."""
    runs = sorted(path for path in RUNS.iterdir() if re.fullmatch(r"\d{8}-\d{6}-\d+", path.name))
    for run in runs[:-RUNS_KEPT]:
        for file in run.iterdir():
            file.unlink()
        run.rmdir()


def main():
    parser = argparse.ArgumentParser(prog="tools/demo")
    parser.add_argument("--format", choices=("fine", "coarse"), default="fine", help="of displacements")
    parser.add_argument("--mcu", choices=("virtual", *CHIPS), default="virtual", help="what the second one is")
    parser.add_argument("--url", default="udpm://239.255.76.67:7667?ttl=0", help="of LCM")
    options = parser.parse_args()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # so that clean_up is not left out
    demo = Demo(options)
    forget_old_runs()
    mcus = f"a virtual MCU and {CHIPS[options.mcu][1]}" if options.mcu in CHIPS else "2 virtual MCUs"
    print(f"demo: 32 motors on {mcus}, 500000 baud, {options.format} displacements")
    print(f"demo: all files of this run are in {demo.directory.relative_to(TOP)}", flush=True)
    try:
        demo.bring_up()
        demo.run()
        demo.bring_down()
        result = demo.check()
    except Failure as failure:
        demo.print_logs()
        print(f"demo: FAILED: {failure}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("\ndemo: interrupted", file=sys.stderr)
        return 130
    finally:
        demo.clean_up()
    print(f"demo: {result}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
