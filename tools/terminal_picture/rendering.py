"""Pictures as a browser (Chromium) and as others (librsvg) show them, light and dark, as PNG; and where the browser puts words."""

import html
import json
import pathlib
import re
import shutil
import subprocess
import tempfile

PROGRAMS = {"chromium": "chromium", "librsvg": "rsvg-convert"}
THEMES = ("light", "dark")
# The colour of the sheet, behind pictures that leave it out.
PAPER = {"light": "#ffffff", "dark": "#0d1117"}
# Headless, alone, and asking nobody for anything.
QUIET = ["--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
         "--disable-component-update", "--disable-sync", "--hide-scrollbars"]
PREFERS = {"dark": "--blink-settings=preferredColorScheme=0", "light": "--blink-settings=preferredColorScheme=1"}
MEASURE = """
const of = text => { const box = text.getBBox(); return {
  text: text.textContent, anchor: text.getAttribute("text-anchor") || "start",
  x: Number(text.getAttribute("x")), width: text.getComputedTextLength(),
  left: box.x, right: box.x + box.width, top: box.y, bottom: box.y + box.height}; };
document.body.dataset.words = JSON.stringify([...document.querySelectorAll("text")].map(of));
"""


def missing():
    """Programs that are not there."""
    return [program for program in PROGRAMS.values() if not shutil.which(program)]


def size(text):
    return tuple(int(float(re.search(rf'<svg[^>]* {side}="([\d.]+)"', text)[1])) for side in ("width", "height"))


def chromium(page, theme, *options):
    """Opens a page; returns what it prints."""
    with tempfile.TemporaryDirectory() as folder:
        file = pathlib.Path(folder) / "page.html"
        file.write_text(page)
        command = [PROGRAMS["chromium"], *QUIET, PREFERS[theme], f"--user-data-dir={folder}/profile", *options, f"file://{file}"]
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout


def shown_by_chromium(picture, theme, png):
    """As an image of a page, as README.md has it."""
    width, height = size(picture.read_text())
    page = (f'<!doctype html><meta name="color-scheme" content="light dark"><body style="margin:0;background:{PAPER[theme]}">'
            f'<img src="file://{picture.resolve()}" style="display:block">')
    chromium(page, theme, f"--window-size={width},{height}", f"--screenshot={png}")


def shown_by_librsvg(picture, theme, png):
    """It does not know which one the reader prefers: so dark is said to it."""
    with tempfile.TemporaryDirectory() as folder:
        sheet = pathlib.Path(folder) / "dark.css"
        dark = re.search(r"@media\(prefers-color-scheme:dark\)\{(.*)\}", picture.read_text()) if theme == "dark" else None
        sheet.write_text(re.sub(r"(:#\w+)", r"\1!important", dark[1]) if dark else "")
        command = [PROGRAMS["librsvg"], f"--stylesheet={sheet}", f"--background-color={PAPER[theme]}", f"--output={png}", picture]
        subprocess.run(command, check=True)


SHOWN_BY = {"chromium": shown_by_chromium, "librsvg": shown_by_librsvg}


def render(pictures, folder):
    """Makes NAME-PROGRAM-THEME.png of all of them; yields each with its picture, program and theme."""
    for picture in pictures:
        for program, show in SHOWN_BY.items():
            for theme in THEMES:
                png = folder / f"{picture.stem}-{program}-{theme}.png"
                show(picture, theme, png.resolve())
                yield picture, program, theme, png


def words(picture, theme="light"):
    """Where Chromium puts each text of a picture: text, anchor, x, width; left, right, top, bottom."""
    page = f"<!doctype html><body>{picture.read_text()}<script>{MEASURE}</script>"
    return json.loads(html.unescape(re.search(r'data-words="([^"]*)"', chromium(page, theme, "--dump-dom"))[1]))
