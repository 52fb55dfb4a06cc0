#!/usr/bin/env python3
"""The states of docs/states.md: its tables against the enums and functions of the code, and the pictures made of them.

  states.py           prints the pictures
  states.py --write   puts them into docs/states.md
"""

import os
import pathlib
import re
import sys
from collections import namedtuple

SOURCE = pathlib.Path(os.environ.get("BUSHD_SOURCE_DIR", pathlib.Path(__file__).resolve().parents[2]))
PAGE = "docs/states.md"
BEGIN = "<!-- picture: made from the table of transitions by tests/documents/states.py --write -->\n"
END = "<!-- end of picture -->\n"
START = "[*]"

# Under `heading` are a table of the states and one of their transitions. The states are those of the enum, without the
# prefix of its names, or the alternatives of the variant. Each function below `folder` in which `changed_by` is found makes a transition.
Machine = namedtuple("Machine", "heading header enum prefix folder changed_by")
MACHINES = [
    Machine("Owners of a motor", "firmware/core/owner.h", "bushd_mcu_motor_owner", "BUSHD_MCU_OWNER_", "firmware/core",
            r"bushd_mcu_give_(motor|to_queue)\(|mcu->trigger\.armed = |mcu->line\.motors = mcu"),
    Machine("States of an MCU", "lib/engine/message_base.h", "bushd_state", "BUSHD_STATE_", "firmware/core",
            r"mcu->faults [|&]= |mcu->flags [|&]?= .*BUSHD_FLAG_(ENABLED|SYNCED|CONFIGURED)\b"),
    Machine("Activity of a motor", "lib/motion/motor.h", "Activity", "", "lib/motion", r"activity_ = "),
    Machine("Phases of an MCU", "lib/bus/rs485/mcu_record.h", "McuPhase", "k", "lib/bus/rs485", r"view\.phase = "),
]
Transition = namedtuple("Transition", "sources targets when function file")


def without_comments(text):
    return re.sub(r"//.*", "", text)


def names_of(machine, source=SOURCE):
    text = without_comments((source / machine.header).read_text(encoding="utf-8"))
    variant = re.search(rf"using {machine.enum} = std::variant<(.*?)>;", text, re.DOTALL)
    if variant:
        return [name.strip() for name in variant[1].split(",")]
    body = re.search(rf"enum(?: class)? {machine.enum}\b[^{{]*{{(.*?)}}", text, re.DOTALL)[1]
    return [name.removeprefix(machine.prefix) for name in re.findall(r"(?:^|,)\s*(\w+)", body, re.MULTILINE)]


def functions(path):
    """Name and body of each that is defined in the file, outside of others."""
    text = without_comments(path.read_text(encoding="utf-8"))
    for found in re.finditer(r"^(?!typedef|struct|#)\w[^\n;={}]*?([\w:]+)\([^;{}]*\)[^;{}()]*{\n(.*?)^}", text, re.MULTILINE | re.DOTALL):
        yield found[1], found[2]


def defines(path, function):
    return path.exists() and any(name == function for name, _ in functions(path))


def changing(machine, source=SOURCE):
    """(function, file) of those that change a state, but for what they do it by."""
    return {
        (name, path.relative_to(source).as_posix())
        for path in sorted((source / machine.folder).rglob("*.c*"))
        for name, body in functions(path)
        if re.search(machine.changed_by, body) and not re.search(machine.changed_by, f"{name}(")
    }


def section(machine, page):
    found = re.search(rf"^### {machine.heading}\n(.*?)(?=^##|\Z)", page, re.MULTILINE | re.DOTALL)
    return found[1] if found else ""


def rows(text, head):
    found = re.search(rf"^\| {head} \|.*\n\|[-| ]+\|\n((?:\|.*\n)+)", text, re.MULTILINE)
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in found[1].splitlines()] if found else []


def listed(cell):
    return [name.strip("` ") for name in cell.split(",")]


def transitions(machine, page):
    for source, target, when, function, file in rows(section(machine, page), "from"):
        link = re.search(r"\]\(\.\./(.+)\)", file)
        yield Transition(listed(source), listed(target), when, function.strip("`"), link[1] if link else file)


def picture(machine, page):
    """One arrow for each pair of states."""
    why = {}
    for one in transitions(machine, page):
        for source in one.sources:
            for target in one.targets:
                why.setdefault((source, target), []).append(one.when)
    lines = [f"    {source} --> {target}: {'<br>'.join(dict.fromkeys(when))}" for (source, target), when in why.items()]
    return "```mermaid\nstateDiagram-v2\n" + "\n".join(lines) + "\n```\n"


def with_pictures(page):
    for machine in MACHINES:
        old = section(machine, page)
        before, rest = old.split(BEGIN)
        page = page.replace(old, f"{before}{BEGIN}\n{picture(machine, page)}\n{END}{rest.split(END)[1]}")
    return page


def complaints(machine, page, source=SOURCE):
    """What the page and the code have that the other one has not, in words."""
    wrong = []
    states = names_of(machine, source)
    told = [row[0].strip("`") for row in rows(section(machine, page), "state")]
    if told != states:
        wrong.append(f"{machine.heading}: the states are {states}, not {told}")
    reached = {START}
    made = set()
    for one in transitions(machine, page):
        reached.update(one.targets)
        made.add((one.function, one.file))
        if re.search(r"[:;]", one.when):
            wrong.append(f"{machine.heading}: a picture takes neither ':' nor ';': {one.when}")
        wrong += [f"{machine.heading}: there is no state {name}" for name in one.sources + one.targets if name not in [*states, START]]
        if not defines(source / one.file, one.function):
            wrong.append(f"{machine.heading}: {one.file} defines no {one.function}")
    wrong += [f"{machine.heading}: nothing leads to {name}" for name in states if name not in reached]
    wrong += [f"{machine.heading}: {name} ({file}) changes a state and is in no row" for name, file in sorted(changing(machine, source) - made)]
    return wrong


def main():
    page = (SOURCE / PAGE).read_text(encoding="utf-8")
    if sys.argv[1:] == ["--write"]:
        (SOURCE / PAGE).write_text(with_pictures(page), encoding="utf-8")
        return 0
    if sys.argv[1:]:
        print(__doc__, file=sys.stderr)
        return 2
    for machine in MACHINES:
        print(picture(machine, page))
    return 0


if __name__ == "__main__":
    sys.exit(main())
