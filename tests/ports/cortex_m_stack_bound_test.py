"""How deep the stack of an image for Cortex-M can get, by its machine code, that this much RAM is left for it, and that
docs/firmware.md says so.

    cortex_m_stack_bound_test.py OBJDUMP IMAGE.elf...

The depth is followed through every instruction from reset and from each interrupt: what is pushed, frames, calls. What is
called through a pointer may be any function whose address stands in the image, and so may interrupts be. On top of the
deepest path lies one interrupt, the deepest, with what the CPU saves for it: all are of one priority.
"""

import re
import subprocess
import sys
from collections import namedtuple

import page_figures

RAM_BEGIN = 0x20000000
RAM_SIZE = 64 * 1024
SAVED_BY_CPU = 8 * 4 + 4  # and aligned
CLOSING = {"b", "bx", "tbb", "tbh", "udf"}
ASSEMBLER = {"reset", "emission_half_slot"}
DATA = {".word", ".short", ".byte"}

Instruction = namedtuple("Instruction", "address name operands target next")


def registers(operands):
    """How many there are in {r4, r5-r7, lr}."""
    count = 0
    for part in re.search(r"{(.*)}", operands)[1].split(","):
        ends = [int(number) for number in re.findall(r"\d+", part)]
        count += ends[-1] - ends[0] + 1 if "-" in part else 1
    return count


def ends_here(code):
    """Nothing goes on behind it. A conditional return has another name."""
    if code.name in CLOSING:
        return True
    loads_pc = "pc" in code.operands if code.name in ("pop", "ldmia") else code.operands.startswith("pc,")
    return code.name in ("pop", "ldmia", "ldr", "mov") and loads_pc


def words_of(objdump, path):
    text = subprocess.run([objdump, "-s", "-j", ".text", "-j", ".data", path], check=True, capture_output=True, text=True).stdout
    lines = re.findall(r"^ [0-9a-f]+ ((?:[0-9a-f]{8} ){1,4})", text, re.M)
    return [int.from_bytes(bytes.fromhex(word), "little") for line in lines for word in line.split()]


class Image:
    def __init__(self, objdump, path):
        text = subprocess.run([objdump, "-d", "-j", ".text", "-j", ".data", path], check=True, capture_output=True, text=True).stdout
        names = subprocess.run([objdump, "-t", path], check=True, capture_output=True, text=True).stdout
        self.symbols = {name: int(at, 16) for at, name in re.findall(r"^([0-9a-f]+) .*[ \t](\S+)$", names, re.M)}
        found = re.findall(r"^([0-9a-f]+) .{6}F \S+\t([0-9a-f]+)\s(?:.* )?(\S+)$", names, re.M)
        self.functions = {int(at, 16): name for at, _, name in found}
        self.functions |= {at: name for name, at in self.symbols.items() if name in ASSEMBLER}
        self.end = {int(at, 16): int(at, 16) + int(size, 16) for at, size, _ in found}
        self.code = {}
        for line in text.splitlines():
            part = re.match(r" *([0-9a-f]+):\t[0-9a-f ]+\t(\S+)\t?([^@]*)(?:@ (.*))?", line)
            if not part:
                continue
            address, name = int(part[1], 16), part[2]
            if name not in DATA:
                size = 2 if re.match(r" *[0-9a-f]+:\t[0-9a-f]{4} *\t", line) else 4
                target = re.search(r"\b([0-9a-f]+) <", part[3])
                name = re.sub(r"\.[nw]$", "", name)
                self.code[address] = Instruction(address, name, part[3].strip(), target and int(target[1], 16), address + size)
        every = sorted(self.symbols.values())
        for at in self.functions:
            if self.end.get(at, at) == at:  # no size is told
                self.end[at] = next(symbol for symbol in every if symbol > at)
        named = {word - 1 for word in words_of(objdump, path) if word & 1 and word - 1 in self.functions}
        self.pointed = {at for at in named if self.functions[at] not in ("reset", "fail")}
        self.handlers = {at for at in self.pointed if not self.functions[at].startswith("port_")}
        self.known = {}

    def depth(self, entry):
        """The deepest that the stack gets from `entry` until it returns."""
        if entry not in self.known:
            self.known[entry] = None
            self.known[entry] = Path(self, entry).deepest()
        assert self.known[entry] is not None, f"recursion at {self.functions[entry]}"
        return self.known[entry]

    def through_pointer(self):
        return max(self.depth(at) for at in self.pointed)


class Path:
    def __init__(self, image, entry):
        self.image, self.entry = image, entry
        self.seen, self.most = {}, 0

    def deepest(self):
        veneer = re.match(r"__(.*)_veneer$", self.image.functions[self.entry])
        if veneer:
            return self.image.depth(self.image.symbols[veneer[1]])
        unvisited = [(self.entry, 0)]
        while unvisited:
            address, depth = unvisited.pop()
            if self.seen.get(address, -1) >= depth:
                continue
            assert depth < 65536, f"the stack grows without end at {address:#x}"
            self.seen[address] = depth
            unvisited += self.step(self.image.code[address], depth)
        return self.most

    def reach(self, depth):
        self.most = max(self.most, depth)

    def step(self, code, depth):
        after = depth + self.grows(code)
        self.reach(after)
        if code.name == "bl":
            self.reach(depth + self.image.depth(code.target))
        if code.name == "blx" or code.name == "bx" and code.operands != "lr":
            self.reach(depth + self.image.through_pointer())
        onward = []
        if code.name in ("tbb", "tbh"):
            onward = [(at, depth) for at in self.behind_ends()]
        elif re.fullmatch(r"b([a-z]{2})?|cbn?z", code.name) and code.name != "bl" and code.target is not None:
            if self.entry <= code.target < self.image.end[self.entry]:
                onward = [(code.target, depth)]
            else:
                self.reach(depth + self.image.depth(code.target))  # in this one's place
        fills_up = code.name == "nop" and code.next not in self.image.code  # before data
        if not ends_here(code) and not fills_up:
            onward.append((code.next, after))
        return onward

    @staticmethod
    def grows(code):
        name, operands = code.name, code.operands
        number = re.search(r"#(-?\d+)", operands)
        if name == "push" or name == "stmdb" and operands.startswith("sp!"):
            return 4 * registers(operands)
        if (name == "pop" or name == "ldmia" and operands.startswith("sp!")) and "pc" not in operands:
            return -4 * registers(operands)
        if name in ("sub", "subw") and re.match(r"sp, (sp, )?#", operands):
            return int(number[1])
        if name in ("add", "addw") and re.match(r"sp, (sp, )?#", operands):
            return -int(number[1])
        if re.search(r"\[sp, #-\d+\]!", operands):
            return -int(number[1])
        if re.search(r"\[sp\], #", operands) and not operands.startswith("pc"):
            return -int(number[1])
        reads_only = name.startswith(("cmp", "ldm", "st"))  # what changes it there is handled above
        assert not re.match(r"sp,", operands) or reads_only, f"what does {name} {operands} do to the stack?"
        return 0

    def behind_ends(self):
        """Where nothing leads to but a table."""
        inside = sorted(at for at in self.image.code if self.entry <= at < self.image.end[self.entry])
        found = []
        for before, at in zip(inside, inside[1:]):
            code = self.image.code[before]
            if at not in self.seen and (ends_here(code) or code.next != at):
                found.append(at)
        return found


def main(objdump, *paths):
    for path in paths:
        image = Image(objdump, path)
        print(path)
        deepest_interrupt = 0
        for at in sorted(image.handlers):
            print(f"  {image.functions[at]} {image.depth(at)}")
            deepest_interrupt = max(deepest_interrupt, SAVED_BY_CPU + image.depth(at))
        program = image.depth(image.symbols["start"])
        print(f"  start and main {program}")
        room = image.symbols["stack_end"] - image.symbols["bss_end"]
        deepest = program + deepest_interrupt
        print(f"  stack up to {deepest} of {room} bytes")
        assert deepest <= room, "the stack may reach the variables"
        page_figures.expect(path, objdump, image.symbols["bss_end"] - RAM_BEGIN, RAM_SIZE, deepest)


if __name__ == "__main__":
    main(*sys.argv[1:])
