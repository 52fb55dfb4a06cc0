"""Processor time of bushd with many motors: at rest, and while all of them move.

    tests/tools/with-loopback-multicast python3 tools/benchmarks/many_motors.py --buses 8 --mcus 4

Each bus is a bushsim of its own, whose MCUs have 16 motors each and make runs of their tables. Needs bushd, bushsim and
bushctl of build/release. Other programs on the machine make the figures larger, so builds are compared in turns:
--bushd BEFORE --bushd AFTER --turns 3 prints the medians of each.
"""

import argparse
import os
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

TOP = pathlib.Path(__file__).resolve().parents[2]
BIN = TOP / "build" / "release" / "bin"
TABLES = ["bushd2-constant", "bushd2-scurve", "bushd2-exponential", "bushd2-resonance"]
MOTORS_PER_MCU = 16
MOTORS_PER_REQUEST = 1024  # more do not fit into one
FAR_STEPS = 400_000  # 160 s
GIVE_UP_S = 60


def configuration(options, folder):
    lines = ['[lcm]\nurl = "udpm://239.255.76.67:7667?ttl=0"', f'[control]\npath = "{folder}/control"', '[state]\npath = ""']
    lines += [f'[[group]]\nname = "group{i}"\ntable = "{table}"' for i, table in enumerate(TABLES)]
    motors = 0
    for bus in range(options.buses):
        lines += [f'[[bus]]\nname = "b{bus}"\nport = "{folder}/port{bus}"\nbaud = 2000000\ntick_us = 2560\nformat = "fine"\nmoves = "table"']
        for address in range(1, options.mcus + 1):
            lines += [f'[[mcu]]\nbus = "b{bus}"\naddress = {address}']
            for output in range(MOTORS_PER_MCU):
                group = motors % len(TABLES)
                lines += [f'[[motor]]\nname = "m{motors}"\nmcu = "b{bus}:{address}"\noutput = {output}\ngroup = "group{group}"']
                motors += 1
    return "\n".join(lines) + "\n", motors


def go_first(pid):
    try:
        os.sched_setscheduler(pid, os.SCHED_RR, os.sched_param(1))
    except PermissionError:
        print("not permitted to go before other programs")


def used(pid):
    """Seconds of processor time, and changes of context, of all its threads."""
    seconds, switches = 0.0, 0
    for task in pathlib.Path(f"/proc/{pid}/task").iterdir():
        seconds += int((task / "schedstat").read_text().split()[0]) / 1e9
        switches += sum(int(line.split()[1]) for line in (task / "status").read_text().splitlines() if "ctxt_switches" in line)
    return seconds, switches


def measure(what, pid, seconds):
    begin_s = time.monotonic()
    used_s, switches = used(pid)
    time.sleep(seconds)
    passed_s = time.monotonic() - begin_s
    more_s, more_switches = used(pid)
    share, rate = 100 * (more_s - used_s) / passed_s, (more_switches - switches) / passed_s
    print(f"{what}: {share:.2f} % of a core, {rate:.0f} changes of context a second", flush=True)
    return share


def run(options, bushd, folder, programs):
    """Percent of a core at rest, and while all move."""
    text, motors = configuration(options, folder)
    config = folder / "bushd.toml"
    config.write_text(text, encoding="utf-8")

    def start(*command):
        with open(folder / f"{len(programs)}.log", "wb") as log:
            programs.append(subprocess.Popen(list(map(str, command)), stdout=log, stderr=subprocess.STDOUT))
        go_first(programs[-1].pid)
        return programs[-1]

    def bushctl(*arguments):
        command = [BIN / "bushctl", *arguments, "--socket", folder / "control"]
        if subprocess.run(command, stdout=subprocess.DEVNULL, check=False).returncode != 0:
            sys.exit(f"bushctl {arguments[0]} has failed: this machine may be too slow for so many bushsim")

    ports = [folder / f"port{bus}" for bus in range(options.buses)]
    for bus, port in enumerate(ports):
        start(BIN / "bushsim", "--config", config, "--bus", f"b{bus}", "--link", port)
    give_up_s = time.monotonic() + GIVE_UP_S
    while not all(port.is_symlink() for port in ports):
        if time.monotonic() > give_up_s or any(program.poll() is not None for program in programs):
            sys.exit((folder / "0.log").read_text(encoding="utf-8"))
        time.sleep(0.05)
    daemon = start(bushd, "--config", config)
    bushctl("status", "--wait-s", str(GIVE_UP_S))
    time.sleep(2)
    at_rest = measure(f"{motors} motors at rest", daemon.pid, options.seconds)
    for first in range(0, motors, MOTORS_PER_REQUEST):
        moves = []
        for motor in range(first, min(first + MOTORS_PER_REQUEST, motors)):
            moves += [f"m{motor}", str(FAR_STEPS if motor % 2 else -FAR_STEPS)]
        bushctl("move", "--steps", *moves)
    time.sleep(4)
    return at_rest, measure(f"{motors} motors moving", daemon.pid, options.seconds)


def run_in_folder(options, bushd):
    programs = []
    with tempfile.TemporaryDirectory(prefix="bushd-many-") as folder:
        try:
            return run(options, bushd, pathlib.Path(folder), programs)
        finally:
            for program in programs:
                program.kill()
                program.wait()


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--buses", type=int, default=8)
    parser.add_argument("--mcus", type=int, default=4, help="of each bus, 16 motors each")
    parser.add_argument("--seconds", type=float, default=10, help="of each measurement")
    parser.add_argument("--bushd", type=pathlib.Path, action="append", help="several: in turns")
    parser.add_argument("--turns", type=int, default=1)
    options = parser.parse_args()
    builds = options.bushd or [BIN / "bushd"]
    seen = {bushd: [] for bushd in builds}
    for _ in range(options.turns):
        for bushd in builds:
            print(f"{bushd}, load average {os.getloadavg()[0]:.1f}", flush=True)
            seen[bushd].append(run_in_folder(options, bushd))
    for bushd, shares in seen.items():
        at_rest, moving = (statistics.median(column) for column in zip(*shares))
        print(f"{bushd}: medians of {options.turns}: at rest {at_rest:.2f} %, moving {moving:.2f} % of a core")


if __name__ == "__main__":
    main()
