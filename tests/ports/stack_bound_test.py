"""How deep the stack of an image for AVR can get, by its machine code, and that this much RAM is left for it, and that
docs/firmware.md says so.

    stack_bound_test.py CHIP OBJDUMP IMAGE.elf...

The depth is followed through every instruction from main and from each interrupt: pushes, frames, calls. What is called
through a pointer is one of the port's functions. On top of the deepest path of main lie all interrupts that let others
in, each once, and the UART's receiver once more, since a byte may come while the last one is being put away; and then the
deepest of those that let none in.
"""

import re
import subprocess
import sys
from collections import namedtuple

import page_figures

Chip = namedtuple("Chip", "ram_size return_address receiver")
CHIPS = {
    "atmega2560": Chip(8192, 3, "__vector_25"),
    "atmega1284p": Chip(16384, 2, "__vector_20"),
    "atmega328p": Chip(2048, 2, None),  # of nodes without interrupts
}
BRANCH = re.compile(r"br\w\w$")
SKIP = {"cpse", "sbrc", "sbrs", "sbic", "sbis"}
RETURN = {"ret", "reti"}
SP_LOW = "0x3d"

Instruction = namedtuple("Instruction", "name operands target next")
State = namedtuple("State", "depth frame low")  # `frame`: the depth that Y stands for; `low`: half of a subtraction


class Image:
    def __init__(self, chip, objdump, path):
        self.chip = chip
        text = subprocess.run([objdump, "-d", "-j", ".text", path], check=True, capture_output=True, text=True).stdout
        self.code = {}
        self.symbols = {}
        before = None
        for line in text.splitlines():
            if label := re.match(r"([0-9a-f]+) <(.+)>:", line):
                self.symbols[label[2]] = int(label[1], 16)
            if part := re.match(r" *([0-9a-f]+):\t[0-9a-f ]+\t([a-z.]+)\t?([^;]*)(?:; 0x([0-9a-f]+))?", line):
                address = int(part[1], 16)
                operands = [operand.strip() for operand in part[3].split(",")]
                target = int(part[4], 16) if part[4] else None
                if part[2] in ("call", "jmp"):
                    target = int(operands[0], 16)
                self.code[address] = Instruction(part[2], operands, target, None)
                if before is not None:
                    self.code[before] = self.code[before]._replace(next=address)
                before = address
        self.starts = sorted(self.symbols.values())
        self.port = [at for name, at in self.symbols.items() if name.startswith("port_")]
        self.known = {}

    def name(self, address):
        return next(name for name, at in self.symbols.items() if at == address)

    def end_of_function(self, address):
        return next((start for start in self.starts if start > address), max(self.code) + 1)

    def depth(self, entry):
        """The deepest that the stack gets from `entry` until it returns, without its return address."""
        if entry not in self.known:
            self.known[entry] = None
            self.known[entry] = Path(self, entry).deepest()
        assert self.known[entry] is not None, f"recursion at {entry:#x}"
        return self.known[entry]

    def called(self, address):
        return self.chip.return_address + self.depth(address)

    def through_pointer(self):
        return max(self.called(at) for at in self.port)


class Path:
    def __init__(self, image, entry):
        self.image = image
        self.entry = entry
        self.seen = {}
        self.most = 0

    def deepest(self):
        self.follow([(self.entry, State(0, 0, 0))])
        return self.most

    def follow(self, unvisited):
        while unvisited:
            address, state = unvisited.pop()
            if address in self.seen and self.seen[address].depth >= state.depth:
                continue
            assert state.depth < self.image.chip.ram_size, f"the stack grows without end at {address:#x}"
            self.seen[address] = state
            unvisited += self.step(address, state)
            self.most = max(self.most, state.depth)

    def step(self, address, state):
        code = self.image.code[address]
        name, operands = code.name, code.operands
        if name in RETURN:
            return []
        if name in ("ijmp", "eijmp"):
            return self.table_jump(address, state)
        if name in ("jmp", "rjmp"):
            return self.jump(code, state)
        after = [(code.next, self.change(code, state))]
        if BRANCH.match(name):
            return after + [(code.target, state)]
        if name in SKIP:
            return after + [(self.image.code[code.next].next, state)]
        return after

    def change(self, code, state):
        """What an instruction that goes on behind itself does to the state."""
        name, operands = code.name, code.operands
        if name == "push":
            return state._replace(depth=state.depth + 1)
        if name == "pop":
            return state._replace(depth=state.depth - 1)
        if name in ("rcall", "call"):
            if code.target == code.next:
                return state._replace(depth=state.depth + self.image.chip.return_address)  # makes room
            self.most = max(self.most, state.depth + self.image.called(code.target))
        if name in ("icall", "eicall"):
            self.most = max(self.most, state.depth + self.image.through_pointer())
        if name == "in" and operands == ["r28", SP_LOW]:
            return state._replace(frame=state.depth)
        if name == "out" and operands == [SP_LOW, "r28"]:
            return state._replace(depth=state.frame)
        if name == "subi" and operands[0] == "r28":
            return state._replace(low=int(operands[1], 16))
        if name == "sbci" and operands[0] == "r29" or name == "sbc" and operands == ["r29", "r1"]:
            size = (int(operands[1], 16) << 8 if name == "sbci" else 0) | state.low
            return state._replace(frame=state.frame + (size if size < 0x8000 else size - 0x10000))
        if name in ("sbiw", "adiw") and operands[0] == "r28":
            size = int(operands[1], 16)
            return state._replace(frame=state.frame + (size if name == "sbiw" else -size))
        return state

    def jump(self, code, state):
        """libgcc's shared ends of functions: the first pushes, and comes back; the last one returns."""
        saves, restores = (self.image.symbols.get(f"__{name}__", -1) for name in ("prologue_saves", "epilogue_restores"))
        if 0 <= saves <= code.target < self.image.end_of_function(saves):
            at, pushes = code.target, 0
            while self.image.code[at].name == "push":
                at, pushes = self.image.code[at].next, pushes + 1
            depth = state.depth + pushes
            return [(code.next, State(depth, depth, 0))]
        if 0 <= restores <= code.target < self.image.end_of_function(restores):
            return []
        return [(code.target, state)]

    def table_jump(self, address, state):
        """A pointer's function takes this one's place, or a table leads to what nothing else leads to."""
        if address < self.image.symbols.get("__tablejump2__", -1) or address > self.image.end_of_function(self.entry):
            self.most = max(self.most, state.depth + max(self.image.depth(at) for at in self.image.port))
        begin = max(start for start in self.image.starts if start <= self.entry)
        end = self.image.end_of_function(begin)
        closed = {"ret", "reti", "jmp", "rjmp", "ijmp", "eijmp"}
        found = []
        for at, code in self.image.code.items():
            if begin <= at < end and code.name in closed and begin <= (code.next or 0) < end and code.next not in self.seen:
                found.append((code.next, state))
        return found


def bound(image):
    main = image.called(image.symbols["main"])
    print(f"  main {main}")
    open_interrupts, closed_interrupts = 0, 0
    for name, at in sorted(image.symbols.items(), key=lambda symbol: symbol[1]):
        if not re.match(r"__vector_\d+$", name):
            continue
        depth = image.called(at)
        path = Path(image, at)
        path.deepest()
        lets_in = any(image.code[seen].name == "sei" for seen in path.seen)
        print(f"  {name} {depth}{'' if lets_in else ', alone'}")
        if lets_in:
            open_interrupts += depth * (2 if name == image.chip.receiver else 1)
        else:
            closed_interrupts = max(closed_interrupts, depth)
    return main + open_interrupts + closed_interrupts


def main(chip, objdump, *paths):
    chip = CHIPS[chip]
    for path in paths:
        image = Image(chip, objdump, path)
        headers = subprocess.run([objdump, "-h", path], check=True, capture_output=True, text=True).stdout
        used = sum(int(size, 16) for size in re.findall(r" \.(?:data|bss|noinit|line_bytes) +([0-9a-f]+)", headers))
        print(path)
        deepest = bound(image)
        print(f"  stack up to {deepest}, variables {used}: {chip.ram_size - used - deepest} bytes of RAM are left")
        assert used + deepest <= chip.ram_size, "the stack may reach the variables"
        page_figures.expect(path, objdump, used, chip.ram_size, deepest)


if __name__ == "__main__":
    main(*sys.argv[1:])
