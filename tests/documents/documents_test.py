#!/usr/bin/env python3
"""Pages link only to what is there, every page can be reached, and files and functions that are named exist.

$BUSHD_SOURCE_DIR is the source tree."""

import os
import pathlib
import re
import unittest

SOURCE = pathlib.Path(os.environ["BUSHD_SOURCE_DIR"])
DOCS = SOURCE / "docs"
PAGES = [*sorted(SOURCE.glob("*.md")), *sorted(DOCS.rglob("*.md"))]


def prose(page):
    """The page without its code blocks."""
    text = re.sub(r"^```.*?^```$", "", page.read_text(), flags=re.DOTALL | re.MULTILINE)
    return re.sub(r"^    .*$", "", text, flags=re.MULTILINE)


def anchors(page):
    """The anchors of all headings, as a forge makes them: lower case, punctuation left out, blanks as hyphens."""
    headings = re.findall(r"^#+ (.*)$", prose(page), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def links(page):
    """Yields (target as written, file, anchor or "") of all links within the tree."""
    for target in re.findall(r"\]\(([^)\s]+)\)", prose(page)):
        if re.match(r"\w+:", target):
            continue
        path, _, anchor = target.partition("#")
        yield target, (page.parent / path).resolve() if path else page, anchor


class Documents(unittest.TestCase):
    def test_links_lead_somewhere(self):
        for page in PAGES:
            for target, path, anchor in links(page):
                with self.subTest(page=str(page.relative_to(SOURCE)), link=target):
                    self.assertTrue(path.exists(), "there is no such file")
                    if anchor:
                        self.assertIn(anchor, anchors(path), "there is no such heading")

    def test_every_page_can_be_reached_from_the_index(self):
        index = DOCS / "README.md"
        entries = re.findall(r"^- \[[^\]]*\]\(([^)#]+)\)", index.read_text(), re.MULTILINE)
        self.assertEqual([page for page in set(entries) if entries.count(page) > 1], [], "docs/README.md has them twice")
        listed = {path for _, path, _ in links(index)}
        for page in sorted(DOCS.glob("*.md")):
            with self.subTest(page=page.name):
                self.assertTrue(page == index or page in listed, "docs/README.md does not name it")
        decisions = {path for _, path, _ in links(DOCS / "design.md")}
        for page in sorted((DOCS / "decisions").glob("*.md")):
            with self.subTest(page=page.name):
                self.assertIn(page, decisions, "docs/design.md does not list it")

    def test_tables_have_heads_and_headings_stand_alone(self):
        """A row behind an empty line is text, not a row; so is a heading right behind text for some readers."""
        for page in PAGES:
            lines = ["", *prose(page).splitlines(), ""]
            for number, (before, line, behind) in enumerate(zip(lines, lines[1:], lines[2:]), 1):
                with self.subTest(page=str(page.relative_to(SOURCE)), line=number):
                    if line.startswith("|") and not before.startswith("|"):
                        self.assertRegex(behind, r"^\|( *:?-+:? *\|)+$", "a table begins with a head and a line of hyphens")
                    if line.startswith("#"):
                        self.assertEqual((before, behind), ("", ""), "a heading has empty lines around it")

    def test_files_that_the_recipes_name_are_there(self):
        named = re.findall(
            r"`((?:cmake|daemon|docs|firmware|lib|tables|tests|tools)/[\w./-]+)`", (SOURCE / "CONTRIBUTING.md").read_text()
        )
        self.assertGreater(len(named), 20, "no files were found in CONTRIBUTING.md")
        for path in named:
            with self.subTest(path):
                stands_for_another = "CHIP" in path or "NAME" in path
                self.assertTrue(stands_for_another or (SOURCE / path).exists(), "mend CONTRIBUTING.md")

    def test_protocol_lists_every_capability(self):
        header = (SOURCE / "lib/engine/message_setup.h").read_text()
        bits = {1 << int(shift) for shift in re.findall(r"\bBUSHD_CAN_\w+ = 1 << (\d+),", header)}
        bits |= {int(value, 16) for value in re.findall(r"#define BUSHD_CAN_\w+ UINT32_C\((0x[0-9a-fA-F]+)\)", header)}
        self.assertEqual(len(bits), len(set(re.findall(r"\bBUSHD_CAN_[A-Z]\w*\b(?= =| UINT32_C)", header))))
        table = re.search(r"^\| capability \| \|\n(.*?)\n\n", (DOCS / "protocol.md").read_text(), re.DOTALL | re.MULTILINE)
        listed = [int(bit) for bit in re.findall(r"^\| (\d+) \|", table[1], re.MULTILINE)]
        self.assertEqual(listed, sorted(bits), "mend the table of capabilities in docs/protocol.md")

    def test_map_of_the_code_names_functions_that_are_there(self):
        rows = re.findall(
            r"^\|[^|]*\| `([\w:]+)` \| \[[^\]]*\]\(([^)]*)\)", (DOCS / "design.md").read_text(), re.MULTILINE
        )
        self.assertGreater(len(rows), 20, "the tables of docs/design.md were not found")
        for function, path in rows:
            with self.subTest(function=function, file=path):
                name = function.rsplit("::", 1)[-1]
                self.assertRegex((DOCS / path).read_text(), rf"\b{name}\(", "mend the row in docs/design.md")


if __name__ == "__main__":
    unittest.main()
