// Homing among limit and home switches at any inputs of the MCU. (With one input: homing_test.cpp.)
#include <algorithm>
#include <array>
#include <cstdlib>
#include <random>

#include "firmware/switches.h"

namespace bushd::test {
namespace {

// A stage of 2000 steps to either side with a limit switch at each end, whose motor stands
// somewhere between, and a home switch that is active from a place on, over some width.
class Stage : public Switches {
 protected:
  Stage() { wire(); }

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
    wire();
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
  void expect_counted() {
    EXPECT_EQ(rig.poll().motor[kSwitched].position_steps, rig.pulses(kSwitched));
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
BUSHD_IN_BOTH_FORMATS(Stage);

TEST_P(Stage, TheHomeSwitchIsNoLimit) {
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
      wire(kApart, settings);
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
  put(500, {.at = 50'000, .direction = 1});
  const auto way = home(command(1));
  EXPECT_EQ(rig.poll().homing, BUSHD_HOMING_NOT_FOUND);
  EXPECT_EQ(rig.poll().homed, 0);
  EXPECT_GE(way.second, kEnd);
  EXPECT_LE(way.first, -kEnd);
  EXPECT_EQ(rig.poll().forbidden_negative, kSwitchedBit) << "it stands there";
  expect_counted();
}

TEST_P(Stage, NoSwitchWithinTheStepsOfEitherWay) {
  put(1900, {.at = -1500, .direction = 1, .width = 100});
  const auto way = home(command(1, 600));
  EXPECT_EQ(rig.poll().homing, BUSHD_HOMING_NOT_FOUND);
  EXPECT_EQ(way.first, way.second - 600);
}

// Also with the limit switch of the other end at another input.
TEST_P(Stage, TheHomeSwitchMayBeTheLimit) {
  for (const int direction : {1, -1}) {
    const std::uint8_t its = direction > 0 ? kPositive : kNegative;
    wire({kSwitched, kPositive, kNegative, its});
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
  wire({kSwitched, kPositive, kNegative, kNegative});
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
  put(1500, {.at = kEnd + 4, .direction = 1});
  const auto way = home(command(1));
  EXPECT_EQ(rig.poll().homing, BUSHD_HOMING_LIMIT);
  EXPECT_EQ(rig.poll().homed, 0);
  EXPECT_LE(way.second, kEnd + kThreeTicks + kRamp);
  expect_counted();
  EXPECT_EQ(rig.poll().forbidden_positive, kSwitchedBit);
  EXPECT_EQ(start(kSwitched, -50), BUSHD_OK) << "back is free";
  rig.pass_until_rest();
}

TEST_P(Stage, OnItsSwitchAtTheOtherLimitItCannotBackOff) {
  put(-kEnd, {.at = -kEnd - 50, .direction = 1});
  rig.pass(3);
  EXPECT_EQ(rig.home(command(1)), BUSHD_E_FORBIDDEN);
}

// Ticks of the slowest step: the first one of a stage is made in the tick in which it begins.
TEST_P(Stage, ALimitThatIsActiveWhereAStageBeginsLetsNoStepIntoIt) {
  take_long_ticks();
  rig.sense = [this] {
    const bool there = place() >= 500;
    const unsigned inputs = there ? 1u << kNegative | 1u << kHome : 0u;
    return bushd_inputs{static_cast<std::uint16_t>(inputs), 0};
  };
  const auto way = home(command(1));
  EXPECT_EQ(rig.poll().homing, BUSHD_HOMING_LIMIT);
  EXPECT_EQ(place(), way.second) << "not a step back";
  expect_counted();
}

TEST_P(Stage, BetweenTwoActiveLimitsItDoesNotTurn) {
  take_long_ticks();
  rig.sense = [this] {
    const unsigned inputs = place() >= 500 ? 1u << kNegative | 1u << kPositive : 0u;
    return bushd_inputs{static_cast<std::uint16_t>(inputs), 0};
  };
  const auto way = home(command(1));
  EXPECT_EQ(rig.poll().homing, BUSHD_HOMING_NOT_FOUND);
  EXPECT_EQ(place(), way.second) << "not a step back";
}

TEST_P(Stage, CanBeGivenUpOnTheWayBack) {
  put(1900, {.at = -1500, .direction = 1, .width = 100});
  ASSERT_EQ(rig.home(command(1)), BUSHD_OK);
  while (place() < kEnd) rig.pass();
  while (place() > 1000) rig.pass();
  EXPECT_EQ(rig.poll().homing, BUSHD_HOMING_FAST);
  ASSERT_EQ(rig.home(command(1, 0)), BUSHD_OK);
  rig.pass_until_rest();
  EXPECT_EQ(rig.poll().homing, BUSHD_HOMING_STOPPED);
  EXPECT_GT(place(), 1000 - kThreeTicks - kRamp) << "seen within a tick, then as above";
  expect_counted();
}

}  // namespace
}  // namespace bushd::test
