// What an MCU does by itself, an image beside its virtual twin: homing with a switch that bounces,
// motion by local inputs, and coming back after a watchdog reset in motion.
#include <random>

#include "conformance/script.h"
#include "keypad_bytes.h"
#include "sim/switch.h"

namespace bushd::sim::autonomous_test {
namespace {

constexpr std::uint8_t kMotor = 6;

class Autonomous : public TargetScript {
 protected:
  void SetUp() override { ASSERT_NO_FATAL_FAILURE(make_ready(BUSHD_FORMAT_FINE, {kMotor})); }

  // The image hangs; the twin is reset when the image's watchdog has bitten.
  void bite() {
    real_->hang();
    pass_ticks(60);
    bus_.mcu(0).set_reset_cause(BUSHD_RESET_WATCHDOG);
    bus_.reboot(0);
    pass_ticks(120);
  }

  void expect_alike() { Script::expect_alike({kMotor}); }
};
BUSHD_FOR_TARGETS(Autonomous, targets());

class HomingScript : public Autonomous {
 protected:
  static constexpr std::int64_t kAtSteps = -300;

  // Three ticks of bounce are within a slow step.
  static SwitchOptions contact() {
    return {.at_steps = kAtSteps,
            .positive_end = false,
            .hysteresis_steps = 6,
            .bounce_ns = 3 * TimeNs{kTickNs},
            .seed = 5};
  }

  void pass_until_rest() {
    for (int ticks = 0; ticks < 3000; ++ticks) {
      to_inputs_time();
      for (const std::size_t mcu : {0, 1}) {
        const bool active = contacts_[mcu].read(bus_.now_ns(), position(mcu, kMotor));
        bus_.node(mcu).set_inputs({static_cast<std::uint16_t>(active ? 1u << kMotor : 0u), 0});
      }
      if (ticks % 60 == 59 && master_.poll(kReal).moving == 0 &&
          master_.poll(kVirtual).moving == 0) {
        return;
      }
    }
    FAIL() << "it does not come to rest";
  }

  std::array<Switch, 2> contacts_{Switch(contact()), Switch(contact())};  // by MCU
};
BUSHD_FOR_TARGETS(HomingScript, targets());

// Fast approach, ramp-down on the switch, back-off, slow approach, each step in the slot of the
// twin's.
TEST_P(HomingScript, WhereverItComesFromItIsTheSameToOneStep) {
  std::mt19937 random(3);
  for (int i = 0; i < 6; ++i) {
    SCOPED_TRACE("homing " + std::to_string(i));
    run_by_table(master_.poll(kReal).tick + 24,
                 {{kMotor, 0, 1, 20 + static_cast<std::uint32_t>(random() % 400), 0}});
    ASSERT_NO_FATAL_FAILURE(pass_until_rest());
    home({kMotor, -1, 5000, 0, 400, 1000, 0});
    ASSERT_NO_FATAL_FAILURE(pass_until_rest());
    const bushd_report report = master_.poll(kReal);
    EXPECT_EQ(report.homing, BUSHD_HOMING_DONE);
    EXPECT_EQ(report.homed, 1 << kMotor);
    const std::int64_t off = position(1, kMotor) - kAtSteps - report.motor[kMotor].position_steps;
    EXPECT_LE(std::abs(off), 1) << "the counter is 0 where the switch closes";
    expect_alike();
  }
}

TEST_P(Autonomous, LocalInputsMoveItsMotorsWhileTheyAreHeld) {
  ASSERT_NO_FATAL_FAILURE(ask(bushd_local{1 << kMotor, 0, 0}));
  for (const std::uint8_t button : {BUSHD_INPUT_FORWARD, BUSHD_INPUT_REVERSE}) {
    const std::size_t before = steps(1, kMotor).size();
    const std::int32_t from_steps = master_.poll(kReal).motor[kMotor].position_steps;
    to_inputs_time();
    set_inputs({0, button});
    pass_ticks(120);
    const bushd_report held = master_.poll(kReal);
    EXPECT_EQ(held.autonomous, 1 << kMotor);
    EXPECT_EQ(held.motor[kMotor].position_steps > from_steps, button == BUSHD_INPUT_FORWARD);
    const std::size_t until_released = steps(1, kMotor).size();
    EXPECT_GT(until_released, before + 200) << "0.9 ms a step";
    to_inputs_time();
    set_inputs({});
    pass_ticks(60);
    EXPECT_EQ(master_.poll(kReal).moving, 0);
    EXPECT_LT(steps(1, kMotor).size(), until_released + 30) << "it ramps down";
    expect_alike();
  }
}

TEST_P(Autonomous, ItMovesNoFurtherThanPositionsAreCounted) {
  constexpr std::int32_t kLeft = 50;
  ASSERT_NO_FATAL_FAILURE(ask(bushd_local{1 << kMotor, 0, 0}));
  for (const int sign : {1, -1}) {
    ASSERT_NO_FATAL_FAILURE(ask(bushd_set_position{kMotor, sign * (INT32_MAX - kLeft)}));
    ASSERT_NO_FATAL_FAILURE(ask(bushd_home{kMotor, -1, 5000, 0, 400, 1000, 0}, BUSHD_E_FORMAT));
    const std::size_t before = steps(1, kMotor).size();
    to_inputs_time();
    set_inputs(
        {0, static_cast<std::uint8_t>(sign > 0 ? BUSHD_INPUT_FORWARD : BUSHD_INPUT_REVERSE)});
    pass_ticks(120);
    EXPECT_EQ(master_.poll(kReal).motor[kMotor].position_steps, sign * INT32_MAX);
    EXPECT_EQ(steps(1, kMotor).size() - before, static_cast<std::size_t>(kLeft));
    to_inputs_time();
    set_inputs({});
    pass_ticks(20);
    EXPECT_EQ(master_.poll(kReal).moving, 0);
    expect_alike();
  }
}

// Half a configuration moves nothing, and what a master takes away ramps down.
TEST_P(Autonomous, LocalMotionIsAMastersToBeginAndToEnd) {
  const auto press = [this](std::uint8_t button, int ticks) {
    to_inputs_time();
    set_inputs({0, button});
    pass_ticks(ticks);
  };
  constexpr bushd_local kOne{1 << kMotor, 0, 0};
  ASSERT_NO_FATAL_FAILURE(ask(kOne));
  ASSERT_NO_FATAL_FAILURE(ask(bushd_set_inputs{}));
  press(BUSHD_INPUT_FORWARD, 60);
  EXPECT_EQ(steps(1, kMotor).size(), 0u);
  ASSERT_NO_FATAL_FAILURE(ask(kOne));
  press(0, 10);
  press(BUSHD_INPUT_FORWARD, 60);
  ASSERT_NO_FATAL_FAILURE(ask(bushd_local{}));
  pass_ticks(60);
  EXPECT_EQ(master_.poll(kReal).moving, 0);
  const std::size_t made = steps(1, kMotor).size();
  EXPECT_GT(made, 50u);
  ASSERT_NO_FATAL_FAILURE(ask(kOne));
  pass_ticks(60);
  EXPECT_EQ(steps(1, kMotor).size(), made) << "held all the time";
  press(0, 10);
  press(BUSHD_INPUT_REVERSE, 60);
  press(0, 60);
  EXPECT_GT(steps(1, kMotor).size(), made);
}

class KeypadLine : public Autonomous {};
BUSHD_FOR_TARGETS(KeypadLine, targets_with(BUSHD_CAN_KEYPAD));

class DeniedKeypad : public Autonomous {};
BUSHD_FOR_TARGETS(DeniedKeypad, targets_without(BUSHD_CAN_KEYPAD));

TEST_P(DeniedKeypad, IsRefused) {
  ASSERT_NO_FATAL_FAILURE(ask(bushd_local{0, 1 << kMotor, 100}, BUSHD_E_FORMAT));
  expect_the_same_reports();
}

TEST_P(KeypadLine, MovesItsMotors) {
  ASSERT_NO_FATAL_FAILURE(ask(bushd_local{0, 1 << kMotor, 100}));
  pass_ticks(200);  // 0.5 s: a key that is held would have been repeated
  using enum test::KeypadByte;
  const auto press = [this](std::uint8_t key, int ticks) {
    to_inputs_time();
    for (std::size_t i = 0; i < 2; ++i) bus_.node(i).keypad_byte(key, bus_.now_ns());
    pass_ticks(ticks);
  };
  press(kKeyForward, 60);
  EXPECT_EQ(master_.poll(kReal).autonomous, 1 << kMotor);
  press(kKeySlower, 20);
  press(kKeyForward, 40);
  press(kKeyReverse, 60);
  press(kKeyStop, 20);
  EXPECT_EQ(master_.poll(kReal).moving, 0);
  const std::size_t made = steps(1, kMotor).size();
  EXPECT_GT(made, 100u) << "3 ms and 3.3 ms a step";
  expect_alike();
  // Not repeated: for 100 ticks, and its ramp.
  press(kKeyForward, 160);
  EXPECT_EQ(master_.poll(kReal).moving, 0);
  EXPECT_NEAR(static_cast<double>(steps(1, kMotor).size() - made), 100 * 2.56 / 3.3, 4);
  expect_alike();
}

class VelocityLoop : public Autonomous {};
BUSHD_FOR_TARGETS(VelocityLoop, targets_with(BUSHD_CAN_VELOCITY));

class DeniedVelocity : public Autonomous {};
BUSHD_FOR_TARGETS(DeniedVelocity, targets_without(BUSHD_CAN_VELOCITY));

// Local motion goes by the table then.
TEST_P(DeniedVelocity, IsRefusedAndLocalInputsMoveByTheTable) {
  ASSERT_NO_FATAL_FAILURE(
      ask(bushd_set_velocity{kMotor, 200 * 64, 1500 * 64, 3000}, BUSHD_E_UNKNOWN_MESSAGE));
  ASSERT_NO_FATAL_FAILURE(ask(bushd_local{1 << kMotor, 0, 0}));
  to_inputs_time();
  set_inputs({0, BUSHD_INPUT_FORWARD});
  pass_ticks(60);
  to_inputs_time();
  set_inputs({});
  pass_ticks(60);
  EXPECT_GT(steps(1, kMotor).size(), 0u);
  expect_alike();
}

TEST_P(VelocityLoop, LocalInputsMoveAMotor) {
  constexpr std::uint8_t kFirst = 0;
  ASSERT_NO_FATAL_FAILURE(ask(bushd_set_velocity{kFirst, 200 * 64, 1500 * 64, 3000}));
  ASSERT_NO_FATAL_FAILURE(ask(bushd_local{1 << kFirst, 0, 0}));
  for (const std::uint8_t button : {BUSHD_INPUT_FORWARD, BUSHD_INPUT_REVERSE}) {
    to_inputs_time();
    set_inputs({0, button});
    pass_ticks(250);
    EXPECT_EQ(master_.poll(kReal).autonomous, 1 << kFirst) << "turns without rest";
  }
  to_inputs_time();
  set_inputs({});
  pass_ticks(300);
  EXPECT_EQ(master_.poll(kReal).moving, 0);
  EXPECT_GT(steps(1, kFirst).size(), 800u);
  Script::expect_alike({kFirst});
}

TEST_P(Autonomous, AWatchdogResetInMotionIsToldAndLeavesEnAsItWasAskedFor) {
  for (const bool keeps_enable : {false, true}) {
    SCOPED_TRACE(keeps_enable);
    bushd_set_inputs inputs{};
    inputs.enable_after_watchdog = keeps_enable;
    ASSERT_NO_FATAL_FAILURE(ask(inputs));
    run_by_table(master_.poll(kReal).tick + 24, {{kMotor, 0, 1, 10'000, 0}});
    pass_ticks(60);
    const bushd_report before = master_.poll(kReal);
    ASSERT_EQ(before.running, 1 << kMotor);
    const TimeNs hung_ns = bus_.now_ns();
    bite();
    std::size_t falls = 0;
    for (const TimeNs fall_ns : recorder_.times(1, Signal::kEnable, 0, false)) {
      if (fall_ns < hung_ns) continue;
      ++falls;
      EXPECT_LT(fall_ns - hung_ns, 150'000'000);
    }
    EXPECT_EQ(falls, 1u);
    const bushd_report after = master_.poll(kReal);
    EXPECT_EQ(after.boot_number, before.boot_number + 1);
    EXPECT_EQ(after.reset_cause, BUSHD_RESET_WATCHDOG);
    EXPECT_EQ(after.state, BUSHD_STATE_BUSY);
    EXPECT_EQ((after.flags & BUSHD_FLAG_ENABLED) != 0, keeps_enable);
    EXPECT_EQ(after.motor[kMotor].position_steps, 0);
    if (keeps_enable) {
      bite();  // once more, before a master has told it anything
      EXPECT_TRUE(master_.poll(kReal).flags & BUSHD_FLAG_ENABLED);
    }
    EXPECT_EQ(master_.poll(kVirtual).reset_cause, after.reset_cause);
    expect_the_same_reports();

    // And it goes on.
    const std::array<std::size_t, 2> made = {steps(0, kMotor).size(), steps(1, kMotor).size()};
    ASSERT_NO_FATAL_FAILURE(make_ready(BUSHD_FORMAT_FINE, {kMotor}));
    run_by_table(master_.poll(kReal).tick + 24, {{kMotor, 0, -1, 50, 0}});
    pass_ticks(100);
    for (const std::size_t mcu : {0, 1}) EXPECT_EQ(steps(mcu, kMotor).size(), made[mcu] + 50);
    EXPECT_EQ(master_.poll(kReal).motor[kMotor].position_steps, -50);
    expect_the_same_reports();
  }
}

// The port switches EN off although the core hangs; and the reset must not undo that.
TEST_P(Autonomous, APressWhileItHangsKeepsEnOffOverTheWatchdogReset) {
  bushd_set_inputs inputs{};
  inputs.enable_after_watchdog = true;
  inputs.emergency = BUSHD_EMERGENCY_INPUT_DISABLE;
  ASSERT_NO_FATAL_FAILURE(ask(inputs));
  real_->hang();
  pass_ticks(4);
  const TimeNs pressed_ns = bus_.now_ns();
  set_inputs({0, BUSHD_INPUT_EMERGENCY});
  pass_ticks(1);
  set_inputs({});
  const auto falls = recorder_.times(1, Signal::kEnable, 0, false);
  ASSERT_EQ(falls.size(), 1u) << "by its interrupt, without the core";
  EXPECT_LE(falls[0], pressed_ns + kTickNs);
  recorder_.edges.clear();
  pass_ticks(180);
  const bushd_report after = master_.poll(kReal);
  EXPECT_EQ(after.reset_cause, BUSHD_RESET_WATCHDOG);
  EXPECT_EQ(after.flags & BUSHD_FLAG_ENABLED, 0);
  EXPECT_EQ(recorder_.times(1, Signal::kEnable, 0, true).size(), 0u);
}

}  // namespace
}  // namespace bushd::sim::autonomous_test
