#!/usr/bin/env python3
"""The pictures of bushtab plot, as files. Standard library only; the program is $BUSHTAB."""

import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest
import xml.etree.ElementTree as ElementTree

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
import png_file
from contrast import OTHERS, TEXT, contrast, luminance

SVG = "{http://www.w3.org/2000/svg}"
FIRST_COLOUR = (0x00, 0x72, 0xB2)
SECOND_COLOUR = (0xD5, 0x5E, 0x00)
GRID = "#dddddd"  # fainter than what must be seen


def hex_colour(colour):
    return "#%02x%02x%02x" % colour


class Pictures(unittest.TestCase):
    def setUp(self):
        self.directory = tempfile.TemporaryDirectory()
        self.addCleanup(self.directory.cleanup)
        self.path = pathlib.Path(self.directory.name)

    def bushtab(self, *arguments):
        return subprocess.run(
            [os.environ["BUSHTAB"], *map(str, arguments), "--dir", self.path],
            capture_output=True,
            text=True,
        )

    def svg(self, *tables):
        done = self.bushtab("plot", *tables, "--svg", self.path / "out.svg")
        self.assertEqual((done.returncode, done.stdout, done.stderr), (0, "", ""))
        return ElementTree.parse(self.path / "out.svg").getroot()

    def more_tables(self, count):
        for i in range(count):
            (self.path / f"t{i}.toml").write_text(f'name = "t{i}"\ntime_unit_ns = {1000 + i}\naccel = [90, 70, 50]\n')
        return [f"t{i}" for i in range(count)]

    def test_svg_has_three_panels_with_units_and_a_legend(self):
        root = self.svg("bushd2-constant", "bushd2-scurve")
        texts = [text.text for text in root.iter(SVG + "text")]
        for wanted in (
            "bushd2-constant",
            "bushd2-scurve",
            "Speed in steps/s over steps",
            "Speed in steps/s over time",
            "Acceleration in steps/s² over time",
            "step",
        ):
            self.assertIn(wanted, texts)
        self.assertEqual(texts.count("ms"), 2)
        self.assertIn("2500", texts)  # the speed axis ends at the tables' top speed

    def test_svg_draws_every_table_in_every_panel_inside_the_sheet(self):
        root = self.svg("bushd2-constant", "bushd2-scurve")
        width, height = float(root.get("width")), float(root.get("height"))
        for colour in (FIRST_COLOUR, SECOND_COLOUR):
            lines = [
                [tuple(map(float, dot.split(","))) for dot in line.get("points").split()]
                for line in root.iter(SVG + "polyline")
                if line.get("stroke") == hex_colour(colour)
            ]
            self.assertEqual(len(lines), 4)  # the legend and three panels
            self.assertTrue(all(0 <= x <= width and 0 <= y <= height for line in lines for x, y in line))
            for line in lines[1:3]:
                top = min(range(len(line)), key=lambda i: line[i][1])
                self.assertTrue(0.4 < (line[top][0] - line[0][0]) / (line[-1][0] - line[0][0]) < 0.6)

    def test_legend_tells_revisions_apart_and_is_escaped(self):
        (self.path / "t.toml").write_text(
            'name = "a<b & c"\nrevision = 4\ntime_unit_ns = 1000\naccel = [90, 70, 50]\n'
        )
        texts = [text.text for text in self.svg("t").iter(SVG + "text")]
        self.assertIn("a<b & c, revision 4", texts)

    def test_table_of_one_speed_can_be_drawn(self):
        (self.path / "flat.toml").write_text('name = "flat"\ntime_unit_ns = 1000\naccel = [50]\n')
        self.assertEqual(len(list(self.svg("flat").iter(SVG + "polyline"))) > 3, True)

    def test_svg_is_dark_where_the_reader_prefers_that_and_seen_either_way(self):
        root = self.svg("bushd2-constant", *self.more_tables(6))
        style = root.find(SVG + "style").text
        dark = re.fullmatch(r"@media\(prefers-color-scheme:dark\)\{(.*)\}", style)[1]
        sheet, text = (re.search(rf"\b{element}\{{fill:(#\w+)\}}", dark)[1] for element in ("rect", "text"))
        self.assertLess(luminance(sheet), 0.05)
        self.assertGreater(contrast(text, sheet), TEXT)
        colours = {line.get("stroke") for line in root.iter(SVG + "polyline")}
        self.assertGreaterEqual(len(colours), 9)  # seven curves, axes and grid
        for colour in colours - {GRID}:
            on_dark = re.search(rf'\[stroke="{colour}"\]\{{stroke:(#\w+)\}}', dark)
            self.assertGreater(contrast(on_dark[1] if on_dark else colour, sheet), OTHERS, colour)

    def test_svg_of_a_long_table_has_only_what_can_be_seen(self):
        codes = ", ".join(str(40000 - i // 2) for i in range(65000))
        (self.path / "long.toml").write_text(
            f'name = "long"\ntime_unit_ns = 100\naccel = [{codes}]\ncruise = 7500\n'
        )
        self.svg("long")
        self.assertLess((self.path / "out.svg").stat().st_size, 200_000)

    def test_same_table_gives_the_same_bytes(self):
        self.svg("bushd2-scurve")
        first = (self.path / "out.svg").read_bytes()
        self.svg("bushd2-scurve")
        self.assertEqual((self.path / "out.svg").read_bytes(), first)

    def test_png_decodes_and_shows_both_tables(self):
        done = self.bushtab("plot", "bushd2-constant", "bushd2-scurve", "--png", self.path / "out.png")
        self.assertEqual((done.returncode, done.stdout), (0, ""))
        width, height, rows = png_file.pixels((self.path / "out.png").read_bytes())
        colours = {colour for row in rows for colour in row}
        root = self.svg("bushd2-constant", "bushd2-scurve")
        self.assertEqual((width, height), (int(root.get("width")), int(root.get("height"))))
        for colour in (FIRST_COLOUR, SECOND_COLOUR, (255, 255, 255), (0, 0, 0)):
            self.assertIn(colour, colours)

    def test_file_that_cannot_be_written_is_refused(self):
        done = self.bushtab("plot", "bushd2-constant", "--svg", self.path / "none" / "out.svg")
        self.assertEqual(done.returncode, 1)
        self.assertIn("none", done.stderr)

    def test_steps_have_delay_time_speed_and_acceleration(self):
        (self.path / "t.toml").write_text(
            'name = "t"\ntime_unit_ns = 1000\naccel = [100, 50]\ndecel = [50, 80, 100]\n'
        )
        lines = self.bushtab("show", "t", "--steps").stdout.splitlines()
        # 10000 to 20000 steps/s between the middles of delays of 100 and 50 us
        self.assertEqual(lines[-5].split(), "2 accel 1 50.000 0.150000 20000 1.33333e+08".split())
        self.assertEqual(lines[-4].split(), "3 cruise 0 50.000 0.200000 20000 0".split())
        self.assertEqual(lines[-1].split()[:6], "6 decel 2 100.000 0.430000 10000".split())
        self.assertIn('"steps_per_s2": null', self.bushtab("show", "t", "--steps", "--json").stdout)


if __name__ == "__main__":
    unittest.main()
