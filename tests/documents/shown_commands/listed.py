"""not_run.toml: what is not run, and why."""

import fnmatch
import os
import pathlib
import re
import tomllib

FILE = pathlib.Path(__file__).resolve().parent / "not_run.toml"
SOURCE = pathlib.Path(os.environ["BUSHD_SOURCE_DIR"])


class Listed:
    """Entries `[[not_run]]`: `reason`, `commands` (patterns of the shell, of a command's first line), `pages` (absent: all), and who
    runs them in its own way, if anybody: `by`, a file that holds each of them, or `reads`, one that takes them from the page."""

    def __init__(self):
        self.entries = tomllib.loads(FILE.read_text())["not_run"]
        self.used = set()

    def reason(self, shown):
        first = shown.text.splitlines()[0]
        for entry in self.entries:
            if not any(fnmatch.fnmatchcase(shown.page, page) for page in entry.get("pages", ["*"])):
                continue
            for pattern in entry["commands"]:
                if fnmatch.fnmatchcase(first, pattern):
                    self.used.add((entry["reason"], pattern))
                    return entry["reason"]
        return None

    def unused(self):
        return [(entry["reason"], pattern) for entry in self.entries for pattern in entry["commands"] if (entry["reason"], pattern) not in self.used]

    def not_there(self):
        """What `by` and `reads` claim, and the file does not have."""
        for entry in self.entries:
            if by := entry.get("by"):
                held = words_of((SOURCE / by).read_text())
                for pattern in entry["commands"]:
                    if words_of(pattern.removeprefix("sudo ").split("*")[0]) not in held:
                        yield f"{by} does not have: {pattern}"
            if reads := entry.get("reads"):
                for page in entry["pages"]:
                    if pathlib.Path(page).name not in (SOURCE / reads).read_text():
                        yield f"{reads} does not read {page}"


def words_of(text):
    """The words of a command line, or of a program that has it as a list; with a line's continuation."""
    return re.sub(r"[\s\"',()\\]+", " ", text).rstrip()
