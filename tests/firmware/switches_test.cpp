// MOTOR_INPUTS: limit and home switches at any inputs of the MCU. That a motor without it has its
// one input, as ever, is in inputs_test.cpp; homing among switches is in homing_switches_test.cpp.
#include "firmware/switches.h"

#include <array>

namespace bushd::test {
namespace {

BUSHD_IN_BOTH_FORMATS(Switches);

TEST_P(Switches, EachEndHasItsOwn) {
  wire();
  for (const unsigned other : {1u, 3u, 0u, 15u}) {
    pins(bit(other));
    expect_forbidden(0, 0);
  }
  pins(bit(9));
  expect_forbidden(kSwitchedBit, 0);
  EXPECT_EQ(start(kSwitched, 5), BUSHD_E_FORBIDDEN);
  EXPECT_EQ(start(kSwitched, -5), BUSHD_OK);
  rig.pass_until_rest();
  pins(bit(14));
  expect_forbidden(0, kSwitchedBit);
  EXPECT_EQ(start(kSwitched, -5), BUSHD_E_FORBIDDEN);
  EXPECT_EQ(start(kSwitched, 5), BUSHD_OK);
  rig.pass_until_rest();
  pins(bit(9) | bit(14));
  expect_forbidden(kSwitchedBit, kSwitchedBit);
  expect_position(kSwitched, 0);
}

TEST_P(Switches, AnInputOfAHighNumberStopsItsMotorAlone) {
  wire({kSwitched, 15, 14, kSwitched});
  for (const std::uint8_t motor : {kSwitched, std::uint8_t{15}}) {
    ASSERT_EQ(start(motor, 50), BUSHD_OK);
  }
  rig.pass(20);
  pins(bit(15));
  rig.pass_until_rest();
  EXPECT_LT(rig.pulses(kSwitched), 50);
  EXPECT_GT(rig.pulses(kSwitched), 0);
  EXPECT_EQ(rig.pulses(15), 50);
  EXPECT_EQ(rig.poll().inputs, bit(15));
  EXPECT_EQ(rig.poll().forbidden_positive, kSwitchedBit);
}

TEST_P(Switches, AHitSwitchInhibitsUntilItIsLeft) {
  wire();
  run_into(bit(9));
  rig.pass(2);
  pins(0);  // overrun
  rig.pass_until_rest();
  expect_forbidden(kSwitchedBit, 0);
  rig.run_plan(plan(-3), kSwitched);
  expect_forbidden(0, 0);
}

// The switch opens by the last step of the way back, and the motor stands when that counts.
TEST_P(Switches, AHitSwitchThatTheLastStepLeavesInhibitsNoMore) {
  for (const std::uint8_t debounce_ticks : std::to_array<std::uint8_t>({0, 1, 5, 15})) {
    SCOPED_TRACE(int{debounce_ticks});
    InputSettings settings = both();
    settings.debounce_ticks = debounce_ticks;
    wire(kApart, settings);
    const std::int64_t end = rig.pulses(kSwitched) + 20;
    rig.sense = [this, end] {
      const bool closed = rig.pulses(kSwitched) >= end;
      return bushd_inputs{closed ? bit(9) : std::uint16_t{0}, 0};
    };
    ASSERT_EQ(start(kSwitched, 400), BUSHD_OK);
    rig.pass_until_rest();
    const int beyond = static_cast<int>(rig.pulses(kSwitched) - end);
    ASSERT_GE(beyond, 0);
    expect_forbidden(kSwitchedBit, 0);
    rig.run_plan(plan(-beyond), kSwitched);
    ASSERT_EQ(rig.pulses(kSwitched), end);
    rig.pass(50);
    expect_forbidden(kSwitchedBit, 0);
    rig.run_plan(plan(-1), kSwitched);
    rig.pass(debounce_ticks);
    expect_forbidden(0, 0);
    EXPECT_EQ(start(kSwitched, 5), BUSHD_OK);
    rig.pass_until_rest();
    rig.run_plan(plan(-100), kSwitched);
  }
}

// It may bounce: when it closes again at rest nothing tells at which end that is.
TEST_P(Switches, OneSwitchForBothEndsThatOpensAtRestStillInhibits) {
  wire({kSwitched, 12, 12, 12});
  run_into(bit(12));
  rig.pass_until_rest();
  expect_forbidden(kSwitchedBit, 0);
  rig.run_plan(plan(-1), kSwitched);
  for (const std::uint16_t level : {std::uint16_t{0}, bit(12), std::uint16_t{0}}) {
    pins(level);
    rig.pass(50);
    expect_forbidden(kSwitchedBit, 0);
  }
  rig.run_plan(plan(-1), kSwitched);
  expect_forbidden(0, 0);
}

// Nobody has seen it leave one that it has overrun and that opens by itself.
TEST_P(Switches, AHitSwitchThatOpensAtRestStillInhibits) {
  wire();
  run_into(bit(9));
  rig.pass_until_rest();
  pins(0);
  rig.pass(50);
  expect_forbidden(kSwitchedBit, 0);
  EXPECT_EQ(start(kSwitched, 5), BUSHD_E_FORBIDDEN);
}

TEST_P(Switches, LevelsAreThoseOfInputs) {
  InputSettings settings = both();
  settings.inverted = bit(9);  // a contact that opens
  pins(bit(9));
  wire(kApart, settings);
  expect_forbidden(0, 0);
  EXPECT_EQ(rig.poll().inputs, 0);
  pins(0);
  expect_forbidden(kSwitchedBit, 0);
  EXPECT_EQ(rig.poll().inputs, bit(9));
  pins(bit(9) | bit(14));
  expect_forbidden(0, kSwitchedBit);
}

TEST_P(Switches, OneSwitchForBothEndsMayBeAnyInput) {
  wire({kSwitched, 12, 12, 12});
  ASSERT_EQ(start(kSwitched, -50), BUSHD_OK);
  rig.pass(20);
  pins(bit(12));
  rig.pass_until_rest();
  expect_forbidden(0, kSwitchedBit);
}

TEST_P(Switches, AnInputMayStopTwoMotors) {
  constexpr std::uint16_t kTwo = bit(0) | bit(1);
  ASSERT_EQ(rig.set_inputs({.limit_positive = kTwo}), BUSHD_OK);
  ASSERT_EQ(rig.motor_inputs({0, 7, 0, 0}), BUSHD_OK);
  ASSERT_EQ(rig.motor_inputs({1, 7, 1, 1}), BUSHD_OK);
  pins(bit(7));
  expect_forbidden(kTwo, 0);
}

TEST_P(Switches, EachInputIsDebouncedByItself) {
  InputSettings settings = both();
  settings.debounce_ticks = 3;
  wire(kApart, settings);
  pins(bit(9));
  rig.pass(2);
  pins(bit(9) | bit(14));
  rig.pass(2);
  EXPECT_EQ(rig.poll().forbidden_positive, kSwitchedBit);
  EXPECT_EQ(rig.poll().forbidden_negative, 0);
  rig.pass(2);
  EXPECT_EQ(rig.poll().forbidden_negative, kSwitchedBit);
}

TEST_P(Switches, InputsBringsTheDefaultBack) {
  wire();
  pins(bit(9));
  expect_forbidden(kSwitchedBit, 0);
  ASSERT_EQ(rig.set_inputs({.limit_positive = kSwitchedBit}), BUSHD_OK);
  expect_forbidden(0, 0);
  pins(kSwitchedBit);
  expect_forbidden(kSwitchedBit, 0);
}

// As a daemon does that begins anew.
TEST_P(Switches, AHitSwitchInhibitsWhileSettingsAreToldAgain) {
  wire();
  run_into(bit(9));
  rig.pass_until_rest();
  pins(0);
  expect_forbidden(kSwitchedBit, 0);
  wire();
  expect_forbidden(kSwitchedBit, 0);
  ASSERT_EQ(rig.set_inputs({.limit_negative = kSwitchedBit}), BUSHD_OK);
  expect_forbidden(0, 0);
}

// Between INPUTS and MOTOR_INPUTS the switch of this motor is another one: nobody may move it by
// the local inputs then, and if the line breaks there, not until a master has told all.
TEST_P(Switches, LocalMotionWaitsUntilAllOfTheConfigurationIsThere) {
  const auto press = [this](std::uint16_t inputs, std::uint8_t system) {
    rig.pins({inputs, 0});
    rig.pass(3);
    rig.pins({inputs, system});
    rig.pass(100);
  };
  wire();
  ASSERT_EQ(rig.local(kSwitchedBit), BUSHD_OK);
  press(bit(9), BUSHD_INPUT_FORWARD);
  EXPECT_EQ(rig.pulses(kSwitched), 0) << "it stands at its switch";
  pins(bit(9));
  rig.pass(3);
  ASSERT_EQ(rig.set_inputs(both()), BUSHD_OK);
  press(bit(9), BUSHD_INPUT_FORWARD);
  EXPECT_EQ(rig.pulses(kSwitched), 0) << "half of it is there";
  ASSERT_EQ(rig.motor_inputs(kApart), BUSHD_OK);
  rig.pass(100);
  press(bit(9), BUSHD_INPUT_REVERSE);
  EXPECT_EQ(rig.pulses(kSwitched), 0) << "all but the end";
  ASSERT_EQ(rig.local(kSwitchedBit), BUSHD_OK);
  rig.pass(100);
  EXPECT_EQ(rig.pulses(kSwitched), 0) << "what is held then must be pressed anew";
  press(bit(9), BUSHD_INPUT_FORWARD);
  EXPECT_EQ(rig.pulses(kSwitched), 0);
  press(bit(9), BUSHD_INPUT_REVERSE);
  EXPECT_LT(rig.pulses(kSwitched), 0);
  rig.pins({});
  expect_rest_as_counted();
}

// A half of it is not kept over resets.
TEST_P(Switches, AHalfConfigurationIsNotKept) {
  bushd_mcu_nvm_scan scan{};
  const auto is_quiet = [&] {
    bool quiet = false;
    for (int ticks = 0; ticks < 2000; ++ticks) {
      rig.pass();
      bushd_mcu_nvm_begin_scan(&scan);
      while (bushd_mcu_nvm_scan_next(rig.mutable_mcu(), &scan, 64).at != nullptr) {
      }
      quiet = bushd_mcu_nvm_is_quiet(&rig.mcu(), &scan);
    }
    return quiet;
  };
  ASSERT_EQ(rig.local(kSwitchedBit), BUSHD_OK);
  EXPECT_TRUE(is_quiet());
  ASSERT_EQ(rig.set_inputs(both()), BUSHD_OK);
  EXPECT_FALSE(is_quiet());
  ASSERT_EQ(rig.motor_inputs(kApart), BUSHD_OK);
  EXPECT_FALSE(is_quiet());
  ASSERT_EQ(rig.local(kSwitchedBit), BUSHD_OK);
  EXPECT_TRUE(is_quiet());
}

TEST_P(Switches, SettingsOutlastAReset) {
  wire();
  rig.restart_with_nvm();
  pins(bit(14));
  expect_forbidden(0, kSwitchedBit);
}

TEST_P(Switches, WhatCannotBeIsRefused) {
  for (const bushd_motor_inputs& bad : std::array<bushd_motor_inputs, 4>{
           {{4, 0, 0, 0}, {0, 4, 0, 0}, {0, 0, 4, 0}, {0, 0, 0, 4}}}) {
    EXPECT_EQ(Rig().motor_inputs(bad), BUSHD_E_FORMAT) << "four motors and inputs: 0..3";
  }
  EXPECT_EQ(rig.request(BUSHD_MSG_MOTOR_INPUTS, {1, 2, 3}), BUSHD_E_LENGTH);
  ASSERT_EQ(start(0, 40), BUSHD_OK);
  EXPECT_EQ(rig.motor_inputs(kApart), BUSHD_E_STATE) << "a motor moves";
  Rig small({.disabled_capabilities = BUSHD_CAN_MOTOR_INPUTS});
  EXPECT_EQ(small.identify().capabilities & BUSHD_CAN_MOTOR_INPUTS, 0);
  EXPECT_EQ(small.motor_inputs({0, 0, 0, 0}), BUSHD_E_UNKNOWN_MESSAGE);
}

}  // namespace
}  // namespace bushd::test
