"""What becomes of motion when the daemon ends, dies or stands still: no step is made that is not accounted for."""

import signal
import time
import unittest

from rig import FAR, MOTORS, TICK_US, EndToEndTest, delays_before_end_us

# Moving both ways, on both MCUs, by all four tables.
OUTWARD = {"a0": FAR, "a1": -FAR, "a2": FAR, "b1": FAR, "b3": -FAR}


class DaemonEnds(EndToEndTest):
    def start_moving(self, displacement_format="fine"):
        self.bring_up(displacement_format)
        move = self.start_move(*[word for pair in OUTWARD.items() for word in pair])
        self.wait_until_travelled(600, *OUTWARD)
        return move

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

    def assert_ran_down_by_table(self, edges, table):
        """The times of the last steps before the end, against the table: each edge may lie a tick off."""
        delays_us = delays_before_end_us(table)
        end_us = edges[-1].time_ns / 1000
        before_us = 0
        for step, delay_us in enumerate(delays_us[: len(delays_us) - 1]):
            before_us += delay_us
            made_us = end_us - edges[-2 - step].time_ns / 1000
            self.assertAlmostEqual(made_us, before_us, delta=2 * TICK_US, msg=f"{table}, {step + 1} steps before")

    def check_kill(self, displacement_format):
        move = self.start_moving(displacement_format)
        self.assertEqual(self.bushd.end(signal.SIGKILL), -signal.SIGKILL)
        move.end(signal.SIGINT)
        # At once, so that the motors still move when it comes.
        self.bushd = self.start_bushd("moves-after.jsonl")
        self.wait_until_ready()
        found = self.motors()
        self.assertEqual({motor["trust"] for motor in found.values()}, {"known"})

        # Now each against its former direction, so that in the trace the two can be told apart.
        back = {name: -137 if steps > 0 else 137 for name, steps in OUTWARD.items()}
        self.command("move", "--wait", *[word for pair in back.items() for word in pair])
        self.assertEqual(self.bushd.end(), 0)
        self.assertEqual(self.bushsim.end(), 0)

        edges = self.traced()
        for name, motor in found.items():
            way_out = OUTWARD.get(name, FAR) > 0
            out = [edge for edge in edges[name] if edge.direction == way_out]
            self.assertEqual(motor["position_steps"], len(out) if way_out else -len(out), name)
            self.assertEqual(len(edges[name]) - len(out), 137 if name in OUTWARD else 0, name)
            if name in OUTWARD:
                self.assert_ran_down_by_table(out, motor["table"])
        self.assert_one_result_each("moves-after.jsonl")

    def test_killed_in_motion_mcus_run_down_and_the_next_daemon_goes_on_fine(self):
        self.check_kill("fine")

    def test_killed_in_motion_mcus_run_down_and_the_next_daemon_goes_on_coarse(self):
        self.check_kill("coarse")

    def test_stopped_longer_than_the_queue_is_a_lost_link(self):
        move = self.start_moving()
        self.bushd.send(signal.SIGSTOP)
        # Not to wait for something: so long it is away. Queues hold at most half a second, and the simulated MCUs
        # live by the same clock.
        time.sleep(1.5)
        self.bushd.send(signal.SIGCONT)
        self.assertEqual(move.process.wait(), 1)
        self.assertIn("link", move.said())
        self.wait_until_ready()
        self.assert_one_result_each()
        found = self.motors()
        self.assertEqual({motor["trust"] for motor in found.values()}, {"known"})
        results = [event for event in self.moves() if event["event"] == "result"]
        self.assertEqual({event["result"] for event in results}, {"link"})
        for event in results:
            self.assertEqual(event["position_steps"], found[event["motor"]]["position_steps"])

        self.command("move", "--wait", *[word for name in OUTWARD for word in (name, "--to", "0")])
        self.assertEqual(self.bushd.end(), 0)
        self.assertEqual(self.bushsim.end(), 0)
        edges = self.traced()
        for name, steps in OUTWARD.items():
            out = [edge for edge in edges[name] if edge.direction == (steps > 0)]
            self.assertEqual(abs(found[name]["position_steps"]), len(out), name)
            self.assertEqual(2 * len(out), len(edges[name]), name)
            self.assert_ran_down_by_table(out, found[name]["table"])


if __name__ == "__main__":
    unittest.main()
