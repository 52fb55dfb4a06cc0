#!/usr/bin/env python3
"""PV Access: p4p's client and ophyd-async's Motor against the real programs."""

import asyncio
import getpass
import signal
import unittest

from lab import LabTest, pyepics

FOREVER_S = 60


class Heard:
    """Variables as they are heard: (field, value, severity), in order. One worker: p4p's others overtake each other."""

    def __init__(self, context, names):
        self._heard = []
        self._subscriptions = [context.monitor(f"LAB:{name}", lambda value, name=name: self._hear(name, value)) for name in names]

    def _hear(self, name, value):
        self._heard.append((name.rpartition(".")[2], value, value.severity))

    def take(self):
        heard = list(self._heard)
        del self._heard[: len(heard)]
        return heard

    def of(self, field):
        return [value for name, value, _ in list(self._heard) if name == field]


class Pva(LabTest):
    def setUp(self):
        from p4p.client.thread import Context, RemoteError
        from p4p.util import ThreadedWorkQueue

        self.refused = RemoteError
        queue = ThreadedWorkQueue(maxsize=1000, workers=1).start()
        self.addCleanup(queue.stop)
        self.context = Context("pva", queue=queue)
        self.context._T = []  # p4p 4.3 cannot close one with a queue of its user otherwise
        self.addCleanup(self.context.close)

    def read(self, name):
        return self.context.get(f"LAB:{name}", timeout=10)

    def write(self, name, value, wait=True):
        self.context.put(f"LAB:{name}", value, timeout=FOREVER_S, wait=wait)

    def why_not(self, name, value, wait=True):
        with self.assertRaises(self.refused) as caught:
            self.write(name, value, wait)
        return str(caught.exception)

    def hear(self, *names):
        heard = Heard(self.context, names)
        self.wait_until("first values", lambda: len({name for name, *_ in list(heard._heard)}) == len(names))
        heard.take()
        return heard

    def test_values_have_what_belongs_to_them(self):
        self.bring_up_lab()
        self.write("theta.VAL", 2.5)
        for name in ("theta.RBV", "theta.VAL", "theta"):
            read = self.read(name)
            raw = read.raw
            self.assertEqual((read, read.severity, raw["alarm.message"]), (2.5, 0, ""))
            self.assertEqual((raw["display.units"], raw["display.limitLow"], raw["display.limitHigh"]), ("deg", -500.0, 500.0))
            self.assertEqual((raw["control.limitLow"], raw["control.limitHigh"]), (-500.0, 500.0))
            self.assertEqual(raw["display.precision"], self.read("theta.PREC"))
            self.assertEqual(raw.getID(), "epics:nt/NTScalar:1.0")
        of_channel_access = pyepics().PV("LAB:theta.RBV", form="time")
        of_channel_access.get(timeout=10)
        self.assertAlmostEqual(self.read("theta.RBV").timestamp, of_channel_access.timestamp, places=5)
        self.assertEqual((self.read("theta.EGU"), self.read("theta.DMOV"), self.read("theta.STAT")), ("deg", 1, "NO_ALARM"))
        self.assertEqual((self.read("theta.HLM"), self.read("theta.LLM"), self.read("theta.DHLM"), self.read("theta.DLLM")), (500.0, -500.0, 500.0, -500.0))
        self.assertEqual(self.read("theta.MSTA"), self.get("theta.MSTA"))

    def test_words_are_enums(self):
        self.bring_up_lab()
        self.assertEqual(self.read("theta.SPMG").raw["value"].todict(), {"index": 3, "choices": ["Stop", "Pause", "Move", "Go"]})
        self.write("theta.SPMG", "Pause")
        self.wait_for("theta.SPMG", lambda word: word == 1)
        self.write("theta.SPMG", 3)
        self.wait_for("theta.SPMG", lambda word: word == 3)
        self.assertEqual(self.read("theta_able").raw["value.choices"], ["Enable", "Disable"])
        self.why_not("theta.SPMG", {"value.index": 9})

    def test_a_move_is_over_when_its_put_is(self):
        self.bring_up_lab()
        heard = self.hear("theta.DMOV", "theta.RBV")
        for to in (2.0, 2.0, -1.0):
            self.write("theta.VAL", to)
            self.wait_until("what was told", lambda: heard.of("DMOV")[-1:] == [1])
            told = heard.take()
            self.assertEqual([value for field, value, _ in told if field == "DMOV"], [0, 1])
            positions = [value for field, value, _ in told[:-1] if field == "RBV"]
            self.assertEqual((positions or [to])[-1], to)
            self.assertEqual(told[-1][:2], ("DMOV", 1))
        self.end_all()
        self.assertEqual(self.steps_made("theta"), -100)

    def test_a_put_that_does_not_wait_is_answered_at_once(self):
        self.bring_up_lab()
        self.write("theta.VELO", 1.0)
        self.write("theta.VAL", 300.0, wait=False)
        self.assertEqual(self.read("theta.DMOV"), 0)
        self.why_not("phi.RBV", 1.0, wait=False)
        self.write("theta.STOP", 1)
        self.wait_for("theta.DMOV", lambda dmov: dmov == 1)
        self.assertEqual(self.read("theta.RBV").severity, 2)

    def test_a_refusal_has_the_reason_of_the_daemon(self):
        self.bring_up_lab()
        self.command("hold", "theta")
        self.assertIn("held", self.why_not("theta.VAL", 3.0))
        position = self.read("theta.RBV")
        self.assertEqual(position.severity, 2)
        self.assertIn("held", position.raw["alarm.message"])
        self.write("theta_able", 0)
        self.assertIn("soft limit", self.why_not("theta.VAL", 501.0))
        self.assertEqual(self.read("theta.LVIO"), 1)
        self.why_not("theta.MRES", 1.0)
        self.why_not("theta.RBV", 1.0)
        self.write("theta.VAL", 1.0)
        self.assertEqual(self.read("theta.RBV").severity, 0)
        self.end_all()
        self.assertEqual(self.steps_made("theta"), 100)

    def test_what_ends_with_its_client_is_left_to_channel_access(self):
        self.bring_up_lab()
        for name in ("theta.JOGF", "theta.JOGR", "deferMoves"):
            self.assertIn("Channel Access", self.why_not(name, 1))
        self.put("deferMoves", 1)
        self.assertIn("Channel Access", self.why_not("theta.VAL", 1.0))
        self.put("deferMoves", 0)
        self.write("theta.VAL", 1.0)
        self.write("allstop", 1)
        self.end_all()
        self.assertEqual(self.steps_made("theta"), 100)

    def test_rights_and_history_are_as_by_channel_access(self):
        self.bring_up_lab()
        self.write("theta.VAL", 1.0)
        self.assertIn(f"epics:{getpass.getuser()}:127.0.0.1", self.command("history", "theta").stdout)
        self.bridge.end()
        self.bridge = self.start_bridge("--read-only")
        self.assertIn("may not put", self.why_not("theta.VAL", 2.0))
        self.bridge.end()
        self.file("names.toml").write_text('[names]\nphi = ""\n[allow]\nhosts = ["10.0.0.0/8"]\n')
        self.bridge = self.start_bridge("--names", self.file("names.toml"))
        self.assertIn("127.0.0.1 may not put", self.why_not("theta.STOP", 1))
        with self.assertRaises(TimeoutError):
            self.context.get("LAB:phi.RBV", timeout=1)
        self.assertEqual(self.read("theta.RBV"), 1.0)

    def test_a_daemon_that_is_gone_makes_positions_invalid_until_it_is_back(self):
        self.bring_up_lab()
        heard = self.hear("theta.DMOV", "theta.RBV")
        self.bushd.send(signal.SIGKILL)
        self.bushd.process.wait()
        self.wait_until("the alarm", lambda: self.read("theta.RBV").severity == 3)
        self.why_not("theta.VAL", 1.0)
        self.wait_until("the edge of the refusal", lambda: 0 in heard.of("DMOV") and heard.of("DMOV")[-1] == 1)
        heard.take()
        self.bushd = self.start_bushd()
        self.wait_until("its end", lambda: self.read("theta.RBV").severity < 3)
        self.assertEqual([value for field, value, _ in heard.take() if field == "DMOV" and value == 0], [])

    def test_ophyd_async_hears_why_a_move_fails(self):
        self.bring_up_lab()

        async def work():
            from ophyd_async.core import init_devices
            from ophyd_async.epics.motor import Motor

            async with init_devices(timeout=20):
                theta = Motor("pva://LAB:theta", name="theta")
            await theta.set(2.0)
            reading = (await theta.read())["theta"]
            self.assertEqual((reading["value"], reading["alarm_severity"]), (2.0, 0))
            self.command("hold", "theta")
            with self.assertRaisesRegex(Exception, "held"):
                await theta.set(3.0)

        asyncio.run(asyncio.wait_for(work(), 100))
        self.end_all()
        self.assertEqual(self.steps_made("theta"), 200)

    def test_it_can_be_left_out(self):
        self.bring_up_lab(bridge=["--no-pva"])
        with self.assertRaises(TimeoutError):
            self.context.get("LAB:theta.RBV", timeout=1)
        self.assertEqual(self.get("theta.RBV"), 0.0)


if __name__ == "__main__":
    unittest.main()
