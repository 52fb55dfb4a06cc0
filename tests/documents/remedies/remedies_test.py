#!/usr/bin/env python3
"""Every remedy that the sources tell (told.py) is run in a state that tells it (remedies.toml), or stands there with the reason why not.

Runs within shown_commands/in-a-world, where a daemon and a simulated bus are this test's own. $BUSHD_SOURCE_DIR is the tree. With
names of states as arguments only those are tried."""

import fnmatch
import os
import pathlib
import re
import sys
import tempfile
import tomllib

HERE = pathlib.Path(__file__).resolve().parent
SOURCE = pathlib.Path(os.environ["BUSHD_SOURCE_DIR"])
sys.path.insert(0, str(HERE.parent / "shown_commands"))

import templates  # noqa: E402
import told  # noqa: E402
from world import Failed, Shell  # noqa: E402

COMMAND = re.compile(rf"'((?:{told.PROGRAMS})\b[^']*)'")
# The MCUs lose power, and have forgotten all.
SWITCH = "BUSHSIM_OPTIONS='--switch 1.0:2@-400'"
HELPERS = f"""power-cut() {{ {SWITCH} systemctl restart bushd-sim@demo; sleep 0.3; }}
wait-status() {{ while ! bushctl status | grep -q "$1"; do sleep 0.1; done; }}
wait-no-status() {{ while bushctl status | grep -q "$1"; do sleep 0.1; done; }}"""


def alternatives(pattern):
    """`*@(a|b)*` are two patterns."""
    match = re.match(r"(.*)@\((.*)\)(.*)", pattern)
    return [match[1] + one + match[3] for one in match[2].split("|")] if match else [pattern]


class Remedies:
    def __init__(self):
        listed = tomllib.loads((HERE / "remedies.toml").read_text())
        self.states = listed["state"]
        self.not_run = listed["not_run"]
        self.configuration = listed["configuration"]
        self.outputs = []
        self.failed = []
        self.ran = 0
        self.shell = Shell(pathlib.Path.home(), pathlib.Path(tempfile.mkdtemp(dir="/run")))
        self.shell.must(HELPERS)
        pathlib.Path("/run/remedies.toml").write_text(self.configuration)

    def begin(self):
        """Everything as it is after an installation: nothing of the state before is left."""
        self.shell.must(
            "systemctl stop bushd; systemctl stop bushd-sim@demo; rm -rf /var/lib/bushd/*\n"
            "mkdir -p /etc/bushd/sim; cp /run/remedies.toml /etc/bushd/bushd.toml; cp /run/remedies.toml /etc/bushd/sim/demo.toml\n"
            f"{SWITCH} systemctl start bushd-sim@demo; systemctl start bushd\n"
            "bushctl set theta --dial 0; bushctl set phi --dial 0; bushctl set chi --dial 0"
        )

    def told_in(self, state):
        self.begin()
        for command in filter(None, state.get("before", "").split("; ")):
            self.shell.must(command)
        code, output = self.shell.run(state["says"])
        allowed = state.get("says_exit", 1)
        if code not in (allowed if isinstance(allowed, list) else [allowed]):
            raise Failed(f"{state['says']}\nended with {code}: {output}")
        output = re.sub(r"\n +(?:-> )?", " ", output)
        self.outputs.append(output)
        return [match for match in dict.fromkeys(COMMAND.findall(output)) if self.is_meant(match, state)]

    @staticmethod
    def is_meant(command, state):
        return any(fnmatch.fnmatchcase(command, pattern) for pattern in state.get("only", ["*"]))

    def try_state(self, state):
        commands = self.told_in(state)
        if not commands and state.get("only") is None:
            raise Failed(f"{state['says']}\ntells no command: {self.outputs[-1]}")
        for number, command in enumerate(commands):
            if number:
                self.told_in(state)
            if "start" in state:
                self.shell.must(state["start"])
            (filled,) = {templates.filled(command, state.get("words", {}))}
            code, output = self.shell.run(filled)
            if code != state.get("exit", 0):
                raise Failed(f"{self.outputs[-1]}\n'{filled}' ended with {code}: {output}")
            self.ran += 1
            for then in filter(None, state.get("then", f"wait-for rest; {state['says']}").split("; ")):
                code, output = self.shell.run(then)
                if code != 0:
                    raise Failed(f"{self.outputs[-1]}\nafter '{filled}' {then}\nended with {code}: {output}")

    def run(self, names):
        for state in self.states:
            if names and state["name"] not in names:
                continue
            try:
                self.try_state(state)
            except (Failed, templates.NoWord) as failure:
                self.failed.append(f"{state['name']}: {failure}")
        if not names:
            self.compare_with_sources()
        print(f"{self.ran} remedies run in {len(self.states)} states")
        if self.failed:
            print(f"{len(self.failed)} failed:", *self.failed, sep="\n")
        return 1 if self.failed else 0

    def compare_with_sources(self):
        used = set()
        for remedy in told.all_told(SOURCE):
            if any(remedy.is_in(output) for output in self.outputs):
                continue
            reasons = [
                number
                for number, entry in enumerate(self.not_run)
                if fnmatch.fnmatchcase(remedy.file, entry["file"])
                and any(fnmatch.fnmatchcase(re.sub(r"\\(.)", r"\1", remedy.text), pattern) for pattern in alternatives(entry.get("told", "*")))
            ]
            used.update(reasons[:1])
            if not reasons:
                self.failed.append(f"nobody runs {remedy}")
        for number, entry in enumerate(self.not_run):
            if number not in used:
                self.failed.append(f"remedies.toml gives a reason for what no source tells: {entry}")


if __name__ == "__main__":
    sys.exit(Remedies().run(sys.argv[1:]))
