"""The sizes of an image that docs/firmware.md tells, against the image.

They stand in the paragraph that names the image. A figure may be 2 % off, so that not every change of the firmware is one of the page.
"""

import pathlib
import re
import subprocess

PAGE = pathlib.Path(__file__).resolve().parents[2] / "docs/firmware.md"
FORM = re.compile(
    r"(?P<flash>\d+) (?P<unit>KB|bytes) of flash, (?P<variables>\d+) of (?P<ram>\d+) bytes of RAM\. "
    r"The rest is the stack, of which (?P<stack>\d+) bytes can be in use"
)


def expect(image, objdump, variables, ram, stack):
    """`objdump` stands beside the `size` of its toolchain; all figures but its own are bytes."""
    size = subprocess.run([objdump.replace("objdump", "size"), image], check=True, capture_output=True, text=True).stdout
    text, data = map(int, size.splitlines()[1].split()[:2])
    name = pathlib.Path(image).name
    paragraphs = [" ".join(part.split()) for part in PAGE.read_text(encoding="utf-8").split("\n\n")]
    told = [match for part in paragraphs if name in part and (match := FORM.search(part))]
    assert told, f"{PAGE.name} tells no sizes where it names {name}, in the form {FORM.pattern}"
    flash = (text + data) / (1000 if told[0]["unit"] == "KB" else 1)
    for figure, value in {"flash": flash, "variables": variables, "ram": ram, "stack": stack}.items():
        assert abs(int(told[0][figure]) - value) <= 0.02 * value, f"{PAGE.name}: {name}: {figure} is {value:.0f}, not {told[0][figure]}"
