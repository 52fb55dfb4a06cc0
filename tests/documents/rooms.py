#!/usr/bin/env python3
"""The rooms of the source tree (docs/rooms.toml): who includes whom, and what design.md shows of them.

  rooms.py           prints the table and the picture
  rooms.py --write   puts them into docs/design.md
"""

import os
import pathlib
import re
import sys
import tomllib

SOURCE = pathlib.Path(os.environ.get("BUSHD_SOURCE_DIR", pathlib.Path(__file__).resolve().parents[2]))
BEGIN = "<!-- rooms: made from rooms.toml by tests/documents/rooms.py --write -->\n"
END = "<!-- end of rooms -->\n"
WIDTH = 110


class Rooms:
    def __init__(self, text):
        told = tomllib.loads(text)
        self.rooms = {room["path"]: room for room in told["room"]}
        self.library_of = {header: library for library, headers in told["library"].items() for header in headers}

    def room_of(self, path):
        """The innermost room that this file lies in, or None."""
        return next((str(folder) for folder in path.parents if str(folder) in self.rooms), None)

    def library(self, header):
        return next((library for begin, library in self.library_of.items() if header.startswith(begin)), None)

    def level(self, path):
        return 1 + max((self.level(used) for used in self.rooms[path]["uses"]), default=-1)


def sources(source=SOURCE):
    for folder in ("lib", "daemon", "firmware", "tools", "tests/faults"):
        yield from sorted(path.relative_to(source) for path in (source / folder).rglob("*") if path.suffix in {".c", ".h", ".cpp", ".S", ".inc"})


def includes(path):
    """(line, header, whether it is in quotes)"""
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
        found = re.match(r'\s*#\s*include\s*(["<])([^">]+)[">]', line)
        if found:
            yield number, found[2], found[1] == '"'


def table(rooms):
    lines = ["| room | language | uses | libraries | holds |", "| --- | --- | --- | --- | --- |"]
    for path, room in rooms.rooms.items():
        uses = ", ".join(used.removeprefix("lib/") for used in room["uses"])
        lines.append(f"| `{path}` | {room['language']} | {uses} | {', '.join(room.get('libraries', []))} | {room['holds']} |")
    return "\n".join(lines) + "\n"


def picture(rooms):
    """The rooms above those that they use, as text."""
    levels = {}
    for path in rooms.rooms:
        levels.setdefault(rooms.level(path), []).append(path)
    lines = []
    for _, paths in sorted(levels.items(), reverse=True):
        row = ""
        for path in paths:
            if len(row) + len(path) > WIDTH:
                lines.append(row.rstrip())
                row = ""
            row += path + "   "
        lines += [row.rstrip(), ""]
    return "".join(f"    {line}\n" if line else "\n" for line in lines[:-1])


def shown(rooms):
    return f"{BEGIN}\n{table(rooms)}\nEach line uses only what is below it:\n\n{picture(rooms)}\n{END}"


def main():
    text = shown(Rooms((SOURCE / "docs/rooms.toml").read_text(encoding="utf-8")))
    if sys.argv[1:] == ["--write"]:
        page = SOURCE / "docs/design.md"
        before, rest = page.read_text(encoding="utf-8").split(BEGIN)
        page.write_text(before + text + rest.split(END)[1], encoding="utf-8")
        return 0
    if sys.argv[1:]:
        print(__doc__, file=sys.stderr)
        return 2
    print(text, end="")
    return 0


if __name__ == "__main__":
    sys.exit(main())
