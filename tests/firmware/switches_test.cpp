// MOTOR_INPUTS: limit and home switches at any inputs of the MCU, and homing among them. That a
// motor without it has its one input, as ever, is in inputs_test.cpp and homing_test.cpp.
#include <algorithm>
#include <array>
#include <cstdlib>
#include <random>

#include "firmware/streams.h"

namespace bushd::test {
namespace {

constexpr std::uint8_t kSwitched = 1;
constexpr std::uint16_t kSwitchedBit = 1u << kSwitched;

constexpr std::uint16_t bit(unsigned input) {
  return static_cast<std::uint16_t>(1u << input);
}

class Switches : public Streams {
 protected:
  Switches() : Streams({.motors = 16, .queue_ticks = 256, .code_count = 400}) {}

  void wire(const bushd_motor_inputs& inputs, InputSettings settings = both()) {
    ASSERT_EQ(rig.set_inputs(settings), BUSHD_OK);
    ASSERT_EQ(rig.motor_inputs(inputs), BUSHD_OK);
  }
  static InputSettings both() {
    return {.limit_positive = kSwitchedBit, .limit_negative = kSwitchedBit};
  }
  bushd_status start(std::uint8_t motor, int steps) {
    return rig.take(rig.part(plan(steps), rig.first_open(), 0, 100, motor));
  }
  void expect_forbidden(std::uint16_t positive, std::uint16_t negative) {
    rig.pass();
    const bushd_report report = rig.poll();
    EXPECT_EQ(report.forbidden_positive, positive);
    EXPECT_EQ(report.forbidden_negative, negative);
  }
};
INSTANTIATE_TEST_SUITE_P(Formats, Switches, testing::Values(BUSHD_FORMAT_FINE, BUSHD_FORMAT_COARSE),
                         format_name);

TEST_P(Switches, EachEndHasItsOwn) {
  ASSERT_NO_FATAL_FAILURE(wire({kSwitched, 9, 14, 3}));
  for (const unsigned other : {1u, 3u, 0u, 15u}) {
    rig.pins({bit(other), 0});
    expect_forbidden(0, 0);
  }
  rig.pins({bit(9), 0});
  expect_forbidden(kSwitchedBit, 0);
  EXPECT_EQ(start(kSwitched, 5), BUSHD_E_FORBIDDEN);
  EXPECT_EQ(start(kSwitched, -5), BUSHD_OK);
  rig.pass_until_rest();
  rig.pins({bit(14), 0});
  expect_forbidden(0, kSwitchedBit);
  EXPECT_EQ(start(kSwitched, -5), BUSHD_E_FORBIDDEN);
  EXPECT_EQ(start(kSwitched, 5), BUSHD_OK);
  rig.pass_until_rest();
  rig.pins({static_cast<std::uint16_t>(bit(9) | bit(14)), 0});
  expect_forbidden(kSwitchedBit, kSwitchedBit);
  expect_position(kSwitched, 0);
}

TEST_P(Switches, AnInputOfAHighNumberStopsItsMotorAlone) {
  ASSERT_NO_FATAL_FAILURE(wire({kSwitched, 15, 14, kSwitched}));
  for (const std::uint8_t motor : {kSwitched, std::uint8_t{15}}) {
    ASSERT_EQ(start(motor, 50), BUSHD_OK);
  }
  rig.pass(20);
  rig.pins({bit(15), 0});
  rig.pass_until_rest();
  EXPECT_LT(rig.pulses(kSwitched), 50);
  EXPECT_GT(rig.pulses(kSwitched), 0);
  EXPECT_EQ(rig.pulses(15), 50);
  EXPECT_EQ(rig.poll().inputs, bit(15));
  EXPECT_EQ(rig.poll().forbidden_positive, kSwitchedBit);
}

TEST_P(Switches, AHitSwitchInhibitsUntilItIsLeft) {
  ASSERT_NO_FATAL_FAILURE(wire({kSwitched, 9, 14, 3}));
  ASSERT_EQ(start(kSwitched, 60), BUSHD_OK);
  rig.pass(30);
  rig.pins({bit(9), 0});
  rig.pass(2);
  rig.pins({0, 0});  // overrun
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
    ASSERT_NO_FATAL_FAILURE(wire({kSwitched, 9, 14, 3}, settings));
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
  ASSERT_NO_FATAL_FAILURE(wire({kSwitched, 12, 12, 12}));
  ASSERT_EQ(start(kSwitched, 60), BUSHD_OK);
  rig.pass(30);
  rig.pins({bit(12), 0});
  rig.pass_until_rest();
  expect_forbidden(kSwitchedBit, 0);
  rig.run_plan(plan(-1), kSwitched);
  for (const std::uint16_t level : {std::uint16_t{0}, bit(12), std::uint16_t{0}}) {
    rig.pins({level, 0});
    rig.pass(50);
    expect_forbidden(kSwitchedBit, 0);
  }
  rig.run_plan(plan(-1), kSwitched);
  expect_forbidden(0, 0);
}

// Nobody has seen it leave one that it has overrun and that opens by itself.
TEST_P(Switches, AHitSwitchThatOpensAtRestStillInhibits) {
  ASSERT_NO_FATAL_FAILURE(wire({kSwitched, 9, 14, 3}));
  ASSERT_EQ(start(kSwitched, 60), BUSHD_OK);
  rig.pass(30);
  rig.pins({bit(9), 0});
  rig.pass_until_rest();
  rig.pins({0, 0});
  rig.pass(50);
  expect_forbidden(kSwitchedBit, 0);
  EXPECT_EQ(start(kSwitched, 5), BUSHD_E_FORBIDDEN);
}

TEST_P(Switches, LevelsAreThoseOfInputs) {
  InputSettings settings = both();
  settings.inverted = bit(9);  // a contact that opens
  rig.pins({bit(9), 0});
  ASSERT_NO_FATAL_FAILURE(wire({kSwitched, 9, 14, 3}, settings));
  expect_forbidden(0, 0);
  EXPECT_EQ(rig.poll().inputs, 0);
  rig.pins({0, 0});
  expect_forbidden(kSwitchedBit, 0);
  EXPECT_EQ(rig.poll().inputs, bit(9));
  rig.pins({static_cast<std::uint16_t>(bit(9) | bit(14)), 0});
  expect_forbidden(0, kSwitchedBit);
}

TEST_P(Switches, OneSwitchForBothEndsMayBeAnyInput) {
  ASSERT_NO_FATAL_FAILURE(wire({kSwitched, 12, 12, 12}));
  ASSERT_EQ(start(kSwitched, -50), BUSHD_OK);
  rig.pass(20);
  rig.pins({bit(12), 0});
  rig.pass_until_rest();
  expect_forbidden(0, kSwitchedBit);
}

TEST_P(Switches, AnInputMayStopTwoMotors) {
  constexpr std::uint16_t kTwo = bit(0) | bit(1);
  ASSERT_EQ(rig.set_inputs({.limit_positive = kTwo}), BUSHD_OK);
  ASSERT_EQ(rig.motor_inputs({0, 7, 0, 0}), BUSHD_OK);
  ASSERT_EQ(rig.motor_inputs({1, 7, 1, 1}), BUSHD_OK);
  rig.pins({bit(7), 0});
  expect_forbidden(kTwo, 0);
}

TEST_P(Switches, EachInputIsDebouncedByItself) {
  InputSettings settings = both();
  settings.debounce_ticks = 3;
  ASSERT_NO_FATAL_FAILURE(wire({kSwitched, 9, 14, 3}, settings));
  rig.pins({bit(9), 0});
  rig.pass(2);
  rig.pins({static_cast<std::uint16_t>(bit(9) | bit(14)), 0});
  rig.pass(2);
  EXPECT_EQ(rig.poll().forbidden_positive, kSwitchedBit);
  EXPECT_EQ(rig.poll().forbidden_negative, 0);
  rig.pass(2);
  EXPECT_EQ(rig.poll().forbidden_negative, kSwitchedBit);
}

TEST_P(Switches, InputsBringsTheDefaultBack) {
  ASSERT_NO_FATAL_FAILURE(wire({kSwitched, 9, 14, 3}));
  rig.pins({bit(9), 0});
  expect_forbidden(kSwitchedBit, 0);
  ASSERT_EQ(rig.set_inputs({.limit_positive = kSwitchedBit}), BUSHD_OK);
  expect_forbidden(0, 0);
  rig.pins({kSwitchedBit, 0});
  expect_forbidden(kSwitchedBit, 0);
}

// As a daemon does that begins anew.
TEST_P(Switches, AHitSwitchInhibitsWhileSettingsAreToldAgain) {
  ASSERT_NO_FATAL_FAILURE(wire({kSwitched, 9, 14, 3}));
  ASSERT_EQ(start(kSwitched, 60), BUSHD_OK);
  rig.pass(30);
  rig.pins({bit(9), 0});
  rig.pass_until_rest();
  rig.pins({0, 0});
  expect_forbidden(kSwitchedBit, 0);
  ASSERT_NO_FATAL_FAILURE(wire({kSwitched, 9, 14, 3}));
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
  ASSERT_NO_FATAL_FAILURE(wire({kSwitched, 9, 14, 3}));
  ASSERT_EQ(rig.local(kSwitchedBit), BUSHD_OK);
  press(bit(9), BUSHD_INPUT_FORWARD);
  EXPECT_EQ(rig.pulses(kSwitched), 0) << "it stands at its switch";
  rig.pins({bit(9), 0});
  rig.pass(3);
  ASSERT_EQ(rig.set_inputs(both()), BUSHD_OK);
  press(bit(9), BUSHD_INPUT_FORWARD);
  EXPECT_EQ(rig.pulses(kSwitched), 0) << "half of it is there";
  ASSERT_EQ(rig.motor_inputs({kSwitched, 9, 14, 3}), BUSHD_OK);
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
  ASSERT_EQ(rig.motor_inputs({kSwitched, 9, 14, 3}), BUSHD_OK);
  EXPECT_FALSE(is_quiet());
  ASSERT_EQ(rig.local(kSwitchedBit), BUSHD_OK);
  EXPECT_TRUE(is_quiet());
}

TEST_P(Switches, SettingsOutlastAReset) {
  ASSERT_NO_FATAL_FAILURE(wire({kSwitched, 9, 14, 3}));
  std::vector<std::vector<std::uint8_t>> kept;
  for (std::uint8_t i = 0;; ++i) {
    const bushd_mcu_nvm_region region = bushd_mcu_nvm_region_at(rig.mutable_mcu(), i);
    if (region.at == nullptr) break;
    const auto* at = static_cast<const std::uint8_t*>(region.at);
    kept.emplace_back(at, at + region.size);
  }
  Rig anew({.motors = 16, .queue_ticks = 256, .code_count = 400});
  for (std::uint8_t i = 0; i < 6; ++i) {  // settings; tables hold addresses
    const bushd_mcu_nvm_region region = bushd_mcu_nvm_region_at(anew.mutable_mcu(), i);
    ASSERT_EQ(region.size, kept[i].size());
    std::copy(kept[i].begin(), kept[i].end(), static_cast<std::uint8_t*>(region.at));
  }
  bushd_mcu_nvm_restored(anew.mutable_mcu());
  anew.pins({bit(14), 0});
  anew.pass();
  EXPECT_EQ(anew.poll().forbidden_negative, kSwitchedBit);
  EXPECT_EQ(anew.poll().forbidden_positive, 0);
}

TEST_P(Switches, WhatCannotBeIsRefused) {
  for (const bushd_motor_inputs& bad : std::array<bushd_motor_inputs, 4>{
           {{4, 0, 0, 0}, {0, 4, 0, 0}, {0, 0, 4, 0}, {0, 0, 0, 4}}}) {
    EXPECT_EQ(Rig().motor_inputs(bad), BUSHD_E_FORMAT) << "four motors and inputs: 0..3";
  }
  EXPECT_EQ(rig.request(BUSHD_MSG_MOTOR_INPUTS, {1, 2, 3}), BUSHD_E_LENGTH);
  ASSERT_EQ(start(0, 40), BUSHD_OK);
  EXPECT_EQ(rig.motor_inputs({kSwitched, 9, 14, 3}), BUSHD_E_STATE) << "a motor moves";
  Rig small({.disabled_capabilities = BUSHD_CAN_MOTOR_INPUTS});
  EXPECT_EQ(small.identify().capabilities & BUSHD_CAN_MOTOR_INPUTS, 0);
  EXPECT_EQ(small.motor_inputs({0, 0, 0, 0}), BUSHD_E_UNKNOWN_MESSAGE);
}

// A stage of 2000 steps to either side with a limit switch at each end, whose motor stands
// somewhere between, and a home switch that is active from a place on, over some width.
class Stage : public Switches {
 protected:
  static constexpr std::uint8_t kPositive = 9;
  static constexpr std::uint8_t kNegative = 14;
  static constexpr std::uint8_t kHome = 3;
  static constexpr std::int64_t kEnd = 2000;

  // `at` is the edge that is met in `direction`.
  struct HomeFlag {
    std::int64_t at;
    int direction;
    std::int64_t width = 100'000;
  };

  void put(std::int64_t stands_at, HomeFlag flag, int bounce_readings = 0) {
    plus_ = stands_at - rig.pulses(kSwitched);
    rig.sense = [this, flag, bounce_readings] {
      const std::int64_t at = place();
      const std::int64_t beyond = (at - flag.at) * flag.direction;
      unsigned inputs = 0;
      if (sense(0, at >= kEnd, bounce_readings)) inputs |= 1u << kPositive;
      if (sense(1, at <= -kEnd, bounce_readings)) inputs |= 1u << kNegative;
      if (sense(2, beyond >= 0 && beyond < flag.width, bounce_readings)) inputs |= 1u << kHome;
      return bushd_inputs{static_cast<std::uint16_t>(inputs), 0};
    };
  }
  std::int64_t place() const { return rig.pulses(kSwitched) + plus_; }
  void take_long_ticks() {
    ASSERT_EQ(rig.configure(format, kSlow * 10'000), BUSHD_OK);
    rig.sync_to(1000);
    ASSERT_EQ(rig.assign(kSwitched, 0), BUSHD_OK);
    ASSERT_NO_FATAL_FAILURE(wire({kSwitched, kPositive, kNegative, kHome}));
  }
  static bushd_home command(int direction, std::uint32_t most_steps = 8000) {
    return {kSwitched, static_cast<std::int8_t>(direction), most_steps, 0, 400, kSlow, 100};
  }
  // How far it went to either side.
  std::pair<std::int64_t, std::int64_t> home(const bushd_home& message) {
    EXPECT_EQ(rig.home(message), BUSHD_OK);
    std::pair<std::int64_t, std::int64_t> way{place(), place()};
    for (int n = 0; rig.poll().moving != 0 && n < 100'000; ++n) {
      rig.pass();
      way = {std::min(way.first, place()), std::max(way.second, place())};
    }
    EXPECT_EQ(rig.poll().autonomous, 0);
    EXPECT_EQ(rig.poll().faults, 0);
    EXPECT_EQ(rig.steps_with_dir(), 0);
    return way;
  }
  void expect_home_at(std::int64_t at) {
    EXPECT_EQ(rig.poll().homing, BUSHD_HOMING_DONE);
    EXPECT_EQ(rig.poll().homed, kSwitchedBit);
    const std::int64_t counted = rig.poll().motor[kSwitched].position_steps;
    // A reading comes within a tick of the edge, or of the end of three readings that bounce, and a
    // slow step takes almost four.
    EXPECT_LE(std::abs(counted - 100 - (place() - at)), 1);
  }
  // At cruise, of 20 units of 40 us, a tick has 3.2 steps. An MCU acts on a switch within two ticks
  // (docs/configuration.md) and then ramps down by the 11 codes of ramp_law; a limit counts after
  // one more, for debouncing.
  static constexpr std::int64_t kTwoTicks = 7;
  static constexpr std::int64_t kThreeTicks = 10;
  static constexpr std::int64_t kSixTicks = 20;
  static constexpr std::int64_t kRamp = 11;

 private:
  bool sense(std::size_t n, bool closed, int bounce_readings) {
    if (closed != closed_[n]) left_[n] = bounce_readings;
    closed_[n] = closed;
    if (left_[n] == 0) return closed;
    --left_[n];
    return (noise_() & 1) != 0;
  }

  std::int64_t plus_ = 0;
  std::array<bool, 3> closed_{};
  std::array<int, 3> left_{};
  std::mt19937 noise_{5};
};
INSTANTIATE_TEST_SUITE_P(Formats, Stage, testing::Values(BUSHD_FORMAT_FINE, BUSHD_FORMAT_COARSE),
                         format_name);

TEST_P(Stage, TheHomeSwitchIsNoLimit) {
  ASSERT_NO_FATAL_FAILURE(wire({kSwitched, kPositive, kNegative, kHome}));
  put(0, {.at = 700, .direction = 1, .width = 50});
  const auto way = home(command(1));
  expect_home_at(700);
  EXPECT_LE(way.second, 700 + kTwoTicks + kRamp);
  EXPECT_EQ(rig.poll().forbidden_positive, 0);
  EXPECT_EQ(rig.poll().forbidden_negative, 0);
  // It stands where the switch closes, or a step further: three readings and the tick that is
  // prepared by then last five ticks, 12.8 ms, and a slow step 10 ms.
  rig.run_plan(plan(300), kSwitched);
  EXPECT_GE(place(), 1000);
  EXPECT_LE(place(), 1001);
}

// The switch lies behind: towards the limit first, then on its other side.
TEST_P(Stage, ALimitBeforeTheSwitchTurnsTheMotor) {
  for (const int direction : {1, -1}) {
    for (const bool cuts : {false, true}) {
      SCOPED_TRACE(std::to_string(direction) + (cuts ? " immediate" : " ramp"));
      InputSettings settings = both();
      if (cuts) settings.limit_immediate = kSwitchedBit;
      ASSERT_NO_FATAL_FAILURE(wire({kSwitched, kPositive, kNegative, kHome}, settings));
      put(1500 * direction, {.at = -900 * direction, .direction = direction, .width = 400});
      rig.pass(3);
      const auto way = home(command(direction));
      expect_home_at(-900 * direction);
      const std::int64_t far = direction > 0 ? way.second : -way.first;
      EXPECT_GE(far, kEnd);
      EXPECT_LE(far, kEnd + kThreeTicks + (cuts ? 0 : kRamp));
      EXPECT_EQ(rig.poll().forbidden_positive, 0) << "it has left the limit";
      EXPECT_EQ(rig.poll().forbidden_negative, 0);
    }
  }
}

TEST_P(Stage, AtTheLimitItBeginsTheOtherWay) {
  ASSERT_NO_FATAL_FAILURE(wire({kSwitched, kPositive, kNegative, kHome}));
  put(kEnd + 5, {.at = 100, .direction = 1, .width = 300});
  rig.pass(3);
  const auto way = home(command(1));
  expect_home_at(100);
  EXPECT_EQ(way.second, kEnd + 5);
  put(-kEnd - 5, {.at = 100, .direction = 1, .width = 300});
  rig.pass(3);
  EXPECT_EQ(home(command(1)).first, -kEnd - 5);
  expect_home_at(100);
}

TEST_P(Stage, FromAnywhereItIsTheSameToOneStep) {
  std::mt19937 random(17);
  ASSERT_NO_FATAL_FAILURE(wire({kSwitched, kPositive, kNegative, kHome}));
  for (int n = 0; n < 40; ++n) {
    const int direction = random() % 2 == 0 ? 1 : -1;
    const auto stands = static_cast<std::int64_t>(random() % 4000) - 2000;
    const auto flag = static_cast<std::int64_t>(random() % 3000) - 1500;
    SCOPED_TRACE(std::to_string(n) + ": from " + std::to_string(stands) + " to " +
                 std::to_string(flag) + " towards " + std::to_string(direction));
    put(stands, {.at = flag, .direction = direction, .width = 60}, 3);
    rig.pass(5);
    const auto way = home(command(direction));
    expect_home_at(flag);
    EXPECT_GE(way.first, -kEnd - kSixTicks - kRamp) << "three readings bounce";
    EXPECT_LE(way.second, kEnd + kSixTicks + kRamp);
  }
}

TEST_P(Stage, NoSwitchBetweenTheLimits) {
  ASSERT_NO_FATAL_FAILURE(wire({kSwitched, kPositive, kNegative, kHome}));
  put(500, {.at = 50'000, .direction = 1});
  const auto way = home(command(1));
  EXPECT_EQ(rig.poll().homing, BUSHD_HOMING_NOT_FOUND);
  EXPECT_EQ(rig.poll().homed, 0);
  EXPECT_GE(way.second, kEnd);
  EXPECT_LE(way.first, -kEnd);
  EXPECT_EQ(rig.poll().forbidden_negative, kSwitchedBit) << "it stands there";
  EXPECT_EQ(rig.poll().motor[kSwitched].position_steps, rig.pulses(kSwitched));
}

TEST_P(Stage, NoSwitchWithinTheStepsOfEitherWay) {
  ASSERT_NO_FATAL_FAILURE(wire({kSwitched, kPositive, kNegative, kHome}));
  put(1900, {.at = -1500, .direction = 1, .width = 100});
  const auto way = home(command(1, 600));
  EXPECT_EQ(rig.poll().homing, BUSHD_HOMING_NOT_FOUND);
  EXPECT_EQ(way.first, way.second - 600);
}

// Also with the limit switch of the other end at another input.
TEST_P(Stage, TheHomeSwitchMayBeTheLimit) {
  for (const int direction : {1, -1}) {
    const std::uint8_t its = direction > 0 ? kPositive : kNegative;
    ASSERT_NO_FATAL_FAILURE(wire({kSwitched, kPositive, kNegative, its}));
    put(100, {.at = 50'000, .direction = 1});
    const auto way = home(command(direction));
    expect_home_at(kEnd * direction);
    EXPECT_LE(std::max(way.second, -way.first), kEnd + kTwoTicks + kRamp);
    EXPECT_EQ(rig.poll().forbidden_positive, direction > 0 ? kSwitchedBit : 0) << "it stands there";
    EXPECT_EQ(rig.poll().forbidden_negative, direction < 0 ? kSwitchedBit : 0);
    rig.run_plan(plan(-60 * direction), kSwitched);
    EXPECT_EQ(rig.poll().forbidden_positive | rig.poll().forbidden_negative, 0);
  }
}

// A lever so short that the ramp overruns it: what it bars stays barred until it backs off.
TEST_P(Stage, AShortLeverBarsTheWayWhereverTheOtherLimitIs) {
  ASSERT_NO_FATAL_FAILURE(wire({kSwitched, kPositive, kNegative, kNegative}));
  rig.sense = [this] {
    const std::int64_t at = rig.pulses(kSwitched);
    return bushd_inputs{at <= -700 && at > -708 ? bit(kNegative) : std::uint16_t{0}, 0};
  };
  ASSERT_EQ(rig.home(command(-1)), BUSHD_OK);
  while (rig.poll().homing < BUSHD_HOMING_BACK_OFF) rig.pass();
  rig.pass(2);
  ASSERT_LT(rig.pulses(kSwitched), -708);
  rig.emergency(BUSHD_STOP_IMMEDIATE);
  rig.pass_until_rest();
  EXPECT_EQ(rig.poll().forbidden_negative, kSwitchedBit);
}

// Home is marked behind the limit: the slow approach would go into it.
TEST_P(Stage, ALimitEndsTheSlowStages) {
  ASSERT_NO_FATAL_FAILURE(wire({kSwitched, kPositive, kNegative, kHome}));
  put(1500, {.at = kEnd + 4, .direction = 1});
  const auto way = home(command(1));
  EXPECT_EQ(rig.poll().homing, BUSHD_HOMING_LIMIT);
  EXPECT_EQ(rig.poll().homed, 0);
  EXPECT_LE(way.second, kEnd + kThreeTicks + kRamp);
  EXPECT_EQ(rig.poll().motor[kSwitched].position_steps, rig.pulses(kSwitched));
  EXPECT_EQ(rig.poll().forbidden_positive, kSwitchedBit);
  EXPECT_EQ(start(kSwitched, -50), BUSHD_OK) << "back is free";
  rig.pass_until_rest();
}

TEST_P(Stage, OnItsSwitchAtTheOtherLimitItCannotBackOff) {
  ASSERT_NO_FATAL_FAILURE(wire({kSwitched, kPositive, kNegative, kHome}));
  put(-kEnd, {.at = -kEnd - 50, .direction = 1});
  rig.pass(3);
  EXPECT_EQ(rig.home(command(1)), BUSHD_E_FORBIDDEN);
}

// Ticks of the slowest step: the first one of a stage is made in the tick in which it begins.
TEST_P(Stage, ALimitThatIsActiveWhereAStageBeginsLetsNoStepIntoIt) {
  ASSERT_NO_FATAL_FAILURE(take_long_ticks());
  rig.sense = [this] {
    const bool there = place() >= 500;
    const unsigned inputs = there ? 1u << kNegative | 1u << kHome : 0u;
    return bushd_inputs{static_cast<std::uint16_t>(inputs), 0};
  };
  const auto way = home(command(1));
  EXPECT_EQ(rig.poll().homing, BUSHD_HOMING_LIMIT);
  EXPECT_EQ(place(), way.second) << "not a step back";
  EXPECT_EQ(rig.poll().motor[kSwitched].position_steps, rig.pulses(kSwitched));
}

TEST_P(Stage, BetweenTwoActiveLimitsItDoesNotTurn) {
  ASSERT_NO_FATAL_FAILURE(take_long_ticks());
  rig.sense = [this] {
    const unsigned inputs = place() >= 500 ? 1u << kNegative | 1u << kPositive : 0u;
    return bushd_inputs{static_cast<std::uint16_t>(inputs), 0};
  };
  const auto way = home(command(1));
  EXPECT_EQ(rig.poll().homing, BUSHD_HOMING_NOT_FOUND);
  EXPECT_EQ(place(), way.second) << "not a step back";
}

TEST_P(Stage, CanBeGivenUpOnTheWayBack) {
  ASSERT_NO_FATAL_FAILURE(wire({kSwitched, kPositive, kNegative, kHome}));
  put(1900, {.at = -1500, .direction = 1, .width = 100});
  ASSERT_EQ(rig.home(command(1)), BUSHD_OK);
  while (place() < kEnd) rig.pass();
  while (place() > 1000) rig.pass();
  EXPECT_EQ(rig.poll().homing, BUSHD_HOMING_FAST);
  ASSERT_EQ(rig.home(command(1, 0)), BUSHD_OK);
  rig.pass_until_rest();
  EXPECT_EQ(rig.poll().homing, BUSHD_HOMING_STOPPED);
  EXPECT_GT(place(), 1000 - kThreeTicks - kRamp) << "seen within a tick, then as above";
  EXPECT_EQ(rig.poll().motor[kSwitched].position_steps, rig.pulses(kSwitched));
}

}  // namespace
}  // namespace bushd::test
