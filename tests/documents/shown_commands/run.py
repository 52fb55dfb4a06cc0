#!/usr/bin/env python3
"""Runs all commands that a page shows, in their order, in the world of the page (worlds/). Within in-a-world:

    run.py camac     those of docs/camac.md
    run.py help      those of --help of the programs

What is not run stands in not_run.toml, with the reason."""

import pathlib
import re
import sys
import tempfile

import pages
import templates
from listed import Listed
from shown import all_pages, shown_on
from world import BUILD, EXTENSIONS, SOURCE, Failed, Shell, Stuck, read_world, world_file

TREE = ("CMakeLists.txt", "CMakePresets.json", "README.md", "daemon", "docs", "firmware", "lib", "tables", "tests", "tools")


class Page:
    def __init__(self, page):
        self.page = page
        self.shown, files = shown_on(page)
        self.world = read_world(page) or {}
        self.listed = Listed()
        self.counts = {"run": 0, "named": 0, "listed": 0}
        self.failed = []
        self.notes = {}
        for entry in [*self.world.get("command", []), *self.world.get("program", [])]:
            self.notes.setdefault(entry["shown"], []).append(entry)
        self.folder = pathlib.Path.home() / "bushd"
        self.folder.mkdir()
        if self.world.get("folder") == "tree":
            for name in TREE:
                (self.folder / name).symlink_to(SOURCE / name)
            (self.folder / "build").mkdir()
            (self.folder / "build/release").symlink_to(BUILD)
            for images in BUILD.parent.glob("*/firmware"):
                if images.parent != BUILD:
                    (self.folder / "build" / images.parent.name).symlink_to(images.parent)
        if other := self.world.get("files_of"):
            files = {**shown_on(other)[1], **files}
        for name, text in {**files, **self.world.get("files", {})}.items():
            path = self.folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
        self.logs = pathlib.Path(tempfile.mkdtemp(dir="/run"))
        self.shell = Shell(self.folder, self.logs)

    def run(self):
        unknown = set(self.notes) - {first_line(shown) for shown in self.shown}
        if unknown:
            self.failed.append(f"worlds/ speaks of what {self.page} does not show: {sorted(unknown)}")
        try:
            self.all_in_order()
        except Stuck as stuck:
            self.failed.append(str(stuck))
        print(f"{self.page}: {len(self.shown)} commands: " + ", ".join(f"{count} {what}" for what, count in self.counts.items()))
        if self.failed:
            print(f"{len(self.failed)} failed:", *self.failed, sep="\n")
        return 1 if self.failed else 0

    def all_in_order(self):
        self.shell.must(self.world.get("before", "true"))
        for shown in self.shown:
            try:
                self.one(shown)
            except (Failed, templates.NoWord) as failure:
                self.failed.append(f"{shown}\n    {str(failure).strip()}")
        for command in self.world.get("after", "").splitlines():
            try:
                self.shell.must(command)
            except Failed as failure:
                self.failed.append(f"{self.page}: in the end\n    {failure}")

    def one(self, shown):
        if self.listed.reason(shown):
            self.counts["listed"] += 1
        elif shown.is_mention or shown.text in self.world.get("mentions", []):
            self.counts["named"] += 1  # complete_test.py looks whether there is such a command
        else:
            self.counts["run"] += 1
            note = self.note(shown)
            if shown.is_program:
                self.run_program(shown, note)
                return
            self.shell.must(note.get("before", "true"))
            if shown.is_template and "as" not in note:
                for number, command in enumerate(templates.commands_of(shown.text, self.world.get("words", {}))):
                    self.shell.must(note.get("between", "true") if number else "true")
                    self.run_command(command, shown, note)
            else:
                self.run_command(note.get("as", shown.text), shown, note)
            for command in note.get("after", "").splitlines():
                self.shell.must(command)

    def note(self, shown):
        """What the world says about it: of several entries, each is for the next time that it is shown."""
        entries = self.notes.get(first_line(shown), [{}])
        return entries.pop(0) if len(entries) > 1 else entries[0]

    def run_command(self, command, shown, note):
        if "typed" in note:
            code, output = self.shell.run_in_terminal(command, note["typed"])
        else:
            code, output = self.shell.run(command, note.get("input"))
        if command.endswith(" &"):
            self.shell.wait_for_start(command)
        self.judge(command, code, output, note)
        if shown.prints is not None and output.rstrip("\n") != shown.prints:
            raise Failed(f"{command}\nprints\n{output}\nThe page says\n{shown.prints}")

    @staticmethod
    def judge(command, code, output, note):
        allowed = note.get("exit", 0)
        if code not in (allowed if isinstance(allowed, list) else [allowed]):
            raise Failed(f"{command}\nended with {code}:\n{output}")
        if not re.search(note.get("prints", ""), output):
            raise Failed(f"{command}\nprinted nothing like {note['prints']}:\n{output}")

    def run_program(self, shown, note):
        source = self.folder / f"program.{EXTENSIONS[shown.kind]}"
        source.write_text(note.get("before", "") + shown.text + "\n" + note.get("after", ""))
        self.shell.must(note.get("shell", "true"))
        command = note.get("as", f"python3 {source.name}" if shown.kind == "python" else "./program")
        self.judge(command, *self.shell.run(command), note)


def first_line(shown):
    return shown.text.splitlines()[0]


def main(name):
    (page,) = [page for page in all_pages() if world_file(page).stem == name]
    return Page(page).run()


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
