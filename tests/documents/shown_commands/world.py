"""The world of a page: what its file in worlds/ says, and a shell in which the page's commands run.

Keys of a world file, all optional:
  about       what there is, in a sentence
  folder      "tree": in a source tree with a build; absent: in an empty folder, with the programs in the path
  files       {name = text}: written before; those that the page itself shows by name are there too
  files_of    another page, whose files are there as well
  before      shell commands that come first
  after       shell commands that come last; each must succeed
  words       {NAME = ["theta", "phi"]}: what stands for the words in capitals of a template, one after another
  mentions    what the page only names: parts of commands
  [[command]] about one command of the page:
    shown     its text (of several lines, the first one)
    before    shell commands that come before it: what the page says in words, or what others do
    after     shell commands after it; each must succeed
    between   shell commands between those that a template stands for
    typed     [[condition, text], ..]: it has a terminal. When its output matches the condition, or the condition's command
              ("$ command") succeeds, this is typed
    input     what it reads
    exit      the exit code that it must have, or those that it may have
    prints    a regular expression that its output must match
    as        shell commands in its place, where the page names what is another one here: a file, a port
  [[program]] about one program in another language:
    shown     its first line
    before    source text before it
    after     source text behind it
    shell     shell commands that come before it is run: one that makes `./program` of `program.EXTENSION`, if it needs that
    as        in place of `./program`, or `python3 program.py`
    exit, prints"""

import os
import pathlib
import pty
import re
import select
import signal
import subprocess
import time
import tomllib

HERE = pathlib.Path(__file__).resolve().parent
SOURCE = pathlib.Path(os.environ["BUSHD_SOURCE_DIR"])
BUILD = pathlib.Path(os.environ.get("BUSHD_BUILD_DIR", SOURCE / "build/release"))
GIVE_UP_S = 120
EXTENSIONS = {"python": "py", "cpp": "cpp", "c": "c", "fortran": "f"}


class Failed(Exception):
    pass


class Stuck(Exception):
    """A command has not come to its end: what comes behind it cannot be tried."""


def world_file(page):
    """For docs/camac.md worlds/camac.toml, for README.md worlds/README.toml, for docs/README.md worlds/docs.toml."""
    path = pathlib.Path(page)
    name = "docs" if page == "docs/README.md" else path.name.split(".")[0]
    return HERE / "worlds" / f"{name}.toml"


def read_world(page):
    file = world_file(page)
    return tomllib.loads(file.read_text()) if file.exists() else None


class Shell:
    """One bash, to which commands are given one by one, as a user does."""

    def __init__(self, folder, logs):
        self.folder = folder
        self._logs = logs
        self._number = 0
        self._environment = dict(os.environ, PATH=f"{HERE / 'bin'}:{BUILD / 'bin'}:{os.environ['PATH']}", PYTHONDONTWRITEBYTECODE="1")
        self._bash = subprocess.Popen(
            ["bash"], cwd=folder, env=self._environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        )

    def run(self, command, text=None):
        """(exit code, what it has printed by then)"""
        log = self._next(command)
        given = "/dev/null"
        if text is not None:
            given = log.with_suffix(".input")
            given.write_text(text)
        self._bash.stdin.write(f". {log.with_suffix('.sh')} >{log} 2>&1 <{given}; echo done $?\n")
        self._bash.stdin.flush()
        while True:
            ready, _, _ = select.select([self._bash.stdout], [], [], GIVE_UP_S)
            line = self._bash.stdout.readline() if ready else ""
            if not line:
                raise Stuck(f"no end within {GIVE_UP_S} s, or the shell has ended: {command}\n{printed(log)}")
            if end := re.match(r"done (\d+)$", line):
                self.log = log
                return int(end[1]), printed(log)

    def must(self, command):
        code, output = self.run(command if "\n" not in command else f"set -e\n{command}\nset +e")
        if code != 0:
            raise Failed(f"{command}\nended with {code}: {output}")

    def wait_for_start(self, command):
        """Behind `PROGRAM ... &`: until it does what it is for."""
        words = re.sub(r"^(?:sudo|exec) ", "", command).split()
        name = pathlib.Path(words[0]).name
        if name == "bushsim":
            log = self.log
            wait_until(f"'bushsim: ready' in\n{command}", lambda: "bushsim: ready" in printed(log), lambda: printed(log))
        elif name == "bushd":
            self.must("wait-for ready")

    def run_in_terminal(self, command, typed):
        """(exit code, what it has printed): a terminal, at which somebody types when conditions hold."""
        self._environment = self._exported()
        log = self._next(command)
        self.log = log
        process, terminal = pty.fork()
        if process == 0:
            os.chdir(self.folder)
            os.environ.clear()
            os.environ.update(self._environment)
            os.execvp("bash", ["bash", str(log.with_suffix(".sh"))])
        output = b""
        give_up_s = time.monotonic() + GIVE_UP_S
        typed = list(typed)
        while True:
            try:
                if select.select([terminal], [], [], 0.05)[0]:
                    output += (part := os.read(terminal, 65536))
                    if not part:
                        break
            except OSError:  # the end of what is at the other side
                break
            if typed and self._holds(typed[0][0], output.decode(errors="replace")):
                os.write(terminal, typed.pop(0)[1].encode())
            if time.monotonic() > give_up_s:
                os.kill(process, signal.SIGKILL)
                break
        status = os.waitpid(process, 0)[1]
        log.write_bytes(output)
        if typed:
            raise Failed(f"{command}\ncame to its end before {typed[0][0]}: {printed(log)}")
        code = os.waitstatus_to_exitcode(status)
        return (code if code >= 0 else 128 - code), printed(log)

    def _exported(self):
        """What bash gives to its programs by now."""
        file = self._logs / "exported"
        self.must(f"env -0 >{file}")
        return dict(line.split("=", 1) for line in file.read_text().split("\0") if line)

    def _holds(self, condition, output):
        if condition.startswith("$ "):
            return subprocess.run(condition[2:], shell=True, cwd=self.folder, env=self._environment, capture_output=True, check=False).returncode == 0
        return re.search(condition, output) is not None

    def _next(self, command):
        self._number += 1
        log = self._logs / f"{self._number}.log"
        log.with_suffix(".sh").write_text(f"{command}\n")
        log.touch()
        return log


def printed(log):
    return log.read_text(errors="replace")


def wait_until(what, holds, seen):
    end_s = time.monotonic() + GIVE_UP_S
    while not holds():
        if time.monotonic() > end_s:
            raise Failed(f"waited {GIVE_UP_S} s in vain for {what}: {seen()}")
        time.sleep(0.02)
