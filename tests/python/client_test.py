"""The Python client against the real daemon on a simulated bus: over the control socket and over LCM, blocking and with
asyncio."""

import asyncio
import contextlib
import dataclasses
import pathlib
import random
import re
import signal
import sys
import threading
import unittest
import unittest.mock

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1] / "e2e"))

import bushd
import bushd.aio
from bushd import Activity, Outcome, Trust
from bushd.links import LcmLink
from rig import FAR, TOP, EndToEndTest

SOCKET, LCM = {}, {"lcm": True}
UNITS = 'unit = "mm"\nsteps_per_unit = 100\nsoft_limits = [-50, 50]'


class PythonTest(EndToEndTest):
    def bring_up_with_unit(self, state=""):
        """a0 has a unit: 100 steps are a millimetre."""
        self.write_config(state=state)
        config = self.file("bushd.toml")
        config.write_text(config.read_text().replace('name = "a0"', f'name = "a0"\n{UNITS}'))
        self.bushsim = self.start_bushsim()
        self.bushd = self.start_bushd()
        self.wait_until_ready()

    def connect(self, **how):
        client = bushd.connect(**how)
        self.addCleanup(client.close)
        return client

    def rests(self, name):
        self.wait_until(f"{name} to rest", lambda: self.motors()[name]["activity"] == "rest")

    def moves_on(self, name):
        self.wait_until(f"{name} to move", lambda: self.motors()[name]["moving"])

    def start_script(self, *lines):
        script = self.file("script.py")
        script.write_text("\n".join(["import asyncio, sys, time, bushd, bushd.aio", *lines]))
        return self.start([sys.executable, "-B", script], f"script-{len(self.programs)}.log")


class Blocking(PythonTest):
    def test_moves(self):
        self.bring_up_with_unit()
        for how in (SOCKET, LCM):
            with bushd.connect(**how) as client:
                client.set_position("a0", 0, unit="steps")
                result = client.move("a0", to=1.25)
                self.assertEqual((result.outcome, result["a0"].outcome), (Outcome.REACHED, Outcome.REACHED))
                motor = client.where("a0")
                self.assertEqual((motor.position, motor.position_steps, motor.unit), (1.25, 125, "mm"))
                self.assertEqual((motor.trust, motor.activity), (Trust.KNOWN, Activity.REST))
                self.assertEqual(motor.soft_limits, (-50, 50))
                self.assertEqual(str(result["a0"]), "a0: reached, stands at 1.2500 mm")
                client.move("a0", by=-25, unit="steps", speed=500)
                self.assertEqual(client.where()["a0"].position, 1.0)
                before = client.where("b1").position_steps
                client.move(by={"a0": -1, "b1": 20})
                self.assertEqual(client.move({"a0": 0.5, "b1": before}, unit=None)["b1"].position_steps, before)
                client.move("a0", to=0.5, unit="mm")
                with self.assertRaisesRegex(ValueError, 'its unit is "mm", not "deg"'):
                    client.move("a0", to=0, unit="deg")
                plan = client.plan("a0", to=10)
                self.assertEqual((plan.legs[0].steps, client.where("a0").position), (950, 0.5))
                self.assertGreater(plan.duration_s, 0.3)
        self.assert_one_result_each()

    def test_refusals_and_failures(self):
        self.bring_up_with_unit()
        for how in (SOCKET, LCM):
            client = self.connect(**how)
            with self.assertRaisesRegex(bushd.Refused, "soft limit"):
                client.move("a0", to=51)
            with self.assertRaisesRegex(bushd.Refused, 'no motor "nobody"'):
                client.move("nobody", by=1)
            with self.assertRaisesRegex(bushd.UnknownMotor, "nobody"):
                client.where("nobody")
            motion = client.move("a1", by=FAR, wait=False)
            self.assertFalse(motion.done)
            self.moves_on("a1")
            client.stop("a1")
            with self.assertRaises(bushd.MoveFailed) as failed:
                motion.wait()
            self.assertEqual(failed.exception.result["a1"].outcome, Outcome.STOPPED)
            self.assertEqual(motion.wait(check=False).outcome, Outcome.STOPPED)
            self.assertEqual(client.move("a1", by=FAR, wait=False).stop().outcome, Outcome.STOPPED)
        with self.assertRaises(bushd.NoDaemon):
            bushd.connect(self.file("nothing"))

    def test_ctrl_c_ramps_down(self):
        self.bring_up()
        self.survey()
        for how in ("", "lcm=True"):
            script = self.start_script(
                f"with bushd.connect({how}) as client:",
                "    try:",
                f"        client.move('a0', by={FAR})",
                "    except KeyboardInterrupt:",
                "        print('stands at', client.where('a0').position_steps, client.where('a0').moving)",
                "        raise")
            self.wait_until("a0 to move", lambda: self.motors()["a0"]["moving"])
            script.end(signal.SIGINT)
            self.assertRegex(script.said(), r"stands at \d+ False\n(.|\n)*KeyboardInterrupt")
            self.assertFalse(self.motors()["a0"]["moving"])
        results = [event["result"] for event in self.moves() if event["event"] == "result"]
        self.assertEqual(results, ["stopped", "stopped"])

    def test_lines(self):
        self.bring_up_with_unit()
        for how in (SOCKET, LCM):
            with self.connect(**how) as client:
                client.set_position("a0", 0, unit="steps")
                before = client.where("b1").position_steps
                plan = client.plan_line(by={"a0": 5, "b1": -200}, duration_s=2)
                self.assertGreaterEqual(plan.duration_s, 2)
                self.assertIn(plan.limited_by, ("a0", "b1"))
                motion = client.move_line(by={"a0": 5, "b1": -200}, duration_s=2, wait=False)
                self.wait_until("a line", lambda: client.where("b1").line is not None)
                self.assertLessEqual(client.where("b1").line.fraction, 1)
                result = motion.wait()
                self.assertIn("the line was limited by", result.reason)
                self.assertEqual(result["b1"].position_steps, before - 200)
                self.assertIsNone(client.where("b1").line)
                client.move_line({"a0": 0, "b1": before})
                steps = client.where("a1").position_steps
                armed = client.arm_line(by={"a1": 100, "b1": -100}, unit="steps", delay_us=300)
                self.wait_until("the line to wait", lambda: client.where("b1").activity == bushd.Activity.ARMED)
                self.bushsim.send(signal.SIGRTMIN)
                self.assertEqual(armed.wait()["a1"].position_steps, steps + 100)
                self.bushsim.send(signal.SIGRTMIN)
                client.move_line({"a0": 0, "b1": before})
                with self.assertRaisesRegex(bushd.Refused, "takes at least"):
                    client.move_line(by={"a0": 5, "b1": -200}, duration_s=0.001)
        self.assert_one_result_each()

    def test_paths_and_trajectories(self):
        self.bring_up_with_unit()
        for how in (SOCKET, LCM):
            with self.connect(**how) as client:
                client.set_position("a0", 0, unit="steps")
                client.set_position("b1", 0, unit="steps")
                points = [(0.5, 40), (1, 90), (1, 0), (0, 0)]
                plan = client.plan_path(["a0", "b1"], points, exact=True)
                self.assertEqual(len(plan.points_s), 4)
                self.assertEqual(client.where("b1").position_steps, 0)
                result = client.move_path(["a0", "b1"], points)
                self.assertIn("the path has ended", result.reason)
                self.assertEqual(client.where("b1").position_steps, 0)
                follow = client.follow(["b1"], [0, 1, 2], [[0], [50], [0]], wait=False)
                self.wait_until("b1 to follow", lambda: client.where("b1").position_steps > 10)
                self.assertEqual(follow.wait()["b1"].position_steps, 0)
                with self.assertRaisesRegex(bushd.RequestFailed, "stretched by"):
                    client.follow(["b1"], [0, 0.001], [[0], [500]])
        self.assert_one_result_each()

    def test_jogs(self):
        self.bring_up_with_unit()
        for how in (SOCKET, LCM):
            client = self.connect(**how)
            client.set_position("a0", 0, unit="steps")
            with client.jog("a0", -3.0, keepalive_ms=200) as jog:
                self.wait_until("a0 to be jogged", lambda: self.positions()["a0"] < -400)  # longer than its keepalive
                self.assertFalse(jog.done)
                jog.change(4.0)
                self.wait_until("a0 to come back", lambda: self.motors()["a0"]["velocity_steps_per_s"] > 0)
            self.assertEqual(jog.result.outcome, Outcome.DONE)
            self.assertEqual(jog.result["a0"].position_steps, client.where("a0").position_steps)
            with self.assertRaises(bushd.MoveFailed) as failed:
                with client.jog("a0", 100.0):
                    client.stop("a0")
            self.assertEqual(failed.exception.result.outcome, Outcome.STOPPED)
            with self.assertRaises(ZeroDivisionError), client.jog("b0", 3.0):
                self.moves_on("b0")
                raise ZeroDivisionError
            self.assertFalse(client.where("b0").moving)
            with self.assertRaises(bushd.Refused), client.jog("a0", 1e-6):
                self.fail("the jog has begun")

    def test_a_jog_ends_with_its_program(self):
        self.bring_up()
        for how in ("", "lcm=True"):
            script = self.start_script(f"client = bushd.connect({how})", "with client.jog('a0', 300):",
                                       "    time.sleep(1000)")
            self.moves_on("a0")
            script.end(signal.SIGKILL)
            self.rests("a0")
            self.wait_until("others to be let in", lambda: self.bushctl("move", "a0", "0").returncode == 0)

    def test_pauses_and_holds(self):
        self.bring_up()
        client = self.connect()
        motion = client.move("a0", by=3000, wait=False)
        self.moves_on("a0")
        client.pause("group0")
        self.assertTrue(client.where("a0").paused)
        client.hold("a0")
        with self.assertRaisesRegex(bushd.Refused, "held"):
            client.resume()
        client.release()
        client.resume()
        self.assertEqual(motion.wait().outcome, Outcome.REACHED)

    def test_watches(self):
        self.bring_up()
        for how in (SOCKET, LCM):
            client = self.connect(**how)
            before = client.where("a0").position_steps
            motion = client.move("a0", by=1000, wait=False)
            seen = []
            for status in client.watch(every_s=0.01):
                seen.append(status["a0"].position_steps)
                if seen[-1] != before and not status["a0"].moving:
                    break
            self.assertEqual(seen, sorted(seen))
            self.assertGreater(len(set(seen)), 3)
            self.assertEqual(seen[-1], before + 1000, motion.wait(check=False))

    def test_emergency_stop_and_drivers(self):
        self.bring_up()
        client = self.connect()
        motion = client.move(by={"a0": FAR, "b0": -FAR}, wait=False)
        self.moves_on("a0")
        client.emergency_stop()
        self.assertEqual(motion.wait(check=False).outcome, Outcome.STOPPED)
        with self.assertRaises(bushd.Refused):
            client.move("a0", by=1)
        client.clear()
        client.enable()
        client.confirm("a0", "b0")
        self.assertTrue(client.where("a0").enabled)
        client.disable("a0")
        self.assertFalse(client.where("a0").enabled)

    def test_settings_tables_history_and_health(self):
        self.bring_up_with_unit(state=self.file("state.db"))
        client = self.connect(program="a test")
        client.move("a0", by=1)
        past = client.history("a0")
        self.assertEqual([(motion.what, motion.outcome) for motion in past[:1]], [("move", "reached")])
        self.assertIn(client.id, past[0].who)
        changed = client.config("a0", soft_limits=(-2, 3))
        self.assertEqual(client.where("a0").soft_limits, (-2, 3))
        self.assertTrue(any(setting.in_file != setting.value for setting in changed.settings))
        client.config("a0", soft_limits=None)
        self.assertIsNone(client.where("a0").soft_limits)
        self.assertEqual({setting.motor for setting in client.config().settings} >= {"a0", "b3"}, True)
        names = {entry.name for entry in client.tables.list()}
        self.assertIn("bushd2-constant", names)
        table = client.tables.get("bushd2-constant")
        made = client.tables.set("own", dataclasses.replace(table, name="own", hash="", revision=0))
        self.assertEqual(made.name, "own")
        self.assertEqual(client.tables.get("own").accel, table.accel)
        client.tables.use("group0", "own")
        self.assertEqual(client.where("a0").table.name, "own")
        self.assertEqual(client.tables.reload().outcome, Outcome.DONE)
        health = client.health()["hall"]
        self.assertEqual((health.port_state, [mcu.address for mcu in health.mcus]), ("open", [1, 2]))

    def test_the_end_of_the_daemon(self):
        self.bring_up()
        client = self.connect()
        motion = client.move("a0", by=FAR, wait=False)
        self.moves_on("a0")
        self.bushd.end(signal.SIGKILL)
        with self.assertRaises(bushd.ResultUnknown):
            motion.wait()
        with self.assertRaises(bushd.NoDaemon):
            client.where()

    def test_a_program_may_end_without_closing_anything(self):
        self.bring_up()
        script = self.start_script("client = bushd.connect()", "states = client.watch()", "next(states)",
                                   f"motion = client.move('a0', by={FAR}, wait=False)")
        self.assertEqual((script.process.wait(60), script.said()), (0, ""))
        self.moves_on("a0")
        self.command("stop")

    def test_threads_share_a_client(self):
        self.bring_up()
        self.survey()
        for how in (SOCKET, LCM):
            client = self.connect(**how)
            names = ["a0", "a1", "b0", "b1"]
            threads = [threading.Thread(target=client.move, args=(name,), kwargs={"by": 50}) for name in names]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join()
        self.assertEqual({self.positions()[name] for name in names}, {100})

    def test_a_program_that_only_reads_states_slowly(self):
        self.bring_up()
        client = self.connect()
        states = client.watch()
        next(states)
        self.start_move("a0", FAR)
        self.wait_until_travelled(600, "a0")
        self.assertGreater(next(states)["a0"].position_steps, 0)
        states.close()
        client.stop()


class LossyLink(LcmLink):
    """A quarter of the datagrams, both ways, is lost, and a quarter comes twice."""

    chance = random.Random(1985)

    def send(self, channel, payload):
        for _ in range(self.chance.choice([0, 1, 1, 2])):
            super().send(channel, payload)

    def receive(self):
        for message in super().receive():
            yield from [message] * self.chance.choice([0, 1, 1, 2])


class OverABadNetwork(PythonTest):
    def test_every_move_is_made_once(self):
        self.bring_up()
        self.survey()
        timing = bushd.Timing(resend_every_s=0.05, ask_again_every_s=0.1, answer_within_s=60, silence_limit_s=60)
        with unittest.mock.patch("bushd.links.LcmLink", LossyLink):
            client = self.connect(lcm=True, timing=timing)
        for i in range(1, 16):
            self.assertEqual(client.move(by={"a0": 10, "b0": -1})["a0"].position_steps, 10 * i)
        self.assertEqual(self.positions()["b0"], -15)
        self.assert_one_result_each()


class Documentation(PythonTest):
    """The examples of docs/python.md, as they are but for the names of motors."""

    def run_block(self, first_words):
        page = (TOP / "docs" / "python.md").read_text()
        blocks = re.findall(r"^```python\n(.*?)^```$", page, re.DOTALL | re.MULTILINE)
        (block,) = [block for block in blocks if block.startswith(first_words)]
        script = self.file("script.py")
        script.write_text(block.replace("theta", "a0").replace("phi", "b0"))
        ran = self.run_program(sys.executable, "-B", script)
        self.assertEqual((ran.returncode, ran.stderr), (0, ""))
        return ran.stdout

    def test_the_first_program(self):
        self.bring_up()
        lines = self.run_block("import bushd\n").splitlines()
        self.assertEqual(lines[:2], ["a0: reached, stands at 400 steps", "a0: 400 steps (known), rest"])
        self.assertIn("b0: 0 steps (uncertain), rest", lines)

    def test_asyncio(self):
        self.bring_up()
        self.survey()
        self.run_block("import asyncio\n")
        self.assertEqual((self.positions()["a0"] > 1, self.positions()["b0"]), (True, 2))


class Asyncio(PythonTest):
    def run_async(self, coroutine):
        async def within_time():
            async with asyncio.timeout(120):
                return await coroutine

        return asyncio.run(within_time())

    def test_several_at_once(self):
        self.bring_up()
        self.survey()

        async def move(**how):
            async with bushd.aio.connect(**how) as client:
                results = await asyncio.gather(*[client.move(name, by=30) for name in ("a0", "a1", "b0")])
                self.assertEqual({result.outcome for result in results}, {Outcome.REACHED})
                motion = await client.move("b1", by=FAR, wait=False)
                await client.stop("b1")
                self.assertEqual((await motion.wait(check=False)).outcome, Outcome.STOPPED)

        for how in (SOCKET, LCM):
            self.run_async(move(**how))
        self.assertEqual(self.positions()["a0"], 60)

    def test_a_task_that_is_cancelled_ramps_down(self):
        self.bring_up()

        async def cancel(**how):
            async with bushd.aio.connect(**how) as client:
                moving = asyncio.create_task(client.move("a0", by=FAR))
                async with contextlib.aclosing(client.watch(0.01)) as states:
                    async for status in states:
                        if status["a0"].moving:
                            break
                moving.cancel()
                with self.assertRaises(asyncio.CancelledError):
                    await moving
                self.assertFalse((await client.where("a0")).moving)

        for how in (SOCKET, LCM):
            self.run_async(cancel(**how))
        results = [event["result"] for event in self.moves() if event["event"] == "result"]
        self.assertEqual(results, ["stopped", "stopped"])

    def test_ctrl_c_ramps_down(self):
        self.bring_up()
        script = self.start_script(
            "async def main():",
            "    async with bushd.aio.connect() as client:",
            f"        await client.move('a0', by={FAR})",
            "asyncio.run(main())")
        self.moves_on("a0")
        script.end(signal.SIGINT)
        self.assertIn("KeyboardInterrupt", script.said())
        self.assertFalse(self.motors()["a0"]["moving"])
        self.assertEqual([event["result"] for event in self.moves() if event["event"] == "result"], ["stopped"])

    def test_jogs(self):
        self.bring_up()
        self.survey()

        async def jog(**how):
            async with bushd.aio.connect(**how) as client:
                async with client.jog("a0", 400, keepalive_ms=150) as jog:
                    async with contextlib.aclosing(client.watch(0.01)) as states:
                        begin = (await client.where("a0")).position_steps
                        async for status in states:
                            if status["a0"].position_steps > begin + 200:
                                break
                    ended = await jog.end(steps_after=700)
                self.assertEqual(ended.outcome, Outcome.DONE)
                self.assertIn("700 steps after the stop event", ended.reason)

        for how in (SOCKET, LCM):
            self.run_async(jog(**how))


if __name__ == "__main__":
    unittest.main()
