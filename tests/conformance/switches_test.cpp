// Motors with limit and home switches at inputs of their own, an image beside its virtual twin:
// each limit, levels, homing between limits from anywhere, with contacts that bounce, and settings
// over a reset.
#include <cstdlib>
#include <utility>
#include <vector>

#include "conformance/script.h"
#include "sim/switch.h"

namespace bushd::sim::switches_test {
namespace {

constexpr std::uint8_t kMotor = 6;
// Inputs, of sixteen (Script::own).
constexpr std::uint8_t kPositive = 13;
constexpr std::uint8_t kNegative = 2;
constexpr std::uint8_t kHome = 9;
constexpr std::int64_t kEnd = 500;

constexpr std::uint16_t bit(unsigned n) {
  return static_cast<std::uint16_t>(1u << n);
}

// What stands at the motor.
class Stage {
 public:
  Stage(std::int64_t home_at_steps, std::uint8_t positive, std::uint8_t home) {
    put(positive, {.at_steps = kEnd, .positive_end = true, .seed = 1});
    put(kNegative, {.at_steps = -kEnd, .seed = 2, .opens = true});
    put(home, {.at_steps = home_at_steps, .seed = 3, .width_steps = 80});
  }

  bushd_inputs sense(TimeNs now_ns, std::int64_t position_steps) {
    unsigned active = 0;
    for (auto& [input, contact] : contacts_) {
      if (contact.read(now_ns, position_steps)) active |= 1u << input;
    }
    return {static_cast<std::uint16_t>(active), 0};
  }

 private:
  // Three ticks of bounce are within a slow step.
  void put(std::uint8_t input, SwitchOptions options) {
    options.hysteresis_steps = 5;
    options.bounce_ns = 3 * TimeNs{kTickNs};
    contacts_.emplace_back(input, Switch(options));
  }

  std::vector<std::pair<std::uint8_t, Switch>> contacts_;
};

class Switches : public TargetScript {
 protected:
  static constexpr std::int64_t kHomeAt = -120;

  void SetUp() override {
    ASSERT_NO_FATAL_FAILURE(make_ready(BUSHD_FORMAT_FINE, {kMotor}));
    ASSERT_NO_FATAL_FAILURE(wire(own(kHome)));
  }

  void wire(std::uint8_t home) {
    sense();
    bushd_set_inputs inputs{};
    inputs.limit_positive = inputs.limit_negative = bit(kMotor);
    inputs.inverted = bit(kNegative);
    inputs.debounce_ticks = 1;
    ASSERT_NO_FATAL_FAILURE(ask(inputs));
    ASSERT_NO_FATAL_FAILURE(ask(bushd_motor_inputs{kMotor, own(kPositive), kNegative, home}));
  }

  // By the pins of the twin: a step of both is not at just the same time, and the contacts are to
  // say the same to both.
  std::int64_t position_steps() { return position(0, kMotor); }
  void sense() {
    to_inputs_time();
    set_inputs(stage_.sense(bus_.now_ns(), position_steps()));
  }

  // Polls take ticks in which nobody looks at the switches, so they wait until nothing moves.
  void pass_until_rest() {
    std::int64_t stood_at = position_steps();
    for (int ticks = 1; ticks < 6000; ++ticks) {
      sense();
      if (ticks % 60 != 0) continue;
      if (std::exchange(stood_at, position_steps()) != stood_at) continue;
      if (master_.poll(kReal).moving == 0 && master_.poll(kVirtual).moving == 0) return;
    }
    FAIL() << "it does not come to rest";
  }

  void go(std::int8_t direction, std::uint32_t steps) {
    run_by_table(master_.poll(kReal).tick + 24, {{kMotor, 0, direction, steps, 0}});
    ASSERT_NO_FATAL_FAILURE(pass_until_rest());
  }
  void go_to(std::int64_t place) {
    const std::int64_t way = place - position_steps();
    if (way == 0) return;
    go(way > 0 ? 1 : -1, static_cast<std::uint32_t>(std::abs(way)));
  }

  void home(std::int8_t direction) {
    Script::home({kMotor, direction, 3000, 0, 400, 1000, 0});
    ASSERT_NO_FATAL_FAILURE(pass_until_rest());
  }

  void expect_home_at(std::int64_t at) {
    const bushd_report report = master_.poll(kReal);
    EXPECT_EQ(report.homing, BUSHD_HOMING_DONE);
    EXPECT_EQ(report.homed, bit(kMotor));
    // Bounce, of three ticks, and the tick up to the next reading end within a slow step, of 10 ms
    // or almost four ticks.
    const std::int64_t off = position_steps() - at - report.motor[kMotor].position_steps;
    EXPECT_LE(std::abs(off), 1) << "the counter is 0 where the switch closes";
    // Then come two more readings, and the tick that is prepared by then is made: eight ticks in
    // all, 20.5 ms, in which two more steps may begin.
    EXPECT_LE(std::abs(position_steps() - at), 2);
  }

  void expect_alike() {
    Script::expect_alike({kMotor});
    const bushd_report expected = master_.poll(kVirtual);
    const bushd_report report = master_.poll(kReal);
    EXPECT_EQ(report.forbidden_positive, expected.forbidden_positive);
    EXPECT_EQ(report.forbidden_negative, expected.forbidden_negative);
    EXPECT_EQ(report.homing, expected.homing);
  }

  Stage stage_{kHomeAt, own(kPositive), own(kHome)};
};
BUSHD_FOR_TARGETS(Switches, targets());

TEST_P(Switches, EachLimitStopsItsDirection) {
  for (const std::int8_t direction : {std::int8_t{1}, std::int8_t{-1}}) {
    SCOPED_TRACE(int{direction});
    ASSERT_NO_FATAL_FAILURE(go(direction, 1500));
    const bushd_report report = master_.poll(kReal);
    EXPECT_EQ(report.forbidden_positive, direction > 0 ? bit(kMotor) : 0);
    EXPECT_EQ(report.forbidden_negative, direction < 0 ? bit(kMotor) : 0);
    EXPECT_EQ(report.inputs, bit(direction > 0 ? own(kPositive) : kNegative));
    EXPECT_GE(position_steps() * direction, kEnd);
    // At cruise, 0.9 ms, a tick has 2.9 steps: three ticks of bounce, one for debouncing, two until
    // the MCU acts, and then its ramp.
    const std::int64_t overrun = 18 + static_cast<std::int64_t>(codes_.size());
    EXPECT_LE(position_steps() * direction, kEnd + overrun);
    expect_alike();
  }
}

TEST_P(Switches, HomeIsFoundFromAnywhereBetweenTheLimits) {
  for (const std::int64_t from : {300, -400, 900, -900, -150, -200}) {
    SCOPED_TRACE("from " + std::to_string(from));
    ASSERT_NO_FATAL_FAILURE(go_to(from));
    ASSERT_NO_FATAL_FAILURE(home(-1));
    expect_home_at(kHomeAt);
    expect_alike();
  }
}

TEST_P(Switches, ALimitMayBeTheHomeSwitch) {
  ASSERT_NO_FATAL_FAILURE(wire(kNegative));
  ASSERT_NO_FATAL_FAILURE(home(-1));
  expect_home_at(-kEnd);
  EXPECT_EQ(master_.poll(kReal).forbidden_negative, bit(kMotor));
  expect_alike();
}

// Nothing is connected to that input.
TEST_P(Switches, NoHomeBetweenTheLimits) {
  ASSERT_NO_FATAL_FAILURE(wire(kMotor));
  ASSERT_NO_FATAL_FAILURE(home(1));
  EXPECT_EQ(master_.poll(kReal).homing, BUSHD_HOMING_NOT_FOUND);
  EXPECT_EQ(master_.poll(kReal).forbidden_negative, bit(kMotor));
  EXPECT_LE(position_steps(), -kEnd);
  expect_alike();
}

}  // namespace
}  // namespace bushd::sim::switches_test
