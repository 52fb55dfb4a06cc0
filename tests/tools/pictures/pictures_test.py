#!/usr/bin/env python3
"""Pictures of terminals look the same wherever they are shown: each word at its column, and no other glyphs than letters.

$BUSHD_SOURCE_DIR is the source tree."""

import os
import pathlib
import random
import sys
import unicodedata
import unittest

SOURCE = pathlib.Path(os.environ["BUSHD_SOURCE_DIR"])
sys.path[:0] = [str(SOURCE / "tools"), str(SOURCE / "tests/tools")]
from contrast import TEXT, contrast, luminance
from reading import Wrong, colours, read
from terminal_picture import drawing

# The lines below the command: of watch the summary, the heads, five motors and the keys; of the editor all of its terminal.
LINES = {"watch": 8, "tui": 30}
PICTURES = {name: (SOURCE / f"docs/pictures/{name}.svg").read_text() for name in LINES}


class Drawing(unittest.TestCase):
    def test_what_is_read_back_is_what_was_shown(self):
        seed = random.randrange(2**32)
        some = random.Random(seed)
        drawn = [chr(0x2801 + i) for i in range(255)] + [*"─│┌┐└┘├┤┬┴┼╴╵╶╷←→↑↓▀▐"] + [chr(0x2581 + i) for i in range(15)]
        letters = [chr(code) for code in range(0x21, 0x7F)] + [*"²°µé"]
        for _ in range(50):
            lines = ["".join(some.choice(some.choice((letters, drawn, "   "))) for _ in range(60)).rstrip() or "x" for _ in range(8)]
            command = "x".join(some.choices(letters, k=5)) + " two"
            with self.subTest(seed=seed):
                self.assertEqual(read(drawing.picture(command, lines, 60)), (command, lines))

    def test_a_character_that_is_not_drawn_is_refused(self):
        for character in "╭═┅░♥中\u00ad":
            with self.assertRaisesRegex(drawing.NoShape, unicodedata.name(character)):
                drawing.picture("x", [f"a{character}b"], 10)

    def test_an_empty_cell_of_braille_is_a_blank(self):
        self.assertEqual(read(drawing.picture("x", ["a\u2800b"], 10)), ("x", ["a b"]))


class Readme(unittest.TestCase):
    def test_all_words_stand_in_columns(self):
        for name, text in PICTURES.items():
            with self.subTest(name):
                command, lines = read(text)
                self.assertTrue(command.startswith("bush"))
                self.assertEqual(len(lines), LINES[name])

    def test_columns_of_watch_begin_or_end_where_their_heads_do(self):
        """A table: each of its words is below its head."""
        lines = read(PICTURES["watch"])[1]
        head, *rows = [line for line in lines[1:-1] if not line.startswith(" ")]  # not what is said of the motor above
        self.assertEqual(len(rows), 5)
        for column in ("MOTOR", "MCU", "GROUP", "TABLE", "TRUST"):
            begin = head.index(column)
            for line in rows:
                self.assertRegex(f" {line}"[begin : begin + 2], r" \S", f"{column} of {line}")
        for column in ("OUTPUT", "POSITION", "TARGET"):
            end = head.index(column) + len(column)
            for line in rows:
                self.assertRegex(line[end - 1 : end + 1], r"\S ", f"{column} of {line}")

    def test_light_and_dark_can_be_read(self):
        for name, text in PICTURES.items():
            for theme, colour in colours(text).items():
                for ink in ("text", "prompt", "rule", "dots", "block"):
                    with self.subTest(name=name, theme=theme, ink=ink):
                        self.assertGreater(contrast(colour[ink], colour["window"]), TEXT)
            self.assertGreater(luminance(colours(text)["light"]["window"]), 0.8)
            self.assertLess(luminance(colours(text)["dark"]["window"]), 0.05)

    def test_words_that_a_renderer_could_shift_are_refused(self):
        for wrong in ('<text x="12" y="70">a  b</text>', '<text x="13" y="70">a</text>', '<text x="12" y="71">a</text>',
                      '<text x="12" y="70">⣿</text>', '<text x="12" y="70" textLength="9">a</text>',
                      '<text x="12" y="70">a<tspan>b</tspan></text>'):
            with self.subTest(wrong), self.assertRaises(Wrong):
                read(drawing.picture("x", ["a"], 10).replace('<text x="12" y="70">a</text>', wrong))


if __name__ == "__main__":
    unittest.main()
