#!/usr/bin/env python3
"""Gates what makes the engine and the firmware core run everywhere. One check per call:

  purity.py includes DIR...      only freestanding headers, string.h and the rooms that these rooms may know
  purity.py symbols NM LIBRARY   nothing from outside but mem* and the compiler's helpers; no writable globals
  purity.py cross PRESET SOURCE_DIR BUILD_DIR
                                 builds engine, firmware core and golden vectors for `avr` or `cortex-m` with
                                 warnings as errors, and checks the engine's symbols; exit code 77: no compiler
"""

import pathlib
import re
import shutil
import subprocess
import sys
import tomllib

FREESTANDING = {"stdint.h", "stdbool.h", "stddef.h", "limits.h", "string.h"}
# docs/rooms.toml says which other rooms these use.
ROOMS_FILE = pathlib.Path(__file__).resolve().parents[2] / "docs/rooms.toml"
FREESTANDING_ROOMS = ("lib/engine", "firmware/commutator", "firmware/core")

MEMORY = {"memcpy", "memset", "memmove", "memcmp"}
# A port may bring its own: BUSHD_OWN_CRC32, BUSHD_OWN_SLOTS_FILL, BUSHD_OWN_RUN_PARTS, BUSHD_OWN_LINE_FOLLOWER.
OF_PORTS = {"bushd_crc32", "bushd_slots_fill",
            "bushd_run_make_evenly", "bushd_run_make_on_side", "bushd_run_move_place", "bushd_run_share",
            "bushd_run_take_span", "bushd_line_follower_make"}
# libgcc's arithmetic on small machines, and the names that AVR objects use to ask for start-up code that copies
# constants and clears memory.
COMPILER = re.compile(r"__(aeabi_\w+|[a-z]+[qhsd]i\d?(_s8)?|do_copy_data|do_clear_bss|tablejump2?__|prologue_saves__|"
                      r"epilogue_restores__|gnu_thumb1_case_\w+)$")
WRITABLE = set("DdBbCSsGg")

CROSS = {"avr": ("avr-", ["-mmcu=atmega2560"]), "cortex-m": ("arm-none-eabi-", ["-mcpu=cortex-m3", "-mthumb"])}
NOT_HERE = 77


def rooms():
    """By room, how the headers begin that it may include: its own, and those of rooms that it uses."""
    uses = {room["path"]: room["uses"] for room in tomllib.loads(ROOMS_FILE.read_text(encoding="utf-8"))["room"]}
    return {room: tuple(path.removeprefix("lib/") + "/" for path in (room, *uses[room])) for room in FREESTANDING_ROOMS}


def check_includes(directories):
    faults = []
    allowed_in = rooms()
    for directory in directories:
        room = next(r for r in allowed_in if directory.as_posix().endswith(r))
        files = sorted(directory.glob("*.[ch]"))
        if not files:
            faults.append(f"{directory}: no sources found")
        for path in files:
            for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
                match = re.match(r"\s*#\s*include\s*(\S.*)", line)
                if not match:
                    continue
                header = match[1].strip()
                allowed = (header.startswith("<") and header[1:-1] in FREESTANDING) or (
                    header.startswith('"') and header[1:].startswith(allowed_in[room]))
                if not allowed:
                    faults.append(f"{path}:{number}: {header} is not allowed in {room}; allowed: "
                                  f"{', '.join(sorted(FREESTANDING))} and {', '.join(allowed_in[room])}")
    return faults


def check_symbols(nm, library):
    defined, undefined, faults = set(), {}, []
    listing = subprocess.run([nm, "-A", library], check=True, capture_output=True, text=True).stdout
    for line in listing.splitlines():
        place, kind, name = re.match(r"(.*?):[0-9a-fA-F]*\s+(\S) (\S+)$", line).groups()
        if kind == "U":
            undefined.setdefault(name, place)
            continue
        defined.add(name)
        if kind in WRITABLE:
            faults.append(f"{place}: {name} is a writable global ({kind}); the caller owns all memory")
    if not defined:
        faults.append(f"{library}: defines nothing")
    for name, place in undefined.items():
        if name not in defined | MEMORY | OF_PORTS and not COMPILER.match(name):
            faults.append(f"{place}: needs {name}; allowed: {', '.join(sorted(MEMORY))}")
    return faults


def check_cross(preset, source, build):
    prefix, machine = CROSS[preset]
    if shutil.which(prefix + "gcc") is None:
        print(f"{prefix}gcc is not installed")
        sys.exit(NOT_HERE)

    def run(*command):
        result = subprocess.run([str(part) for part in command], capture_output=True, text=True)
        return [] if result.returncode == 0 else [f"{' '.join(map(str, command))}\n{result.stdout}{result.stderr}"]

    faults = run("cmake", "-S", source, "-B", build, f"-DCMAKE_TOOLCHAIN_FILE={source}/cmake/{preset}.cmake",
                 "-DBUSHD_FIRMWARE_ONLY=ON", "-DBUSHD_WERROR=ON", "-DCMAKE_BUILD_TYPE=MinSizeRel")
    faults = faults or run("cmake", "--build", build, "--target", "bushd_engine", "bushd_firmware")
    if faults:
        return faults
    faults += run(sys.executable, source / "tests/vectors/make_vectors.py", "--header", build / "golden_vectors.h")
    faults += run(prefix + "gcc", *machine, "-std=gnu11", "-Os", "-Wall", "-Wextra", "-Wconversion", "-Werror",
                  "-I", source / "lib", "-I", source / "tests", "-I", build, "-c",
                  source / "tests/vectors/check_vectors.c", "-o", build / "check_vectors.o")
    return faults + check_symbols(prefix + "nm", str(build / "lib/engine/libbushd_engine.a"))


def main(arguments):
    if arguments[:1] == ["includes"] and len(arguments) > 1:
        faults = check_includes([pathlib.Path(a) for a in arguments[1:]])
    elif arguments[:1] == ["symbols"] and len(arguments) == 3:
        faults = check_symbols(*arguments[1:])
    elif arguments[:1] == ["cross"] and len(arguments) == 4 and arguments[1] in CROSS:
        faults = check_cross(arguments[1], pathlib.Path(arguments[2]), pathlib.Path(arguments[3]))
    else:
        print(__doc__)
        return 2
    print("\n".join(faults) if faults else "pure")
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
