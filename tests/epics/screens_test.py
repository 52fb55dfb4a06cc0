#!/usr/bin/env python3
"""Screens of Phoebus: what they name is there, each motor has one, and what others have written stays."""

import os
import pathlib
import re
import tempfile
import unittest
import xml.etree.ElementTree as ET

from bushd_epics import screens, trigger
from bushd_epics.fields import FIELDS

PREFIX = "LAB:"
MOTORS = ("theta", "hall:slit<1>", "Theta", "a-b")
RECORDS = [PREFIX + motor for motor in MOTORS]
VARIABLES = {f"{record}.{field}" for record in RECORDS for field in FIELDS} | {f"{record}_able" for record in RECORDS} | {"LAB:allstop", "LAB:deferMoves"}
VARIABLES |= {f"{record}{field}" for record in RECORDS for field in trigger.FIELDS}
# What widgets of Phoebus there are, with the version of each whose properties these are.
WIDGETS = {
    "label": "2.0.0", "textupdate": "2.0.0", "textentry": "3.0.0", "choice": "2.0.0", "led": "2.0.0", "byte_monitor": "2.0.0",
    "action_button": "3.0.0", "bool_button": "2.0.0", "embedded": "2.0.0",
}  # fmt: skip


def expand(text, macros):
    return re.sub(r"\$\((\w+)\)", lambda found: macros[found[1]], text)


class Reader:
    """Opens a display as Phoebus does: with macros of its own, of who embeds it, and of buttons that open others."""

    def __init__(self, folder):
        self.folder = folder
        self.opened = set()  # (file, macros)
        self.variables = set()

    def open(self, file, macros):
        key = (file, tuple(sorted(macros.items())))
        if key in self.opened:
            return
        self.opened.add(key)
        root = ET.fromstring((self.folder / file).read_bytes())
        macros = macros | macros_of(root)
        for parent in root.iter():
            for name in parent.findall("pv_name"):
                self.variables.add(expand(name.text, macros))
        for widget in [*root.iter("widget"), *root.iter("action")]:
            if widget.find("file") is not None:
                self.open(widget.find("file").text, macros | macros_of(widget))


def macros_of(element):
    found = element.find("macros")
    return {} if found is None else {one.tag: one.text for one in found}


class Screens(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name, "new", "screens")

    def write(self, records=RECORDS):
        screens.write(self.folder, screens.make(PREFIX, records))

    def names(self):
        return sorted(file.name for file in self.folder.iterdir())

    def test_every_name_is_that_of_a_variable(self):
        self.write()
        reader = Reader(self.folder)
        reader.open("overview.bob", {})
        for file in self.folder.glob("motor-*.bob"):
            reader.open(file.name, {})
        self.assertEqual({name for name in reader.variables if not name.startswith("ca://")}, set())
        named = {name.removeprefix("ca://").removesuffix("$") for name in reader.variables}
        self.assertEqual(named - VARIABLES, set())
        for record in RECORDS:
            for field in (".VAL", ".RBV", ".STOP", ".MSTA", ".AMSG", "_trgArm"):
                self.assertIn(f"{record}{field}", named)
        self.assertEqual({file for file, _ in reader.opened}, set(self.names()), "one is opened by nobody")

    def test_each_motor_has_a_screen_whatever_its_name(self):
        self.write()
        files = sorted(file for file in self.names() if file.startswith("motor-"))
        self.assertEqual(files, ["motor-Theta.bob", "motor-a-b.bob", "motor-hall_slit_1_.bob", "motor-theta_2.bob"])
        opened = {}
        for file in files:
            (embedded,) = ET.fromstring((self.folder / file).read_bytes()).iter("widget")
            opened[file] = macros_of(embedded)
        self.assertEqual({tuple(macros.values()) for macros in opened.values()}, {(PREFIX, motor) for motor in MOTORS})
        self.assertEqual(opened["motor-hall_slit_1_.bob"], {"P": PREFIX, "M": "hall:slit<1>"})

    def test_widgets_are_those_of_phoebus_within_their_display_and_apart(self):
        self.write(["LAB:theta"])
        for file in self.folder.iterdir():
            root = ET.fromstring(file.read_bytes())
            self.assertEqual((root.tag, root.get("version")), ("display", "2.0.0"))
            width, height = int(root.findtext("width")), int(root.findtext("height"))
            boxes = []
            for widget in root.iter("widget"):
                self.assertEqual(widget.get("version"), WIDGETS[widget.get("type")])
                left, top, wide, high = (int(widget.findtext(key)) for key in ("x", "y", "width", "height"))
                self.assertTrue(0 <= left and left + wide <= width and 0 <= top and top + high <= height, f"{file.name}: {widget.findtext('name')}")
                for name, (x, y, w, h) in boxes:
                    apart = left >= x + w or x >= left + wide or top >= y + h or y >= top + high
                    self.assertTrue(apart, f"{file.name}: {widget.findtext('name')} lies on {name}")
                boxes.append((widget.findtext("name"), (left, top, wide, high)))

    def test_what_is_written_again_follows_the_installation(self):
        self.write()
        self.write(["LAB:phi"])
        self.assertEqual(self.names(), ["motor-phi.bob", "motor.bob", "overview.bob", "row.bob", "trigger.bob"])
        (embedded,) = ET.fromstring((self.folder / "overview.bob").read_bytes()).iterfind("widget[@type='embedded']")
        self.assertEqual(macros_of(embedded)["M"], "phi")
        self.assertEqual((self.folder / "motor.bob").stat().st_mode & 0o777, 0o644)

    def test_files_of_others_stay_and_nothing_is_written_beside_them(self):
        self.folder.mkdir(parents=True)
        (self.folder / "notes.txt").write_text("mine")
        (self.folder / "motor-old.bob").write_text("<display/>")
        self.write()
        self.assertEqual(((self.folder / "notes.txt").read_text(), (self.folder / "motor-old.bob").read_text()), ("mine", "<display/>"))
        before = {file.name: file.read_bytes() for file in self.folder.iterdir()}
        (self.folder / "row.bob").write_text("<display/>")
        with self.assertRaisesRegex(screens.NotOurs, "row.bob"):
            self.write(["LAB:phi"])
        self.assertEqual({file.name: file.read_bytes() for file in self.folder.iterdir()}, before | {"row.bob": b"<display/>"})

    def test_a_link_is_not_followed(self):
        self.folder.mkdir(parents=True)
        other = self.folder.parent / "other"
        other.write_text(screens.MARK)
        (self.folder / "motor.bob").symlink_to(other)
        with self.assertRaises(screens.NotOurs):
            self.write()
        self.assertEqual((other.read_text(), self.names()), (screens.MARK, ["motor.bob"]))

    def test_a_file_that_cannot_be_written_leaves_the_old_one_and_nothing_else(self):
        self.write()
        before = {file.name: file.read_bytes() for file in self.folder.iterdir()}
        replace = os.replace

        def fails(source, target):
            if pathlib.Path(target).name == "overview.bob":
                raise OSError("no space left on device")
            replace(source, target)

        os.replace = fails
        self.addCleanup(setattr, os, "replace", replace)
        with self.assertRaises(OSError):
            self.write(["LAB:theta", "LAB:phi"])
        self.assertEqual((self.folder / "overview.bob").read_bytes(), before["overview.bob"])
        self.assertEqual([name for name in self.names() if not name.endswith(".bob")], [])


if __name__ == "__main__":
    unittest.main()
