#!/usr/bin/env python3
"""What users wait for: from a request to the beginning of its run, and from the last edge of STEP to the result.

  tools/bench --latency [--moves N]

bushd, bushsim behind a pty, and a client of the control socket by lib/python. All three know CLOCK_MONOTONIC: the client
takes it when it calls and when the call returns, and the head of bushsim's trace says when time 0 of its edges was.
The run begins where the table's first delay does: so long before the first edge.

Programs are those of $BUSHD and $BUSHSIM, else of build/release/bin. Nothing is left behind; any user may run it.
"""

import argparse
import bisect
import collections
import contextlib
import ctypes
import math
import os
import pathlib
import random
import re
import signal
import subprocess
import sys
import tempfile
import time
import tomllib

TOP = pathlib.Path(__file__).resolve().parents[2]
BIN = TOP / "build" / "release" / "bin"
sys.dont_write_bytecode = True
sys.path.insert(0, str(TOP / "tools"))
import bushd
from check_trace.trace import Trace

BAUD = 500_000
BITS_PER_BYTE = 10
TICK_US = 2560
TABLE = "bushd2-constant"
# By name: (address, output).
TWO_MCUS = {f"m{output:02}": (1, output) for output in range(16)} | {"n00": (2, 0)}
EIGHT_MCUS = {f"w{address}": (address, 0) for address in range(1, 9)}
STEPS = 4
# A request comes whenever it does: this long after the result before at most, which is twice the time between polls.
MOST_PAUSE_S = 0.1
BIT_ERRORS = "1e-4"
SEED = 1
GIVE_UP_S = 60
MOST_REST_S = 20
WIDTH = 42


class Failure(Exception):
    pass


def first_delay_ns():
    table = tomllib.loads((TOP / "tables" / f"{TABLE}.toml").read_text())
    return table["accel"][0] * table["time_unit_ns"]


def configuration(folder, motors):
    lines = ['[lcm]\nurl = "memq://"', f'[control]\npath = "{folder / "control"}"', '[state]\npath = ""']
    lines += [f'[[bus]]\nname = "hall"\nport = "{folder / "port"}"\nbaud = {BAUD}\ntick_us = {TICK_US}\nformat = "fine"']
    lines += [f'[[mcu]]\nbus = "hall"\naddress = {address}' for address in sorted({address for address, _ in motors.values()})]
    lines += [f'[[group]]\nname = "all"\ntable = "{TABLE}"']
    for name, (address, output) in motors.items():
        lines += [f'[[motor]]\nname = "{name}"\nmcu = "hall:{address}"\noutput = {output}\ngroup = "all"']
    return "\n".join(lines) + "\n"


def in_real_time(on):
    """This thread, and what it starts from now on, before other programs: whether it may."""
    try:
        os.sched_setscheduler(0, *((os.SCHED_RR, os.sched_param(1)) if on else (os.SCHED_OTHER, os.sched_param(0))))
    except PermissionError:
        return False
    return True


def until(what, holds):
    give_up_s = time.monotonic() + GIVE_UP_S
    while not (found := holds()):
        if time.monotonic() > give_up_s:
            raise Failure(f"waited {GIVE_UP_S} s in vain for {what}")
        time.sleep(0.02)
    return found


def cpu_s(pid):
    clock = ctypes.c_int()
    if ctypes.CDLL(None).clock_getcpuclockid(pid, ctypes.byref(clock)) != 0:
        raise Failure("its CPU time cannot be read")
    return time.clock_gettime(clock.value)


def bytes_through(pid):
    """(read, written) by this process. An idle bushsim reads and writes nothing but the bytes of its line."""
    text = pathlib.Path(f"/proc/{pid}/io").read_text()
    return tuple(int(re.search(rf"{name}: (\d+)", text)[1]) for name in ("rchar", "wchar"))


def end(process):
    if process.poll() is not None:
        return
    process.terminate()
    try:
        process.wait(GIVE_UP_S)
    except BaseException:
        process.kill()
        process.wait()
        raise


class World:
    """A bus of virtual MCUs, a daemon and a client; and afterwards the edges."""

    def __init__(self, motors, *options):
        self.motors = motors
        self._options = options
        self._processes = []

    def __enter__(self):
        self._stack = contextlib.ExitStack()
        try:
            self._folder = pathlib.Path(self._stack.enter_context(tempfile.TemporaryDirectory(prefix="bushd-latency-")))
            self.control = self._folder / "control"
            self._stack.callback(in_real_time, False)
            in_real_time(True)
            self._begin()
        except BaseException:
            self._stack.close()
            raise
        return self

    def __exit__(self, *_):
        self._stack.close()

    def _start(self, name, *arguments):
        log = self._folder / f"{name}.log"
        command = [os.environ.get(name.upper(), BIN / name), "--config", self._folder / "bushd.toml", *arguments]
        with open(log, "wb") as file:
            process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=file, stderr=subprocess.STDOUT)
        self._processes.append(process)
        self._stack.callback(end, process)
        return process, log

    def _alive(self):
        for process in self._processes:
            if process.poll() is not None:
                logs = "\n".join(path.read_text() for path in self._folder.glob("*.log"))
                raise Failure(f"{process.args[0]} has ended with {process.returncode}:\n{logs}")

    def _begin(self):
        (self._folder / "bushd.toml").write_text(configuration(self._folder, self.motors))
        self._trace = self._folder / "trace.vcd"
        arguments = ["--link", self._folder / "port", "--trace", self._trace, *self._options]
        self._bushsim, self._said = self._start("bushsim", *arguments)
        until("bushsim", lambda: self._alive() or "bushsim: ready" in self._said.read_text())
        self._bushd, _ = self._start("bushd")
        self.client = self._stack.enter_context(until("bushd", self._connected))
        self.wait_until_ready()
        self.client.set_position(dict.fromkeys(self.motors, 0), dial=True)

    def _connected(self):
        self._alive()
        with contextlib.suppress(bushd.NoDaemon):
            return bushd.connect(self.control)

    def wait_until_ready(self):
        until("all MCUs to be READY", self._ready)

    def _ready(self):
        self._alive()
        return all(mcu.state == bushd.McuState.READY for mcu in self.client.status().mcus.values())

    def end(self):
        """The edges of each motor, ns of CLOCK_MONOTONIC; no more moves."""
        self.client.close()
        in_real_time(False)
        # bushd first, which ramps down; bushsim writes the rest of its trace.
        for process in reversed(self._processes):
            end(process)
        self.collisions = int(re.search(r"collisions (\d+)", self._said.read_text())[1])
        with open(self._trace, encoding="ascii") as file:
            begin_ns = int(re.search(r"time 0 is (\d+) ns of CLOCK_MONOTONIC", file.read(1000))[1])
        edges = Trace(self._trace).edges
        return {name: [edge.time_ns + begin_ns for edge in edges.get(place, [])] for name, place in self.motors.items()}

    def at_rest(self, seconds):
        """(bytes of requests, bytes of answers, CPU seconds of bushd, seconds)"""
        before = *bytes_through(self._bushsim.pid), cpu_s(self._bushd.pid), time.monotonic()
        time.sleep(seconds)
        after = *bytes_through(self._bushsim.pid), cpu_s(self._bushd.pid), time.monotonic()
        return tuple(then - now for now, then in zip(before, after))


class Case:
    """The same request, many times."""

    def __init__(self, name, by, line=False):
        self._name = name
        self._by = by
        self._line = line
        self._calls = []  # (begin, end) of those that reached their target
        self._asked = 0
        self._failures = collections.Counter()

    def run(self, world, moves):
        ask = world.client.move_line if self._line else world.client.move
        chance = random.Random(SEED)
        for _ in range(moves):
            time.sleep(chance.uniform(0, MOST_PAUSE_S))
            self._asked += 1
            begin_ns = time.monotonic_ns()
            try:
                result = ask(by=self._by, check=False)
            except bushd.Refused as error:
                self._failed(world, str(error))
                continue
            end_ns = time.monotonic_ns()
            if result.outcome == bushd.Outcome.REACHED:
                self._calls.append((begin_ns, end_ns))
            else:
                self._failed(world, f"{result.outcome.value}: {result.reason}")

    def _failed(self, world, why):
        """The next one is asked for when it can be carried out."""
        self._failures[why] += 1
        world.wait_until_ready()

    def row(self, edges):
        to_begin, to_result = [], []
        for begin_ns, end_ns in self._calls:
            made = []
            for name, steps in self._by.items():
                mine = edges[name][bisect.bisect_left(edges[name], begin_ns) : bisect.bisect_right(edges[name], end_ns)]
                if len(mine) != steps:
                    raise Failure(f"{self._name}: {name} was to make {steps} steps, and the trace has {len(mine)}")
                made += [mine[0], mine[-1]]
            to_begin.append(min(made) - first_delay_ns() - begin_ns)
            to_result.append(end_ns - max(made))
        figures = "".join(f"{value:8.1f}" for times in (to_begin, to_result) for value in percentiles_ms(times))
        print(f"{self._name:{WIDTH}}{figures}{len(self._calls):8} of {self._asked}")
        for why, times in self._failures.items():
            print(f"  {times} x {why}")
        sys.stdout.flush()


def percentiles_ms(times_ns):
    """50, 90 and 99 of 100 times are no longer than this."""
    times_ns = sorted(times_ns)
    return [times_ns[math.ceil(share * len(times_ns)) - 1] / 1e6 if times_ns else math.nan for share in (0.5, 0.9, 0.99)]


def header():
    print(f"{'ms':{WIDTH}}{'request to beginning':>24}{'last edge to result':>24}  reached")
    print(" " * WIDTH + "".join(f"{percent:>8}" for percent in ("p50", "p90", "p99") * 2), flush=True)


def scan(client, moves):
    """Steps one by one, each waited for."""
    begin_s = time.monotonic()
    reached = sum(client.move("m00", by=1, check=False).outcome == bushd.Outcome.REACHED for _ in range(moves))
    return f"step scan, one motor: {moves / (time.monotonic() - begin_s):.1f} points/s; {reached} of {moves} reached"


def rest(world, seconds):
    asked, answered, cpu, passed = world.at_rest(seconds)
    requests, answers = (100 * count * BITS_PER_BYTE / (BAUD * passed) for count in (asked, answered))
    return (
        f"at rest, 2 MCUs: line busy {requests + answers:.2f} % (requests {requests:.2f} %, answers {answers:.2f} %); "
        f"bushd {cpu / passed:.4f} s of CPU a second"
    )


def measure(moves):
    one = {"m00": STEPS}
    sixteen = {name: STEPS for name, (address, _) in TWO_MCUS.items() if address == 1}
    collisions = {}
    cases = [Case("one motor", one), Case("16 motors of one MCU", sixteen), Case("line of 2 motors on 2 MCUs", {"m00": STEPS, "n00": STEPS - 1}, line=True)]
    with World(TWO_MCUS, "--latency-ms", "1") as world:
        for case in cases:
            case.run(world, moves)
        scanned = scan(world.client, 2 * moves)
        time.sleep(1)
        rested = rest(world, min(MOST_REST_S, max(1, moves // 20)))
        edges = world.end()
        collisions["2 MCUs"] = world.collisions
    for case in cases:
        case.row(edges)
    for name, motors, by, options in [
        ("8 motors of 8 MCUs", EIGHT_MCUS, dict.fromkeys(EIGHT_MCUS, STEPS), ["--latency-ms", "1"]),
        (f"one motor, bit errors {BIT_ERRORS} (seed {SEED})", TWO_MCUS, one, ["--latency-ms", "1", "--bit-errors", BIT_ERRORS, "--seed", str(SEED)]),
        ("one motor, adapter latency 4 ms", TWO_MCUS, one, ["--latency-ms", "4"]),
        ("one motor, adapter latency 16 ms", TWO_MCUS, one, ["--latency-ms", "16"]),
    ]:
        case = Case(name, by)
        with World(motors, *options) as world:
            case.run(world, moves)
            edges = world.end()
            collisions[name] = world.collisions
        case.row(edges)
    print(scanned)
    print(rested)
    # bushsim has not got its bytes in time, and so answers late. Those of a real line come as they are sent.
    late = "; ".join(f"{count} ({name})" for name, count in collisions.items() if count)
    print(f"collisions on the line, each a sign that this machine was late: {late or 'none'}")


def main():
    parser = argparse.ArgumentParser(prog="tools/bench --latency", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--moves", type=int, default=500, metavar="N", help="of each case (default: 500)")
    options = parser.parse_args()
    if options.moves < 1:
        parser.error("--moves: must be at least 1")
    # The programs are ended in any case.
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(128 + signal.SIGTERM))
    allowed = in_real_time(True)
    in_real_time(False)
    before = "before other programs (SCHED_RR)" if allowed else "beside other programs (SCHED_RR is not permitted)"
    print(f"bushd, bushsim and the client run {before}; load average {os.getloadavg()[0]:.1f} at the beginning")
    print(f"{BAUD} baud, tick {TICK_US} us, adapter latency 1 ms unless another is named, no state store, moves of {STEPS} steps from rest")
    header()
    try:
        measure(options.moves)
    except (Failure, bushd.BushdError) as error:
        sys.exit(f"tools/bench: {error}")


if __name__ == "__main__":
    main()
