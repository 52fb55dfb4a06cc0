"""Tables that are changed while the daemon runs: which of them each move is made by, and who is told."""

import json
import signal
import unittest

from rig import TABLE_RUNS, TICK_US, EndToEndTest, program


class Tables(EndToEndTest):
    def bushtab(self, *arguments):
        ran = self.run_program(program("BUSHTAB"), "--dir", self.file("tables"), *map(str, arguments))
        self.assertEqual(ran.returncode, 0, ran.stdout + ran.stderr)
        return ran

    def bring_up_with_tables(self, bus_lines=()):
        """Beside the shipped ones `own`, of two revisions, the second twice as fast."""
        self.file("tables").mkdir()
        self.bushtab("new", "own", "--law", "constant", "--start", "200Hz", "--max", "1200Hz", "--acceleration", 8000)
        self.bushtab("tag", "own", "gentle")
        self.bushtab("scale", "own", "--speed", 2)
        self.bring_up(bus_lines=bus_lines)

    def table_of(self, motor):
        table = self.motors()[motor]["table"]
        return table["name"], table["revision"]

    def check_use_while_a_move_runs(self, bus_lines=()):
        self.bring_up_with_tables(bus_lines)
        before = self.motors()["a0"]["table"]
        move = self.start_move("a0", 4000)
        self.wait_until_travelled(600, "a0")
        use = self.start_bushctl("table", "use", "group0", "own@1")
        self.wait_until("the change to be accepted", lambda: "accepted" in use.said())
        self.assertEqual(self.table_of("a0"), ("bushd2-constant", 0))
        refused = self.bushctl("move", "b0", "5")
        self.assertEqual(refused.returncode, 1)
        self.assertIn("about to get another table, for group group0", refused.stderr)
        self.assertEqual(move.process.wait(), 0, move.said())
        self.assertIn(f"stands at 4000 by bushd2-constant ({before['hash']})", move.said())
        self.assertEqual(use.process.wait(), 0, use.said())
        after = self.motors()["a0"]["table"]
        self.assertEqual((after["name"], after["revision"]), ("own", 1))
        self.assertNotEqual(after["hash"], before["hash"])
        ran = self.command("move", "--wait", "a0", "1000", "b0", "-900", "a1", "300")
        self.assertIn(f"a0: reached, stands at 5000 by own@1 ({after['hash']})", ran.stdout)
        self.assertRegex(ran.stdout, r"a1: reached, stands at 300 by bushd2-scurve \(")

        # A tag is a revision, too; without any it is the newest.
        self.command("table", "use", "group1", "own@gentle")
        self.assertEqual(self.table_of("b1"), ("own", 1))
        self.command("table", "use", "group0", "own")
        self.assertEqual(self.table_of("b0"), ("own", 2))
        self.command("move", "--wait", "a0", "--to", "0", "a1", "--to", "0", "b0", "--to", "0")
        self.finish()

    def finish(self):
        status = self.status()
        self.assertEqual(self.bushd.end(), 0)
        self.assertEqual(self.bushsim.end(), 0)
        self.assert_one_result_each()
        self.assert_trace_is_right(status)

    def test_used_while_a_move_runs_serves_the_next_streams(self):
        self.check_use_while_a_move_runs()

    def test_used_while_a_move_runs_serves_the_next_table_runs(self):
        self.check_use_while_a_move_runs(TABLE_RUNS)

    def test_reload_after_bushtab_has_changed_a_table(self):
        self.bring_up_with_tables()
        self.command("table", "use", "group0", "own")
        self.command("table", "use", "group2", "own@1")
        self.command("move", "--wait", "a0", "500", "a2", "500")
        self.bushtab("scale", "own", "--acceleration", 0.5)
        self.assertEqual(self.table_of("a0"), ("own", 2))
        ran = self.command("table", "reload")
        self.assertRegex(ran.stdout, r"done: group group0 has own@3 \([0-9a-f]{8}\)\n")
        self.assertEqual(self.table_of("a0"), ("own", 3))
        self.assertEqual(self.table_of("a2"), ("own", 1))
        self.command("move", "--wait", "a0", "--to", "0", "a2", "--to", "0")
        # By a signal the same; what is no table leaves the old one in service.
        with open(self.file("tables") / "own.toml", "a", encoding="utf-8") as file:
            print("nonsense = 1", file=file)
        self.bushd.send(signal.SIGHUP)
        self.wait_until("the log to tell", lambda: "nonsense: unknown key" in self.bushd.said())
        self.assertIn("group group0 keeps own@3", self.bushd.said())
        refused = self.bushctl("table", "reload")
        self.assertEqual(refused.returncode, 1)
        self.assertRegex(refused.stderr, r"own.toml:\d+:1: nonsense: unknown key")
        self.command("move", "--wait", "a0", "700")
        # check-trace reads the file first: what bushd refused, it refuses too.
        path = self.file("tables") / "own.toml"
        path.write_text(path.read_text().replace("nonsense = 1\n", ""))
        self.finish()

    def test_what_does_not_fit_is_refused_and_the_old_one_stays(self):
        self.bring_up_with_tables()
        fast = 'name = "fast"\ntime_unit_ns = 1000\naccel = [250, 20]\n'
        (self.file("tables") / "fast.toml").write_text(fast)
        for table, reason in (
            ("fast", "makes up to 129 steps in a tick of 2560 us; allowed: 127"),
            ("none", 'there is no table "none"'),
            ("own@9", 'table "own" has no revision 9'),
            ("own@loud", 'no tag "loud"'),
        ):
            with self.subTest(table):
                ran = self.bushctl("table", "use", "group0", table)
                self.assertEqual(ran.returncode, 1)
                self.assertIn(reason, ran.stderr)
        self.assertIn('no group "axes"', self.bushctl("table", "use", "axes", "own").stderr)
        self.assertEqual(self.table_of("a0"), ("bushd2-constant", 0))
        self.command("move", "--wait", "a0", "300")
        self.finish()

    def test_list_and_show(self):
        self.bring_up_with_tables()
        self.command("table", "use", "group0", "own@1")
        listed = json.loads(self.command("table", "list", "--json").stdout)
        self.assertEqual([entry["group"] for entry in listed["groups"]], [f"group{i}" for i in range(4)])
        used = listed["groups"][0]["table"]
        self.assertEqual((used["name"], used["revision"]), ("own", 1))
        own = next(entry for entry in listed["tables"] if entry["name"] == "own")
        self.assertEqual((own["table"]["revision"], round(own["max_steps_per_s"], -2)), (2, 2400))
        self.assertRegex(self.command("table", "list").stdout, r"group0 +own +1 +[0-9a-f]{8}\n")
        # What bushtab says of the same revision.
        for wanted in ("own", "own@1", "own@gentle"):
            shown = json.loads(self.command("table", "show", wanted, "--json").stdout)
            said = json.loads(self.bushtab("show", wanted, "--json").stdout)
            self.assertEqual((shown["hash"], shown["time_unit_ns"]), (said["sha256"], said["time_unit_ns"]))
        self.assertIn("revision 2, SHA-256 ", self.command("table", "show", "own").stdout)
        refused = self.bushctl("table", "show", "own@9")
        self.assertEqual(refused.returncode, 1)
        self.assertIn('table "own" has no revision 9', refused.stderr)

    def test_dry_run_moves_nothing_and_tells_what_the_move_is(self):
        self.bring_up_with_tables()
        plan = json.loads(self.command("move", "--dry-run", "--json", "a0", "1000", "b0", "-30").stdout)
        self.assertEqual([motor["steps"] for motor in plan["motors"]], [1000, -30])
        self.assertEqual(plan["motors"][0]["peak_steps_per_s"], 2500)
        self.assertEqual(plan["duration_us"], plan["ticks"] * TICK_US)
        self.assertGreater(plan["bytes"], 20 * plan["frames"])
        ran = self.command("move", "--dry-run", "a0", "1000")
        self.assertRegex(ran.stdout, r"a0: \+1000 steps in 0\.\d{3} s, up to 2500 steps/s\n\d+ ticks, ")
        self.assertEqual(self.moves(), [])
        self.command("move", "--wait", "a0", "1000")
        self.finish()

    def test_what_was_used_stays_when_the_daemon_is_started_again(self):
        self.bring_up_with_tables()
        self.command("table", "use", "group0", "own@1")
        self.command("table", "use", "group3", "own")
        self.assertEqual(self.bushd.end(signal.SIGKILL), -signal.SIGKILL)
        self.bushd = self.start_bushd()
        self.wait_until_ready()
        self.assertEqual(self.table_of("a0"), ("own", 1))
        self.assertEqual(self.table_of("a3"), ("own", 2))
        # The configuration's own table: nothing is kept of the group any more.
        self.command("table", "use", "group3", "bushd2-resonance")
        kept = json.loads(self.file(".tables-in-service.json").read_text())
        self.assertEqual(kept, {"group0": {"table": "own@1", "configured": "bushd2-constant"}})
        # Whoever edits the configuration later means it.
        self.assertEqual(self.bushd.end(), 0)
        text = self.file("bushd.toml").read_text()
        self.file("bushd.toml").write_text(text.replace('"bushd2-constant"', '"bushd2-scurve"'))
        self.bushd = self.start_bushd()
        self.wait_until_ready()
        self.assertEqual(self.table_of("a0"), ("bushd2-scurve", 0))

    def test_what_was_used_and_is_gone_keeps_the_daemon_from_starting(self):
        self.bring_up_with_tables()
        self.command("table", "use", "group0", "own")
        self.assertEqual(self.bushd.end(), 0)
        (self.file("tables") / "own.toml").unlink()
        started = self.start_bushd()
        self.assertEqual(started.process.wait(), 1)
        self.assertIn('there is no table "own"', started.said())
        self.assertIn(".tables-in-service.json says so", started.said())


if __name__ == "__main__":
    unittest.main()
