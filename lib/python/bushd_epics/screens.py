"""Screens of Phoebus for the motors of an installation: an overview, and a screen of each motor.

All motors have the same screen, motor.bob, with the macros P (prefix) and M (name behind it). A file for each motor, motor-NAME.bob,
opens it with these macros; the overview shows a row of each motor, row.bob. Names are given as ca://, since Phoebus speaks PV Access
first, and the bridge may have Channel Access alone.
"""

from __future__ import annotations

import contextlib
import os
import pathlib
import re
import tempfile
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Mapping

MARK = "written by bushd-epics, and written anew by it: change a copy of another name"  # no hyphens: it stands in a comment
LOOKED_AT_BYTES = 1000  # of a file that is there: the mark stands at its beginning

STRING = 6  # what Phoebus calls formats
PUSH = 1  # a button that is 1 as long as it is pressed
Box = tuple[int, int, int, int]  # left, top, width, height
Macros = Mapping[str, str]

RED, GREEN, GREY, DARK = (224, 64, 48), (60, 200, 80), (225, 225, 225), (90, 90, 90)
TITLE_HEIGHT, ROW_HEIGHT, OVERVIEW_WIDTH = 44, 32, 900

MSTA = (
    (0, "up"), (1, "done"), (2, "plus limit"), (13, "minus limit"), (3, "home switch"), (14, "position known"),
    (5, "drivers enabled"), (10, "moves"), (6, "fault"), (9, "problem"), (12, "not heard of"),
)  # fmt: skip


class NotOurs(Exception):
    """A file of this name is there that bushd-epics has not written."""


def make(prefix: str, records: Iterable[str]) -> dict[str, bytes]:
    """Files by name, for records whose names begin with the prefix; the overview is the last one, as it needs the others."""
    motors = sorted(name.removeprefix(prefix) for name in records)
    screens = {"motor.bob": _motor(), "row.bob": _row(), "trigger.bob": _trigger()}
    for motor, file in _files(motors).items():
        screens[file] = _wrapper(prefix, motor)
    screens["overview.bob"] = _overview(prefix, motors)
    return screens


def write(folder: pathlib.Path, screens: Mapping[str, bytes]) -> None:
    """Raises NotOurs before anything is written, OSError.

    A file is there as a whole, the old one or the new one. Those of motors that are gone are removed. What others have written stays.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for name in screens:
        if os.path.lexists(folder / name) and not _is_ours(folder / name):
            raise NotOurs(f"{folder / name} is not a file that bushd-epics has written, and is left as it is: move it, or name another folder")
    for name, content in screens.items():
        _replace(folder / name, content)
    for old in folder.glob("motor-*.bob"):
        if old.name not in screens and _is_ours(old):
            old.unlink()


def _is_ours(file: pathlib.Path) -> bool:
    if file.is_symlink() or not file.is_file():
        return False
    with file.open("rb") as content:
        return MARK.encode() in content.read(LOOKED_AT_BYTES)


def _replace(file: pathlib.Path, content: bytes) -> None:
    number, temporary = tempfile.mkstemp(dir=file.parent, prefix=".bushd-epics-")
    try:
        with os.fdopen(number, "wb") as new:
            os.fchmod(new.fileno(), 0o644)
            new.write(content)
            new.flush()
            os.fsync(new.fileno())
        os.replace(temporary, file)
    except BaseException:
        with contextlib.suppress(FileNotFoundError):
            os.unlink(temporary)
        raise


def _files(motors: list[str]) -> dict[str, str]:
    """By motor. Some file systems take capitals for small letters, and characters of EPICS for none of theirs."""
    files: dict[str, str] = {}
    taken: set[str] = set()
    for motor in motors:
        plain = re.sub(r"[^A-Za-z0-9_-]", "_", motor)
        name, number = plain, 1
        while name.lower() in taken:
            number += 1
            name = f"{plain}_{number}"
        taken.add(name.lower())
        files[motor] = f"motor-{name}.bob"
    return files


class Page:
    """A display, widget by widget."""

    def __init__(self, name: str, width: int, height: int, macros: Macros | None = None) -> None:
        self._root = ET.Element("display", version="2.0.0")
        self._root.append(ET.Comment(MARK))
        _add(self._root, name=name, width=width, height=height)
        _add_macros(self._root, macros or {})
        self._count = 0

    def bytes(self) -> bytes:
        ET.indent(self._root)
        return b'<?xml version="1.0" encoding="UTF-8"?>\n' + ET.tostring(self._root) + b"\n"

    def label(self, text: str, box: Box, size: int = 14, bold: bool = False) -> None:
        widget = self._widget("label", box, text=text, vertical_alignment=1)
        ET.SubElement(ET.SubElement(widget, "font"), "font", family="Liberation Sans", style="BOLD" if bold else "REGULAR", size=str(size))

    def shows(self, name: str, box: Box, units: bool = False, text: bool = False) -> None:
        more: dict[str, object] = {"format": STRING} if text else {}
        self._widget("textupdate", box, "2.0.0", pv_name=name, show_units=units, vertical_alignment=1, **more)

    def takes(self, name: str, box: Box) -> None:
        self._widget("textentry", box, "3.0.0", pv_name=name, show_units=False)

    def chooses(self, name: str, box: Box) -> None:
        self._widget("choice", box, pv_name=name, items_from_pv=True)

    def lamp(self, name: str, box: Box, on: tuple[int, int, int] = GREEN) -> None:
        _add_color(self._widget("led", box, pv_name=name, on_label="", off_label=""), on_color=on, off_color=DARK)

    def bit(self, name: str, bit: int, box: Box) -> None:
        _add_color(self._widget("byte_monitor", box, pv_name=name, startBit=bit, numBits=1), on_color=GREEN, off_color=DARK)

    def puts(self, text: str, name: str, box: Box, color: tuple[int, int, int] = GREY) -> None:
        """1, when it is pressed."""
        widget = self._widget("action_button", box, "3.0.0", pv_name=name, text=text)
        action = ET.SubElement(ET.SubElement(widget, "actions"), "action", type="write_pv")
        _add(action, pv_name=name, value=1, description=text)
        _add_color(widget, background_color=color)

    def holds(self, text: str, name: str, box: Box) -> None:
        """1, as long as it is pressed."""
        self._widget("bool_button", box, pv_name=name, on_label=text, off_label=text, show_led=False, mode=PUSH)

    def opens(self, text: str, file: str, box: Box) -> None:
        widget = self._widget("action_button", box, "3.0.0", text=text)
        action = ET.SubElement(ET.SubElement(widget, "actions"), "action", type="open_display")
        _add(action, file=file, target="tab", description=text)

    def embeds(self, file: str, macros: Macros, box: Box) -> None:
        _add_macros(self._widget("embedded", box, file=file), macros)

    def _widget(self, kind: str, box: Box, version: str = "2.0.0", **properties: object) -> ET.Element:
        self._count += 1
        left, top, width, height = box
        widget = ET.SubElement(self._root, "widget", type=kind, version=version)
        _add(widget, name=f"{kind} {self._count}", x=left, y=top, width=width, height=height, **properties)
        return widget


def _add(parent: ET.Element, **properties: object) -> None:
    for key, value in properties.items():
        ET.SubElement(parent, key).text = str(value).lower() if isinstance(value, bool) else str(value)


def _add_color(parent: ET.Element, **colors: tuple[int, int, int]) -> None:
    for key, (red, green, blue) in colors.items():
        ET.SubElement(ET.SubElement(parent, key), "color", red=str(red), green=str(green), blue=str(blue))


def _add_macros(parent: ET.Element, macros: Macros) -> None:
    if macros:
        _add(ET.SubElement(parent, "macros"), **macros)


def _field(name: str) -> str:
    return f"ca://$(P)$(M).{name}"


def _trg(name: str) -> str:
    return f"ca://$(P)$(M)_trg{name}"


REASON = _field("AMSG") + "$"  # as long as it is: a text of Channel Access has 40 characters
ALL_STOP = "ca://$(P)allstop"
ABLE = "ca://$(P)$(M)_able"


# -- the screens


def _wrapper(prefix: str, motor: str) -> bytes:
    page = Page(f"{prefix}{motor}", 640, 640)
    page.embeds("motor.bob", {"P": prefix, "M": motor}, (0, 0, 640, 640))
    return page.bytes()


def _overview(prefix: str, motors: list[str]) -> bytes:
    page = Page(f"Motors of {prefix}", OVERVIEW_WIDTH, TITLE_HEIGHT + ROW_HEIGHT * len(motors), {"P": prefix})
    page.label("Motors of $(P)", (10, 8, 400, 28), 20, bold=True)
    page.puts("Stop all", ALL_STOP, (OVERVIEW_WIDTH - 130, 8, 120, 28), RED)
    for row, motor in enumerate(motors):
        page.embeds("row.bob", {"P": prefix, "M": motor}, (0, TITLE_HEIGHT + ROW_HEIGHT * row, OVERVIEW_WIDTH, ROW_HEIGHT))
    return page.bytes()


def _row() -> bytes:
    page = Page("$(P)$(M)", OVERVIEW_WIDTH, ROW_HEIGHT)
    page.opens("$(M)", "motor.bob", (10, 4, 150, 24))
    page.shows(_field("RBV"), (170, 4, 130, 24), units=True)
    page.takes(_field("VAL"), (305, 4, 110, 24))
    page.puts("<", _field("TWR"), (425, 4, 28, 24))
    page.takes(_field("TWV"), (457, 4, 70, 24))
    page.puts(">", _field("TWF"), (531, 4, 28, 24))
    page.lamp(_field("LLS"), (570, 6, 20, 20), RED)
    page.lamp(_field("MOVN"), (594, 6, 20, 20))
    page.lamp(_field("HLS"), (618, 6, 20, 20), RED)
    page.puts("Stop", _field("STOP"), (650, 4, 60, 24), RED)
    page.shows(REASON, (720, 4, 170, 24), text=True)
    return page.bytes()


def _motor() -> bytes:
    page = Page("$(P)$(M)", 640, 640)
    page.label("$(P)$(M)", (10, 8, 300, 28), 20, bold=True)
    page.shows(_field("DESC"), (320, 10, 220, 24), text=True)
    page.opens("Trigger", "trigger.bob", (550, 8, 80, 28))
    _add_positions(page, 46)
    _add_moves(page, 204)
    _add_settings(page, 300)
    _add_state(page, 460)
    return page.bytes()


def _trigger() -> bytes:
    page = Page("Trigger of $(P)$(M)", 420, 190)
    page.label("Trigger of $(P)$(M)", (10, 8, 400, 28), 20, bold=True)
    page.label("Edge", (10, 46, 105, 24))
    page.chooses(_trg("Edge"), (120, 46, 160, 24))
    for row, (title, name) in enumerate((("Delay, us", "Delay"), ("Distance", "Distance"))):
        at = 76 + 26 * row
        page.label(title, (10, at, 105, 22))
        page.takes(_trg(name), (120, at, 160, 22))
    page.shows(_trg("State"), (300, 46, 110, 24))
    page.puts("Arm", _trg("Arm"), (300, 76, 110, 28))
    page.puts("Stop", _field("STOP"), (300, 110, 110, 28), RED)
    page.shows(_trg("Message"), (10, 156, 400, 24), text=True)
    return page.bytes()


def _add_positions(page: Page, top: int) -> None:
    for column, title in enumerate(("user", "dial", "steps")):
        page.label(title, (120 + 130 * column, top, 120, 22), bold=True)
    rows: tuple[tuple[str, bool, tuple[str, ...]], ...] = (
        ("Position", False, ("RBV", "DRBV", "RRBV")),
        ("Target", True, ("VAL", "DVAL", "RVAL")),
        ("High limit", True, ("HLM", "DHLM")),
        ("Low limit", True, ("LLM", "DLLM")),
    )
    for row, (title, is_put, fields) in enumerate(rows):
        at = top + 26 * (row + 1)
        page.label(title, (10, at, 105, 22))
        for column, field in enumerate(fields):
            box = (120 + 130 * column, at, 120, 22)
            if is_put:
                page.takes(_field(field), box)
            else:
                page.shows(_field(field), box, units=field != "RRBV")
    for row, (field, title) in enumerate((("HLS", "high switch"), ("LLS", "low switch"), ("ATHM", "home switch"), ("LVIO", "beyond limits"))):
        at = top + 26 * (row + 1)
        page.lamp(_field(field), (520, at + 2, 18, 18), GREEN if field == "ATHM" else RED)
        page.label(title, (544, at, 96, 22), 12)


def _add_moves(page: Page, top: int) -> None:
    page.puts("<", _field("TWR"), (10, top, 40, 28))
    page.takes(_field("TWV"), (55, top, 100, 28))
    page.puts(">", _field("TWF"), (160, top, 40, 28))
    page.holds("Jog -", _field("JOGR"), (220, top, 70, 28))
    page.holds("Jog +", _field("JOGF"), (295, top, 70, 28))
    page.puts("Home -", _field("HOMR"), (385, top, 70, 28))
    page.puts("Home +", _field("HOMF"), (460, top, 70, 28))
    page.puts("Stop", _field("STOP"), (550, top, 80, 28), RED)
    page.chooses(_field("SPMG"), (10, top + 40, 260, 28))
    page.chooses(ABLE, (290, top + 40, 160, 28))
    page.puts("Stop all", ALL_STOP, (550, top + 40, 80, 28), RED)


def _add_settings(page: Page, top: int) -> None:
    columns = (
        (True, (("Speed", "VELO"), ("Jog speed", "JVEL"), ("Home speed", "HVEL"), ("Approach speed", "BVEL"), ("Backlash", "BDST"), ("Delay, s", "DLY"))),
        (False, (("Top speed", "VMAX"), ("First step", "VBAS"), ("Ramp, s", "ACCL"), ("A step", "MRES"), ("Unit", "EGU"), ("MCU, output", "OUT"))),
    )
    for column, (is_put, rows) in enumerate(columns):
        for row, (title, field) in enumerate(rows):
            left, at = 10 + 215 * column, top + 26 * row
            page.label(title, (left, at, 105, 22))
            if is_put:
                page.takes(_field(field), (left + 110, at, 90, 22))
            else:
                page.shows(_field(field), (left + 110, at, 90, 22), text=field in ("EGU", "OUT"))
    page.label("Offset", (440, top, 60, 22))
    page.takes(_field("OFF"), (500, top, 130, 22))
    for row, (title, field) in enumerate((("Direction", "DIR"), ("Offset is", "FOFF"), ("Positions", "SET"), ("Drivers", "CNEN"))):
        at = top + 30 * (row + 1)
        page.label(title, (440, at, 60, 24), 12)
        page.chooses(_field(field), (500, at, 130, 24))


def _add_state(page: Page, top: int) -> None:
    for column, (title, field) in enumerate((("done", "DMOV"), ("moves", "MOVN"))):
        page.lamp(_field(field), (10 + 90 * column, top + 2, 18, 18))
        page.label(title, (32 + 90 * column, top, 60, 22))
    page.shows(_field("SEVR"), (200, top, 90, 22))
    page.shows(_field("STAT"), (295, top, 90, 22), text=True)
    page.shows(REASON, (10, top + 28, 620, 22), text=True)
    for number, (bit, title) in enumerate(MSTA):
        left, at = 10 + 155 * (number % 4), top + 62 + 26 * (number // 4)
        page.bit(_field("MSTA"), bit, (left, at, 18, 18))
        page.label(title, (left + 24, at - 2, 128, 22), 12)
