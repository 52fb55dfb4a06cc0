"""Reads a picture of a terminal as one sees it: what is where, by x and y alone."""

import re
import xml.etree.ElementTree as ElementTree

SVG = "{http://www.w3.org/2000/svg}"
LEFT, COLUMN, TOP, LINE = 12, 8.4, 38, 18  # px; TOP: of the line with the command
BASELINE = 14  # below the top of a line
CLOSE = 0.011  # px: x and y are rounded to two decimals, here and there
RULES = {"LR": "─", "DU": "│", "DR": "┌", "DL": "┐", "RU": "└", "LU": "┘", "DRU": "├", "DLU": "┤", "DLR": "┬", "LRU": "┴",
         "DLRU": "┼", "L": "╴", "U": "╵", "R": "╶", "D": "╷"}
BRAILLE = {(0, 0): 1, (0, 1): 2, (0, 2): 4, (1, 0): 8, (1, 1): 16, (1, 2): 32, (0, 3): 64, (1, 3): 128}


class Wrong(Exception):
    """What a renderer may show otherwise than the terminal did."""


def whole(distance, unit, what):
    """How many units it is."""
    count = round(distance / unit)
    if abs(distance - count * unit) > CLOSE:
        raise Wrong(f"{what} does not stand on the terminal's grid, {distance:.2f} px with units of {unit:.2f}")
    return count


def points(path):
    return [tuple(map(float, pair)) for pair in re.findall(r"(-?[\d.]+),(-?[\d.]+)", path)]


class Grid:
    def __init__(self):
        self.cells = {}

    def put(self, row, column, character):
        if self.cells.get((row, column), character) != character:
            raise Wrong(f"line {row}, column {column} has {self.cells[row, column]!r} and {character!r}")
        self.cells[row, column] = character

    def lines(self):
        last = max(row for row, _ in self.cells)
        out = [[] for _ in range(last + 1)]
        for (row, column), character in sorted(self.cells.items()):
            out[row] += " " * (column - len(out[row])) + character
        return ["".join(line) for line in out]


def cell(x, y):
    return int((y - TOP) // LINE), int((x - LEFT) // COLUMN)


def word(grid, element):
    text = element.text or ""
    if set(element.attrib) - {"x", "y", "class"} or len(element):
        raise Wrong(f"{text!r} is more than a word at a place: {sorted(element.attrib)}")
    if not re.fullmatch("[!-~\u00a1-\u00ac\u00ae-\u00ff]+", text):
        raise Wrong(f"{text!r} is not one word of letters that all fonts have")
    column = whole(float(element.get("x")) - LEFT, COLUMN, text)
    row = whole(float(element.get("y")) - BASELINE - TOP, LINE, text)
    for i, character in enumerate(text):
        grid.put(row, column + i, character)


def dots(grid, path):
    raised = {}
    for part in re.findall("M[^M]*", path):
        (x, y), = points(part)
        row, column = cell(x, y)
        across = whole(x - LEFT - (column + 0.25) * COLUMN, COLUMN / 2, "a dot")
        down = whole(y - TOP - (row + 0.125) * LINE, LINE / 4, "a dot")
        raised[row, column] = raised.get((row, column), 0) | BRAILLE[across, down]
    for (row, column), bits in raised.items():
        grid.put(row, column, chr(0x2800 + bits))


def rules(grid, path):
    lines = {}
    for part in re.findall("M[^M]*", path):
        way = points(part)
        if len(way) > 2:
            arrow(grid, way)
            continue
        (x, y), (to_x, to_y) = way
        row, column = cell(x, y)
        middle = LEFT + (column + 0.5) * COLUMN, TOP + (row + 0.5) * LINE
        if abs(x - middle[0]) > CLOSE or abs(y - middle[1]) > CLOSE:
            raise Wrong(f"a rule does not begin in the middle of line {row}, column {column}")
        way = whole(to_x - x, COLUMN / 2, "a rule"), whole(to_y - y, LINE / 2, "a rule")
        leads_to = {(-1, 0): "L", (1, 0): "R", (0, -1): "U", (0, 1): "D"}[way]
        lines.setdefault((row, column), set()).add(leads_to)
    for (row, column), leads_to in lines.items():
        grid.put(row, column, RULES["".join(sorted(leads_to))])


def arrow(grid, way):
    tail, tip = way[:2]
    middle = (tail[0] + tip[0]) / 2, (tail[1] + tip[1]) / 2
    direction = "→" if tip[0] > tail[0] else "←" if tip[0] < tail[0] else "↓" if tip[1] > tail[1] else "↑"
    row, column = cell(*middle)
    whole(middle[0] - LEFT - COLUMN / 2, COLUMN, direction)
    if any(cell(*point) != (row, column) for point in way):
        raise Wrong(f"{direction} does not keep to its cell")
    grid.put(row, column, direction)


def blocks(grid, path):
    for part in re.findall("M[^M]*", path):
        corners = points(part)
        left, top = corners[0]
        right, bottom = corners[2]
        if corners != [(left, top), (right, top), (right, bottom), (left, bottom)]:
            raise Wrong(f"no rectangle: {corners}")
        row, column = cell((left + right) / 2, (top + bottom) / 2)
        x, y = LEFT + column * COLUMN, TOP + row * LINE
        sides = tuple(whole(side - begin, length / 8, "a block") for side, begin, length in
                      ((left, x, COLUMN), (top, y, LINE), (right, x, COLUMN), (bottom, y, LINE)))
        if sides[0] == 0 and sides[2] == 8 and sides[3] == 8:
            character = chr(0x2588 - sides[1])
        elif sides == (0, 0, 8, 4):
            character = "▀"
        elif sides == (4, 0, 8, 8):
            character = "▐"
        else:
            character = {(0, 0, n, 8): chr(0x2590 - n) for n in range(1, 8)}[sides]
        grid.put(row, column, character)


def read(text):
    """The command, and the lines that the terminal shows."""
    if "textLength" in text or "xml:space" in text:
        raise Wrong("what stretches words or keeps blanks is not the same everywhere: textLength, xml:space")
    root = ElementTree.fromstring(text)
    grid = Grid()
    for element in root.iter(SVG + "text"):
        word(grid, element)
    for kind, understand in (("dots", dots), ("rule", rules), ("block", blocks)):
        for element in root.iter(SVG + "path"):
            if element.get("class") == kind:
                understand(grid, element.get("d"))
    command, *lines = grid.lines()
    return command.removeprefix("$ "), lines


def colours(text):
    """By theme and class, as the style has them."""
    style = ElementTree.fromstring(text).find(SVG + "style").text
    light, dark = style.split("@media(prefers-color-scheme:dark)")
    found = {}
    for theme, rules_of_it in (("light", light), ("dark", dark)):
        found[theme] = {}
        for selectors, body in re.findall(r"([\w.,]+)\{([^{}]*)\}", rules_of_it):
            colour = re.search(r"(?:fill|stroke):(#\w{6})", body)
            if colour:
                found[theme].update((selector.removeprefix("."), colour[1]) for selector in selectors.split(","))
    return found
