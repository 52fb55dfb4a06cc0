"""The rules of the Python client's session, without I/O and without a clock: lost, repeated and hostile messages."""

import random
import unittest
from unittest import mock

from bushd import Outcome, messages
from bushd.errors import NoDaemon, Refused, ResultUnknown, TwoDaemons
from bushd import codec, model, requests
from bushd.session import Session, Timing
from bushd.status import StatusCollector

ACCEPTED, REFUSED, RESULT = (messages.reply_header_t.ACCEPTED, messages.reply_header_t.REFUSED,
                             messages.reply_header_t.RESULT)
TIMING = Timing()


def move(amounts, in_steps=False):
    return requests.ask("MOVE", **requests.way(amounts, True, in_steps))


def reply(request, phase, outcome="", reason="", part=0, parts=1, session=None):
    return messages.reply_header_t(
        session=request.session if session is None else session, client_id=request.client_id, number=request.number,
        phase=phase, outcome=outcome, reason=reason, part=part, parts=parts,
    )


def answer(*arguments, motors=(), **named):
    results = [
        messages.motor_result_t(
            motor=name, outcome="reached", position_steps=int(name[1:]), user_position=float(name[1:]), unit="mm", precision=3,
            asked_by="me", legs=1, most_steps_per_s=100.0,
        )
        for name in motors
    ]
    return messages.answer_t(reply=reply(*arguments, **named), motors=results).encode()


def state(run=1, sequence=1, part=0, parts=1):
    return messages.mcu_state_t(run=run, sequence=sequence, part=part, parts=parts, state="READY").encode()


class Daemon:
    """The other end: answers when it is told to."""

    def __init__(self, loses, timing=TIMING):
        self.now = 100.0
        numbers = iter(range(7, 1000))
        self.session = Session("me", loses=loses, remedy="start it", timing=timing,
                               random_number=lambda: next(numbers), utime_us=lambda: 5)
        self.sent = []  # (channel, message)

    def poll(self):
        kinds = {"MOVE": messages.move_t, "STOP": messages.stop_t, "HELLO": messages.hello_t,
                 "GET_STATUS": messages.get_status_t}
        packets = self.session.poll(self.now)
        self.sent += [(channel, kinds[channel].decode(payload)) for channel, payload in packets]
        return [channel for channel, _ in packets]

    def wait(self, seconds):
        """Time goes by; what is sent meanwhile."""
        until = self.now + seconds
        channels = []
        for _ in range(10_000):
            wake_at = self.session.wake_at()
            if wake_at is None or wake_at > until:
                break
            self.now = max(self.now, wake_at)
            channels += self.poll()
        else:
            raise AssertionError("it does not sleep")
        self.now = until
        return channels + self.poll()

    def tell(self, channel, payload):
        self.session.receive(channel, payload, self.now)

    def welcome(self, session=11, run=1, nonce=None):
        hello = [message for channel, message in self.sent if channel == "HELLO"][-1]
        nonce = hello.nonce if nonce is None else nonce
        self.tell("WELCOME", messages.welcome_t(client_id=hello.client_id, nonce=nonce, session=session, run=run).encode())

    def request(self):
        return self.sent[-1][1].request

    def begin(self, request=None):
        request = request or move({"m1": 1.0})
        exchange = self.session.begin(request, self.now)
        self.poll()
        return exchange

    def begin_with_session(self):
        exchange = self.begin()
        self.welcome()
        self.wait(0.1)
        return exchange


class OverASocket(unittest.TestCase):
    def setUp(self):
        self.daemon = Daemon(loses=False)

    def test_a_request_is_sent_once_and_needs_no_session(self):
        exchange = self.daemon.begin()
        self.assertEqual((self.daemon.request().session, self.daemon.request().number), (0, 1))
        self.daemon.tell("REPLY", answer(self.daemon.request(), ACCEPTED))
        self.assertEqual(self.daemon.wait(3600), [])
        self.daemon.tell("REPLY", answer(self.daemon.request(), RESULT, "reached", "there", motors=["m1"]))
        self.assertEqual((exchange.outcome, exchange.reason), (Outcome.REACHED, "there"))
        self.assertEqual(exchange.detail.motors[0].position, 1.0)
        self.assertIsNone(self.daemon.session.wake_at())

    def test_a_status_is_asked_for_once(self):
        query = self.daemon.session.begin_status(self.daemon.now, 5.0)
        self.assertEqual(self.daemon.wait(4.9), ["GET_STATUS"])
        self.assertFalse(query.over)
        self.assertEqual(self.daemon.wait(0.2), [])
        self.assertIsInstance(query.error, NoDaemon)

    def test_a_daemon_that_does_not_answer_is_given_up(self):
        exchange = self.daemon.begin()
        self.daemon.wait(2.9)
        self.assertFalse(exchange.over)
        self.daemon.wait(0.2)
        self.assertIsInstance(exchange.error, NoDaemon)
        self.assertEqual(str(exchange.error), "start it; it may still carry this out")

    def test_a_refusal_has_its_reason(self):
        exchange = self.daemon.begin()
        self.daemon.tell("REPLY", answer(self.daemon.request(), REFUSED, reason="m1: it is held"))
        self.assertIsInstance(exchange.error, Refused)
        self.assertEqual(exchange.error.reason, "m1: it is held")

    def test_the_end_of_the_link_ends_all_exchanges(self):
        accepted, other = self.daemon.begin(), None
        self.daemon.tell("REPLY", answer(self.daemon.request(), ACCEPTED))
        other = self.daemon.begin()
        self.daemon.session.link_ended("closed")
        self.assertIsInstance(accepted.error, ResultUnknown)
        self.assertEqual(str(other.error), "closed; it may have carried the command out")
        self.assertIsInstance(self.daemon.begin().error, NoDaemon)

    def test_what_cannot_be_read_ends_the_link(self):
        for channel in ("PROGRAM_REPLY", "STATE", "REPLY"):
            with self.subTest(channel):
                daemon = Daemon(loses=False)
                exchange = daemon.begin()
                daemon.tell("REPLY", answer(daemon.request(), ACCEPTED))
                daemon.tell("SOMETHING", b"of a later version")
                self.assertFalse(exchange.over)
                daemon.tell(channel, b"of another version")
                self.assertIsInstance(exchange.error, ResultUnknown)
                self.assertIn(f"the daemon's {channel} cannot be read", str(exchange.error))
                self.assertIsInstance(daemon.begin().error, NoDaemon)

    def test_several_requests_are_told_apart(self):
        exchanges = [self.daemon.begin() for _ in range(5)]
        asked = [message.request for _, message in self.daemon.sent]
        self.assertEqual([request.number for request in asked], [1, 2, 3, 4, 5])
        for request in reversed(asked):
            self.daemon.tell("REPLY", answer(request, RESULT, "done", str(request.number)))
        self.assertEqual([exchange.reason for exchange in exchanges], ["1", "2", "3", "4", "5"])

    def test_what_does_not_fit_a_message_is_an_error_of_the_caller(self):
        with self.assertRaises(ValueError):
            self.daemon.begin(move({"m1": 2**63}, in_steps=True))
        with self.assertRaises(ValueError):
            self.daemon.begin(move({"m": 1.0, "n" * 70_000: 1.0}))
        for wrong in ({"m\0": 1.0}, {"m": float("nan")}, {}):
            with self.assertRaises(ValueError):
                move(wrong)
        for wrong in (1.5, float("inf")):
            with self.assertRaises(ValueError):
                move({"m": wrong}, in_steps=True)
        self.assertEqual(move({"m": 4.0}, in_steps=True).message.motors[0].steps, 4)
        self.assertEqual(self.daemon.sent, [])


class OverLcm(unittest.TestCase):
    def setUp(self):
        self.daemon = Daemon(loses=True)

    def test_a_session_is_asked_for_until_there_is_one(self):
        exchange = self.daemon.begin()
        self.assertEqual(self.daemon.wait(0.7), ["HELLO", "HELLO"])
        self.daemon.welcome()
        # A second daemon would answer now.
        self.assertEqual(self.daemon.wait(0.09), [])
        self.assertEqual(self.daemon.wait(0.02), ["MOVE"])
        self.assertEqual((self.daemon.request().session, self.daemon.request().number), (11, 1))
        self.assertFalse(exchange.over)
        # The next request has it already.
        self.daemon.begin()
        self.assertEqual((self.daemon.request().session, self.daemon.request().number), (11, 2))

    def test_a_welcome_to_others_is_none(self):
        self.daemon.begin()
        self.daemon.welcome(nonce=123456)
        self.assertEqual(set(self.daemon.wait(1)), {"HELLO"})

    def test_without_a_daemon_nothing_was_sent(self):
        exchange = self.daemon.begin()
        self.assertEqual(set(self.daemon.wait(4)), {"HELLO"})
        self.assertEqual(str(exchange.error), "start it")
        self.assertIsNone(self.daemon.session.wake_at())

    def test_a_request_is_repeated_with_its_number_until_it_is_answered(self):
        exchange = self.daemon.begin_with_session()
        first = self.daemon.sent[-1][1].encode()
        self.assertEqual(self.daemon.wait(1.0), ["MOVE"] * 3)
        self.assertEqual({message.encode() for channel, message in self.daemon.sent if channel == "MOVE"}, {first})
        self.daemon.tell("REPLY", answer(self.daemon.request(), ACCEPTED))
        # The result may have been lost: it is asked for once a second, as long as the state comes.
        sent = []
        for _ in range(8):
            self.daemon.tell("STATE", state())
            sent += self.daemon.wait(1.0)
        self.assertEqual(sent, ["MOVE"] * 8)
        self.assertFalse(exchange.over)
        self.daemon.tell("REPLY", answer(self.daemon.request(), RESULT, "reached", "there"))
        self.assertEqual(exchange.outcome, Outcome.REACHED)
        self.assertEqual(self.daemon.wait(10), [])

    def test_a_daemon_that_does_not_answer_may_still_carry_it_out(self):
        exchange = self.daemon.begin_with_session()
        self.daemon.tell("STATE", state())
        self.daemon.wait(4)
        self.assertEqual(str(exchange.error),
                         "bushd sends its state but has not answered for 3 s; it may still carry this out")
        # The next one begins anew.
        self.daemon.begin()
        self.assertEqual(self.daemon.sent[-1][0], "HELLO")

    def test_repeated_answers_change_nothing(self):
        exchange = self.daemon.begin_with_session()
        request = self.daemon.request()
        for _ in range(3):
            self.daemon.tell("REPLY", answer(request, RESULT, "reached", "there"))
            self.daemon.tell("REPLY", answer(request, RESULT, "fault", "another"))
            self.daemon.tell("REPLY", answer(request, ACCEPTED))
        self.assertEqual((exchange.outcome, exchange.reason), (Outcome.REACHED, "there"))

    def test_answers_of_another_session_are_none(self):
        exchange = self.daemon.begin_with_session()
        self.daemon.tell("REPLY", answer(self.daemon.request(), RESULT, "reached", session=12))
        self.assertFalse(exchange.over)

    def test_a_result_in_parts_is_put_together(self):
        exchange = self.daemon.begin_with_session()
        request = self.daemon.request()
        for part in (2, 0, 2):
            self.daemon.tell("REPLY", answer(request, RESULT, "reached", part=part, parts=3, motors=[f"m{part}"]))
        self.assertFalse(exchange.over)
        self.daemon.tell("REPLY", answer(request, RESULT, "reached", part=1, parts=3, motors=["m1"]))
        self.assertEqual([motor.motor for motor in exchange.detail.motors], ["m0", "m1", "m2"])

    def test_a_session_that_was_forgotten(self):
        exchange = self.daemon.begin_with_session()
        self.daemon.tell("REPLY", answer(self.daemon.request(), REFUSED, reason="the session is unknown: look"))
        self.assertIsInstance(exchange.error, Refused)
        self.daemon.begin()
        hello = self.daemon.sent[-1]
        self.assertEqual((hello[0], hello[1].nonce), ("HELLO", 8))

    def test_who_has_accepted_does_not_refuse(self):
        exchange = self.daemon.begin_with_session()
        self.daemon.tell("REPLY", answer(self.daemon.request(), ACCEPTED))
        self.daemon.tell("REPLY", answer(self.daemon.request(), REFUSED, reason="answer not kept"))
        self.assertIsInstance(exchange.error, ResultUnknown)

    def test_a_restart_loses_the_result(self):
        exchange = self.daemon.begin_with_session()
        self.daemon.tell("REPLY", answer(self.daemon.request(), ACCEPTED))
        self.daemon.tell("STATE", state(run=1))
        self.daemon.tell("STATE", state(run=2))
        self.assertIsInstance(exchange.error, ResultUnknown)
        self.assertIn("restarted", str(exchange.error))

    def test_who_watches_hears_the_newest_state_of_the_newest_daemon(self):
        watching = [StatusCollector(), StatusCollector()]
        self.daemon.session.watch(watching[0])
        self.daemon.tell("DESCRIPTION", messages.mcu_description_t(parts=1, run=1).encode())
        self.daemon.tell("STATE", state(sequence=1))
        self.daemon.session.watch(watching[1])  # that has to read what the other one puts off
        self.daemon.tell("DESCRIPTION", messages.mcu_description_t(parts=1, run=1).encode())
        for sequence in (2, 4, 3):
            self.daemon.tell("STATE", state(sequence=sequence))
            self.daemon.tell("STATE", state(sequence=9)[:-1])
            self.daemon.tell("STATE", b"no state")
        self.assertEqual([collector.status().sequence for collector in watching], [4, 4])
        query = self.daemon.session.begin_status(self.daemon.now, 1.0)
        self.daemon.tell("STATE", state(sequence=5))
        self.assertEqual([collector.status().sequence for collector in watching], [5, 5])
        self.daemon.session.abandon_status(query)
        exchange = self.daemon.begin_with_session()
        self.daemon.tell("STATE", state(sequence=6))
        self.daemon.tell("REPLY", answer(self.daemon.request(), ACCEPTED))
        self.daemon.tell("STATE", state(run=2))
        self.assertIsInstance(exchange.error, ResultUnknown)

    def test_who_has_put_a_state_off_is_not_given_it_again_for_one_that_has_not(self):
        watching = [StatusCollector(), StatusCollector()]
        for sequence, collector in enumerate(watching, start=1):
            self.daemon.session.watch(collector)
            self.daemon.tell("DESCRIPTION", messages.mcu_description_t(parts=1, run=1).encode())
            with mock.patch.object(codec, "decode", wraps=codec.decode) as read:
                self.daemon.tell("STATE", state(sequence=sequence))
            self.assertEqual(read.call_count, 1)  # for the one that has begun to watch
        self.assertEqual([collector.states_heard for collector in watching], [2, 1])
        with mock.patch.object(codec, "decode", wraps=codec.decode) as read:
            self.assertEqual([collector.status().sequence for collector in watching], [2, 2])
        self.assertEqual(read.call_count, 1)  # what was put off

    def test_a_daemon_that_falls_silent(self):
        exchange = self.daemon.begin_with_session()
        self.daemon.tell("REPLY", answer(self.daemon.request(), ACCEPTED))
        self.daemon.wait(4.0)
        self.daemon.tell("STATE", state())
        self.daemon.wait(4.9)
        self.assertFalse(exchange.over)
        self.daemon.wait(0.2)
        self.assertIsInstance(exchange.error, ResultUnknown)

    def test_two_daemons_get_stops_only(self):
        exchange = self.daemon.begin()
        self.daemon.welcome(session=11, run=1)
        self.daemon.welcome(session=12, run=2)
        self.assertEqual(self.daemon.wait(1), [])
        self.assertIsInstance(exchange.error, TwoDaemons)
        self.daemon.begin(requests.stop([]))
        self.assertEqual((self.daemon.sent[-1][0], self.daemon.request().session), ("STOP", 0))

    def test_two_daemons_are_known_by_their_states(self):
        for run in (1, 2, 1):
            self.daemon.tell("STATE", state(run=run))
        exchange = self.daemon.begin_with_session()
        self.daemon.wait(0.1)
        self.assertIsInstance(exchange.error, TwoDaemons)
        self.assertNotIn("MOVE", [channel for channel, _ in self.daemon.sent])

    def test_a_stop_waits_for_no_session(self):
        move = self.daemon.begin()
        stop = self.daemon.begin(requests.stop(["m1"]))
        self.assertEqual(self.daemon.sent[-1][0], "STOP")
        self.daemon.welcome()
        self.daemon.wait(0.1)
        self.assertEqual(self.daemon.sent[-1][0], "MOVE")
        stopping = [message for channel, message in self.daemon.sent if channel == "STOP"][0].request
        self.daemon.tell("REPLY", answer(stopping, RESULT, "done"))
        self.assertTrue(stop.over)
        self.assertFalse(move.over)

    def test_what_nobody_waits_for_is_not_sent_again(self):
        exchange = self.daemon.begin_with_session()
        self.daemon.session.abandon(exchange)
        self.assertEqual(self.daemon.wait(10), [])
        self.assertIsInstance(exchange.error, ResultUnknown)  # whoever waits for it nevertheless does not wait for ever


class ExactlyOnce(unittest.TestCase):
    """Against a daemon that keeps to the rules, over a line that loses, repeats and reorders."""

    def carry_out(self, seed):
        chance = random.Random(seed)
        daemon = Daemon(loses=True, timing=Timing(answer_within_s=60.0, silence_limit_s=1000.0))
        carried_out, answers, on_the_way = [], {}, []
        exchanges = [daemon.session.begin(move({f"m{i}": 1.0}), daemon.now)
                     for i in range(5)]
        kinds = {"MOVE": messages.move_t, "HELLO": messages.hello_t}
        for _ in range(3000):
            if all(exchange.over for exchange in exchanges):
                break
            for channel, payload in daemon.session.poll(daemon.now):
                message = kinds[channel].decode(payload)
                daemon.sent.append((channel, message))
                for _ in range(chance.choice([0, 0, 1, 1, 2])):
                    on_the_way.append(("to", channel, message))
            chance.shuffle(on_the_way)
            for _ in range(len(on_the_way) // 2):
                way, channel, message = on_the_way.pop()
                if way == "from":
                    daemon.tell(channel, message)
                elif channel == "HELLO":
                    daemon.welcome()
                else:
                    number = message.request.number
                    if number not in answers:
                        carried_out.append(message.motors[0].motor)
                    answers[number] = chance.choice([ACCEPTED, RESULT]) if answers.get(number) != RESULT else RESULT
                    outcome = "reached" if answers[number] == RESULT else ""
                    if chance.random() < 0.5:
                        on_the_way.append(("from", "REPLY", answer(message.request, answers[number], outcome)))
            wake_at = daemon.session.wake_at()
            daemon.now = max(daemon.now + 0.01, min(wake_at or 0, daemon.now + 0.1))
        self.assertEqual([exchange.outcome for exchange in exchanges], [Outcome.REACHED] * 5, f"seed {seed}")
        self.assertEqual(sorted(carried_out), [f"m{i}" for i in range(5)], f"seed {seed}")

    def test_over_a_bad_line(self):
        for seed in range(100):
            self.carry_out(seed)


class HostileBytes(unittest.TestCase):
    def valid(self):
        request = messages.request_t(client_id="me", number=1)
        done = reply(request, RESULT, "done")
        welcome = messages.welcome_t(client_id="me", nonce=7, session=1)
        table = messages.table_answer_t(reply=done, tables=[messages.table_t(accel=[5, 4, 3])])
        history = messages.history_answer_t(reply=done, motions=[messages.past_motion_t()])
        camac = messages.camac_reply_t(reply=done, responses=[messages.camac_response_t(x=True, data=7)])
        program = messages.program_t(stage="runs", motors=[messages.program_motor_t(motor="m1")])
        programs = messages.program_reply_t(reply=done, programs=[program])
        health = messages.health_t(mcus=[messages.mcu_health_t()], parts=1)
        described = messages.mcu_description_t(motors=[messages.motor_description_t()], parts=1)
        return {"REPLY": answer(request, RESULT, "reached", "there", motors=["m1", "m2"]), "STATE": state(),
                "WELCOME": welcome.encode(), "TABLE_REPLY": table.encode(), "HISTORY_REPLY": history.encode(),
                "CAMAC_REPLY": camac.encode(), "PROGRAM_REPLY": programs.encode(),
                "HEALTH": health.encode(), "DESCRIPTION": described.encode()}

    def test_valid_ones_are_taken(self):
        for channel, payload in self.valid().items():
            self.assertIsNotNone(codec.decode(channel, payload), channel)

    def test_what_is_cut_off_or_too_long_is_dropped(self):
        for channel, payload in self.valid().items():
            for end in range(len(payload)):
                self.assertIsNone(codec.decode(channel, payload[:end]), (channel, end))
            self.assertIsNone(codec.decode(channel, payload + b"\0"), channel)

    def test_any_bytes_raise_nothing(self):
        chance = random.Random(1985)
        session = Session("me", loses=True, remedy="", random_number=lambda: 7)
        query = session.begin_status(0.0, 1.0)
        session.begin(move({"m1": 1.0}), 0.0)
        extremes = [b"\xff\xff\xff\xff", b"\x80\0\0\0", b"\x7f\xff\xff\xff", b"\0\0\0\0"]
        for channel, payload in self.valid().items():
            for _ in range(1500):
                hostile = bytearray(payload)
                for _ in range(chance.randint(1, 3)):
                    place = chance.randrange(8, len(hostile))
                    hostile[place : place + 4] = chance.choice([*extremes, chance.randbytes(4)])
                session.receive(channel, bytes(hostile), 1.0)
                session.poll(1.0)
            session.receive(channel, chance.randbytes(100), 1.0)
        for channel in ("", "NOTHING", "MOVE"):
            session.receive(channel, b"", 1.0)
        if query.collector.has_motors():
            query.collector.status()

    def test_programs_are_as_the_daemon_tells_them(self):
        request = messages.request_t()
        way = messages.program_motor_t(motor="x", least_steps=-3, most_steps=4, end_steps=1, edges=9)
        numbers = {"bytes": 212, "memory": 8192, "frame": 3, "point": 4, "repeats": 5, "pulses": 6}
        flags = {"without_host": True, "at_power_on": False, "kept": True, "stored": False, "endless": False,
                 "waits_for_inputs": True, "cut": False}
        words = {"mcu": "hall:1", "program": "scan", "checksum": "0a1b2c3d", "reason": "why"}
        told = messages.program_t(stage="paused", duration_us=1_500_000, motors=[way], **numbers, **flags, **words)
        heard = codec.decode("PROGRAM_REPLY", messages.program_reply_t(reply=reply(request, RESULT, "done"), programs=[told]).encode())
        (program,) = heard.detail.programs
        self.assertEqual(program, model.Program(
            stage=model.ProgramStage.PAUSED, duration_s=1.5, motors=(model.ProgramMotor("x", -3, 4, 1, 9),), **numbers, **flags, **words))
        self.assertEqual(program["x"].edges, 9)
        with self.assertRaises(KeyError):
            program["y"]
        self.assertEqual(len((heard.detail + heard.detail).programs), 2)
        unknown = messages.program_reply_t(reply=reply(request, RESULT, "done"), programs=[messages.program_t(stage="dances")])
        self.assertIsNone(codec.decode("PROGRAM_REPLY", unknown.encode()))

    def test_words_that_no_daemon_says_are_dropped(self):
        request = messages.request_t()
        for payload in (answer(request, RESULT, "splendid"), answer(request, 9),
                        answer(request, RESULT, "done", part=1, parts=1),
                        answer(request, RESULT, "done", parts=1_000_000)):
            self.assertIsNone(codec.decode("REPLY", payload))


if __name__ == "__main__":
    unittest.main()
