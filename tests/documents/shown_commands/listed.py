"""not_run.toml: what is not run, and why."""

import fnmatch
import os
import pathlib
import tomllib

FILE = pathlib.Path(__file__).resolve().parent / "not_run.toml"
SOURCE = pathlib.Path(os.environ["BUSHD_SOURCE_DIR"])


class Listed:
    """Entries `[[not_run]]`: `reason`, `commands` (patterns of the shell, of a command's first line), `pages` (absent: all), and `by`:
    the file that runs them in its own way, where there is one."""

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

    def missing_files(self):
        return [entry["by"] for entry in self.entries if "by" in entry and not (SOURCE / entry["by"]).exists()]
