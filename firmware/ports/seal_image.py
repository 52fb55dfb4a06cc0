"""Seals an image: sets the four bytes at `image_seal` so that the CRC-32 register is 0 at the image's end.

    seal_image.py OBJCOPY NM IMAGE.elf

A CRC can be run backwards: what the register must be behind the seal follows from its end, what it is before it from
the beginning, and their difference are the four bytes.
"""

import pathlib
import subprocess
import sys
import tempfile

PAGE = 256
POLYNOMIAL = 0xEDB88320


def entry(byte):
    for _ in range(8):
        byte = byte >> 1 ^ (POLYNOMIAL if byte & 1 else 0)
    return byte


FORWARD = [entry(byte) for byte in range(256)]
BY_TOP = {value >> 24: index for index, value in enumerate(FORWARD)}


def run(register, data):
    for byte in data:
        register = register >> 8 ^ FORWARD[(register ^ byte) & 0xFF]
    return register


def run_back(register, data):
    for byte in reversed(data):
        index = BY_TOP[register >> 24]
        register = (register ^ FORWARD[index]) << 8 & 0xFFFFFFFF | index ^ byte
    return register


def seal_for(flash, at):
    before = run(0xFFFFFFFF, flash[:at])
    behind = run_back(0, flash[at + 4:])
    return (run_back(behind, bytes(4)) ^ before).to_bytes(4, "little")


def main(objcopy, nm, image):
    symbols = subprocess.run([nm, image], check=True, capture_output=True, text=True).stdout
    at = next(int(line.split()[0], 16) for line in symbols.splitlines() if line.endswith(" image_seal"))
    with tempfile.TemporaryDirectory() as folder:
        whole = pathlib.Path(folder, "flash")
        text = pathlib.Path(folder, "text")
        subprocess.run([objcopy, "-O", "binary", "-R", ".eeprom", image, whole], check=True)
        flash = whole.read_bytes()
        flash += b"\xFF" * (-len(flash) % PAGE)
        seal = seal_for(flash, at)
        assert run(0xFFFFFFFF, flash[:at] + seal + flash[at + 4:]) == 0
        subprocess.run([objcopy, "--dump-section", f".text={text}", image], check=True)
        code = bytearray(text.read_bytes())
        code[at:at + 4] = seal
        text.write_bytes(code)
        subprocess.run([objcopy, "--update-section", f".text={text}", image], check=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
