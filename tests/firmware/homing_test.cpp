// HOME: a motor finds its switch by itself, from wherever it stands, and never loses a step.
#include <algorithm>
#include <cstdlib>
#include <random>

#include "firmware/streams.h"

namespace bushd::test {
namespace {

// A contact that closes at a position and opens `hysteresis` steps before it, both with bounce.
class Contact {
 public:
  Contact(std::int64_t at, int side, std::int64_t hysteresis = 0, int bounce_readings = 0)
      : at_(at), side_(side), hysteresis_(hysteresis), bounce_readings_(bounce_readings) {}

  bool read(std::int64_t position) {
    const std::int64_t beyond = (position - at_) * side_;
    const bool now = beyond >= (closed_ ? -hysteresis_ : 0);
    if (now != closed_) bounces_left_ = bounce_readings_;
    closed_ = now;
    if (bounces_left_ == 0) return closed_;
    --bounces_left_;
    return (noise_() & 1) != 0;
  }

 private:
  std::int64_t at_;
  int side_;  // closed from there on in this direction
  std::int64_t hysteresis_;
  int bounce_readings_;
  int bounces_left_ = 0;
  bool closed_ = false;
  std::mt19937 noise_{7};
};

constexpr std::uint8_t kHomed = 1;

class Homing : public Streams {
 protected:
  static bushd_home command(int direction = -1, std::int32_t position = 0) {
    return {kHomed, static_cast<std::int8_t>(direction), 5000, 0, 400, kSlow, position};
  }
  void put(Contact contact) {
    contact_ = contact;
    rig.sense = [this] {
      const bool active = contact_.read(rig.pulses(kHomed) + plus_);
      return bushd_inputs{static_cast<std::uint16_t>(active ? 1u << kHomed : 0u), system};
    };
  }
  bushd_report homed() {
    rig.pass_until_rest();
    return rig.poll();
  }
  // Where the steps say it stands, from where the counter was set.
  void expect_counted(std::int64_t offset) {
    EXPECT_EQ(rig.poll().motor[kHomed].position_steps, rig.pulses(kHomed) + offset);
    EXPECT_EQ(rig.steps_with_dir(), 0);
    EXPECT_EQ(rig.steps_while_disabled(), 0);
  }

  std::uint8_t system = 0;
  std::int64_t plus_ = 0;
  Contact contact_{0, 1};
};
BUSHD_IN_BOTH_FORMATS(Homing);

TEST_P(Homing, SetsThePositionAtTheSwitch) {
  for (const int direction : {-1, 1}) {
    Homing::rig.forget_history();
    const std::int64_t before = rig.pulses(kHomed);
    const std::int64_t at = before + direction * 700;
    put(Contact(at, direction, 5));
    ASSERT_EQ(rig.home(command(direction, 1000)), BUSHD_OK);
    EXPECT_EQ(rig.poll().autonomous, 1 << kHomed);
    EXPECT_EQ(rig.poll().moving, 1 << kHomed);
    EXPECT_EQ(rig.poll().running, 1 << kHomed);
    EXPECT_EQ(rig.poll().homed, 0);
    const bushd_report report = homed();
    EXPECT_EQ(report.homing, BUSHD_HOMING_DONE);
    EXPECT_EQ(report.homed, 1 << kHomed);
    EXPECT_EQ(report.autonomous, 0);
    EXPECT_EQ(report.faults, 0);
    EXPECT_EQ(report.state, BUSHD_STATE_READY);
    expect_counted(1000 - at);
    EXPECT_LE(std::abs(rig.pulses(kHomed) - at), 1) << "it stands where it found it";
    ASSERT_EQ(rig.set_position(kHomed, 0), BUSHD_OK);
  }
}

TEST_P(Homing, GoesFastByTheTableUntilTheSwitchAndRampsDown) {
  put(Contact(-700, -1));
  ASSERT_EQ(rig.home(command()), BUSHD_OK);
  rig.forget_history();
  rig.pass(3);
  while (rig.poll().homing == BUSHD_HOMING_FAST) rig.pass();
  const std::size_t ticks = rig.history(kHomed).size();
  while (rig.poll().homing == BUSHD_HOMING_RAMP_DOWN) rig.pass();
  // The reading came in the tick that was being emitted then; the one after it is the first
  // changed.
  auto reference = Reference::move(law, 5000);
  reference.ramp_down_at((ticks - 1) * std::uint64_t{Rig::kTickNs});
  std::vector<int> expected = steps_by_tick(reference, Rig::kTickNs);
  for (int& n : expected) n = -n;
  std::vector<int> seen(rig.history(kHomed).begin() + 2, rig.history(kHomed).end());
  expected.resize(seen.size());
  EXPECT_EQ(seen, expected);
  EXPECT_EQ(homed().homing, BUSHD_HOMING_DONE);
}

TEST_P(Homing, OnTheSwitchItBacksOffFirst) {
  put(Contact(0, -1, 10));
  plus_ = -30;
  rig.pass();
  ASSERT_EQ(rig.home(command()), BUSHD_OK);
  std::int64_t least = 0;
  while (rig.poll().moving != 0) {
    rig.pass();
    least = std::min(least, rig.pulses(kHomed));
  }
  EXPECT_EQ(least, 0) << "not a step farther in";
  EXPECT_EQ(rig.poll().homing, BUSHD_HOMING_DONE);
  expect_counted(-30);
}

TEST_P(Homing, FromRandomPlacesWithBounceItIsTheSameToOneStep) {
  std::mt19937 random(11);
  for (int i = 0; i < 50; ++i) {
    SCOPED_TRACE(i);
    // Three readings of bounce are within one slow step.
    const std::int64_t at = rig.pulses(kHomed) - static_cast<std::int64_t>(random() % 2000) + 20;
    put(Contact(at, -1, 6, 3));
    for (int n = 0; n < 5; ++n) rig.pass();
    ASSERT_EQ(rig.home(command()), BUSHD_OK);
    ASSERT_EQ(homed().homing, BUSHD_HOMING_DONE);
    const std::int64_t off = rig.poll().motor[kHomed].position_steps - (rig.pulses(kHomed) - at);
    ASSERT_GE(off, 0);
    ASSERT_LE(off, 1);
  }
}

TEST_P(Homing, SwitchNeverFound) {
  put(Contact(-100000, -1));
  ASSERT_EQ(rig.home(command()), BUSHD_OK);
  const bushd_report report = homed();
  EXPECT_EQ(report.homing, BUSHD_HOMING_NOT_FOUND);
  EXPECT_EQ(report.homed, 0);
  EXPECT_EQ(report.autonomous, 0);
  EXPECT_EQ(report.faults, 0);
  EXPECT_EQ(rig.pulses(kHomed), -5000);
  expect_counted(0);
}

TEST_P(Homing, SwitchThatStaysActiveAndOneThatIsLost) {
  rig.pins({1 << kHomed, 0});
  ASSERT_EQ(rig.home(command()), BUSHD_OK);
  EXPECT_EQ(homed().homing, BUSHD_HOMING_STUCK);
  EXPECT_EQ(rig.pulses(kHomed), 400);
  expect_counted(0);

  ASSERT_EQ(rig.home(command()), BUSHD_OK);
  rig.pass(20);
  rig.pins({0, 0});
  EXPECT_EQ(homed().homing, BUSHD_HOMING_LOST);
  expect_counted(0);
  EXPECT_EQ(rig.poll().homed, 0);
}

TEST_P(Homing, CanBeGivenUpInEveryStage) {
  put(Contact(-300, -1, 5));
  ASSERT_EQ(rig.home(command()), BUSHD_OK);
  int whole = 0;
  for (; rig.poll().moving != 0; ++whole) rig.pass();
  for (int n = 0; n < whole; n += 7) {
    ReadyRig fresh(law, format);
    Contact contact(-300, -1, 5);
    fresh.sense = [&] {
      const bool active = contact.read(fresh.pulses(kHomed));
      return bushd_inputs{static_cast<std::uint16_t>(active ? 1u << kHomed : 0u), 0};
    };
    ASSERT_EQ(fresh.home(command()), BUSHD_OK);
    fresh.pass(n);
    if (fresh.poll().homing > BUSHD_HOMING_APPROACH) break;
    bushd_home give_up = command();
    give_up.most_steps = 0;
    ASSERT_EQ(fresh.home(give_up), BUSHD_OK);
    fresh.pass();
    fresh.pass_until_rest();
    ASSERT_EQ(fresh.poll().homing, BUSHD_HOMING_STOPPED) << n;
    ASSERT_EQ(fresh.poll().autonomous, 0);
    ASSERT_EQ(fresh.poll().motor[kHomed].position_steps, fresh.pulses(kHomed));
    ASSERT_EQ(fresh.poll().faults, 0);
    ASSERT_EQ(fresh.steps_with_dir(), 0);
  }
}

TEST_P(Homing, AnotherMotorWaitsUntilTheLastSlowStepIsOver) {
  put(Contact(-300, -1, 5));
  ASSERT_EQ(rig.home(command()), BUSHD_OK);
  while (rig.poll().homing < BUSHD_HOMING_BACK_OFF) rig.pass();
  rig.pass(3);
  bushd_home other = command();
  other.motor = 0;
  bushd_home give_up = command();
  give_up.most_steps = 0;
  ASSERT_EQ(rig.home(give_up), BUSHD_OK);
  rig.pass();
  ASSERT_EQ(rig.poll().homing, BUSHD_HOMING_STOPPED);
  ASSERT_EQ(rig.poll().moving, 1 << kHomed);
  EXPECT_EQ(rig.home(other), BUSHD_E_STATE);
  rig.pass_until_rest();
  expect_counted(0);
  EXPECT_EQ(rig.home(other), BUSHD_OK);
}

TEST_P(Homing, EmergencyEndsIt) {
  for (const bushd_stop_mode mode : {BUSHD_STOP_RAMP, BUSHD_STOP_IMMEDIATE}) {
    ReadyRig fresh(law, format);
    ASSERT_EQ(fresh.home(command()), BUSHD_OK);
    fresh.pass(100);
    const std::int64_t at = fresh.pulses(kHomed);
    fresh.emergency(mode);
    fresh.pass_until_rest();
    EXPECT_EQ(fresh.poll().homing, BUSHD_HOMING_STOPPED);
    EXPECT_EQ(fresh.poll().faults, BUSHD_FAULT_EMERGENCY);
    EXPECT_EQ(fresh.poll().motor[kHomed].position_steps, fresh.pulses(kHomed));
    if (mode == BUSHD_STOP_IMMEDIATE) {
      EXPECT_LE(at - fresh.pulses(kHomed), 7) << "two ticks at cruise";
    }
    EXPECT_EQ(fresh.home(command()), BUSHD_E_STATE) << "latched";
  }
}

// Short lever: the ramp overruns it, and the switch no longer tells that the motor is beyond.
// Nothing of it has been prepared: there is no step to complete.
TEST_P(Homing, StoppedBeforeItBeginsItMakesNoStep) {
  put({-200, -1});
  const std::vector<std::function<void()>> stops = {
      [&] { rig.emergency(BUSHD_STOP_RAMP); },
      [&] { EXPECT_EQ(rig.home({kHomed, -1, 0, 0, 400, kSlow, 0}), BUSHD_OK); },
  };
  for (const auto& stop : stops) {
    ASSERT_EQ(rig.home(command()), BUSHD_OK);
    stop();
    rig.pass(100);
    EXPECT_EQ(rig.pulses(kHomed), 0);
    EXPECT_EQ(rig.poll().homing, BUSHD_HOMING_STOPPED);
    EXPECT_EQ(rig.poll().moving, 0);
    EXPECT_EQ(rig.control(BUSHD_CONTROL_CLEAR_FAULTS), BUSHD_OK);
  }
}

TEST_P(Homing, EndedBetweenOverrunAndBackOffTheSwitchBarsTheWayOn) {
  constexpr std::uint16_t kBit = 1u << kHomed;
  ASSERT_EQ(rig.set_inputs({.limit_negative = kBit}), BUSHD_OK);
  rig.sense = [this] {
    const std::int64_t at = rig.pulses(kHomed);
    return bushd_inputs{at <= -700 && at > -708 ? kBit : std::uint16_t{0}, 0};
  };
  ASSERT_EQ(rig.home(command()), BUSHD_OK);
  while (rig.poll().homing == BUSHD_HOMING_FAST) rig.pass();
  while (rig.pulses(kHomed) > -708) rig.pass();
  ASSERT_EQ(rig.poll().homing, BUSHD_HOMING_RAMP_DOWN);
  rig.emergency(BUSHD_STOP_IMMEDIATE);
  rig.pass_until_rest();
  EXPECT_EQ(rig.poll().homing, BUSHD_HOMING_STOPPED);
  EXPECT_EQ(rig.poll().inputs, 0);
  EXPECT_EQ(rig.poll().forbidden_negative, kBit);
  EXPECT_EQ(rig.poll().forbidden_positive, 0);
  ASSERT_EQ(rig.control(BUSHD_CONTROL_CLEAR_FAULTS), BUSHD_OK);
  EXPECT_EQ(rig.home(command()), BUSHD_E_FORBIDDEN);
  rig.run_plan(plan(100), kHomed);
  EXPECT_EQ(rig.poll().forbidden_negative, 0) << "it has left it";
}

TEST_P(Homing, EndedWhereTheSwitchIsReleasedNothingIsBarred) {
  constexpr std::uint16_t kBit = 1u << kHomed;
  ASSERT_EQ(rig.set_inputs({.limit_negative = kBit}), BUSHD_OK);
  put(Contact(-700, -1, 5));
  ASSERT_EQ(rig.home(command()), BUSHD_OK);
  while (rig.poll().homing != BUSHD_HOMING_APPROACH) rig.pass();
  rig.emergency(BUSHD_STOP_IMMEDIATE);
  rig.pass_until_rest();
  EXPECT_EQ(rig.poll().forbidden_negative, 0);
  ASSERT_EQ(rig.control(BUSHD_CONTROL_CLEAR_FAULTS), BUSHD_OK);
  EXPECT_EQ(rig.home(command()), BUSHD_OK);
}

TEST_P(Homing, RunsDownWhenTheHostFallsSilent) {
  ASSERT_EQ(rig.configure(format, Rig::kTickNs, 50), BUSHD_OK);
  ASSERT_EQ(rig.home(command()), BUSHD_OK);
  rig.pass(200);
  const bushd_report report = rig.poll();
  EXPECT_EQ(report.homing, BUSHD_HOMING_STOPPED);
  EXPECT_EQ(report.faults, BUSHD_FAULT_LINK);
  EXPECT_EQ(report.ramp_downs, 1);
  EXPECT_LT(report.motor[kHomed].position_steps, -20);
  EXPECT_GT(report.motor[kHomed].position_steps, -200);
  expect_counted(0);
}

TEST_P(Homing, MeanwhileTheMotorIsItsOwnAndOthersMove) {
  put(Contact(-900, -1));
  const bushd_home home = command();
  ASSERT_EQ(rig.home(home), BUSHD_OK);
  ASSERT_EQ(rig.home(home), BUSHD_OK) << "the same again changes nothing";
  bushd_home other = home;
  other.motor = 2;
  EXPECT_EQ(rig.home(other), BUSHD_E_STATE) << "one at a time";
  other.most_steps = 0;
  EXPECT_EQ(rig.home(other), BUSHD_OK) << "there is nothing to give up";
  EXPECT_EQ(rig.poll().homing, BUSHD_HOMING_FAST);
  Ticks start = ones(kStart, rig.first_open(), 5, 0);
  start.mask = 1 << kHomed;
  EXPECT_EQ(rig.take(start), BUSHD_E_STATE);
  EXPECT_EQ(rig.set_position(kHomed, 5), BUSHD_E_STATE);
  EXPECT_EQ(rig.assign(kHomed, 0), BUSHD_E_STATE);
  EXPECT_EQ(rig.control(BUSHD_CONTROL_DISABLE), BUSHD_E_STATE);
  rig.run_plan(plan(40), 0);
  EXPECT_EQ(rig.pulses(0), 40);
  EXPECT_EQ(homed().homing, BUSHD_HOMING_DONE);
  expect_counted(900);
  rig.run_plan(plan(60), kHomed);
  expect_counted(900);
}

TEST_P(Homing, TheSwitchMayBeALimitAndBarsTheWayAfterwards) {
  constexpr std::uint16_t kBit = 1u << kHomed;
  for (const bool both_ends : {false, true}) {
    ASSERT_EQ(rig.set_inputs({.limit_positive = both_ends ? kBit : std::uint16_t{0},
                              .limit_negative = kBit,
                              .limit_immediate = kBit}),
              BUSHD_OK);
    put(Contact(rig.pulses(kHomed) - 500, -1, 5));
    ASSERT_EQ(rig.home(command()), BUSHD_OK);
    ASSERT_EQ(homed().homing, BUSHD_HOMING_DONE);
    EXPECT_EQ(rig.poll().forbidden_negative, kBit);
    EXPECT_EQ(rig.poll().forbidden_positive, 0);
    Ticks back = ones(kStart, rig.first_open(), 1, 0);
    back.mask = kBit;
    back.displacements = {two_back()};
    EXPECT_EQ(rig.take(back), BUSHD_E_FORBIDDEN);
    rig.run_plan(plan(60), kHomed);
    EXPECT_EQ(rig.poll().forbidden_negative, 0) << "it has left it";
    ASSERT_EQ(rig.set_position(kHomed, static_cast<std::int32_t>(rig.pulses(kHomed))), BUSHD_OK);
  }
}

TEST_P(Homing, BehindASwitchThatItHasOverrunItIsNotLookedFor) {
  constexpr std::uint16_t kBit = 1u << kHomed;
  ASSERT_EQ(rig.set_inputs({.limit_positive = kBit, .limit_negative = kBit}), BUSHD_OK);
  ASSERT_EQ(rig.home(command()), BUSHD_OK);
  rig.pass(100);
  bushd_home give_up = command();
  give_up.most_steps = 0;
  ASSERT_EQ(rig.home(give_up), BUSHD_OK);
  rig.pins({kBit, 0});
  rig.pass(3);
  rig.pins({0, 0});
  rig.pass_until_rest();
  ASSERT_EQ(rig.poll().forbidden_negative, kBit) << "hit while it ran down";
  EXPECT_EQ(rig.home(command()), BUSHD_E_FORBIDDEN);
  EXPECT_EQ(rig.home(command(1)), BUSHD_E_FORBIDDEN) << "nor may it back off that way";
}

TEST_P(Homing, BadCommandsAreRefused) {
  bushd_home bad = command();
  bad.motor = 4;
  EXPECT_EQ(rig.home(bad), BUSHD_E_FORMAT) << "four motors: 0..3";
  bad = command();
  bad.slow_delay = kSlow - 1;
  EXPECT_EQ(rig.home(bad), BUSHD_E_FORMAT) << "faster than the table starts";
  Law slow = law;
  slow.accel = slow.decel = {50};
  ASSERT_EQ(rig.upload(1, slow), BUSHD_OK);
  ASSERT_EQ(rig.assign(kHomed, 1), BUSHD_OK);
  bad.slow_delay = 255;
  EXPECT_EQ(rig.home(bad), BUSHD_E_FORMAT) << "2 ms, faster than a step a tick";
  EXPECT_EQ(rig.request(BUSHD_MSG_HOME, {1, 2, 3}), BUSHD_E_LENGTH);
  Rig fresh;
  EXPECT_EQ(fresh.home(command()), BUSHD_E_STATE) << "BUSY";
  fresh.make_ready(law, format, 1000);
  ASSERT_EQ(fresh.control(BUSHD_CONTROL_FORGET_TABLES), BUSHD_OK);
  EXPECT_EQ(fresh.home(command()), BUSHD_E_NO_TABLE);
  ASSERT_EQ(rig.take(ones(kStart, rig.first_open(), 30)), BUSHD_OK);
  bushd_home moving = command();
  moving.motor = 0;
  EXPECT_EQ(rig.home(moving), BUSHD_E_STATE);
}

// Wherever its stages may lead, its position is counted.
TEST_P(Homing, IsRefusedWhereItsStepsAreNotCounted) {
  constexpr std::int32_t kAll = 5000 + 400;  // of command()
  for (const int direction : {-1, 1}) {
    for (const int side : {-1, 1}) {
      ASSERT_EQ(rig.set_position(kHomed, side * (INT32_MAX - kAll + 1)), BUSHD_OK);
      EXPECT_EQ(rig.home(command(direction)), BUSHD_E_FORMAT);
      ASSERT_EQ(rig.set_position(kHomed, side * (INT32_MAX - kAll)), BUSHD_OK);
      ASSERT_EQ(rig.home(command(direction)), BUSHD_OK);
      const bushd_report report = homed();
      EXPECT_EQ(report.homing, BUSHD_HOMING_NOT_FOUND);
      EXPECT_EQ(report.motor[kHomed].position_steps, side * (INT32_MAX - kAll) + direction * 5000);
    }
  }
  // Below it no step is counted.
  ASSERT_EQ(rig.set_position(kHomed, INT32_MIN), BUSHD_OK);
  EXPECT_EQ(rig.home(command(-1)), BUSHD_E_FORMAT);
}

}  // namespace
}  // namespace bushd::test
