#!/usr/bin/env python3
"""The pictures of bushtab plot, as files. Standard library only; the program is $BUSHTAB."""

import os
import pathlib
import struct
import subprocess
import tempfile
import unittest
import xml.etree.ElementTree as ElementTree
import zlib

SVG = "{http://www.w3.org/2000/svg}"
FIRST_COLOUR = (0x00, 0x72, 0xB2)
SECOND_COLOUR = (0xD5, 0x5E, 0x00)


def hex_colour(colour):
    return "#%02x%02x%02x" % colour


def png_pixels(data):
    """Width, height and the set of colours of an RGB PNG: unpacks and unfilters it."""
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    at, packed = 8, b""
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at : at + 8])
        body = data[at + 8 : at + 8 + length]
        assert zlib.crc32(kind + body) == struct.unpack(">I", data[at + 8 + length :][:4])[0]
        if kind == b"IHDR":
            width, height, depth, colour_type = struct.unpack(">IIBB", body[:10])
            assert (depth, colour_type) == (8, 2)
        elif kind == b"IDAT":
            packed += body
        at += 12 + length
    raw = zlib.decompress(packed)
    stride = 3 * width
    above = bytearray(stride)
    colours = set()
    for row in range(height):
        kind = raw[row * (stride + 1)]
        line = bytearray(raw[row * (stride + 1) + 1 : (row + 1) * (stride + 1)])
        for i in range(stride):
            left = line[i - 3] if i >= 3 else 0
            corner = above[i - 3] if i >= 3 else 0
            up = above[i]
            if kind == 1:
                guess = left
            elif kind == 2:
                guess = up
            elif kind == 3:
                guess = (left + up) // 2
            elif kind == 4:
                slope = left + up - corner
                guess = min((left, up, corner), key=lambda value: abs(slope - value))
            else:
                guess = 0
            line[i] = (line[i] + guess) & 0xFF
        colours.update(zip(line[0::3], line[1::3], line[2::3]))
        above = line
    return width, height, colours


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
        width, height, colours = png_pixels((self.path / "out.png").read_bytes())
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
