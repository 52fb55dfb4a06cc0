"""What each function of the Python client asks of the daemon, message by message."""

import asyncio
import socket
import unittest

from bushd import NoDaemon, Table, aio, messages
from bushd.asks import Asks

QUIET = {"utime_us", "session", "client_id", "number"}  # of each request


def type_of(channel):
    return getattr(messages, "camac_request_t" if channel == "CAMAC" else f"{channel.lower()}_t")


def said(message):
    """What of it is no default, but the counts of arrays."""
    default, counts = type(message)(), {field.count for field in message.FIELDS}
    values = {}
    for field in message.FIELDS:
        value = getattr(message, field.name)
        value = list(value) if field.count else value
        if hasattr(value, "FIELDS"):
            value = said(value)
        elif field.count and value and hasattr(value[0], "FIELDS"):
            value = [said(one) for one in value]
        if field.name not in counts and field.name != "request" and value not in (getattr(default, field.name), {}):
            values[field.name] = value
    return values


class Daemon:
    """As a link: does what it is asked for at once, and has nothing else to say."""

    loses, remedy = False, "start it"

    def __init__(self):
        self.sent = []
        self._answers = []
        self._here, self._there = socket.socketpair()

    def fileno(self):
        return self._here.fileno()

    def send(self, channel, payload):
        message = type_of(channel).decode(payload)
        self.sent.append((channel, said(message)))
        if not hasattr(message, "request") or getattr(message, "renew", False):
            return
        who = {name: getattr(message.request, name) for name in ("session", "client_id", "number")}
        header = messages.reply_header_t(**who, phase="RESULT", outcome="done", part=0, parts=1)
        self._answers.append(("REPLY", messages.answer_t(reply=header).encode()))
        self._there.send(b"x")

    def receive(self):
        self._here.recv(1000)
        answers, self._answers = self._answers, []
        yield from answers

    def close(self):
        self._here.close()
        self._there.close()


def asked(call):
    """The requests that it leads to."""

    async def carry_out():
        daemon = Daemon()
        async with aio.Client(daemon, "me") as client:
            try:
                await call(client)
            except NoDaemon as lacks:  # a plan, a table and others: this one tells none
                assert "lacks what was asked for" in str(lacks), lacks
        return daemon.sent

    return asyncio.run(carry_out())


def way(**values):
    """Motors with steps, or user positions."""
    return [{"motor": name, **({"in_steps": True, "steps": value} if isinstance(value, int) else {"user": value})} for name, value in values.items()]


def made_of_its_type(name):
    """A function that make_told writes: what it is given is what the message says."""
    defaults = type_of(name)()
    said = {field.name: ["m", "n"] if field.count else type(getattr(defaults, field.name))(3) for field in defaults.FIELDS
            if field.name not in ("request", "motor_count")}
    values = [value for field, given in said.items() for value in (given if field == "motors" else [given])]
    return lambda c: getattr(c, name)(*values), name.upper(), said


MOVE = messages.move_t
TABLE = Table(name="own", time_unit_ns=40_000, accel=(3, 2), hash="0a", revision=4)
CAMAC = {"crate": 2, "mode": messages.camac_request_t.SINGLE, "count": 1, "last_station": 23, "last_subaddress": 15,
         "cycles": [{"station": 5, "subaddress": 1, "function": 16, "data": 7}]}

# (call, channel, what its message says)
ASKED = [
    (lambda c: c.move("m", to=1.5, speed=2.0), "MOVE", {"kind": MOVE.ABSOLUTE, "motors": way(m=1.5), "speed": 2.0}),
    (lambda c: c.move(by={"m": 4, "n": -5.0}, unit="steps"), "MOVE", {"kind": MOVE.RELATIVE, "motors": way(m=4, n=-5)}),
    (lambda c: c.plan("m", by=3, unit="steps", speed=9), "MOVE",
     {"kind": MOVE.RELATIVE, "motors": way(m=3), "speed": 9.0, "speed_in_steps": True, "dry_run": True}),
    (lambda c: c.move_line({"m": 1.0, "n": 2.0}, duration_s=3), "MOVE_LINE",
     {"kind": messages.move_line_t.ABSOLUTE, "motors": way(m=1.0, n=2.0), "duration_s": 3.0}),
    (lambda c: c.move_line(by={"m": 4, "n": 3}, unit="steps", law="elementary", feed=9.0), "MOVE_LINE",
     {"kind": messages.move_line_t.RELATIVE, "motors": way(m=4, n=3), "law": messages.move_line_t.ELEMENTARY, "feed": 9.0,
      "feed_in_steps": True}),
    (lambda c: c.plan_line(by={"m": 1.0}), "MOVE_LINE", {"kind": messages.move_line_t.RELATIVE, "motors": way(m=1.0), "dry_run": True}),
    (lambda c: c.move_path(["m", "n"], [(1, 2), (3, 4)], exact=True, speed=5.0, in_steps=True), "MOVE_PATH",
     {"rows": 2, "corners": messages.move_path_t.EXACT, "speed": 5.0, "speed_in_steps": True, "motors": ["m", "n"], "positions": [1, 2, 3, 4]}),
    (lambda c: c.plan_path(["m"], [(1,)], speeds=[2.0], feed=4.0), "MOVE_PATH",
     {"rows": 1, "corners": messages.move_path_t.CONTINUOUS, "feed": 4.0, "dry_run": True, "motors": ["m"], "positions": [1], "speeds": [2.0]}),
    (lambda c: c.home("m", speed=2.0), "HOME", {"motors": ["m"], "speed": 2.0}),
    (lambda c: c.home(all=True), "HOME", {"all": True}),
    (lambda c: c.arm({"m": 1.5}, edge="falling", delay_us=60, speed=2.0, while_connected=True), "ARM",
     {"motors": way(m=1.5), "edge": messages.arm_t.FALLING, "delay_us": 60, "speed": 2.0, "while_connected": True}),
    (lambda c: c.arm_line(by={"m": 1.5}, duration_s=2.0), "ARM_LINE",
     {"kind": messages.arm_line_t.RELATIVE, "motors": way(m=1.5), "edge": messages.arm_line_t.RISING, "delay_us": 50, "duration_s": 2.0}),
    (lambda c: c.stop("m"), "STOP", {"motors": ["m"]}),
    (lambda c: c.stop(wait=False), "STOP", {}),
    (lambda c: c.emergency_stop(), "EMERGENCY_STOP", {}),
    (lambda c: c.set_position("m", 0.5), "SET_POSITION", {"motors": way(m=0.5)}),
    (lambda c: c.set_position({"m": 2}, unit="steps", dial=True), "SET_POSITION", {"motors": way(m=2), "dial": True}),
    (lambda c: c.position_compare("m", 1.5, negative=False, delay_us=3), "POSITION_COMPARE",
     {"position": way(m=1.5)[0], "arrivals": messages.position_compare_t.POSITIVE, "delay_us": 3, "width_us": 10}),
    (lambda c: c.position_compare("m", 1, unit="steps", positive=False, negative=False), "POSITION_COMPARE",
     {"position": way(m=1)[0], "width_us": 10}),
    (lambda c: c.config("m"), "CONFIGURE", {"kind": messages.configure_t.SHOW, "motors": ["m"]}),
    (lambda c: c.config(), "CONFIGURE", {"kind": messages.configure_t.SHOW}),
    (lambda c: c.config("m", local=True, max_speed=None), "CONFIGURE",
     {"kind": messages.configure_t.CHANGE, "changes": [{"motor": "m", "key": "local", "value": "true"}, {"motor": "m", "key": "max_speed", "value": "none"}]}),
    (lambda c: c.history("m", 7), "GET_HISTORY", {"motor": "m", "most": 7}),
    (lambda c: c.camac([(5, 1, 16, 7)], crate=2), "CAMAC", CAMAC),
    (lambda c: c.put_program("scan", "motors = []", {"way.csv": "m\n1\n"}, dry_run=True), "PUT_PROGRAM",
     {"program": "scan", "text": "motors = []", "points": [{"file": "way.csv", "text": "m\n1\n"}], "dry_run": True}),
    (lambda c: c.list_programs(), "LIST_PROGRAMS", {}),
    (lambda c: c.erase_program("scan"), "ERASE_PROGRAM", {"program": "scan"}),
    (lambda c: c.tables.list(), "LIST_TABLES", {}),
    (lambda c: c.tables.get("own"), "GET_TABLE", {"table": "own"}),
    (lambda c: c.tables.set("own", TABLE), "SET_TABLE",
     {"table": "own", "expected_hash": "0a", "content": {"name": "own", "revision": 4, "time_unit_ns": 40_000, "accel": [3, 2]}}),
    (lambda c: c.tables.use("group0", "own"), "USE_TABLE", {"group": "group0", "table": "own"}),
    (lambda c: c.tables.reload(), "RELOAD_TABLES", {}),
    (lambda c: c.clear("m", "n"), "CLEAR_FAULTS", {"motors": ["m", "n"]}),
    *(made_of_its_type(name) for name in vars(Asks) if not name.startswith("_")),
]


class Requests(unittest.TestCase):
    def test_each_function_asks_for_what_it_says(self):
        for call, channel, fields in ASKED:
            with self.subTest(channel):
                self.assertEqual(asked(call), [(channel, fields)])

    def test_help_says_of_which_motors(self):
        self.assertIn("names: at least 1\n", Asks.confirm.__doc__)
        self.assertIn("names: motors; none named: all\n", Asks.enable.__doc__)
        self.assertIn("names: motors or groups; none named: all\n", Asks.hold.__doc__)

    def test_rows_and_the_run_of_an_array(self):
        kind, motors = messages.follow_t, {"motors": ["m"], "array": 1, "stretch": 2.0, "cubic": True}
        self.assertEqual(asked(lambda c: c.follow(["m"], [0, 1], [[0], [4]], cubic=True, stretch=2)), [
            ("FOLLOW", {**motors, "part": kind.LAST_ROWS, "time_s": [0, 1], "positions": [0, 4]}),
            ("FOLLOW", {**motors, "part": kind.RUN})])
        # To check it is the same without the part that begins it.
        self.assertEqual(asked(lambda c: c.check_follow(["m"], [0, 1], [[0], [4]], cubic=True, stretch=2)), [
            ("FOLLOW", {**motors, "part": kind.LAST_ROWS, "time_s": [0, 1], "positions": [0, 4]})])

    def test_whom_programs_move_is_asked_before_they_run(self):
        self.assertEqual(asked(lambda c: c.run_programs("scan", "other")), [
            ("LIST_PROGRAMS", {}), ("RUN_PROGRAMS", {"programs": ["scan", "other"]})])

    def test_a_jog_begins_changes_and_ends(self):
        async def jog(client):
            async with client.jog("m", 2.0, keepalive_ms=300) as jog:
                self.assertTrue(jog.done)  # this daemon ends it at once

        self.assertEqual(asked(jog), [("JOG", {"motor": "m", "speed": 2.0, "keepalive_ms": 300, "steps_after": -1})])

    def test_every_request_of_the_daemon_can_be_made(self):
        made = {type_of(channel).__name__ for _, channel, _ in ASKED} | {"jog_t", "follow_t", "run_programs_t"}
        asks = {path.stem for path in messages.TYPES.glob("*.lcm") if "request" in getattr(messages, path.stem).__slots__}
        self.assertEqual(asks - made, {"get_status_t"})  # of `status()`

    def test_what_cannot_be_asked_for(self):
        for call in (lambda c: c.arm({"m": 1.0}, edge="up"), lambda c: c.move("m", to=1, speed=0), lambda c: c.move({}),
                     lambda c: c.move_line({"m": 1.0}, duration_s=0), lambda c: c.move_line({"m": 1.0}, law="printed"),
                     lambda c: c.move_path(["m"], [(1,)], feed=0), lambda c: c.plan_line({"m": 1.0}, feed=-1), lambda c: c.move("m", by=0.5, unit="steps")):
            with self.assertRaises(ValueError):
                asked(call)
        for call in (lambda c: c.home(), lambda c: c.home("m", all=True), lambda c: c.config(local=True), lambda c: c.stop(5),
                     lambda c: c.run_programs()):
            with self.assertRaises(TypeError):
                asked(call)


if __name__ == "__main__":
    unittest.main()
