#!/usr/bin/env python3
"""Pictures as Chromium and librsvg show them: words stand in the columns of the terminal, and what is blank there is blank.

Where the programs are (tools/setup --pictures); else it is skipped. $BUSHD_SOURCE_DIR is the source tree."""

import contextlib
import html
import os
import pathlib
import sys
import tempfile
import unittest

SOURCE = pathlib.Path(os.environ["BUSHD_SOURCE_DIR"])
sys.path[:0] = [str(SOURCE / "tools"), str(SOURCE / "tests/tools")]
import png_file
from reading import COLUMN, LEFT, LINE, TOP, Wrong, read
from terminal_picture import rendering

PICTURES = sorted((SOURCE / "docs/pictures").glob("*.svg"))
# A letter of DejaVu Sans Mono is 0.602 of its size wide, so 0.03 px wider than a column.
WIDER = 0.03
# A part of a cell's sides, px: what smoothed edges of its neighbours may reach into, and half of how far the last letter of a long word stands
# to the right of its column.
EDGE = 1.2
# The largest difference of a colour's parts that is no ink: what smoothing leaves beyond the edge.
PAPER = 24


def inked_cells(png):
    """Line and column of cells with ink, the line with the command being line 0."""
    width, height, rows = png_file.pixels(png.read_bytes())
    paper = rows[TOP + 2][4]
    found = set()
    for line in range((height - TOP) // LINE):
        for column in range(round((width - 2 * LEFT) / COLUMN)):
            left = LEFT + COLUMN * column
            inside = slice(round(left + EDGE), round(left + COLUMN - EDGE))
            lines = rows[TOP + LINE * line : TOP + LINE * (line + 1)]
            if any(max(abs(a - b) for a, b in zip(pixel, paper)) > PAPER for row in lines for pixel in row[inside]):
                found.add((line, column))
    return found


def cells(lines):
    return {(row, column) for row, line in enumerate(lines) for column, character in enumerate(line) if character != " "}


def faults_of_words(picture, terminal):
    """What is not where the picture says, or of a terminal wider than its columns."""
    width, height = rendering.size(picture.read_text())
    for word in rendering.words(picture):
        at = {"start": word["left"], "middle": (word["left"] + word["right"]) / 2, "end": word["right"]}[word["anchor"]]
        if abs(at - word["x"]) > 0.5:  # px
            yield f"{word['text']!r} stands at {at:.1f}, not {word['x']}"
        if not (0 <= word["left"] and word["right"] <= width and 0 <= word["top"] and word["bottom"] <= height):
            yield f"{word['text']!r} reaches beyond the picture"
        if terminal and not 0 < word["width"] <= (COLUMN + WIDER) * len(word["text"]) + 0.1:
            yield f"{word['text']!r} is {word['width']:.1f} px wide"


# As pictures were once: Chromium does away with the blanks, and stretches the rest over the line.
OLD = ('<svg xmlns="http://www.w3.org/2000/svg" width="400" height="100" viewBox="0 0 400 100"><rect width="400" height="100" fill="#fff"/>'
       '<g font-family="DejaVu Sans Mono" font-size="14" xml:space="preserve">'
       '<text x="12" y="70" textLength="252" lengthAdjust="spacingAndGlyphs">{line}</text></g></svg>')


@unittest.skipIf(rendering.missing(), f"not there: {', '.join(rendering.missing())}")
class Rendered(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        folder = tempfile.TemporaryDirectory()
        cls.addClassCleanup(folder.cleanup)
        cls.folder = pathlib.Path(folder.name)
        cls.terminals = {}
        for picture in PICTURES:
            with contextlib.suppress(Wrong):  # a plot
                command, lines = read(picture.read_text())
                cls.terminals[picture] = [f"$ {command}", *lines]
        assert len(cls.terminals) == 2
        cls.rendered = list(rendering.render(PICTURES, cls.folder))

    def test_chromium_puts_words_where_the_terminal_has_them(self):
        for picture in PICTURES:
            with self.subTest(picture.name):
                self.assertEqual(list(faults_of_words(picture, picture in self.terminals)), [])

    def test_ink_is_where_the_terminal_has_characters(self):
        for picture, program, theme, png in self.rendered:
            if picture in self.terminals:
                with self.subTest(picture=picture.name, program=program, theme=theme):
                    self.assertEqual(sorted(inked_cells(png) ^ cells(self.terminals[picture])), [])

    def test_pictures_are_light_or_dark_as_the_reader_prefers(self):
        for picture, program, theme, png in self.rendered:
            rows = png_file.pixels(png.read_bytes())[2]
            brightness = sum(sum(pixel) for row in rows for pixel in row) / sum(map(len, rows)) / 3 / 255
            with self.subTest(picture=picture.name, program=program):
                self.assertTrue(brightness > 0.8 if theme == "light" else brightness < 0.2, f"{theme}: {brightness:.2f}")

    def test_a_picture_that_is_not_the_same_everywhere_is_found(self):
        line = "MOTOR       MCU     TABLE       "[:30].rstrip()
        picture = self.folder / "old.svg"
        picture.write_text(OLD.format(line=html.escape(line)))
        png = self.folder / "old.png"
        rendering.SHOWN_BY["chromium"](picture, "light", png)
        self.assertNotEqual(inked_cells(png), cells(["", line]))


if __name__ == "__main__":
    unittest.main()
