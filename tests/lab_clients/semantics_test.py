#!/usr/bin/env python3
"""What EPICS' motor record means to its users, heard by pyepics and caproto from the real programs."""

import signal
import subprocess
import sys
import time
import unittest

from lab import LabTest, pyepics


class Edges(LabTest):
    def assert_one_edge(self, heard, end, moved=True):
        """DMOV 0, then 1; the last position before that, with its alarm; nothing of DMOV after it. `moved`: it was not there already."""
        self.wait_until("the move to be done", lambda: heard.values("DMOV")[-1:] == [1])
        told = heard.take()
        self.assertEqual([value for field, value, _ in told if field == "DMOV"], [0, 1])
        before = told[: [index for index, (field, value, _) in enumerate(told) if (field, value) == ("DMOV", 1)][0]]
        positions = [value for field, value, _ in before if field == "RBV"]
        if moved:
            self.assertTrue(positions, told)
        if positions:
            self.assertAlmostEqual(positions[-1], end)
        return told

    def test_dmov_falls_and_rises_once_by_every_field_that_tells_a_target(self):
        self.bring_up_lab()
        heard = self.watch("theta.DMOV", "theta.RBV")
        where = 0.0
        for field, value, to in (
            ("VAL", 2.0, 2.0), ("VAL", 2.0, 2.0), ("DVAL", 3.0, 3.0), ("DVAL", 3.0, 3.0), ("RVAL", 400, 4.0), ("RVAL", 400, 4.0),
            ("RLV", 1.0, 5.0), ("RLV", 0.0, 5.0), ("TWF", 1, 6.0), ("TWR", 1, 5.0),
        ):  # fmt: skip
            self.put(f"theta.{field}", value)
            # It has fallen, risen, and been heard before the put was answered.
            self.assertEqual(heard.values("DMOV"), [0, 1], field)
            self.assert_one_edge(heard, to, moved=to != where)
            self.assertAlmostEqual(self.get("theta.RBV"), to)
            where = to
        self.end_all()
        self.assertEqual(self.steps_made("theta"), round(where * 100))

    def test_a_new_target_on_the_way_makes_no_edge_of_its_own(self):
        self.bring_up_lab()
        heard = self.watch("theta.DMOV", "theta.RBV")
        self.put("theta.VAL", 100.0, wait=False)
        self.wait_for("theta.RBV", lambda rbv: rbv > 5)
        self.put("theta.VAL", -1.0)
        self.assert_one_edge(heard, -1.0)
        self.end_all()
        self.assertEqual(self.steps_made("theta"), -100)

    def test_a_limit_switch_tells_direction_and_switch_before_dmov(self):
        self.bring_up_lab(theta="inputs = { positive = 9, negative = 10 }", sim=("--switch", "1.0:9@+900", "--switch", "1.0:10@-900"))
        heard = self.watch("theta.DMOV", "theta.RBV", "theta.HLS", "theta.LLS", "theta.TDIR")
        self.assertTrue(self.put_fails("theta.VAL", -30.0))
        told = heard.take()
        order = [(field, value) for field, value, _ in told]
        done = order.index(("DMOV", 1))
        self.assertLess(order.index(("LLS", 1)), done)
        self.assertNotIn(("HLS", 1), order)
        self.assertEqual([severity for field, _, severity in told[:done] if field == "RBV"][-1], 2)
        self.assertEqual((self.get("theta.STAT"), self.get("theta.TDIR")), ("HWLIMIT", 0))
        self.put("theta.VAL", 0.0)
        self.assertEqual((self.get("theta.LLS"), self.get("theta.SEVR")), (0, 0))

    def test_stop_in_the_delay_ends_with_dmov_1(self):
        self.bring_up_lab()
        self.put("theta.DLY", 3600)
        heard = self.watch("theta.DMOV", "theta.RBV")
        self.put("theta.VAL", 1.0, wait=False)
        self.wait_for("theta.MIP", lambda mip: mip & 0x400)
        self.assertEqual(heard.values("DMOV"), [0])
        self.put("theta.STOP", 1)
        told = self.assert_one_edge(heard, 1.0)
        self.assertEqual({severity for _, _, severity in told}, {0})

    def test_backlash_is_made_up_for_after_a_stop(self):
        self.bring_up_lab()
        self.put("theta.BDST", 1.0)
        heard = self.watch("theta.DMOV", "theta.RBV")
        self.put("theta.VAL", -200.0, wait=False)
        self.wait_for("theta.RBV", lambda rbv: rbv < -5)
        self.put("theta.STOP", 1)
        self.wait_for("theta.DMOV", lambda dmov: dmov == 1)
        stands = self.get("theta.RBV")
        told = self.assert_one_edge(heard, stands)
        self.assertEqual(told[-1][2], 2)
        self.end_all()
        # The last edges of the trace are those of the approach: a degree upwards.
        from rig import Trace

        edges = Trace(self.file("trace.vcd")).edges[1, 0]
        self.assertEqual([edge.direction for edge in edges[-100:]], [True] * 100)
        self.assertFalse(edges[-101].direction)
        self.assertEqual(self.steps_made("theta"), round(stands * 100))


class Failures(LabTest):
    def test_a_refused_move_fails_as_a_put_and_at_dmov(self):
        self.bring_up_lab()
        self.command("hold", "theta")
        heard = self.watch("theta.DMOV", "theta.RBV")
        self.assertTrue(self.put_fails("theta.VAL", 3.0))
        told = heard.take()
        self.assertEqual([value for field, value, _ in told if field == "DMOV"], [0, 1])
        self.assertEqual([severity for field, _, severity in told if field == "RBV"][-1], 2)
        self.assertIn("held", self.get("theta.AMSG$", as_string=True))
        self.assertEqual(self.get("theta_able"), 1)
        self.put("theta_able", 0)
        self.assertFalse(self.put_fails("theta.VAL", 3.0))
        self.assertEqual((self.get("theta.SEVR"), self.get("theta.RBV")), (0, 3.0))

    def test_beyond_the_soft_limits_is_refused_not_clipped(self):
        self.bring_up_lab()
        self.assertTrue(self.put_fails("theta.VAL", 501.0))
        self.assertEqual([self.get(f"theta.{field}") for field in ("LVIO", "VAL", "RBV", "DMOV")], [1, 0.0, 0.0, 1])
        self.end_all()
        self.assertEqual(self.steps_made("theta"), 0)

    def test_a_stop_is_an_alarm_until_the_next_start_and_at_rest_it_is_nothing(self):
        self.bring_up_lab()
        heard = self.watch("theta.DMOV", "theta.RBV", "theta.VAL", "theta.SEVR")
        self.put("theta.STOP", 1)
        self.put("theta.PROC", 1)  # another answered put: what the stop had to say would have come before
        self.assertEqual(heard.take(), [])
        self.put("theta.VAL", 200.0, wait=False)
        self.wait_for("theta.RBV", lambda rbv: rbv > 5)
        self.put("theta.STOP", 1)
        self.wait_until("the motor to be done", lambda: heard.values("DMOV")[-1:] == [1])
        told = heard.take()
        self.assertEqual([value for field, value, _ in told if field == "DMOV"], [0, 1])
        self.assertEqual([severity for field, _, severity in told if field == "RBV"][-1], 2)
        self.assertEqual(self.get("theta.VAL"), self.get("theta.RBV"))
        self.put("theta.VAL", 1.0)
        self.assertEqual(self.get("theta.SEVR"), 0)

    def test_positions_that_nobody_has_told_are_major_with_the_reason(self):
        self.bring_up_lab(known=False)
        self.assertEqual(self.get("theta.SEVR"), 2)
        self.assertIn("uncertain", self.get("theta.AMSG$", as_string=True))
        self.put("theta.SET", 1)
        self.put("theta.DVAL", 0.0)
        self.put("theta.SET", 0)
        self.assertEqual((self.get("theta.SEVR"), self.get("theta.AMSG$", as_string=True)), (0, ""))


class Clients(LabTest):
    def test_a_jog_ends_at_0_and_with_its_client(self):
        self.bring_up_lab()
        self.put("theta.JOGF", 1)
        self.wait_for("theta.RBV", lambda rbv: rbv > 2)
        self.put("theta.JOGF", 0)
        self.wait_for("theta.DMOV", lambda dmov: dmov == 1)
        self.assertEqual(self.get("theta.SEVR"), 0)
        jogs = "import epics, time; epics.caput('LAB:theta.JOGR', 1, wait=True); print('jogs', flush=True); time.sleep(3600)"
        client = self.start([sys.executable, "-B", "-c", jogs], "client.log")
        self.wait_until("the client to jog", lambda: "jogs" in client.said())
        self.wait_for("theta.MOVN", lambda movn: movn == 1)
        self.assertEqual((self.get("theta.JOGR"), self.get("theta.DMOV")), (1, 0))
        client.send(signal.SIGKILL)
        self.wait_for("theta.DMOV", lambda dmov: dmov == 1)
        self.assertEqual(self.get("theta.JOGR"), 0)
        stands = self.get("theta.RBV")
        self.end_all()
        self.assertEqual(self.steps_made("theta"), round(stands * 100))

    def test_a_jog_ends_that_is_not_put_again(self):
        self.bring_up_lab(bridge=["--longest-jog-s", "2"])
        heard = self.watch("theta.DMOV")
        self.put("theta.JOGF", 1)
        self.wait_until("both edges", lambda: heard.values("DMOV")[-1:] == [1])
        self.assertEqual((heard.values("DMOV"), self.get("theta.SEVR")), ([0, 1], 0))
        self.assertIn("--longest-jog-s", self.bridge.said())

    def test_filters_are_not_served(self):
        self.bring_up_lab()
        filtered = pyepics().PV('LAB:theta.VAL{"arr":{"s":0}}')
        self.assertFalse(filtered.wait_for_connection(2))
        self.assertEqual(self.get("theta.VAL"), 0.0)

    def test_a_target_and_the_stop_of_another_program_are_both_answered(self):
        self.bring_up_lab()
        puts = "import epics, sys; p = epics.PV('LAB:theta.' + sys.argv[1]); p.wait_for_connection(10); print('there', flush=True)\n"
        puts += "sys.stdin.readline(); print('answered', p.put(int(sys.argv[2]), wait=True, timeout=20), flush=True)"
        programs = [
            subprocess.Popen([sys.executable, "-B", "-c", puts, *words], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
            for words in (("VAL", "400"), ("STOP", "1"))
        ]
        for program in programs:
            self.addCleanup(program.kill)
            self.assertEqual(program.stdout.readline(), "there\n")
        for program in programs:
            program.stdin.write("\n")
            program.stdin.flush()
        for program in programs:
            self.assertEqual(program.communicate(timeout=60)[0], "answered 1\n", "-1: not within 20 s")
        self.wait_for("theta.DMOV", lambda dmov: dmov == 1)
        stands = self.get("theta.RBV")
        self.end_all()
        self.assertEqual(self.steps_made("theta"), round(stands * 100))

    def test_the_names_of_a_daemon_that_is_not_there(self):
        command = [sys.executable, "-B", "-m", "bushd_epics", "--prefix", "LAB:", "--daemon", self.file("control"), "--list"]
        listed = subprocess.run(command, capture_output=True, text=True, timeout=60)
        self.assertEqual((listed.returncode, listed.stdout), (1, ""))
        self.assertIn("bushd is not running", listed.stderr)

    def test_set_and_val_by_two_programs_move_nothing(self):
        self.bring_up_lab()
        for field, value in (("SET", 1), ("VAL", 42)):
            puts = f"import epics; epics.caput('LAB:theta.{field}', {value}, wait=True)"
            subprocess.run([sys.executable, "-B", "-c", puts], check=True, timeout=60)
        self.assertEqual((self.get("theta.RBV"), self.get("theta.OFF"), self.get("theta.SET")), (42.0, 42.0, 1))
        self.put("theta.SET", 0)
        self.end_all()
        self.assertEqual(self.steps_made("theta"), 0)

    def test_what_is_above_vmax_is_vmax(self):
        self.bring_up_lab()
        self.put("theta.VELO", 1e6)
        self.assertEqual(self.get("theta.VELO"), self.get("theta.VMAX"))

    def test_history_names_who_has_asked(self):
        self.bring_up_lab()
        self.put("theta.VAL", 1.0)
        self.assertRegex(self.command("history", "theta").stdout, r"epics:\w+:\S+@")

    def test_deferred_moves_begin_in_one_tick(self):
        self.bring_up_lab()
        self.put("deferMoves", 1)
        self.put("theta.VAL", 2.0, wait=False)
        self.put("phi.VAL", -3.0, wait=False)
        self.wait_for("phi.DMOV", lambda dmov: dmov == 0)
        time.sleep(0.3)
        self.assertEqual((self.get("theta.RBV"), self.get("theta.DMOV")), (0.0, 0))
        self.put("deferMoves", 0)
        self.wait_for("theta.DMOV", lambda dmov: dmov == 1)
        self.assertEqual((self.get("theta.RBV"), self.get("phi.RBV")), (2.0, -3.0))
        self.end_all()
        from rig import Trace

        edges = Trace(self.file("trace.vcd")).edges
        self.assertEqual((self.steps_made("theta"), self.steps_made("phi")), (200, -300))
        self.assertEqual(edges[1, 0][0].time_ns, edges[1, 1][0].time_ns)

    def test_allstop_stops_all(self):
        self.bring_up_lab()
        for name in ("theta", "phi", "chi"):
            self.put(f"{name}.VELO", 1.0)  # so that none of them arrives before all are seen to move
            self.put(f"{name}.VAL", 300.0, wait=False)
            self.wait_for(f"{name}.MOVN", lambda movn: movn == 1)
        self.put("allstop", 1)
        for name in ("theta", "phi", "chi"):
            self.wait_for(f"{name}.DMOV", lambda dmov: dmov == 1)
            self.assertEqual(self.get(f"{name}.SEVR"), 2)

    def test_read_only_and_hosts_that_are_not_allowed(self):
        self.bring_up_lab(bridge=["--read-only"])
        self.assertEqual(epics_rights("LAB:theta.VAL"), (True, False))
        self.bridge.end()
        self.file("names.toml").write_text('[names]\ntheta = "m1"\nchi = ""\n[allow]\nhosts = ["10.0.0.0/8"]\n')
        listed = self.run_program(
            sys.executable, "-B", "-m", "bushd_epics", "--prefix", "LAB:", "--daemon", self.file("control"), "--names", self.file("names.toml"), "--list"
        ).stdout.split()
        self.assertTrue({"LAB:m1.VAL", "LAB:m1_able", "LAB:phi.RBV", "LAB:allstop"} <= set(listed))
        self.assertFalse([name for name in listed if "chi" in name or "theta" in name])
        self.bridge = self.start_bridge("--names", self.file("names.toml"))
        self.assertEqual(epics_rights("LAB:m1.VAL"), (True, False))
        self.assertEqual(self.get("m1.RBV"), 0.0)


def epics_rights(name):
    """(may read, may write), as the server tells."""
    import epics

    variable = epics.PV(name)
    variable.wait_for_connection(10)
    return variable.read_access, variable.write_access


if __name__ == "__main__":
    unittest.main()
