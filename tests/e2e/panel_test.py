"""What somebody does at an MCU: the panel of `bushsim --console` presses it, and the trace shows what came of it."""

import json
import re
import signal
import subprocess
import tomllib
import unittest

from rig import FAR, GIVE_UP_S, TICK_US, TOP, EndToEndTest, Trace, delays_before_end_us

TICK_NS = TICK_US * 1000
# Inputs are looked at when a tick is prepared, once a tick, while the one before it is emitted: the tick that follows that one is the first to
# differ.
ACTS_WITHIN_NS = 2 * TICK_NS
# The daemon asks an MCU as often as this (kPollPeriodUs), and needs several answers to set it up before it enables drivers. An MCU that
# enables them by itself does so as it boots, without a message.
POLL_NS = 50_000_000


def changes(trace, wire):
    """[(time_ns, value)] of a variable of MCU 1, the value at the beginning first."""
    text = trace.read_text(encoding="ascii")
    code = re.search(rf"\$scope module mcu1 \$end.*?\$var \w+ \d+ (\S+) {wire} \$end", text, re.S)[1]
    values, now = [], 0
    for line in text.splitlines():
        if line.startswith("#"):
            now = int(line[1:])
        elif line[:1] in "01" and line[1:] == code:
            values.append((now, int(line[0])))
        elif line.startswith("r") and line.split()[-1] == code:
            values.append((now, float(line[1:].split()[0])))
    return values


class Panel(EndToEndTest):
    def bring_up_with(self, *keys):
        """MCU 1 has these keys, and a panel."""
        self.write_config()
        file = self.file("bushd.toml")
        file.write_text(file.read_text().replace("address = 1\n", "\n".join(["address = 1", *keys]) + "\n", 1))
        self.bushsim = self.start_bushsim(options=("--console", 1), stdin=subprocess.PIPE)
        self.bushd = self.start_bushd()
        self.wait_until_ready()
        self.survey()

    def press(self, key):
        self.bushsim.process.stdin.write(key.encode())
        self.bushsim.process.stdin.flush()

    def detail(self):
        return self.status()["mcus"][0]["detail"]

    def wait_until_said(self, detail):
        self.wait_until(f"the MCU to say '{detail}'", lambda: detail in self.detail())

    def end_all(self):
        self.assertEqual(self.bushd.end(), 0)
        self.assertEqual(self.bushsim.end(), 0)

    def steps_of_a0(self):
        return [edge.time_ns for edge in Trace(self.file("trace.vcd")).edges[(1, 0)]]

    def start_both(self):
        """A motor of each MCU, far away, each by a request of its own."""
        moves = [self.start_move("a0", FAR), self.start_move("b1", -FAR)]
        self.wait_until_travelled(300, "a0", "b1")
        return moves

    def check_stop_by_the_input(self):
        """MCU 1 alone stops, until the input is released and the fault cleared."""
        mine, other = self.start_both()
        self.press("E")
        self.assertEqual(mine.process.wait(GIVE_UP_S), 1)
        self.assertRegex(mine.said(), "a0: stopped (immediately )?by the emergency input of MCU hall:1")
        self.wait_until_said("emergency input; release it, then run 'bushctl clear'")
        self.assertIn("emergency", self.status()["mcus"][0]["inputs"])
        self.assertTrue(self.motors()["b1"]["moving"], "the other MCU's motors go on")
        self.command("stop", "b1")
        other.process.wait(GIVE_UP_S)
        self.assertEqual(self.bushctl("move", "a1", "5").returncode, 1)
        self.assertEqual(self.bushctl("clear", "a0").returncode, 1, "the cause persists")
        self.press("E")
        self.wait_until_said("emergency input, released by now; run 'bushctl clear'")
        self.assertEqual(self.bushctl("move", "a1", "5").returncode, 1)
        self.command("clear", "a0")
        self.wait_until_ready()

    def test_the_emergency_input_ramps_its_motors_down_by_their_tables(self):
        self.bring_up_with('emergency_input = "ramp"')
        self.check_stop_by_the_input()
        stands = self.motors()["a0"]
        self.assertEqual(stands["trust"], "known")
        self.end_all()
        levels = changes(self.file("trace.vcd"), "emergency")
        self.assertEqual([level for _, level in levels], [0, 1, 0])
        edges = self.traced()["a0"]
        self.assertEqual(stands["position_steps"], len(edges))
        self.assert_ran_down_by_table(edges, stands["table"]["name"])
        # The ramp from then on, once the running step is over, which takes less than a tick at cruise.
        ramp_ns = sum(delays_before_end_us("bushd2-constant")) * 1000
        self.assertLessEqual(edges[-1].time_ns, levels[1][0] + ACTS_WITHIN_NS + TICK_NS + ramp_ns)

    def test_a_chain_of_closed_contacts_stops_them_immediately_when_it_opens(self):
        self.bring_up_with('emergency_input = "immediate"', 'emergency_active = "open"')
        self.check_stop_by_the_input()
        motors = self.motors()
        self.assertEqual(motors["a0"]["trust"], "uncertain")
        self.assertIn("the emergency input of MCU hall:1", motors["a0"]["uncertain_reason"])
        self.assertEqual(motors["a1"]["trust"], "known")
        self.end_all()
        levels = changes(self.file("trace.vcd"), "emergency")
        self.assertEqual([level for _, level in levels], [0, 1, 0, 1], "closed from the beginning")
        self.assertLessEqual(self.steps_of_a0()[-1], levels[2][0] + ACTS_WITHIN_NS)

    def check_only_a0_lost_its_power(self, other):
        motors = self.motors()
        self.assertFalse(motors["a0"]["enabled"])
        self.assertTrue(motors["b1"]["moving"], "the other MCU's motors go on")
        self.assertEqual({name: motors[name]["trust"] for name in ("a0", "a1", "b0")}, {"a0": "uncertain", "a1": "known", "b0": "known"})
        self.command("stop", "b1")
        other.process.wait(GIVE_UP_S)

    def clear_enable_and_move(self):
        self.command("clear", "a0")
        self.assertFalse(self.motors()["a0"]["enabled"], "they stay disabled")
        self.command("enable", "a0")
        self.command("set", "a0", "0")
        self.command("move", "--wait", "a0", "-5")

    def test_an_emergency_input_takes_the_power_within_a_slot(self):
        self.bring_up_with('emergency_input = "disable"')
        mine, other = self.start_both()
        self.press("E")
        self.assertEqual(mine.process.wait(GIVE_UP_S), 1)
        self.assertIn("a0: stopped immediately by the emergency input of MCU hall:1, which disabled its drivers", mine.said())
        self.wait_until_said("emergency input, its drivers are disabled; release it, then run 'bushctl clear', then 'bushctl enable'")
        self.check_only_a0_lost_its_power(other)
        self.assertEqual(self.bushctl("enable", "a0").returncode, 1)
        self.press("E")
        self.wait_until_said("emergency input, released by now")
        self.clear_enable_and_move()
        self.end_all()
        pressed = next(time for time, level in changes(self.file("trace.vcd"), "emergency") if level == 1)
        enabled = changes(self.file("trace.vcd"), "en")
        self.assertEqual([level for _, level in enabled][-3:], [1, 0, 1])
        self.assertLessEqual(enabled[-2][0], pressed + TICK_NS // 128)
        self.assertFalse([time for time in self.steps_of_a0() if pressed + ACTS_WITHIN_NS < time < enabled[-1][0]])

    def test_overcurrent_disables_the_drivers_until_they_are_enabled(self):
        self.bring_up_with("overcurrent = 900")
        mine, other = self.start_both()
        self.press("O")
        self.assertEqual(mine.process.wait(GIVE_UP_S), 1)
        self.assertIn("a0: fault", mine.said())
        self.wait_until_said("overcurrent, its drivers are disabled (reading now: 1023")
        self.check_only_a0_lost_its_power(other)
        self.assertEqual(self.bushctl("clear", "a0").returncode, 1, "the cause persists")
        self.assertEqual(self.bushctl("enable", "a0").returncode, 1)
        self.press("O")
        self.wait_until_said("reading now: 0")
        self.clear_enable_and_move()
        self.end_all()
        short = next(time for time, reading in changes(self.file("trace.vcd"), "supply") if reading == 1023)
        enabled = changes(self.file("trace.vcd"), "en")
        self.assertEqual([level for _, level in enabled][-3:], [1, 0, 1])
        self.assertLessEqual(enabled[-2][0], short + ACTS_WITHIN_NS)
        # No step from the first tick on that is not prepared.
        self.assertFalse([time for time in self.steps_of_a0() if enabled[-2][0] + 2 * TICK_NS < time < enabled[-1][0]])

    def reset_cause(self):
        """The cause of the last reset of MCU 1, as health has it."""
        return json.loads(self.command("health", "--json").stdout)["buses"][0]["mcus"][0]["reset_cause"]

    def check_reset(self, key, enable_after_reset):
        """From the falling edge of EN to the next rising one, in ns."""
        self.bring_up_with(f'enable_after_reset = "{enable_after_reset}"')
        self.assertTrue(self.motors()["a0"]["enabled"])
        before = self.status()["mcus"][0]["boot_number"]
        self.press(key)
        self.wait_until("the MCU to boot again", lambda: self.status()["mcus"][0]["boot_number"] not in (0, before))
        self.wait_until("the cause to be told", lambda: self.reset_cause() == ("watchdog" if key == "W" else "external"))
        if enable_after_reset == "no":
            self.wait_until_said("drivers disabled")
            self.assertFalse(self.motors()["a0"]["enabled"])
            self.command("enable", "a0")
        self.wait_until_ready()
        self.wait_until("the drivers to be enabled", lambda: self.motors()["a0"]["enabled"])
        self.end_all()
        enabled = changes(self.file("trace.vcd"), "en")
        self.assertEqual([level for _, level in enabled], [0, 1, 0, 1])
        return enabled[3][0] - enabled[2][0]

    def test_after_a_watchdog_reset_drivers_are_enabled_by_the_daemon(self):
        self.assertGreater(self.check_reset("W", "ready"), POLL_NS)

    def test_after_a_watchdog_reset_drivers_are_enabled_by_people_only(self):
        self.check_reset("W", "no")

    def test_after_a_watchdog_reset_the_mcu_enables_them_at_once(self):
        self.assertLess(self.check_reset("W", "at_once"), POLL_NS)

    def test_after_a_pulse_at_reset_it_does_not(self):
        self.assertGreater(self.check_reset("P", "at_once"), POLL_NS)

    def test_a_move_begins_three_ticks_and_its_delay_after_the_edge_of_the_trigger(self):
        self.bring_up_with()
        armed = self.start_bushctl("arm", "--wait", "--delay-us", 700, "a0", 20)
        self.wait_until("the motor to be armed", lambda: self.motors()["a0"]["activity"] == "armed")
        self.bushsim.send(signal.SIGRTMIN)
        self.assertEqual(armed.process.wait(GIVE_UP_S), 0, armed.said())
        self.end_all()
        edge_ns = changes(self.file("trace.vcd"), "trigger")[1][0]
        table = tomllib.loads((TOP / "tables" / "bushd2-constant.toml").read_text())
        first_ns = edge_ns + 3 * TICK_NS + 700_000 + table["accel"][0] * table["time_unit_ns"]
        # Half a slot of 1/128 tick, and 5 us, to which MCUs in step note times (docs/protocol.md, Time).
        self.assertAlmostEqual(self.steps_of_a0()[0], first_ns, delta=TICK_NS / 256 + 5_000)


if __name__ == "__main__":
    unittest.main()
