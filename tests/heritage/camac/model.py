"""BUSHD-1, BUSHD-2 and their crate as docs/camac.md tells of them, in code that shares nothing with lib/heritage/camac.

Registers are kept as sets of bit numbers from 1, as the report of 1985 numbers them. What a module asks of its motors is
collected in `asked`, in the words of driver.cpp.
"""

RIGHT, LEFT = "right", "left"


def bits_of(number):
    return {i + 1 for i in range(number.bit_length()) if number >> i & 1}


def number_of(bits):
    return sum(1 << (bit - 1) for bit in bits)


def checksum(codes):
    total = 0
    for code in codes:
        total = (total * 31 + code) % 2**32
    return total


class Station:
    """The commands that both modules have."""

    size = 0

    def __init__(self, asked, motors):
        self.asked = asked
        self.motors = motors  # what they answer: `accepts`, `statuses`
        self.memory = [0] * self.size
        self.address = 0
        self.control = set()
        self.inhibit = False

    def cycle(self, a, f, data):
        """(X, Q, R)"""
        quiet = not self.lam()
        commands = {
            (0, 0): lambda: (quiet, self.take()),
            (0, 1): lambda: (True, self.address),
            (0, 2): lambda: (True, number_of(self.control)),
            (0, 3): lambda: (True, self.requests()),
            (8, 0): lambda: (not quiet, 0),
            (10, 0): lambda: (False, self.clear_lam()),
            (16, 0): lambda: (quiet, self.put(data)),
            (16, 1): lambda: (True, self.point_to(data)),
            (16, 2): lambda: (True, self.set_control(data)),
            (24, 0): lambda: (False, self.forbid()),
            (26, 0): lambda: (False, None if self.inhibit else self.permit()),
        }
        if (f, a) not in commands:
            return 0, 0, 0
        q, r = commands[f, a]()
        return 1, int(q), r or 0

    def take(self):
        byte = self.memory[self.address]
        self.count()
        return byte

    def put(self, data):
        self.memory[self.address] = data % 256
        self.count()

    def count(self):
        if self.address == self.size - 1:
            self.overflow()
        self.point_to(self.address + 1)

    def point_to(self, data):
        self.address = data % self.size

    def set_control(self, data):
        self.control = bits_of(data % 256)

    def initialise(self):
        self.forbid()
        self.address = 0
        self.control = set()
        self.clear()

    def word(self, address):
        return self.memory[address] + 256 * self.memory[address + 1]


class Bushd2(Station):
    size = 1024

    def __init__(self, asked, motors):
        super().__init__(asked, motors)
        self.status = set()
        self.received = 0
        self.flags = set()
        self.motion = None

    def lam(self):
        enabled = {flag for flag, bit in (("overflow", 5), ("fault", 6), ("end", 7)) if bit in self.control}
        if self.motion:
            enabled.discard("overflow")
        return bool(self.flags & enabled)

    def requests(self):
        return number_of(self.status) + 256 * (self.received % 4)

    def clear_lam(self):
        self.flags = set()

    def clear(self):
        self.clear_lam()
        self.status = set()
        self.received = 0

    def overflow(self):
        self.flags.add("overflow")

    @staticmethod
    def stops(status, direction):
        return bool(status & {3, 4, 1 if direction == RIGHT else 2})

    def permit(self):
        if self.motion:
            return
        self.status, self.received = set(), 0
        number = number_of(self.control & {1, 2, 3, 4, 5})
        direction = LEFT if 8 in self.control else RIGHT
        page = 256 * (number // 8)
        steps = self.word(page)
        if not steps:
            self.flags.add("end")
            return
        status = self.motors["statuses"].get(number, set())
        if self.stops(status, direction):
            self.status, self.received = set(status), 1
            self.flags.add("fault")
            return
        codes = [max(code, 1) for code in self.memory[page + 2:page + 240]]
        self.asked.append(f"move {number // 8} {number} {int(direction == LEFT)} {steps} {checksum(codes)}")
        if not self.motors["accepts"]:
            self.flags.add("fault")
            return
        self.motion = {"number": number, "direction": direction, "left": steps, "made": 0, "codes": codes, "stopped": False}

    def forbid(self):
        if self.motion and not self.motion["stopped"]:
            self.motion["stopped"] = True
            self.asked.append(f"stop {self.motion['number']}")

    def note(self, steps):
        right = self.motion["direction"] == RIGHT
        at = 256 * (self.motion["number"] // 8) + 240 + 2 * (self.motion["number"] % 8)
        position = (self.word(at) + (steps if right else -steps)) % 65536
        self.memory[at:at + 2] = [position % 256, position // 256]

    def answer(self, steps, status):
        motion = self.motion
        if not motion:
            return
        steps = min(steps, motion["left"])
        motion["left"] -= steps
        motion["made"] += steps
        self.note(steps)
        self.received += max(steps, 1)
        self.status = status | ({5} if steps else set())
        if motion["left"] == 0:
            if not motion["stopped"]:
                self.flags.add("end")
            self.motion = None
        elif self.stops(status, motion["direction"]):
            self.flags.add("fault")
            self.motion = None

    def ends(self, status, unanswered):
        motion = self.motion
        if not motion:
            return
        self.note(unanswered)
        if status:
            self.status = set(status)
            self.received += 1
        if not motion["stopped"] or self.stops(status, motion["direction"]):
            self.flags.add("fault")
        self.motion = None


class Bushd1(Station):
    size = 256

    def __init__(self, asked, motors):
        super().__init__(asked, motors)
        self.raised = set()
        self.at = set()  # active limits
        self.motion = None

    def lam(self):
        enables = {1: 1, 2: 2, 3: 3, 4: 5, 5: 5, 6: 6}
        return any(enables[request] in self.control for request in self.raised)

    def requests(self):
        levels = ({7} if RIGHT in self.at else set()) | ({8} if LEFT in self.at else set())
        return number_of(self.raised | levels)

    def clear_lam(self):
        self.raised = set()

    clear = clear_lam

    def overflow(self):
        self.raised.add(6)

    @staticmethod
    def delay(word):
        return min(max(word, 1), 30000)

    def permit(self):
        if self.motion:
            return
        direction = LEFT if 4 in self.control else RIGHT
        automatic, second = 7 in self.control, 8 in self.control
        if not automatic:
            if direction in self.at:
                self.raised.add(1 if direction == RIGHT else 2)
                return
            self.asked.append(f"step {int(direction == LEFT)} {int(second)}")
            if not self.motors["accepts"]:
                self.raised.add(4)
                return
            self.motion = {"automatic": False, "to": direction, "stopped": False}
            return
        steps = self.memory[0]
        if not 1 <= steps <= 126 or direction in self.at:
            self.raised.add(5)
            return
        codes = [self.delay(self.word(4 + 2 * i)) for i in range(steps)]
        self.asked.append(f"travel {int(direction == LEFT)} {steps} {checksum(codes)} {self.delay(self.word(2))} {int(second)}")
        if not self.motors["accepts"]:
            self.raised.add(5)
            return
        self.motion = {"automatic": True, "to": direction, "stopped": False, "home": direction, "steps": steps, "made": 0,
                       "again": second}

    def forbid(self):
        if self.motion and not self.motion["stopped"]:
            self.motion["stopped"] = True
            self.asked.append("halt")

    def fail(self):
        self.raised.add(5)
        self.forbid()

    def limits(self, right, left):
        now = ({RIGHT} if right else set()) | ({LEFT} if left else set())
        new, self.at = now - self.at, now
        motion = self.motion
        if not motion or motion["automatic"] and motion["made"] == 0:
            return
        self.raised |= {1 if limit == RIGHT else 2 for limit in new}
        if motion["automatic"] and not motion["stopped"] and motion["made"] < motion["steps"] and motion["to"] in self.at:
            self.fail()

    def end_step(self, request):
        if self.motion and not self.motion["automatic"]:
            if not self.motion["stopped"]:
                self.raised.add(request)
            self.motion = None

    def step_done(self):
        self.end_step(3)

    def step_not_done(self):
        self.end_step(4)

    def travels(self):
        return self.motion and self.motion["automatic"] and not self.motion["stopped"]

    def run_step_done(self):
        if not self.travels():
            return
        if self.motion["made"] == self.motion["steps"] or self.motion["to"] in self.at:
            self.fail()
        else:
            self.motion["made"] += 1

    def run_ends(self):
        if not self.travels():
            return
        motion = self.motion
        if motion["made"] != motion["steps"] or self.at != {motion["to"]}:
            self.fail()
            return
        motion["made"] = 0
        motion["to"] = LEFT if motion["to"] == RIGHT else RIGHT
        if motion["to"] == motion["home"] and not motion["again"]:
            self.motion = None

    def stands(self):
        if self.motion and not self.motion["stopped"]:
            self.raised.add(5 if self.motion["automatic"] else 4)
        self.motion = None


class Laboratory:
    """The crate, its clock, and what driver.cpp takes."""

    stations = {5: "two", 7: "one"}

    def __init__(self):
        self.asked = []
        self.motors = {"accepts": True, "statuses": {}}
        self.two = Bushd2(self.asked, self.motors)
        self.one = Bushd1(self.asked, self.motors)
        self.inhibit = False
        self.demand = False

    def graded(self):
        return number_of({station for station, name in self.stations.items() if getattr(self, name).lam()})

    def cycle(self, n, a, f, data):
        if n in self.stations:
            return getattr(self, self.stations[n]).cycle(a, f, data % 2**24)
        if (n, a, f) == (28, 8, 26):
            self.two.initialise()
            self.one.initialise()
            return 1, 0, 0
        if (n, a, f) == (28, 9, 26):
            self.two.clear()
            self.one.clear()
            return 1, 0, 0
        if n != 30:
            return 0, 0, 0
        if f == 0 and a < 8:
            return 1, 1, self.graded()
        if a in (9, 10) and f in (24, 26, 27):
            name = "inhibit" if a == 9 else "demand"
            if f == 27:
                return 1, int(getattr(self, name)), 0
            setattr(self, name, f == 26)
            self.one.inhibit = self.two.inhibit = self.inhibit
            return 1, 0, 0
        if a == 11 and f == 27:
            return 1, int(self.graded() != 0), 0
        return 0, 0, 0

    def carry_out(self, line):
        what, *numbers = line.split()
        numbers = [int(number) for number in numbers]
        answer = "- - -"
        if what == "naf":
            answer = " ".join(str(value) for value in self.cycle(*numbers))
        elif what == "status":
            self.motors["statuses"][numbers[0]] = bits_of(numbers[1])
        elif what == "accept":
            self.motors["accepts"] = bool(numbers[0])
        elif what == "answer":
            self.two.answer(numbers[0], bits_of(numbers[1]))
        elif what == "ends":
            self.two.ends(bits_of(numbers[0]), numbers[1])
        else:
            getattr(self.one, what)(*numbers)
        line = " ".join([answer, str(self.graded()), *self.asked])
        self.asked.clear()
        return line
