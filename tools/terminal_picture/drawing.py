"""What a terminal shows, as SVG that looks the same wherever it is shown.

Each word stands at the x of its column: renderers do away with blanks, and fonts differ in width. What is no letter (rules, dots
of Braille, blocks, arrows) is drawn, for fonts lack it or have it in another width. The picture is light, or dark where the reader
prefers that."""

import html
import re
import unicodedata

LEFT, COLUMN, LINE = 12, 8.4, 18  # px; a letter of the fonts below is 0.6 of its size wide
BASELINE = 52  # of the first line, the command
ABOVE = 14  # from the top of a cell to the base line
SIZE = 14
FONTS = "DejaVu Sans Mono, Menlo, Consolas, monospace"
THEMES = {
    "light": {"window": "#f6f8fa", "edge": "#c4ccd4", "bar": "#e4e8ed", "knob": "#aab3bd", "ink": "#1f2328", "prompt": "#1a7f37"},
    "dark": {"window": "#1c1f24", "edge": "#3d444d", "bar": "#30353d", "knob": "#5b626d", "ink": "#d6dae0", "prompt": "#7fb77e"},
}
# Column and row of the dots 1 to 8 of Braille.
DOTS = [(0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (1, 2), (0, 3), (1, 3)]
ARMS = {"LEFT": (0, 0.5), "RIGHT": (1, 0.5), "UP": (0.5, 0), "DOWN": (0.5, 1)}
ARROWS = {"←": (-1, 0), "→": (1, 0), "↑": (0, -1), "↓": (0, 1)}
EIGHTHS = {"█": (0, 0, 1, 1), "▀": (0, 0, 1, 0.5), "▐": (0.5, 0, 1, 1)}
EIGHTHS |= {chr(0x2580 + n): (0, 1 - n / 8, 1, 1) for n in range(1, 8)}
EIGHTHS |= {chr(0x2590 - n): (0, 0, n / 8, 1) for n in range(1, 8)}
# All fonts have those of Latin-1 (but for the soft hyphen), in the width of the others.
LETTERS = "[!-~\u00a1-\u00ac\u00ae-\u00ff]"


class NoShape(Exception):
    """A character that is neither a letter nor drawn."""


def number(value):
    return f"{value:.2f}".rstrip("0").rstrip(".")


def points(x, y, *shares):
    """Points of a cell whose upper left corner is x, y."""
    return " ".join(f"{number(x + COLUMN * across)},{number(y + LINE * down)}" for across, down in shares)


def arms(character):
    """Where the rules of a box-drawing character lead to: LEFT, RIGHT, UP, DOWN."""
    name = unicodedata.name(character, "")
    if not name.startswith("BOX DRAWINGS LIGHT ") or re.search("DASH|ARC|DIAGONAL|HEAVY|DOUBLE", name):
        return []
    return re.findall("LEFT|RIGHT|UP|DOWN", name.replace("HORIZONTAL", "LEFT RIGHT").replace("VERTICAL", "UP DOWN"))


def shape(character, x, y):
    """Class and path of what is no letter, in the cell at x, y."""
    if "\u2800" <= character <= "\u28ff":
        raised = [DOTS[dot] for dot in range(8) if (ord(character) - 0x2800) >> dot & 1]
        return "dots", "".join(f"M{points(x, y, ((column + 0.5) / 2, (row + 0.5) / 4))}h0" for column, row in raised)
    if character in EIGHTHS:
        left, top, right, bottom = EIGHTHS[character]
        return "block", f"M{points(x, y, (left, top), (right, top), (right, bottom), (left, bottom))}z"
    if character in ARROWS:
        across, down = ARROWS[character]
        # The way is 6 px long, so is the head wide; both in the middle of small letters.
        middle_x, middle_y = x + COLUMN / 2, y + ABOVE - 4
        tip = middle_x + 3 * across, middle_y + 3 * down
        tail = middle_x - 3 * across, middle_y - 3 * down
        sides = [(tip[0] - 2.5 * across + 2.5 * turn * down, tip[1] - 2.5 * down + 2.5 * turn * across) for turn in (-1, 1)]
        way = [tail, tip, sides[0], tip, sides[1]]
        return "rule", "M" + " ".join(f"{number(px)},{number(py)}" for px, py in way)
    leads_to = arms(character)
    if not leads_to:
        raise NoShape(f"the terminal shows {character!r} ({unicodedata.name(character, 'no name')}), which pictures do not draw: add it to {__name__}")
    return "rule", "".join(f"M{points(x, y, (0.5, 0.5), ARMS[arm])}" for arm in leads_to)


def line(text, baseline):
    """The elements of one line."""
    out = []
    for word in re.finditer(f"{LETTERS}+", text):
        x = LEFT + COLUMN * word.start()
        out.append(f'<text x="{number(x)}" y="{baseline}">{html.escape(word[0], quote=False)}</text>')
    paths = {}
    for column, character in enumerate(text):
        if character not in " \u2800" and not re.match(LETTERS, character):
            kind, path = shape(character, LEFT + COLUMN * column, baseline - ABOVE)
            paths[kind] = paths.get(kind, "") + path
    return out + [f'<path class="{kind}" d="{path}"/>' for kind, path in paths.items()]


def style():
    def rules(theme):
        colours = THEMES[theme]
        return (f".window{{fill:{colours['window']};stroke:{colours['edge']}}}.bar{{fill:{colours['bar']}}}.knob{{fill:{colours['knob']}}}"
                f"text,.block{{fill:{colours['ink']}}}.rule,.dots{{stroke:{colours['ink']}}}.prompt{{fill:{colours['prompt']}}}")

    return ("<style>\n" + rules("light") + "\n.rule{fill:none;stroke-width:1.3}.dots{fill:none;stroke-width:2.4;stroke-linecap:round}\n"
            f"@media(prefers-color-scheme:dark){{{rules('dark')}}}\n</style>")


def picture(command, lines, columns):
    """A window in which the command was given, and what it shows."""
    width, height = round(2 * LEFT + COLUMN * columns), 58 + LINE * (len(lines) + 1)
    out = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}"'
        f' font-family="{FONTS}" font-size="{SIZE}">',
        style(),
        f'<rect class="window" x="0.5" y="0.5" width="{width - 1}" height="{height - 1}" rx="6"/>',
        f'<path class="bar" d="M1,28V6.5A5.5 5.5 0 0 1 6.5 1H{width - 6.5}A5.5 5.5 0 0 1 {width - 1} 6.5V28z"/>',
        *(f'<circle class="knob" cx="{18 + 18 * i}" cy="14" r="5"/>' for i in range(3)),
    ]
    prompt, *words = line(f"$ {command}", BASELINE)
    out += [prompt.replace("<text", '<text class="prompt"'), *words]
    for row, text in enumerate(lines):
        out += line(text, BASELINE + LINE * (row + 1))
    return "\n".join([*out, "</svg>"]) + "\n"
