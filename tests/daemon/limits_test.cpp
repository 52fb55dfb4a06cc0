// Limit switches, emergency inputs, overcurrent and watchdog resets, from the switch to the client.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>

#include "daemon/lab.h"

namespace bushd::test {
namespace {

using testing::HasSubstr;

// Two motors on one MCU; `keys` are of it, `motor_keys` of m01.
std::string lab_with(const std::string& manner, const std::string& keys,
                     const std::string& motor_keys) {
  return with_mcu_keys(with_keys(hall(1, 2, manner), "m01", motor_keys), keys);
}

class Limits : public testing::TestWithParam<const char*> {
 protected:
  static void press(Lab& lab, std::uint16_t motors, std::uint8_t system = 0) {
    lab.bus(0).mcu(0).set_inputs({motors, system});
  }
  // m01 and m02 move, and m01 meets its switch.
  static Answer meet_switch(Lab& lab, std::int64_t steps) {
    const auto move = lab.send(Ask::kMoveBy, {"m01", "m02"}, {steps, 3000});
    EXPECT_TRUE(lab.run_until([&] { return std::abs(lab.shaft_steps("m01")) > 500; }));
    press(lab, 1);
    return lab.wait(move);
  }
};
INSTANTIATE_TEST_SUITE_P(Manners, Limits,
                         testing::Values("fine", "coarse", "fine_ticks", "coarse_ticks",
                                         "fine_table", "coarse_table"),
                         [](const auto& manner) { return std::string(manner.param); });

TEST_P(Limits, AMoveEndsAtTheSwitchAndTheWayBackIsFree) {
  for (const int sign : {1, -1}) {
    const std::string end = sign > 0 ? "positive" : "negative";
    ReadyLab lab(lab_with(GetParam(), "", "limit = \"" + end + "\"\n"));
    const Answer result = meet_switch(lab, sign * 20000);
    EXPECT_THAT(result, Ends("limit", "m01"));
    EXPECT_THAT(result.reason, HasSubstr(end + " end"));
    EXPECT_EQ(result.motor_results, (std::vector<std::string>{"limit", "reached"}));
    const std::int64_t stands = lab.shaft_steps("m01");
    EXPECT_EQ(result.position_steps.at(0), stands);
    EXPECT_THAT(result.reason, HasSubstr(std::to_string(stands)));
    EXPECT_GT(std::abs(stands), 500);
    EXPECT_LT(std::abs(stands), 1200) << "the table's ramp";
    EXPECT_EQ(lab.shaft_steps("m02"), 3000);
    lab.run_for(0.2);
    EXPECT_EQ(word(lab.motor("m01").inhibited), end);
    EXPECT_EQ(lab.motor("m01").trust, api::Trust::kKnown);
    EXPECT_EQ(lab.state_of("hall:1").state, api::McuState::kReady) << "no fault";

    const Answer refused = lab.last_reply(lab.send(Ask::kMoveBy, {"m01"}, {sign * 10}));
    EXPECT_THAT(refused, Ends("refused", "m01: its limit switch at the " + end + " end"));
    EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m01"}, {sign * -10}).result, "reached");
    const auto back = lab.send(Ask::kMoveBy, {"m01"}, {sign * -200});
    lab.run_for(0.3);
    press(lab, 0);
    EXPECT_EQ(lab.wait(back).result, "reached");
    lab.run_for(0.1);
    EXPECT_EQ(word(lab.motor("m01").inhibited), "");
    EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m01"}, {sign * 20}).result, "reached");
    EXPECT_EQ(lab.shaft_steps("m01"), stands - sign * 190);
    EXPECT_EQ(lab.motor("m01").position_steps, stands - sign * 190);
    EXPECT_TRUE(lab.errors().empty());
  }
}

TEST_P(Limits, OneThatIsCutOffAtItsSwitchMayHaveOverrun) {
  ReadyLab lab(lab_with(GetParam(), "", "limit = \"both\"\nlimit_action = \"immediate\"\n"));
  const Answer result = meet_switch(lab, -20000);
  EXPECT_EQ(result.result, "limit");
  EXPECT_LE(std::abs(lab.shaft_steps("m01")), 560) << "a few ticks at 2500 steps/s";
  EXPECT_EQ(result.position_steps.at(0), lab.shaft_steps("m01"));
  lab.run_for(0.1);
  EXPECT_EQ(word(lab.motor("m01").inhibited), "negative");
  EXPECT_EQ(lab.motor("m01").trust, api::Trust::kUncertain);
}

// The switch closes while the start is on its way.
TEST_P(Limits, AMoveThatTheSwitchForestallsEndsAtTheLimitTheSame) {
  ReadyLab lab(lab_with(GetParam(), "", "limit = \"positive\"\n"));
  const auto move = lab.send(Ask::kMoveBy, {"m01"}, {300});
  press(lab, 1);
  const Answer result = lab.wait(move);
  EXPECT_EQ(result.result, "limit") << result.reason;
  EXPECT_EQ(lab.shaft_steps("m01"), 0);
}

TEST_P(Limits, ANewTargetBeyondTheSwitchEndsThereToo) {
  ReadyLab lab(lab_with(GetParam(), "", "limit = \"positive\"\n"));
  const auto away = lab.send(Ask::kMoveTo, {"m01"}, {-3000});
  ASSERT_TRUE(lab.run_until([&] { return lab.shaft_steps("m01") < -600; }));
  const auto back = lab.send(Ask::kMoveTo, {"m01"}, {5000});
  EXPECT_EQ(lab.wait(away).result, "stopped");
  ASSERT_TRUE(lab.run_until([&] { return lab.shaft_steps("m01") > 300; }));
  press(lab, 1);
  EXPECT_EQ(lab.wait(back).result, "limit");
  EXPECT_EQ(lab.ask(Ask::kMoveTo, {"m01"}, {0}).result, "reached");
  EXPECT_EQ(lab.shaft_steps("m01"), 0);
}

TEST_P(Limits, ASwitchThatOpensWhenItIsMetAndANewDaemon) {
  Lab lab(lab_with(GetParam(), "", "limit = \"negative\"\ninput_active = \"open\"\n"));
  press(lab, 1);
  lab.connect();
  EXPECT_FALSE(lab.motor("m01").input);
  press(lab, 0);
  lab.run_for(0.2);
  EXPECT_TRUE(lab.motor("m01").input);
  EXPECT_EQ(word(lab.motor("m01").inhibited), "negative");
  lab.restart_daemon();
  lab.connect();
  EXPECT_EQ(lab.last_reply(lab.send(Ask::kMoveBy, {"m01"}, {-1})).result, "refused");
  EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m01"}, {1}).result, "reached");
}

TEST_P(Limits, TheEmergencyInputStopsAllMotorsOfItsMcuUntilItIsClearedAndReleased) {
  for (const bool immediate : {false, true}) {
    ReadyLab lab(lab_with(
        GetParam(),
        immediate ? "emergency_input = \"immediate\"\n" : "emergency_input = \"ramp\"\n", ""));
    const auto move = lab.send(Ask::kMoveBy, {"m01", "m02"}, {20000, -20000});
    lab.run_for(1.5);
    const std::int64_t at = lab.shaft_steps("m01");
    press(lab, 0, BUSHD_INPUT_EMERGENCY);
    const Answer result = lab.wait(move);
    EXPECT_THAT(result, Ends("stopped", "emergency input of MCU hall:1"));
    EXPECT_EQ(result.position_steps.at(1), lab.shaft_steps("m02"));
    EXPECT_EQ(lab.shaft_steps("m01") - at > 100, !immediate);
    lab.run_for(0.1);
    EXPECT_EQ(lab.motor("m01").trust, immediate ? api::Trust::kUncertain : api::Trust::kKnown);
    EXPECT_EQ(lab.state_of("hall:1").state, api::McuState::kFault);
    EXPECT_EQ(lab.state_of("hall:1").inputs, "emergency");
    EXPECT_THAT(lab.state_of("hall:1").detail, HasSubstr("release it"));
    EXPECT_THAT(lab.ask(Ask::kClearFaults, {}), Ends("fault", "emergency input"));
    press(lab, 0);
    lab.restart_daemon();
    ASSERT_TRUE(lab.mcu_comes_to("hall:1", api::McuState::kFault)) << "not for a daemon to clear";
    EXPECT_THAT(lab.last_reply(lab.send(Ask::kMoveBy, {"m01"}, {1})).reason,
                HasSubstr("bushctl clear"));
    EXPECT_EQ(lab.ask(Ask::kClearFaults, {}).result, "done");
    if (immediate) continue;
    EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m01"}, {10}).result, "reached");
  }
}

TEST_P(Limits, AnEmergencyInputThatDisablesTakesThePowerAndSaysSo) {
  ReadyLab lab(lab_with(GetParam(), "emergency_input = \"disable\"\n", ""));
  const auto move = lab.send(Ask::kMoveBy, {"m01"}, {20000});
  lab.run_for(1);
  press(lab, 0, BUSHD_INPUT_EMERGENCY);
  press(lab, 0);
  const Answer result = lab.wait(move);
  EXPECT_THAT(result,
              Ends("stopped", "by the emergency input of MCU hall:1, which disabled its drivers"));
  lab.run_for(0.1);
  EXPECT_EQ(lab.motor("m01").uncertain_reason,
            "its drivers were disabled by the emergency input of MCU hall:1 while it moved");
  EXPECT_EQ(lab.motor("m02").trust, api::Trust::kKnown) << "it did not move";
  EXPECT_FALSE(lab.motor("m01").enabled);
  EXPECT_EQ(lab.state_of("hall:1").detail,
            "emergency input, released by now, its drivers are disabled; run 'bushctl clear', then "
            "'bushctl enable'");
  lab.restart_daemon();
  ASSERT_TRUE(lab.mcu_comes_to("hall:1", api::McuState::kFault)) << "not for a daemon to clear";
  EXPECT_EQ(lab.ask(Ask::kClearFaults, {}).result, "done");
  lab.run_for(0.1);
  EXPECT_FALSE(lab.motor("m01").enabled);
  EXPECT_EQ(lab.ask(Ask::kEnable, {}).result, "done");
  EXPECT_EQ(lab.ask(Ask::kSetPosition, {"m02"}, {0}).result, "done");
  EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m02"}, {10}).result, "reached");
}

TEST_P(Limits, OvercurrentTakesThePowerAndSaysSo) {
  ReadyLab lab(lab_with(GetParam(), "overcurrent = 800\n", ""));
  const auto move = lab.send(Ask::kMoveBy, {"m01"}, {20000});
  lab.run_for(1);
  lab.bus(0).mcu(0).set_current(801);
  const Answer result = lab.wait(move);
  EXPECT_THAT(result, Ends("fault", "supply current"));
  lab.run_for(0.1);
  EXPECT_THAT(lab.state_of("hall:1").detail, HasSubstr("overcurrent"));
  EXPECT_EQ(lab.motor("m01").trust, api::Trust::kUncertain);
  EXPECT_EQ(lab.motor("m02").trust, api::Trust::kKnown) << "it did not move";
  EXPECT_FALSE(lab.motor("m01").enabled);
  EXPECT_EQ(lab.mcu_health("hall:1").current, 801);
  // Neither a lost link nor a new daemon puts it back.
  lab.bus(0).mcu(0).set_current(0);
  lab.unplug(0, 2);
  lab.run_for(3);
  EXPECT_FALSE(lab.motor("m01").enabled);
  EXPECT_EQ(lab.state_of("hall:1").state, api::McuState::kFault);
  EXPECT_EQ(lab.ask(Ask::kClearFaults, {}).result, "done");
  lab.run_for(0.1);
  EXPECT_THAT(lab.state_of("hall:1").detail, HasSubstr("drivers disabled"));
  EXPECT_EQ(lab.ask(Ask::kEnable, {}).result, "done");
  EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m02"}, {10}).result, "reached");
}

TEST_P(Limits, OvercurrentBeforeTheFirstStepLeavesThePositionKnown) {
  ReadyLab lab(lab_with(GetParam(), "overcurrent = 800\n", ""));
  const auto move = lab.send(Ask::kMoveBy, {"m01"}, {20000});
  lab.bus(0).mcu(0).set_current(801);
  const Answer result = lab.wait(move);
  EXPECT_THAT(result, Ends("fault", "supply current"));
  EXPECT_THAT(result.reason, HasSubstr("m01: it did not move"));
  lab.run_for(0.1);
  EXPECT_EQ(lab.shaft_steps("m01"), 0);
  EXPECT_EQ(lab.motor("m01").trust, api::Trust::kKnown);
}

// Whatever switches do: one result a move, and the daemon knows where the motors stand.
TEST_P(Limits, NoStepIsLostHoweverSwitchesBounce) {
  for (unsigned seed = 0; seed < 12; ++seed) {
    SCOPED_TRACE(seed);
    std::mt19937 random(seed);
    const auto below = [&random](unsigned n) { return static_cast<int>(random() % n); };
    const char* const ends[] = {"positive", "negative", "both"};
    ReadyLab lab(lab_with(GetParam(), "debounce_ticks = " + std::to_string(below(4)) + "\n",
                          "limit = \"" + std::string(ends[below(3)]) + "\"\n"));
    for (int i = 0; i < 8; ++i) {
      const auto move =
          lab.send(Ask::kMoveBy, {"m01", "m02"}, {below(3000) - 1500, below(3000) - 1500});
      for (int k = below(40); k > 0 && !lab.has_result(move); --k) {
        lab.run_for(0.01 * below(20));
        press(lab, static_cast<std::uint16_t>(below(2)));
      }
      if (below(4) == 0) lab.send(Ask::kStop, {});
      const Answer result = lab.wait(move);
      EXPECT_THAT(result.result, testing::AnyOf("reached", "limit", "stopped", "refused"))
          << result.reason;
      lab.run_for(0.2);
      EXPECT_EQ(lab.motor("m01").position_steps, lab.shaft_steps("m01"));
      EXPECT_EQ(lab.motor("m02").position_steps, lab.shaft_steps("m02"));
      EXPECT_EQ(lab.motor("m01").trust, api::Trust::kKnown);
      EXPECT_EQ(lab.state_of("hall:1").state, api::McuState::kReady);
    }
  }
}

// The ramp of an emergency stop is one without power then, and nobody knows where the motor stands.
TEST_P(Limits, OvercurrentOnTheRampOfAnEmergencyStopLeavesThePositionUncertain) {
  ReadyLab lab(lab_with(GetParam(), "overcurrent = 800\n", ""));
  const auto move = lab.send(Ask::kMoveBy, {"m01"}, {20000});
  lab.run_for(3);
  lab.send(Ask::kEmergencyStop, {});
  sim::VirtualMcu& mcu = lab.bus(0).mcu(0);
  ASSERT_TRUE(lab.run_until([&] { return (mcu.core().faults & BUSHD_FAULT_EMERGENCY) != 0; }));
  mcu.set_current(801);
  EXPECT_THAT(lab.wait(move), Ends("fault", "supply current"));
  EXPECT_EQ(lab.motor("m01").trust, api::Trust::kUncertain);
}

class AfterReset : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Settings, AfterReset, testing::Values("ready", "at_once", "no"),
                         [](const auto& setting) { return std::string(setting.param); });

TEST_P(AfterReset, DriversAreAsConfiguredAfterTheWatchdog) {
  const std::string setting = GetParam();
  ReadyLab lab(lab_with("fine", "enable_after_reset = \"" + setting + "\"\n", ""));
  EXPECT_EQ(lab.mcu_health("hall:1").reset_cause, "power-on");
  const auto move = lab.send(Ask::kMoveBy, {"m01"}, {20000});
  lab.run_for(1);
  const std::int32_t boot_number = lab.state_of("hall:1").boot;
  sim::VirtualMcu& mcu = lab.bus(0).mcu(0);
  mcu.set_reset_cause(BUSHD_RESET_WATCHDOG);
  lab.bus(0).reboot(0, 100'000'000);
  EXPECT_EQ(lab.wait(move).result, "link");
  ASSERT_TRUE(lab.run_until([&] { return mcu.running(); }));
  EXPECT_EQ((mcu.core().flags & BUSHD_FLAG_ENABLED) != 0, setting == "at_once");
  lab.run_for(5);
  EXPECT_NE(lab.state_of("hall:1").boot, boot_number);
  EXPECT_EQ(lab.mcu_health("hall:1").reset_cause, "watchdog");
  EXPECT_EQ(lab.motor("m01").trust, api::Trust::kUncertain);
  EXPECT_EQ(lab.motor("m01").enabled, setting != "no");
  EXPECT_EQ(lab.state_of("hall:1").state,
            setting == "no" ? api::McuState::kBusy : api::McuState::kReady);
  if (setting != "no") return;
  EXPECT_EQ(lab.ask(Ask::kEnable, {}).result, "done");
  lab.run_for(0.1);
  EXPECT_TRUE(lab.motor("m01").enabled);
}

TEST(SelfTest, WhatHasFailedIsNamedAndKeepsMotorsOff) {
  Lab lab(hall(1, 1));
  lab.bus(0).mcu(0).fail_self_tests(BUSHD_TEST_RAM | BUSHD_TEST_FLASH);
  ASSERT_TRUE(lab.mcu_comes_to("hall:1", api::McuState::kFault));
  EXPECT_THAT(lab.state_of("hall:1").detail, HasSubstr("self-test failed (RAM, the program's"));
  EXPECT_EQ(lab.last_reply(lab.send(Ask::kMoveBy, {"m01"}, {1})).result, "refused");
  EXPECT_FALSE(lab.motor("m01").enabled);
}

TEST(SelfTest, AnMcuThatLostWhatItKeepsMovesOnceThatIsKnown) {
  Lab lab(hall(1, 1));
  lab.bus(0).mcu(0).fail_self_tests(BUSHD_TEST_EEPROM);
  ASSERT_TRUE(lab.mcu_comes_to("hall:1", api::McuState::kFault));
  EXPECT_THAT(lab.state_of("hall:1").detail, HasSubstr("if its unique id is 0"));
  EXPECT_EQ(lab.ask(Ask::kClearFaults, {}).result, "done");
  EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m01"}, {20}).result, "reached");
}

}  // namespace
}  // namespace bushd::test
