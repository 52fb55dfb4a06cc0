"""bushctl and the example clients against the real daemon."""

import json
import math
import pathlib
import re
import signal
import sys
import unittest

from rig import FAR, GIVE_UP_S, MOTORS, TOP, EndToEndTest, program

sys.path.insert(0, str(TOP / "tests/tools/bushtab"))
from terminal import Terminal


class Bushctl(EndToEndTest):
    def test_wait_succeeds_only_for_reached(self):
        self.bring_up()
        ran = self.command("move", "--wait", "a0", "300", "b0", "-7")
        by = r" by bushd2-constant \([0-9a-f]{8}\)\n"
        self.assertRegex(ran.stdout, f"a0: reached, stands at 300{by}b0: reached, stands at -7{by}")
        # One motor of a group move is stopped, the other arrives.
        move = self.start_move("a0", FAR, "b0", 100)
        self.wait_until_travelled(600, "a0")
        self.command("stop", "a0")
        self.assertEqual(move.process.wait(), 1)
        self.assertRegex(move.said(), rf"a0: stopped, stands at \d+{by}b0: reached, stands at 93{by}")
        # Nothing to be done is reached, too.
        self.command("move", "--wait", "b0", "--to", "93")

    def test_lines(self):
        self.bring_up()
        ran = self.command("move", "--line", "--wait", "a0", "900", "b0", "-300")
        self.assertRegex(ran.stdout, r"a0: reached, stands at 900 by .*\nb0: reached, stands at -300 by ")
        self.assertRegex(ran.stdout, r"a0: stands at its target; the line was limited by [ab]0\n")
        plan = json.loads(self.command("move", "--line", "--duration", "3", "--dry-run", "--json", "a0", "--to=0", "b0", "--to=0").stdout)
        self.assertGreaterEqual(plan["duration_us"], 3_000_000)
        self.assertIn(plan["limited_by"], ("a0", "b0"))
        self.assertEqual([motor["steps"] for motor in plan["motors"]], [-900, 300])
        self.assertEqual(self.bushctl("move", "--duration", "3", "a0", "1").returncode, 2)
        ran = self.bushctl("move", "--line", "--duration", "0.01", "a0", "1000", "b0", "1")
        self.assertEqual(ran.returncode, 1)
        self.assertRegex(ran.stderr, "the line takes at least .* limited by a0")
        # Ctrl-C ramps all down along the line.
        move = self.start_move("--line", "a0", FAR, "b0", -FAR)
        self.wait_until_travelled(600, "a0", "b0")
        self.assertEqual(move.end(signal.SIGINT), 130)
        self.assertIn("which was left at", move.said())
        self.assertEqual(self.motors()["a0"]["position_steps"] - 900, -300 - self.motors()["b0"]["position_steps"])

    def test_paths(self):
        self.bring_up()
        scan = self.file("scan.csv")
        # More rows than one request holds.
        rows = [f"{i % 40},{-i // 4}" for i in range(2500)]
        scan.write_text("\n".join(["# there and back", "a0, b0", "", *rows, "300,-700"]))
        plan = json.loads(self.command("path", "run", "--dry-run", "--json", scan).stdout)
        self.assertEqual([motor["steps"] for motor in plan["motors"]], [300, -700])
        short = self.file("short.csv")
        short.write_text("a0,b0\n400,0\n400,-250\n0,0\n")
        plan = json.loads(self.command("path", "check", "--json", "--corners", "exact", short).stdout)
        self.assertEqual(plan["points_us"], sorted(plan["points_us"]))
        self.assertEqual(len(plan["points_us"]), 3)
        scan.write_text("a0,b0\n100,-5\n200,-15\n300,-30\n400,-50\n")
        ends = [
            json.loads(self.command("path", "check", "--json", "--corners", corners, scan).stdout)["points_us"][-1]
            for corners in ("continuous", "exact")
        ]
        self.assertLess(*ends)
        ran = self.command("path", "run", "--wait", short)
        self.assertRegex(ran.stdout, r"a0: reached, stands at 0 by .*\nb0: reached, stands at 0 by ")
        # Errors name the line of the file.
        scan.write_text("a0,b0\n1,2\n\n3,4e9\n")
        ran = self.bushctl("path", "run", scan)
        self.assertEqual(ran.returncode, 1)
        self.assertIn(f"{scan}, line 4, b0: ", ran.stderr)
        scan.write_text("a0,b0\n1,2\n3,four\n")
        ran = self.bushctl("path", "run", scan)
        self.assertEqual(ran.returncode, 2)
        self.assertRegex(ran.stderr, r"scan\.csv.*3.*b0")
        # One motor at several speeds.
        ran = self.command("move", "a0", "--to", "300", "--speed-at", "100:50", "--speed-at", "120:1000", "--dry-run", "--json")
        times = json.loads(ran.stdout)["points_us"]
        self.assertGreaterEqual(times[1] - times[0], 400_000)
        # Ctrl-C ramps all down along the path.
        short.write_text(f"a0,b0\n{FAR},-{FAR}\n0,0\n")
        move = self.start_bushctl("path", "run", "--wait", short)
        self.wait_until_travelled(600, "a0", "b0")
        self.assertEqual(move.end(signal.SIGINT), 130)
        self.assertIn("the path has ended, which was left at", move.said())
        self.assertEqual(self.motors()["a0"]["position_steps"], -self.motors()["b0"]["position_steps"])

    def test_a_path_is_what_comes_out_of_the_pins(self):
        self.bring_up()
        path = self.file("path.csv")
        rows = [f"{round(300 * math.sin(i / 8))},{round(150 - 150 * math.cos(i / 8))},{2 * i}" for i in range(1, 60)]
        path.write_text("\n".join(["a0,b0,b1", *rows, "0,0,0"]))
        move = self.start_bushctl("path", "run", "--wait", path)
        self.wait_until_travelled(200, "a0")
        self.command("pause")
        self.command("resume")
        self.assertEqual(move.process.wait(), 0, move.said())
        status = self.status()
        self.assertEqual(self.bushd.end(), 0)
        self.assertEqual(self.bushsim.end(), 0)
        self.file("status.json").write_text(json.dumps(status))
        command = [sys.executable, "-B", TOP / "tools" / "check-trace", "--moves", self.file("moves.jsonl"), "--path", path]
        ran = self.run_program(*command, "--trace", self.file("trace.vcd"), "--positions", self.file("status.json"))
        self.assertEqual(ran.returncode, 0, ran.stdout + ran.stderr)
        judged = re.search(r"(\d+) of (\d+) edges of 3 motors", ran.stdout)
        self.assertEqual(judged[1], judged[2])
        self.assertGreater(int(judged[1]), 2000)

    def test_ctrl_c_ramps_down_and_says_where_motors_stand(self):
        self.bring_up()
        for more in ((), ("--lcm",)):
            move = self.start_move("a0", FAR, "b0", -FAR, *more)
            self.wait_until_travelled(600, "a0", "b0")
            self.assertEqual(move.end(signal.SIGINT), 130)
            self.assertRegex(move.said(), r"a0: stopped, stands at \d+ by")
            self.assertRegex(move.said(), r"b0: stopped, stands at -\d+ by")
            self.assertIn("ramping down", move.said())
            self.command("set", "a0", "0")
            self.command("set", "b0", "0")
        # Any other end of the program lets the motors go on.
        move = self.start_move("a0", FAR)
        self.wait_until_travelled(600, "a0")
        self.assertEqual(move.end(signal.SIGTERM), 130)
        self.assertIn("the move goes on", move.said())
        self.assertTrue(self.motors()["a0"]["moving"])

    def test_what_cannot_be_is_refused_with_the_reason(self):
        self.bring_up()
        self.start_move("a0", FAR)
        for arguments, reason in (
            (("move", "nobody", "5"), 'no motor "nobody"'),
            (("move", "b0", "5", "nobody", "5"), 'no motor "nobody"'),
            (("move", "b0", "5", "b0", "6"), "b0 is named twice"),
            (("move", "b0", "3000000000"), "b0: "),
            (("set", "a0", "5"), "a0 moves"),
            (("disable", "a1"), "a0 moves; run 'bushctl stop a0' first"),
            (("stop", "nobody"), 'no motor "nobody"'),
        ):
            with self.subTest(arguments):
                ran = self.bushctl(*arguments)
                self.assertEqual(ran.returncode, 1)
                self.assertIn(reason, ran.stderr)
        # Nothing has moved of a group that was refused.
        self.command("stop", "--wait")
        self.assertEqual(self.positions()["b0"], 0)

    def test_completion_knows_motors_groups_and_tables(self):
        self.bring_up()

        def offered(*words):
            return self.command("--complete", *words).stdout.split()

        self.assertEqual(offered("move", ""), sorted(MOTORS))
        self.assertEqual(offered("stop", "a0", "b"), sorted(name for name in MOTORS if name.startswith("b")))
        groups = offered("table", "use", "")
        self.assertTrue(groups)
        self.assertIn("bushd2-constant", offered("table", "use", groups[0], "bushd2"))

    def test_disabled_drivers_refuse_moves(self):
        self.bring_up()
        self.command("disable", "a0")
        refused = self.bushctl("move", "a1", "5")
        self.assertEqual(refused.returncode, 1)
        self.assertIn("disabled", refused.stderr)
        self.command("move", "--wait", "b0", "5")
        self.command("enable", "a0")
        self.command("move", "--wait", "a1", "5")

    def test_status_as_json(self):
        self.bring_up()
        self.command("set", "b3", "-12")
        status = json.loads(self.command("status", "--json").stdout)
        self.assertEqual([motor["name"] for motor in status["motors"]], list(MOTORS))
        motor = status["motors"][-1]
        expected = {
            "name": "b3",
            "mcu": "hall:2",
            "output": 3,
            "group": "group3",
            "position_steps": -12,
            "target_steps": -12,
            "velocity_steps_per_s": 0,
            "moving": False,
            "activity": "rest",
            "trust": "known",
        }
        self.assertEqual({key: motor[key] for key in expected}, expected)
        self.assertEqual((motor["table"]["name"], motor["table"]["revision"]), ("bushd2-resonance", 0))
        self.assertEqual([mcu["mcu"] for mcu in status["mcus"]], ["hall:1", "hall:2"])
        for mcu in status["mcus"]:
            self.assertEqual(mcu["state"], "READY")
            self.assertGreater(mcu["boot_number"], 0)

    def test_status_of_a_motor_under_way(self):
        self.bring_up()
        self.start_move("a0", -FAR)
        self.wait_until_travelled(1000, "a0")
        motor = self.motors()["a0"]
        self.assertTrue(motor["moving"])
        self.assertEqual(motor["target_steps"], -FAR)
        # The table's cruise: 10 time units of 40 us a step.
        self.assertAlmostEqual(motor["velocity_steps_per_s"], -2500, delta=1)

    def test_watch_and_health_wait_for_a_daemon_that_begins_anew(self):
        self.bring_up()
        watch, health = (self.enterContext(Terminal([program("BUSHCTL"), *words.split()])) for words in ("watch", "health --watch"))
        for terminal in (watch, health):
            terminal.wait_for(" ends")
        self.bushd.end(signal.SIGKILL)
        for terminal in (watch, health):
            terminal.wait_for("what is shown is old: ")
        self.start_bushd()
        for terminal in (watch, health):
            terminal.wait(lambda text: "what is shown is old" not in text)
        watch.wait_for("all work")
        watch.send("q")
        self.assertEqual(watch.end(), 0)
        self.assertFalse(watch.screen.alternate)
        health.send("\x03")
        self.assertEqual(health.end(), 0)

    def test_watch_in_a_pipe_waits_as_long_as_it_is_told(self):
        self.bring_up()
        watch = self.start_bushctl("watch", "--timeout-s", GIVE_UP_S)
        short = self.start_bushctl("watch", "--timeout-s", "0.1")
        self.wait_until("both to show the motors", lambda: all("b1 position" in each.said() for each in (watch, short)))
        self.bushd.end(signal.SIGKILL)
        self.assertEqual(short.process.wait(GIVE_UP_S), 1)
        self.start_bushd()
        self.wait_until("the new daemon's MCUs", lambda: watch.said().count("READY boot") >= 4)
        watch.process.send_signal(signal.SIGINT)
        self.assertEqual(watch.process.wait(GIVE_UP_S), 0)

    def test_status_where_and_watch_show_who_is_named(self):
        self.bring_up()
        self.assertEqual([motor["name"] for motor in json.loads(self.command("status", "--json", "b*").stdout)["motors"]], ["b0", "b1", "b2", "b3"])
        self.assertEqual([motor["name"] for motor in json.loads(self.command("where", "--json", "*1", "a0").stdout)["motors"]], ["a1", "b1", "a0"])
        self.assertNotIn("a0 ", self.command("watch", "--count", "1", "a1").stdout)
        for show in ("status", "where", "watch"):
            refused = self.bushctl(show, "c*")
            self.assertIn('there is no motor with a name like "c*"', refused.stderr)
            self.assertEqual(refused.returncode, 1)
        self.command("move", "a*", "10", "--wait")
        self.assertEqual([motor["position_steps"] for motor in json.loads(self.command("status", "--json").stdout)["motors"]], [10] * 4 + [0] * 4)

    def test_what_is_typed_into_watch_is_no_command(self):
        self.bring_up()
        shell = self.enterContext(Terminal(["sh", "-c", f"{program('BUSHCTL')} watch; echo ended; read -r typed; echo got: $typed"]))
        shell.wait_for("a0", "q ends")
        shell.send("bushctl move a0 1000\r")
        shell.send("q")
        # It drops what was typed into it once more when it has left its screen.
        shell.wait_for("ended")
        shell.send("that\r")
        shell.wait_for("got: that")

    def test_files_of_numbers_are_read_alike(self):
        self.bring_up()
        for words in (["follow"], ["path", "run"]):
            self.assertIn("it is a folder", self.bushctl(*words, TOP).stderr)
            self.assertIn("not a regular file", self.bushctl(*words, "/dev/zero").stderr)
        # A path of as many points as it may have is longer than any table.
        rows = "".join(f"{row % 7}.000000000000000000,{row % 5}.000000000000000000\n" for row in range(100_000))
        path = pathlib.Path(self.file("path.csv"))
        path.write_text("\ufeffa0,a1\n" + rows)
        self.assertGreater(path.stat().st_size, 2 << 20)
        self.assertEqual(json.loads(self.command("path", "run", "--dry-run", "--json", path).stdout)["motors"][0]["motor"], "a0")
        path.write_text("a0,a1\n" + "1" * 400 + "x,2\n")
        self.assertLess(len(self.bushctl("path", "run", path).stderr), 200)

    def test_status_waits_for_programs_that_start(self):
        self.write_config()
        status = self.start_bushctl("status", "--wait-s", GIVE_UP_S)
        self.start_bushd()
        self.start_bushsim()
        self.assertEqual(status.process.wait(GIVE_UP_S), 0, status.said())
        self.assertEqual(status.said().count("READY"), 2)

    def test_status_tells_what_it_has_waited_for_in_vain(self):
        self.assertRegex(self.bushctl("status", "--wait-s", "0.01").stderr, "^bushctl: waited 0.01 s; no control socket")
        self.write_config()
        bushd = self.start_bushd()
        self.wait_until("the daemon to answer", lambda: self.mcu_states() is not None)
        told = self.bushctl("status", "--wait-s", "0.01")
        self.assertEqual(told.returncode, 1)
        self.assertRegex(told.stderr, "waited 0.01 s; MCU hall:1 is OFFLINE")
        self.assertEqual(bushd.end(), 0)

    def test_watch_ends_after_a_count(self):
        self.bring_up()
        ran = self.command("watch", "--count", "2")
        for name in MOTORS:
            self.assertIn(f"{name} position 0 target 0", ran.stdout)


class Examples(EndToEndTest):
    def check_example(self, *example):
        self.bring_up()
        ran = self.run_program(*example, "a0", "400", "b1", "-20")
        self.assertEqual(ran.returncode, 0, ran.stdout + ran.stderr)
        self.assertIn("a0: reached, stands at 400", ran.stdout)
        self.assertIn("b1: reached, stands at -20", ran.stdout)
        ran = self.run_program(*example, "nobody", "5")
        self.assertEqual(ran.returncode, 1)
        self.assertIn('no motor "nobody"', ran.stdout + ran.stderr)
        self.assertEqual(self.positions()["a0"], 400)

    def test_in_cpp(self):
        self.check_example(program("MOVE_AND_WAIT"))

    def python_with(self, example):
        return sys.executable, "-B", TOP / "tools" / "examples" / "python" / example

    def test_in_python(self):
        lcm = "udpm://239.255.76.67:7667?ttl=0"
        self.check_example(*self.python_with("move_and_wait.py"), "--lcm", lcm)

    def test_in_python_over_the_socket(self):
        self.check_example(*self.python_with("move_and_wait.py"), "--socket", self.file("control"))

    def test_scan_in_python(self):
        self.bring_up()
        self.survey()
        ran = self.run_program(*self.python_with("scan.py"), "a0", "-10", "10", "3")
        self.assertEqual((ran.returncode, ran.stderr), (0, ""))
        self.assertEqual(ran.stdout, "# a0 [steps], reached, value\n-10 -10 0\n0 0 0\n10 10 0\n")
        self.assertEqual(self.positions()["a0"], 0)

    def test_health_in_python(self):
        self.bring_up()
        ran = self.run_program(*self.python_with("show_health.py"), "--count", "1")
        self.assertEqual(ran.returncode, 0, ran.stderr)
        self.assertRegex(ran.stdout, r"hall:1: \d+ CRC errors, .*\nhall:2: \d+ CRC errors, ")


if __name__ == "__main__":
    unittest.main()
