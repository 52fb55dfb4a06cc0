// VELOCITY: local motion by the velocity loop, against the document once more, in this file.
#include <algorithm>
#include <cstdlib>

#include "firmware/rig.h"
#include "firmware/streams.h"

namespace bushd::test {
namespace {

constexpr std::uint8_t kMotor = 1;
// 300 steps/s at least, 1500 at most, 4000 steps/s^2: 24 updates, 375 ms, to full speed.
constexpr bushd_set_velocity kSettings = {kMotor, 300 * 64, 1500 * 64, 4000};

// "Stepper motor controller, part 3", interval by interval, and which tick each step falls in.
class Document {
 public:
  explicit Document(const bushd_set_velocity& s) : s_(s) {}

  // Steps of the next tick of `tick_ns`, with this wanted speed.
  int tick(int wanted, std::int64_t tick_ns) {
    int steps = 0;
    const std::int64_t end_ns = tick_begin_ns_ + tick_ns;
    while (now_ns_ + 25'000 <= end_ns) {
      const bool due = until_step_ == 1 && speed_ != 0;
      if (due && steps != 0 && (speed_ > 0) != (steps > 0)) {
        now_ns_ = end_ns;  // DIR changes with the tick
        break;
      }
      now_ns_ += 25'000;
      if (--until_step_ == 0) {
        steps += speed_ > 0 ? 1 : speed_ < 0 ? -1 : 0;
        until_step_ = period();
      }
      if (--until_update_ != 0) continue;
      until_update_ = 625;
      speed_ = speed_ < wanted ? std::min(speed_ + s_.acceleration, wanted)
                               : std::max(speed_ - s_.acceleration, wanted);
    }
    tick_begin_ns_ = end_ns;
    return steps;
  }
  int speed() const { return speed_; }

 private:
  int period() const { return std::max(1, 2560000 / std::max(std::abs(speed_), int{s_.least})); }

  bushd_set_velocity s_;
  int speed_ = 0;
  int until_step_ = period();
  int until_update_ = 625;
  std::int64_t now_ns_ = 0;
  std::int64_t tick_begin_ns_ = 0;
};

class Velocity : public Streams {
 protected:
  void SetUp() override {
    ASSERT_EQ(rig.local(1u << kMotor), BUSHD_OK);
    ASSERT_EQ(rig.velocity(kSettings), BUSHD_OK);
    rig.forget_history();
  }
  void hold(unsigned inputs, int ticks) {
    rig.pins({0, static_cast<std::uint8_t>(inputs)});
    rig.pass(ticks);
  }
  // A press counts with its third reading, for the tick that is prepared then; a release at once.
  static constexpr int kUntilItBegins = 3;
  std::vector<int> made(std::size_t from) const {
    const auto& all = rig.history(kMotor);
    return {all.begin() + static_cast<std::ptrdiff_t>(from), all.end()};
  }
  void expect_counted() {
    rig.pass_until_rest();
    const bushd_report report = rig.poll();
    EXPECT_EQ(report.autonomous, 0);
    EXPECT_EQ(report.faults, 0);
    EXPECT_EQ(report.motor[kMotor].position_steps, rig.pulses(kMotor));
    EXPECT_EQ(rig.steps_with_dir(), 0);
  }
};
BUSHD_IN_BOTH_FORMATS(Velocity);

TEST_P(Velocity, WhileHeldItSpeedsUpAndWhenReleasedItBrakesAtTheSameRate) {
  hold(BUSHD_INPUT_REVERSE, 400);
  const bushd_report moving = rig.poll();
  EXPECT_EQ(moving.autonomous, 1u << kMotor);
  EXPECT_EQ(moving.moving, 1u << kMotor);
  EXPECT_EQ(moving.running, 0) << "not for a master to end";
  hold(0, 1);
  rig.pass_until_rest();
  const std::vector<int> seen = made(kUntilItBegins + 1);
  Document document(kSettings);
  std::vector<int> expected;
  for (std::size_t tick = 0; tick < seen.size(); ++tick) {
    expected.push_back(document.tick(tick < 400 - kUntilItBegins + 1 ? -kSettings.most : 0, kTick));
  }
  EXPECT_EQ(seen, expected);
  for (int tick = 0; tick < 2; ++tick) EXPECT_EQ(document.tick(0, kTick), 0) << "of those to come";
  EXPECT_EQ(document.speed(), 0) << "it rests as soon as the loop does";
  expect_counted();
}

TEST_P(Velocity, ItReversesByWayOfZeroWithoutRest) {
  hold(BUSHD_INPUT_FORWARD, 300);
  hold(BUSHD_INPUT_REVERSE, 600);
  std::vector<int> seen = made(kUntilItBegins + 1);
  Document document(kSettings);
  std::vector<int> expected;
  const std::size_t turn = 300 - kUntilItBegins + 1;
  for (std::size_t tick = 0; tick < seen.size(); ++tick) {
    const bool bounces = tick >= turn && tick < turn + kUntilItBegins - 1;
    const int wanted = tick < turn ? kSettings.most : bounces ? 0 : -kSettings.most;
    expected.push_back(document.tick(wanted, kTick));
  }
  EXPECT_EQ(seen, expected);
  EXPECT_EQ(rig.poll().autonomous, 1u << kMotor);
  hold(0, 1);
  expect_counted();
}

// Both directions within a tick: DIR allows one, so the loop waits, and no pulse is nearer than T.
TEST_P(Velocity, ATurnWithinATickWaitsForTheNextOne) {
  const bushd_set_velocity fast = {kMotor, 4000 * 64, 5000 * 64, 30000};
  ASSERT_EQ(rig.velocity(fast), BUSHD_OK);
  for (int lead = 0; lead < 12; ++lead) {
    rig.forget_history();
    const std::size_t from = rig.history(kMotor).size() + kUntilItBegins + 1;
    const int first = 100 + lead;
    hold(BUSHD_INPUT_FORWARD, first);
    hold(BUSHD_INPUT_REVERSE, 100);
    hold(0, 1);
    rig.pass_until_rest();
    const std::vector<int> seen = made(from);
    Document document(fast);
    std::vector<int> expected;
    const int turn = first - kUntilItBegins + 1;
    const int end = first + 100 - kUntilItBegins + 1;
    for (int tick = 0; tick < static_cast<int>(seen.size()); ++tick) {
      const bool bounces = tick >= turn && tick < turn + kUntilItBegins - 1;
      const int wanted = tick < turn ? fast.most : tick >= end || bounces ? 0 : -fast.most;
      expected.push_back(document.tick(wanted, kTick));
    }
    EXPECT_EQ(seen, expected) << lead;
  }
  expect_counted();
}

TEST_P(Velocity, ALimitBrakesItAlongTheRampAndInhibitsTheWayOn) {
  ASSERT_EQ(rig.set_inputs({.limit_positive = 1u << kMotor}), BUSHD_OK);
  ASSERT_EQ(rig.local(1u << kMotor), BUSHD_OK);
  hold(BUSHD_INPUT_FORWARD, 300);
  rig.pins({1u << kMotor, BUSHD_INPUT_FORWARD});
  const std::int64_t at = rig.pulses(kMotor);
  rig.pass(400);
  // 24 updates, rounded to where it was between two of them.
  EXPECT_NEAR(static_cast<double>(rig.pulses(kMotor) - at), 281, 24);
  EXPECT_EQ(rig.poll().moving, 0) << "held, but at its limit";
  const auto slowest = std::ranges::max(made(rig.history(kMotor).size() - 200));
  EXPECT_EQ(slowest, 0);
  const std::int64_t rest = rig.pulses(kMotor);
  hold(0, 10);
  rig.pins({1u << kMotor, BUSHD_INPUT_REVERSE});
  rig.pass(100);
  EXPECT_LT(rig.pulses(kMotor), rest);
  hold(0, 1);
  expect_counted();
}

TEST_P(Velocity, TurnedBackWhileALimitBrakesItGoesOnThroughZero) {
  ASSERT_EQ(rig.set_inputs({.limit_positive = 1u << kMotor}), BUSHD_OK);
  ASSERT_EQ(rig.local(1u << kMotor), BUSHD_OK);
  hold(BUSHD_INPUT_FORWARD, 300);
  rig.pins({1u << kMotor, BUSHD_INPUT_FORWARD});
  rig.pass(20);
  rig.pins({1u << kMotor, BUSHD_INPUT_REVERSE});
  const std::size_t from = rig.history(kMotor).size();
  rig.pass(400);
  const std::vector<int> seen = made(from);
  const auto turned = std::ranges::find_if(seen, [](int n) { return n < 0; });
  ASSERT_NE(turned, seen.end());
  EXPECT_LT(turned - seen.begin(), 160) << "24 updates are 147 ticks";
  EXPECT_TRUE(std::all_of(turned, seen.end(), [](int n) { return n <= 0; }));
  hold(0, 1);
  expect_counted();
}

// The other input is pressed, and the limit on the new way becomes active while the motor still
// goes the old one: it comes to rest, whenever that is. If it has turned already, it brakes.
TEST_P(Velocity, ALimitThatComesWhileItTurnsLetsNoStepIntoIt) {
  const std::vector<bushd_set_velocity> all = {
      {kMotor, 200 * 64, 1000 * 64, 20000}, {kMotor, 400 * 64, 2000 * 64, 900}, kSettings};
  for (const bushd_set_velocity& settings : all) {
    ASSERT_EQ(rig.velocity(settings), BUSHD_OK);
    for (const int direction : {1, -1}) {
      const std::uint16_t limit = 1u << kMotor;
      ASSERT_EQ(rig.set_inputs({.limit_positive = direction > 0 ? limit : std::uint16_t{0},
                                .limit_negative = direction < 0 ? limit : std::uint16_t{0}}),
                BUSHD_OK);
      ASSERT_EQ(rig.local(1u << kMotor), BUSHD_OK);
      const auto towards = direction > 0 ? BUSHD_INPUT_FORWARD : BUSHD_INPUT_REVERSE;
      const auto away = direction > 0 ? BUSHD_INPUT_REVERSE : BUSHD_INPUT_FORWARD;
      for (int ticks = 0; ticks < 40; ++ticks) {
        SCOPED_TRACE("A " + std::to_string(settings.acceleration) + ", direction " +
                     std::to_string(direction) + ", limit after " + std::to_string(ticks));
        hold(away, 100);
        hold(towards, ticks);
        const std::size_t pressed = rig.history(kMotor).size();
        rig.pins({limit, static_cast<std::uint8_t>(towards)});
        // What is emitted, and what is prepared.
        rig.pass(2);
        const bool turned = direction * rig.history(kMotor).back() >= 0;
        rig.pass(400);
        const std::vector<int> seen = made(pressed + 2);
        if (!turned) {
          EXPECT_TRUE(std::ranges::none_of(seen, [&](int n) { return n * direction > 0; }));
        }
        EXPECT_EQ(rig.poll().moving, 0);
        hold(0, 10);
      }
    }
  }
  expect_counted();
}

TEST_P(Velocity, StopsActAsOnEveryMotor) {
  hold(BUSHD_INPUT_FORWARD, 300);
  rig.emergency(BUSHD_STOP_RAMP);
  rig.pass(100);
  EXPECT_NE(rig.poll().moving, 0);
  rig.pass(200);
  EXPECT_EQ(rig.poll().moving, 0);
  hold(0, 1);
  ASSERT_EQ(rig.control(BUSHD_CONTROL_CLEAR_FAULTS), BUSHD_OK);
  hold(BUSHD_INPUT_FORWARD, 300);
  rig.emergency(BUSHD_STOP_IMMEDIATE);
  rig.pass(2);
  const std::int64_t at = rig.pulses(kMotor);
  rig.pass(100);
  EXPECT_EQ(rig.pulses(kMotor), at);
  hold(0, 1);
  ASSERT_EQ(rig.control(BUSHD_CONTROL_CLEAR_FAULTS), BUSHD_OK);
  // From rest, not from the speed at which it was cut.
  const std::size_t from = rig.history(kMotor).size() + kUntilItBegins + 1;
  hold(BUSHD_INPUT_FORWARD, 60);
  const std::vector<int> seen = made(from);
  Document document(kSettings);
  for (const int steps : seen) EXPECT_EQ(steps, document.tick(kSettings.most, kTick));
  hold(0, 1);
  expect_counted();
}

TEST_P(Velocity, HostsGetTheMotorWhenItRests) {
  hold(BUSHD_INPUT_FORWARD, 50);
  EXPECT_EQ(rig.take({.flags = kStart,
                      .first = rig.first_open(),
                      .mask = 1u << kMotor,
                      .displacements = {one()},
                      .delays = {0}}),
            BUSHD_E_STATE);
  EXPECT_EQ(rig.velocity({kMotor, 40, 100, 1}), BUSHD_E_STATE);
  EXPECT_EQ(rig.velocity(kSettings), BUSHD_OK) << "it changes nothing";
  hold(0, 1);
  rig.pass_until_rest();
  const std::int64_t at = rig.pulses(kMotor);
  Ticks ticks = ones(kStart, rig.first_open(), 30, 0);
  ticks.mask = 1u << kMotor;
  ASSERT_EQ(rig.take(ticks), BUSHD_OK);
  hold(BUSHD_INPUT_REVERSE, 60);
  EXPECT_EQ(rig.pulses(kMotor), at + 30) << "it belongs to the host until the next press";
  hold(0, 1);
  expect_counted();
}

TEST_P(Velocity, WorksByItselfAfterPowerOnAndNeedsNoTable) {
  ASSERT_EQ(rig.control(BUSHD_CONTROL_FORGET_TABLES), BUSHD_OK);
  rig.restart_with_nvm();
  rig.forget_history();
  hold(BUSHD_INPUT_FORWARD, 200);
  EXPECT_TRUE(rig.enabled());
  Document document(kSettings);
  for (const int steps : made(kUntilItBegins + 1)) {
    EXPECT_EQ(steps, document.tick(kSettings.most, kTick));
  }
  hold(0, 1);
  rig.pass_until_rest();
  EXPECT_GT(rig.pulses(kMotor), 200);
}

TEST_P(Velocity, AnotherTickOrEmissionEndsTheSettings) {
  const bushd_emission burst = {.mode = BUSHD_EMISSION_BURST,
                                .sequence = 0,
                                .hold_current = false,
                                .step_us = 100,
                                .settle_us = 0,
                                .dir_setup_us = 0,
                                .pulse_us = 0};
  ASSERT_EQ(rig.emission(burst), BUSHD_OK);
  hold(BUSHD_INPUT_FORWARD, 100);
  EXPECT_EQ(rig.pulses(kMotor), 0) << "no table either";
  hold(0, 1);
  // 2.56 ms hold 25 periods of 100 us: 24 of 64 intervals and one more fit, 23 do not.
  const auto with_period = [](int intervals) {
    return bushd_set_velocity{kMotor, 64, 2560000 / intervals, 1000};
  };
  EXPECT_EQ(rig.velocity(with_period(4)), BUSHD_E_CAPACITY);
  EXPECT_EQ(rig.velocity(with_period(5)), BUSHD_OK);
  hold(BUSHD_INPUT_FORWARD, 1200);
  hold(0, 1);
  expect_counted();
  ASSERT_EQ(rig.configure(format, 2 * Rig::kTickNs), BUSHD_OK);
  EXPECT_EQ(rig.mcu().config.velocity[kMotor].settings.most, 0);
}

TEST_P(Velocity, WhatItCannotIsRefused) {
  EXPECT_EQ(rig.velocity({2, 40, 100, 1}), BUSHD_E_FORMAT) << "it has the loop for two motors";
  EXPECT_EQ(rig.velocity({2, 0, 0, 0}), BUSHD_OK);
  EXPECT_EQ(rig.velocity({4, 0, 0, 0}), BUSHD_E_FORMAT) << "it has four";
  Rig none({.disabled_capabilities = BUSHD_CAN_VELOCITY});
  EXPECT_EQ(none.velocity({0, 0, 0, 0}), BUSHD_E_UNKNOWN_MESSAGE);
  EXPECT_EQ(none.identify().capabilities & BUSHD_CAN_VELOCITY, 0u);
  Rig fresh;
  EXPECT_EQ(fresh.velocity(kSettings), BUSHD_E_STATE) << "before CONFIGURE";
  // 40 kHz in a tick of 5 ms: 201 steps.
  ASSERT_EQ(fresh.configure(BUSHD_FORMAT_FINE, 5'000'000), BUSHD_OK);
  EXPECT_EQ(fresh.velocity({0, 40, BUSHD_VELOCITY_MOST, 1}), BUSHD_E_CAPACITY);
}

TEST_P(Velocity, WithoutSettingsItsTableCountsAgain) {
  ASSERT_EQ(rig.velocity({kMotor, 0, 0, 0}), BUSHD_OK);
  hold(BUSHD_INPUT_FORWARD, 130);
  hold(0, 1);
  rig.pass_until_rest();
  auto reference = Reference::move(law, 100000);
  reference.ramp_down_at(128 * std::uint64_t{Rig::kTickNs});
  expect_steps(made(4), steps_by_tick(reference, Rig::kTickNs));
  expect_counted();
}

// At full speed T is floor(2560000 / 96000) = 26 intervals of 25 us, in slots of 10 us.
TEST_P(Velocity, StepsAreInTheSlotsOfTheirTimes) {
  hold(BUSHD_INPUT_FORWARD, 250);
  std::vector<std::int64_t> slots_of_steps;
  for (int tick = 0; tick < 100; ++tick) {
    for (std::uint16_t slot = 0; slot < kSlots; ++slot) {
      if ((rig.slot_buffer().step[slot] >> kMotor & 1) != 0) {
        slots_of_steps.push_back(tick * kSlots + slot);
      }
    }
    rig.pass();
  }
  ASSERT_GT(slots_of_steps.size(), 390u);
  for (std::size_t i = 0; i < slots_of_steps.size(); ++i) {
    // From the first step on: the slot in which its time lies, which is known to a slot.
    const std::int64_t since = slots_of_steps[i] - slots_of_steps[0];
    EXPECT_EQ(std::abs(since - static_cast<std::int64_t>(i) * 65) <= 1, true) << i;
  }
  hold(0, 1);
  expect_counted();
}

}  // namespace
}  // namespace bushd::test
