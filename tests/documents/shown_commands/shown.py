"""All that a page shows. Pages are Markdown files, manual pages and `help`: what --help of the programs says."""

import functools
import itertools
import os
import pathlib
import re
import subprocess

import pages

SOURCE = pathlib.Path(os.environ["BUSHD_SOURCE_DIR"])
BUILD = pathlib.Path(os.environ.get("BUSHD_BUILD_DIR", SOURCE / "build/release"))
SCRIPTS = ("bench", "check-pulses", "check-trace", "demo", "format", "lint", "man-page", "package", "pictures", "setup", "test", "test-install", "test-on")


def all_pages():
    markdown = [str(page.relative_to(SOURCE)) for page in pages.markdown_pages(SOURCE)]
    manuals = [str(page.relative_to(SOURCE)) for page in sorted((SOURCE / "docs/man").glob("*.[1-8]*"))]
    return [*markdown, *manuals, "help"]


def shown_on(page):
    """(what it shows in its order, files that it shows by name)"""
    if page == "help":
        return list(shown_by_help()), {}
    text = (SOURCE / page).read_text()
    if page.endswith(".md"):
        return pages.shown_in_markdown(page, text)
    return pages.shown_in_manual(page, text), {}


@functools.cache
def help_of(*command):
    return subprocess.run([*command, "--help"], capture_output=True, text=True, check=True).stdout


def programs():
    """Each program and subcommand that has a --help, as a command line."""
    for name in ("bushd", "bushsim", "bushctl", "bushd-web", "bushtab", "bushfaults"):
        yield from with_subcommands([str(BUILD / "bin" / name)])
    yield [str(SOURCE / "tools/flash/bushd-flash")]
    for name in SCRIPTS:
        yield [str(SOURCE / "tools" / name)]


def with_subcommands(command):
    yield command
    if below := re.search(r"^Subcommands:\n(.*?)(?:\n\n|\Z)", help_of(*command), re.DOTALL | re.MULTILINE):
        for word in re.findall(r"^  ([a-z0-9-]+)", below[1], re.MULTILINE):
            yield from with_subcommands([*command, word])


def shown_by_help():
    for program, *words in programs():
        name = pathlib.Path(program).name if program.startswith(str(BUILD)) else pathlib.Path(program).relative_to(SOURCE)
        yield from pages.shown_in_help(" ".join([str(name), *words, "--help"]), help_of(program, *words))


def what_is_missing(text):
    """What a command that is only named, or a part of one, lacks: '' if the program has this subcommand and these options."""
    name, *words = text.removeprefix("sudo ").split()
    program = str(SOURCE / "tools/flash" / name if name == "bushd-flash" else BUILD / "bin" / name)
    names = list(itertools.takewhile(re.compile("[a-z][a-z-]*").fullmatch, words))
    while names and [program, *names] not in [*programs()]:
        if len(names) == 1:
            return f"{name} has no command {names[0]}"
        names.pop()
    text = help_of(program, *names)
    return ", ".join(f"no option {word}" for word in words if word.startswith("--") and not re.search(rf"{word}\b", text))
