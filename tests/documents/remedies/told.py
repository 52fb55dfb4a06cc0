"""Commands that the programs tell as remedies, taken out of the sources.

A remedy is a whole command between quotes in a text, 'bushctl status', or one that words::remedy() makes (lib/words/remedy.h). What
--help says is run by the test of that page (shown_commands)."""

import dataclasses
import pathlib
import re

PLACES = {"lib": (".cpp", ".h", ".py"), "daemon": (".cpp", ".h"), "tools/bushctl": (".cpp", ".h")}
PROGRAMS = "bushctl|bushtab|bushd|bushd-flash|sudo|systemctl|journalctl|timedatectl|newgrp|sysctl|ls|du|man"
LITERAL = re.compile(r'f?"((?:[^"\\\n]|\\.)*)"')
ADJACENT = re.compile(r'"\s*\n?\s*f?"')
QUOTED = re.compile(rf"'((?:{PROGRAMS})\b[^']*)")
CALL = re.compile(r'\bremedy\("([a-z]+)"|\bset_remedy\(')
HELP = re.compile(r"\.(?:footer|flag|flag_with|option|option_with|words|number|number<.*?>|choice|file|add|add_group)\(|another = |kNameAnother =|\badd<.*?>\(")


@dataclasses.dataclass(frozen=True)
class Told:
    file: str
    text: str  # that stands before it, or around it: a regular expression
    command: str  # how it begins

    def __str__(self):
        return f"{self.file}: {self.command}, behind /{self.text}/"

    def is_in(self, output):
        """Whether a program has told it just there."""
        return re.search(self.text, output) is not None and re.search("'" + self.command, output) is not None


def pattern(literal):
    """What is printed of a literal: fields of fmt and Python may be anything, and so may the end."""
    text = re.sub(r"\\(.)", r"\1", literal)
    text = re.sub(r"\{\{|\}\}", "\0", text)
    return "".join(".*?" if piece.startswith("{") else re.escape(piece) for piece in re.split(r"(\{[^}]*\})", text))


def statements(text):
    text = re.sub(r"^\s*(?://|#).*$", "", text, flags=re.M)
    text = ADJACENT.sub("", text)
    return re.split(r"[;{}]\s*\n", text)


def told_by(file, text):
    found = []
    for statement in statements(text):
        if HELP.search(statement):
            continue
        literals = [(match.start(), match[1]) for match in LITERAL.finditer(statement)]
        for _, literal in literals:
            for match in QUOTED.finditer(literal):
                # From a little before it; where its end is put together it may be anything.
                begin = max(0, match.start() - 40)
                found.append(Told(file, pattern(literal[begin : match.end()]), re.split(r"[{<]", match[1])[0].strip()))
        for match in CALL.finditer(statement):
            before = [literal for at, literal in literals if at < match.start() and re.search(r"\w+ \w+.*\w{3}", literal)]
            command = f"bushctl {match[1] or 'set'} "
            found.append(Told(file, pattern(before[-1]) if before else re.escape("'" + command), command))
    return found


def all_told(source):
    found = []
    for place, endings in PLACES.items():
        for path in sorted((source / place).rglob("*")):
            if path.suffix in endings and path.name != "remedy.h":
                found += told_by(str(path.relative_to(source)), path.read_text())
    return list(dict.fromkeys(found))


if __name__ == "__main__":
    for told in all_told(pathlib.Path(__file__).resolve().parents[3]):
        print(told)
