"""What becomes of motion when the daemon ends, dies or stands still: no step is made that is not accounted for."""

import signal
import time
import unittest

from rig import MOTORS, OUTWARD, TABLE_RUNS, EndToEndTest


class DaemonEnds(EndToEndTest):
    def start_moving(self, displacement_format="fine", bus_lines=()):
        self.bring_up(displacement_format, bus_lines)
        self.survey()
        return self.start_outward()

    def check_sigterm(self, displacement_format):
        move = self.start_moving(displacement_format)
        self.assertEqual(self.bushd.end(signal.SIGTERM), 0)
        self.assertIn("SIGTERM: ramping all motors down", self.bushd.said())
        # It heard the result although the daemon ended right after.
        self.assertEqual(move.process.wait(), 1)
        self.assertIn("stopped", move.said())
        self.assertEqual(self.bushsim.end(), 0)
        self.assert_one_result_each()
        results = {event["motor"]: event for event in self.moves() if event["event"] == "result"}
        self.assertEqual({event["result"] for event in results.values()}, {"stopped"})
        stood_at = {name: results[name]["position_steps"] if name in results else 0 for name in MOTORS}
        self.assertEqual(stood_at, self.traced_positions())
        self.assert_trace_is_right(
            {"motors": [{"name": name, "position_steps": steps} for name, steps in stood_at.items()]}
        )

    def test_sigterm_in_motion_ramps_down_fine(self):
        self.check_sigterm("fine")

    def test_sigterm_in_motion_ramps_down_coarse(self):
        self.check_sigterm("coarse")

    def test_sigterm_at_rest_ends_at_once(self):
        self.bring_up()
        self.assertEqual(self.bushd.end(signal.SIGTERM), 0)

    def check_kill(self, displacement_format="fine", bus_lines=()):
        move = self.start_moving(displacement_format, bus_lines)
        self.assertEqual(self.bushd.end(signal.SIGKILL), -signal.SIGKILL)
        move.end(signal.SIGTERM)
        # At once, so that the motors still move when it comes.
        self.bushd = self.start_bushd("moves-after.jsonl")
        self.wait_until_ready()
        # No step is lost, but the new daemon has not seen that.
        self.assert_way_back_shows_no_step_lost("moves-after.jsonl", trust="uncertain")

    def test_killed_in_motion_mcus_run_down_and_the_next_daemon_goes_on_fine(self):
        self.check_kill("fine")

    def test_killed_in_motion_mcus_run_down_and_the_next_daemon_goes_on_coarse(self):
        self.check_kill("coarse")

    def test_killed_in_table_runs_the_next_daemon_ends_them_and_goes_on(self):
        self.check_kill(bus_lines=TABLE_RUNS)

    def check_stopped_for_long(self, bus_lines=()):
        move = self.start_moving(bus_lines=bus_lines)
        self.bushd.send(signal.SIGSTOP)
        # Not to wait for something: so long it is away. Queues hold at most half a second, table runs go on without
        # a master for one, and the simulated MCUs live by the same clock.
        time.sleep(2)
        self.bushd.send(signal.SIGCONT)
        self.assertEqual(move.process.wait(), 1)
        self.assertIn("link", move.said())
        self.wait_until_ready()
        found = self.positions()
        results = [event for event in self.moves() if event["event"] == "result"]
        self.assertEqual({event["motor"]: event["result"] for event in results}, dict.fromkeys(OUTWARD, "link"))
        for event in results:
            self.assertEqual(event["position_steps"], found[event["motor"]])
        self.assert_way_back_shows_no_step_lost()

    def test_stopped_longer_than_the_queue_is_a_lost_link(self):
        self.check_stopped_for_long()

    def test_stopped_longer_than_table_runs_go_on_alone_is_a_lost_link(self):
        self.check_stopped_for_long(TABLE_RUNS)

    def check_stopped_for_short(self, bus_lines=()):
        self.bring_up(bus_lines=bus_lines)
        steps = {name: 3000 if steps > 0 else -3000 for name, steps in OUTWARD.items()}
        move = self.start_move(*[word for pair in steps.items() for word in pair])
        away_s = []
        for travelled in (600, 1200, 1800):
            self.wait_until_travelled(travelled, *OUTWARD)
            self.bushd.send(signal.SIGSTOP)
            stopped_s = time.monotonic()
            time.sleep(0.1)  # so long it is away: well within the queue
            self.bushd.send(signal.SIGCONT)
            away_s.append(round(time.monotonic() - stopped_s, 3))
        self.assertEqual(move.process.wait(), 0, f"{move.said()}; bushd was stopped for {away_s} s, and queues hold 0.25 s")
        self.assertEqual({name: self.positions()[name] for name in steps}, steps)
        self.command("move", "--wait", *[word for name in OUTWARD for word in (name, "--to", "0")])
        status = self.status()
        self.assertEqual(self.bushd.end(), 0)
        self.assertEqual(self.bushsim.end(), 0)
        self.assert_one_result_each()
        self.assert_trace_is_right(status)

    def test_stopped_shorter_than_the_queue_changes_nothing(self):
        self.check_stopped_for_short()

    def test_stopped_shorter_than_table_runs_go_on_alone_changes_nothing(self):
        self.check_stopped_for_short(TABLE_RUNS)


if __name__ == "__main__":
    unittest.main()
