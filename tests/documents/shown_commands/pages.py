"""What pages show to be typed: commands in code blocks and in the text, and programs in other languages.

Markdown: indented blocks and blocks of ``` whose language is console or sh; between backquotes in the text. Manual pages: what stands
between .nf and .fi, and bold words. --help: lines that begin with a program, and what stands between quotes."""

import dataclasses
import pathlib
import re
import shlex

OURS = ("bushctl", "bushd", "bushsim", "bushtab", "bushfaults", "bushd-epics", "bushd-web", "bushd-flash")
# Other programs that pages show. A line of an indented block that begins with one of them is a command.
OTHERS = (
    "apt avrdude cat cc cd cmake cp ctest echo export g++ gdb gdb-multiarch gfortran install ip journalctl kill lcm-gen ls make man ninja nft openocd pip"
    " pkg-config printf python3 qemu-system-arm source sysctl systemctl systemd-analyze systemd-sysusers tar usermod"
).split()
BEFORE_PROGRAM = re.compile(r"(?:sudo (?:-u \w+ |nice -n -?\d+ )?|[A-Za-z_]+=(?:\"[^\"]*\"|'[^']*'|\S+) )*")
MESSAGE = re.compile(r"(?:bushd|bushsim) [a-z]")  # `bushd sends its state`: what a program says
PROGRAMS_IN_OTHER_LANGUAGES = ("python", "cpp", "c", "fortran", "cmake")
PLACEHOLDER = re.compile(r"[A-Z][A-Z0-9_@:=.|-]*(?:\.[a-z]+)?|\S*/[A-Z_]+")


@dataclasses.dataclass(frozen=True)
class Shown:
    page: str
    line: int
    text: str  # without a comment behind it
    kind: str  # "block", "inline", or the language of a program
    prints: str | None = None  # what the page shows of its output

    @property
    def is_program(self):
        return self.kind not in ("block", "inline")

    @property
    def is_template(self):
        return not self.is_program and is_template(self.text)

    @property
    def is_mention(self):
        """Names a command, and is none itself: `bushctl jog`."""
        words = self.text.removeprefix("sudo ").split()
        named = words[0] in OURS and all(re.fullmatch("[a-z-]+", word) for word in words[1:])
        return self.kind == "inline" and named and len(words) <= (3 if words[1] in ("path", "program", "table") else 2)

    def __str__(self):
        return f"{self.page}:{self.line}: {self.text.splitlines()[0]}"


def is_template(text):
    first = text.splitlines()[0]
    words = [re.sub(r"[\[\](),]", "", word) for word in re.sub(r"'[^']*'|\"[^\"]*\"", "", first).split()[1:]]
    words = [word for word in words if "=" not in word or re.fullmatch("[A-Z]+=[A-Z]+(?:\\.\\.\\.)?", word)]
    return "..." in first or " [" in first or any(PLACEHOLDER.fullmatch(word.removesuffix("...")) for word in words)


def is_command(line):
    """Whether it begins with a program."""
    if re.fullmatch(r"[a-z_]+=(\"[^\"]*\"|\S+)|PATH=\S+", line):
        return True
    rest = line[BEFORE_PROGRAM.match(line).end() :]
    word = rest.split(maxsplit=1)[0] if rest.strip() else ""
    return word in (*OURS, *OTHERS) or re.match(r"(?:build|tools|tests|\.)/\S+$|\.ci/run$|\w+/bin/\w+$|\w+_test$", word) is not None


def without_comment(text):
    return re.sub(r"\s+# .*$", "", text, flags=re.MULTILINE) if "<<" not in text else re.sub(r"\s+# .*$", "", text.split("\n")[0]) + text[text.index("\n") :]


def is_open(text):
    """Whether the command goes on in the next line."""
    if here := re.search(r"<<'?(\w+)'?", text):
        return not re.search(rf"^{here[1]}$", text, re.MULTILINE)
    if text.endswith("\\"):
        return True
    try:
        shlex.split(re.sub(r"\s+# .*$", "", text, flags=re.MULTILINE))
    except ValueError:
        return True
    return False


def commands_of_block(page, first_line, lines):
    """All commands of an indented block; none if it is something else."""
    if not any(is_command(line) for line in lines):
        return
    at = 0
    while at < len(lines):
        begin = at
        text = lines[at]
        at += 1
        if not text.strip() or text.startswith("#"):
            continue
        if not is_command(text):
            if text.startswith(("(gdb) ", "    ")):  # typed into the program above; what a command does, in a second column
                continue
            raise AssertionError(f"{page}:{first_line + begin}: neither a command nor a part of one: {text}")
        while is_open(text):
            text += "\n" + lines[at]
            at += 1
        if "\n" in text or "  #" in text:
            yield Shown(page, first_line + begin, without_comment(text).strip(), "block")
            continue
        # Several commands side by side, or what one does in words.
        for part in re.split(r"   +", text):
            if is_command(part):
                yield Shown(page, first_line + begin, without_comment(part).strip(), "block")


def console_of_block(page, first_line, lines):
    """`$ command` and what it prints."""
    at = 0
    while at < len(lines):
        begin = at
        if not lines[at].startswith("$ "):
            raise AssertionError(f"{page}:{first_line + at}: a console shows '$ ' before a command")
        text = lines[at][2:]
        at += 1
        while is_open(text):
            text += "\n" + lines[at]
            at += 1
        prints = []
        while at < len(lines) and not lines[at].startswith("$ "):
            prints.append(lines[at])
            at += 1
        yield Shown(page, first_line + begin, without_comment(text), "block", "\n".join(prints) or None)


def dedent(lines):
    width = min(len(line) - len(line.lstrip()) for line in lines if line.strip())
    return [line[width:] for line in lines]


def shown_in_markdown(page, text):
    """(all that is shown, files that the page shows by name) in their order."""
    lines = text.splitlines()
    shown, files = [], {}
    prose = []
    at = 0

    def end_of_prose():
        shown.extend(inline(page, prose))
        prose.clear()

    while at < len(lines):
        fence = re.match(r"( *)```(\w*) ?(.*)", lines[at])
        if fence:
            begin = at + 1
            at = begin
            while not lines[at].strip().startswith("```"):
                at += 1
            body = [line.removeprefix(fence[1]) for line in lines[begin:at]]
            at += 1
            named = re.search(r"`([^`\s]+\.\w+)`:?$", " ".join(line for _, line in prose[-3:]).rstrip())
            end_of_prose()
            if fence[2] == "console":
                shown.extend(console_of_block(page, begin + 1, body))
            elif fence[2] == "sh":
                shown.extend(commands_of_block(page, begin + 1, body))
            elif fence[2] in PROGRAMS_IN_OTHER_LANGUAGES:
                shown.append(Shown(page, begin + 1, "\n".join(body), fence[2]))
            elif fence[2] in ("toml", "csv") and (fence[3] or named):
                files[fence[3] or named[1]] = "\n".join(body) + "\n"
        elif lines[at].startswith("    ") and (at == 0 or not lines[at - 1].strip() or lines[at - 1].startswith("<!--")):
            begin = at
            while at < len(lines) and (lines[at].startswith("    ") or not lines[at].strip()):
                at += 1
            end_of_prose()
            shown.extend(commands_of_block(page, begin + 1, dedent(lines[begin:at])))
        else:
            prose.append((at + 1, lines[at]))
            at += 1
    end_of_prose()
    return shown, files


def inline(page, numbered_lines):
    """Commands between backquotes."""
    text = "\n".join(line for _, line in numbered_lines)
    for found in re.finditer(r"`([^`]+)`", text):
        words = " ".join(found[1].split())
        line = numbered_lines[text.count("\n", 0, found.start())][0]
        if " " in words and is_command(words) and not MESSAGE.match(words):
            yield Shown(page, line, words, "inline")


def unroff(text):
    text = re.sub(r"\\f(?:.|\[[A-Z]*\])", "", text)
    return text.replace(r"\-", "-").replace(r"\(aq", "'").replace(r"\(ga", "`").replace(r"\(ti", "~").replace(r"\e", "\\")


def shown_in_manual(page, text):
    """What a manual page shows, or its template."""
    lines = text.splitlines()
    shown = []
    within = False
    for number, line in enumerate(lines, 1):
        if line in (".nf", ".fi"):
            within = line == ".nf"
        elif within and is_command(unroff(line)):
            shown.append(Shown(page, number, re.split(r"   +", unroff(line))[0], "block"))
        elif not within and re.match(r"\.B [a-z]", line) and is_command(unroff(line[3:])) and " " in line[3:]:
            shown.append(Shown(page, number, unroff(line[3:]), "inline"))
    return shown


def shown_in_help(page, text):
    shown = []
    for number, line in enumerate(text.splitlines(), 1):
        words = line.strip()
        if words.startswith("Usage:"):
            continue
        if is_command(words) and " " in words and not words.startswith(("build/", "openocd (")) and not re.match(r"\S+: ", words):
            command = re.split(r"  +|, or |: | for (?=tools/)", words)[0].strip()
            shown.append(Shown(page, number, command, "block"))
        shown += [Shown(page, number, found, "inline") for found in re.findall(r"'((?:bush\S+|tools/\S+) [^']+)'", line)]
        if found := re.search(r": (bushd --[^:]*)$", line):
            shown.append(Shown(page, number, found[1], "block"))
    return shown


def markdown_pages(source):
    source = pathlib.Path(source)
    top = [page for page in sorted(source.glob("*.md")) if page.name != "CHANGELOG.md"]
    return [*top, *sorted((source / "docs").rglob("*.md"))]
