"""What the Python client's session stands on: the whole from its parts, LCM's datagrams, arguments of callers."""

import inspect
import os
import socket
import struct
import tempfile
import unittest
from unittest import mock

from bushd import NoDaemon, Trust, aio, arguments, client, codec, messages, motion, requests, udpm
from bushd.status import MOST_PUT_OFF, StatusCollector


def encoded_state(part, parts=2, sequence=1, run=1, motors=(), trust="known", position=12.5):
    message = messages.mcu_state_t()
    message.mcu, message.state = f"hall:{part + 1}", "READY"
    message.part, message.parts, message.sequence, message.run = part, parts, sequence, run
    for name in motors:
        motor = messages.motor_t()
        motor.name, motor.trust, motor.activity, motor.user_position = name, trust, "rest", position
        message.motors.append(motor)
    message.motor_count = len(motors)
    return message.encode()


def state(*arguments, **named):
    return codec.decode("STATE", encoded_state(*arguments, **named))


def unread(*arguments, **named):
    return codec.unread(encoded_state(*arguments, **named))


def description(part, parts=2, sequence=1, run=1, motors=()):
    message = messages.mcu_description_t()
    message.mcu, message.part, message.parts = f"hall:{part + 1}", part, parts
    message.sequence, message.run = sequence, run
    for name in motors:
        motor = messages.motor_description_t()
        motor.name, motor.unit, motor.precision, motor.soft_limits = name, "mm", 3, True
        motor.user_low, motor.user_high = -5.0, 30.0
        message.motors.append(motor)
    message.motor_count = len(motors)
    return codec.decode("DESCRIPTION", message.encode())


def health(part=0, parts=1, sequence=1, run=1, bus="hall"):
    return codec.decode("HEALTH", messages.health_t(bus=bus, part=part, parts=parts, sequence=sequence, run=run).encode())


class Whole(unittest.TestCase):
    def test_is_there_once_all_parts_are(self):
        collector = StatusCollector()
        for part in (description(1, motors=["b"]), state(0, motors=["a"]), description(0, motors=["a"])):
            collector.add(part)
            self.assertFalse(collector.has_motors())
        collector.add(state(1, motors=["b"]))
        status = collector.status()
        self.assertEqual(list(status.motors), ["a", "b"])
        self.assertEqual((status["b"].mcu, status["b"].position), ("hall:2", 12.5))
        self.assertEqual(status["b"].soft_limits, (-5.0, 30.0))
        self.assertEqual(str(status["a"]), "a: 12.500 mm (known), rest")

    def test_the_newest_counts_and_another_run_begins_anew(self):
        collector = StatusCollector()
        for part in (state(0, 1, sequence=9, motors=["new"]), state(0, 1, sequence=3, motors=["old"]),
                     description(0, 1, motors=["new", "old"])):
            collector.add(part)
        self.assertEqual(list(collector.status().motors), ["new"])
        collector.add(state(0, 1, run=2, motors=["new"]))
        self.assertFalse(collector.has_motors())

    def test_health_of_another_run_begins_anew(self):
        collector = StatusCollector()
        for part in (health(sequence=9), health(sequence=3, bus="old")):
            collector.add(part)
        self.assertEqual(list(collector.health()), ["hall"])
        collector.add(health(part=0, parts=2, sequence=1, run=2, bus="attic"))
        self.assertFalse(collector.has_health())
        collector.add(health(part=1, parts=2, sequence=2, run=2, bus="cellar"))
        self.assertEqual(list(collector.health()), ["attic", "cellar"])

    def test_what_is_told_again_is_not_made_anew(self):
        collector = StatusCollector()
        for part in (state(0, motors=["a"]), state(1, motors=["b"]), description(0, motors=["a"]), description(1, motors=["b"])):
            collector.add(part)
        first = collector.status()
        self.assertIsNot(state(0, sequence=2, motors=["a"]).content, state(0, sequence=2, motors=["a"]).content)
        for part in (state(0, sequence=2, motors=["a"]), state(1, sequence=3, motors=["b"], trust="uncertain"), description(0, sequence=4, motors=["a"])):
            collector.add(part)
        second = collector.status()
        self.assertIs(second["a"], first["a"])
        self.assertEqual((first["b"].trust, second["b"].trust), (Trust.KNOWN, Trust.UNCERTAIN))
        self.assertEqual((first.sequence, second.sequence), (1, 3))
        other = description(0, sequence=5, motors=["a"]).content.motors
        self.assertIs(other[0], description(0, sequence=6, motors=["a"]).content.motors[0])
        collector.add(state(0, sequence=7, motors=["a", "c"]))
        self.assertEqual(list(collector.status().motors), ["a", "b"])  # c is described by nobody
        collector.add(description(0, sequence=8, motors=["a", "c"]))
        self.assertEqual(list(collector.status().motors), ["a", "c", "b"])

    def test_a_list_of_motors_that_was_right_once_is_not_taken_with_another_length(self):
        message = messages.mcu_state_t(mcu="hall:1", state="READY", parts=1, motors=[messages.motor_t(name="a", trust="known", activity="rest")])
        good = message.encode()
        self.assertEqual(len(codec.decode("STATE", good).content.motors), 1)
        for count in (0, 2, -1):
            at = len(good) - len(message.motors[0].encode()) + 8 - 4
            self.assertEqual(good[at : at + 4], b"\0\0\0\1")
            bad = good[:at] + count.to_bytes(4, "big", signed=True) + good[at + 4 :]
            self.assertIsNone(codec.decode("STATE", bad))
        self.assertIsNone(codec.decode("STATE", good[:-1]))
        self.assertIsNone(codec.decode("STATE", good + b"\0"))

    def test_a_word_that_no_daemon_says_is_refused_each_time(self):
        for _ in range(2):
            self.assertIsNone(state(0, motors=["a"], trust="sure"))

    def test_an_unknown_position_is_none(self):
        collector = StatusCollector()
        collector.add(state(0, 1, motors=["a"], trust="unknown"))
        collector.add(description(0, 1, motors=["a"]))
        motor = collector.status()["a"]
        self.assertEqual((motor.trust, motor.position, motor.target_steps), (Trust.UNKNOWN, None, None))

    def collector(self):
        collector = StatusCollector()
        for part in (state(0, 1, sequence=5, motors=["a"]), description(0, 1, motors=["a"])):
            collector.add(part)
        return collector

    def test_a_state_that_is_put_off_is_read_with_the_whole(self):
        collector = self.collector()
        heard = collector.states_heard
        for sequence, position in ((6, 13.0), (8, 14.0), (7, 15.0)):
            self.assertTrue(collector.put_off(unread(0, 1, sequence=sequence, motors=["a"], position=position)))
        self.assertEqual(collector.states_heard, heard + 3)
        self.assertFalse(collector.add(state(0, 1, sequence=7, motors=["a"])))
        status = collector.status()
        self.assertEqual((status["a"].position, status.sequence), (14.0, 8))
        self.assertFalse(collector.put_off(unread(0, 1, sequence=7, motors=["a"])))

    def test_a_newer_state_that_is_read_takes_the_place_of_one_that_was_put_off(self):
        collector = self.collector()
        collector.put_off(unread(0, 1, sequence=6, motors=["a"], position=13.0))
        collector.add(state(0, 1, sequence=7, motors=["a"], trust="uncertain"))
        self.assertEqual((collector.status()["a"].trust, collector.status().sequence), (Trust.UNCERTAIN, 7))

    def test_what_begins_anew_is_not_put_off(self):
        collector = StatusCollector()
        self.assertFalse(collector.put_off(unread(0, 1)))
        collector = self.collector()
        self.assertTrue(collector.put_off(unread(0, 1, sequence=6, motors=["a"], position=13.0)))
        for other in (unread(0, 1, run=2, sequence=9), unread(0, 2, sequence=9), unread(1, 2, sequence=9), unread(-1, 1, sequence=9)):
            self.assertFalse(collector.put_off(other))
        collector.add(state(0, 1, run=2, sequence=1, motors=["a"]))
        collector.add(description(0, 1, run=2, motors=["a"]))
        self.assertEqual((collector.status()["a"].position, collector.status().run), (12.5, 2))

    def test_what_was_put_off_and_is_no_state_is_dropped(self):
        good = encoded_state(0, 1, sequence=6, motors=["a"], position=13.0)
        for bad in (good[:-1], good + b"\0", good[:40], encoded_state(0, 1, sequence=6, motors=["a"], trust="sure")):
            collector = self.collector()
            self.assertTrue(collector.put_off(codec.unread(bad)))
            status = collector.status()
            self.assertEqual((status["a"].position, status.sequence), (12.5, 5))
            self.assertTrue(collector.put_off(codec.unread(good)))
            for _ in range(MOST_PUT_OFF - 1):
                self.assertTrue(collector.put_off(codec.unread(bad)))
            self.assertFalse(collector.put_off(codec.unread(bad)))
            self.assertEqual(collector.status()["a"].position, 13.0)
        for none in (b"", good[:39], b"\0" + good[1:]):
            self.assertIsNone(codec.unread(none))

    def test_states_and_descriptions_of_different_configurations_are_no_whole(self):
        collector = StatusCollector()
        collector.add(state(0, 2))
        collector.add(state(1, 2))
        collector.add(description(0, 1))
        self.assertFalse(collector.has_motors())

    def test_parts_beyond_all_configurations_are_dropped(self):
        collector = StatusCollector()
        for part, parts in ((0, 0), (-1, 1), (1, 1), (0, 2**31 - 1)):
            self.assertFalse(collector.add(state(part, parts)))
        self.assertTrue(collector.is_empty())


class Datagrams(unittest.TestCase):
    def fragment(self, number, count, offset, size, piece, sequence=1):
        return struct.pack(">IIIIHH", udpm.FRAGMENT, sequence, size, offset, number, count) + piece

    def test_a_message_is_as_lcm_has_it(self):
        data = udpm.datagram(5, "BUSHD_STOP", b"abc")
        self.assertEqual(data, b"LC02\0\0\0\x05BUSHD_STOP\0abc")
        self.assertEqual(udpm.Receiver().take(data, "host"), ("BUSHD_STOP", b"abc"))

    def test_fragments_come_in_any_order(self):
        receiver = udpm.Receiver()
        self.assertIsNone(receiver.take(self.fragment(1, 3, 2, 6, b"cd"), "host"))
        self.assertIsNone(receiver.take(self.fragment(2, 3, 4, 6, b"ef"), "host"))
        self.assertIsNone(receiver.take(self.fragment(2, 3, 4, 6, b"ef"), "host"))
        self.assertIsNone(receiver.take(self.fragment(0, 3, 0, 6, b"X\0zz"), "another host"))
        self.assertEqual(receiver.take(self.fragment(0, 3, 0, 6, b"X\0ab"), "host"), ("X", b"abcdef"))
        self.assertIsNone(receiver.take(self.fragment(0, 3, 0, 6, b"X\0ab"), "host"))

    def test_what_is_no_message_is_dropped(self):
        receiver = udpm.Receiver()
        for data in (b"", b"LC02", b"LC02\0\0\0\0", b"LC02\0\0\0\0name without end", b"LC02\0\0\0\0\0",
                     b"LC09" + bytes(40), b"LC02\0\0\0\0" + b"n" * 64 + b"\0", b"LC02\0\0\0\0\xff\0",
                     self.fragment(0, 0, 0, 4, b"X\0ab"), self.fragment(2, 2, 0, 4, b"X\0ab"),
                     self.fragment(0, 1, 3, 4, b"X\0abcd"), self.fragment(0, 1, 0, 2**32 - 1, b"X\0ab"),
                     self.fragment(0, 1, 0, 4, b"no channel"),
                     self.fragment(0, 1, 0, 5, b"X\0abcd")):
            self.assertIsNone(receiver.take(data, "host"), data)

    def test_unfinished_messages_are_bounded(self):
        receiver = udpm.Receiver()
        for sequence in range(1000):
            receiver.take(self.fragment(0, 2, 0, 4, b"X\0ab", sequence), "host")
        self.assertLessEqual(len(receiver._unfinished), receiver.MAX_MESSAGES)

    def test_urls(self):
        self.assertEqual(udpm.Url.parse("udpm://"), udpm.Url())
        self.assertEqual(udpm.Url.parse("udpm://239.1.2.3:4000?ttl=1&recv_buf_size=5"),
                         udpm.Url("239.1.2.3", 4000, 1, 5))
        for url in ("file:///x", "udpm://a:b"):
            with self.assertRaises(ValueError):
                udpm.Url.parse(url)


class NoDaemonThere(unittest.TestCase):
    """Told at once: what is missing, and how to start it."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = f"{folder.name}/control"
        environment = mock.patch.dict(os.environ, BUSHD_CONTROL=self.path)
        environment.start()
        self.addCleanup(environment.stop)
        os.environ.pop("LCM_DEFAULT_URL", None)

    def assert_told(self, begins):
        for connect in (client.connect, lambda: client.connect(self.path)):
            with self.assertRaises(NoDaemon) as told:
                connect()
            self.assertEqual(
                str(told.exception),
                f"{begins}. Start it with 'sudo systemctl start bushd', or 'bushd --config FILE'; for another daemon use "
                "connect(PATH) ($BUSHD_CONTROL), or connect(lcm=True)")

    def test_without_a_socket(self):
        self.assert_told(f"no control socket at {self.path}: bushd is not running")

    def test_with_a_socket_that_is_left(self):
        with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as left:
            left.bind(self.path)
        self.assert_told(f"nobody listens at the control socket {self.path}: bushd has ended")

    def test_a_daemon_that_hangs(self):
        with socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as listener, socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET) as first:
            listener.bind(self.path)
            listener.listen(0)
            first.connect(self.path)  # has the only place among those who wait
            with self.assertRaisesRegex(NoDaemon, f"bushd takes no connection at {self.path}: it hangs"):
                client.connect()

    def test_lcm_is_used_if_somebody_asks_for_it(self):
        os.environ["LCM_DEFAULT_URL"] = "udpm://127.0.0.1:7667"  # no multicast address
        for lcm in (False, True):
            with self.assertRaisesRegex(NoDaemon, 'LCM cannot use the URL "udpm://127.0.0.1:7667"'):
                client.connect(lcm=lcm)


class Arguments(unittest.TestCase):
    def test_ways_to_write_a_move(self):
        self.assertEqual(arguments.amounts("m", 1, None, None), arguments.Amounts({"m": 1}, True, None))
        self.assertEqual(arguments.amounts("m", None, 1, None), arguments.Amounts({"m": 1}, False, None))
        self.assertEqual(arguments.amounts({"m": 1}, None, None, None), arguments.Amounts({"m": 1}, True, None))
        self.assertEqual(arguments.amounts(None, None, {"m": 1}, "steps"), arguments.Amounts({"m": 1}, False, "steps"))
        for wrong in (("m", None, None), ("m", 1, 1), ({"m": 1}, 1, None), ("m", {"m": 1}, None), (None, 1, None),
                      (None, None, None)):
            with self.assertRaises(TypeError):
                arguments.amounts(*wrong, None)

    def test_a_client_id_is_one(self):
        name = arguments.client_id("a program\n" + "x" * 100)
        self.assertRegex(name, r"^[!-~]{1,64}$")
        self.assertNotEqual(name, arguments.client_id("a program\n" + "x" * 100))
        self.assertRegex(arguments.client_id("a@b"), rf"^a_b@.+-{os.getpid()}-[0-9a-f]{{8}}$")

    def test_settings_are_as_in_the_file(self):
        for changes, said in (
            ({"offset": 12.5, "direction": "negative", "soft_limits": (-5, 30.0)},
             [("offset", "12.5"), ("direction", "negative"), ("soft_limits", "[-5.0, 30.0]")]),
            ({"soft_limits": None}, [("soft_limits", "none")]),
            ({"max_speed": 2.5}, [("max_speed", "2.5")]),
            ({"acceleration": 0.5}, [("acceleration", "0.5")]),
            ({"local": True, "keypad": False}, [("local", "true"), ("keypad", "false")]),
            ({"velocity": (100, 1500, 500), "currents": (1500, 1000, 300, "fast")},
             [("velocity", "100,1500,500"), ("currents", "1500,1000,300,fast")]),
        ):
            message = requests.change_configuration("m", changes).message
            self.assertEqual([(change.motor, change.key, change.value) for change in message.changes], [("m", *one) for one in said])

    def test_cycles_have_addresses_and_data(self):
        message = requests.camac([(5, 1, 16, 7), (5, 0, 0)], crate=2).message
        self.assertEqual((message.crate, message.count), (2, 2))
        self.assertEqual(messages.camac_request_t.decode(message.encode()).cycle_count, 2)
        cycles = [(cycle.station, cycle.subaddress, cycle.function, cycle.data) for cycle in message.cycles]
        self.assertEqual(cycles, [(5, 1, 16, 7), (5, 0, 0, 0)])
        self.assertEqual((message.last_station, message.last_subaddress), (23, 15))
        self.assertEqual(requests.camac([(5, 0, 0)], mode="q-stop", count=4096).message.count, 4096)
        for wrong in ({"mode": "stop"}, {"cycles": [(5, 0)]}):
            with self.assertRaises(ValueError):
                requests.camac(**{"cycles": [(5, 0, 0)], **wrong})

    def test_points_of_a_path_come_in_several_messages(self):
        points = [(n, -n, 0.5) for n in range(3000)]
        made = [request.message for request in requests.move_path(["a", "b", "c"], points, exact=True, dry_run=True)]
        self.assertEqual([(part.rows, part.first_row) for part in made], [(3000, 0), (3000, 1365), (3000, 2730)])
        self.assertEqual([value for part in made for value in part.positions], [v for row in points for v in row])
        self.assertTrue(all(part.corners == messages.move_path_t.EXACT and part.dry_run for part in made))
        single = [request.message for request in requests.move_path(["a"], [[n] for n in range(5000)], speeds=range(5000))]
        self.assertEqual([value for part in single for value in part.speeds], list(range(5000)))
        for wrong in (([], [[1]]), (["a"], []), (["a", "b"], [[1, 2], [3]]), (["a"], [[float("nan")]])):
            with self.assertRaises(ValueError):
                requests.move_path(*wrong)
        with self.assertRaisesRegex(ValueError, "1 speeds for 2 points"):
            requests.move_path(["a"], [[1], [2]], speeds=[3])

    def test_rows_of_a_trajectory_come_in_several_messages_and_then_run(self):
        times = [n / 8 for n in range(5000)]
        made = [request.message for request in requests.follow(["a"], times, [[-t] for t in times], array=4, cubic=True)]
        kind = messages.follow_t
        self.assertEqual([part.part for part in made], [kind.ROWS, kind.LAST_ROWS, kind.RUN])
        self.assertEqual([t for part in made for t in part.time_s], times)
        self.assertEqual([p for part in made for p in part.positions], [-t for t in times])
        self.assertTrue(all((part.array, part.cubic, part.motors) == (4, True, ["a"]) for part in made))
        with self.assertRaisesRegex(ValueError, "1 times for 2 rows"):
            requests.follow(["a"], [0], [[0], [1]], array=1)

    def test_both_faces_have_the_same_functions(self):
        pairs = ((client.Client, aio.Client), (client.Tables, aio.Tables), (client.Jog, motion.Jog),
                 (client.Motion, motion.Motion))
        for blocking, other in pairs:
            for name, function in vars(blocking).items():
                if name.startswith("_") or not callable(function):
                    continue
                parameters = dict(inspect.signature(function).parameters)
                self.assertEqual(parameters, dict(inspect.signature(getattr(other, name)).parameters), name)
                self.assertTrue(function.__doc__, name)

    def test_names_are_a_list(self):
        with self.assertRaises(TypeError):
            requests.stop("theta")


if __name__ == "__main__":
    unittest.main()
