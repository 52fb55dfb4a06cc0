// Motors with limit and home switches at inputs of their own, from the switch to the client.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>

#include "daemon/lab.h"
#include "sim/plant.h"
#include "sim/shipped_motors.h"

namespace bushd::test {
namespace {

using testing::HasSubstr;

constexpr std::uint8_t kPositive = 9;
constexpr std::uint8_t kNegative = 14;
constexpr std::uint8_t kHome = 3;
constexpr std::int64_t kEnd = 5000;
// The way by the table bushd2-constant. At cruise, 0.4 ms, a tick has 6.4 steps: 6 ms of bounce, a
// tick for debouncing and two until the MCU acts make 35, and then comes the ramp, of 238 codes.
constexpr std::int64_t kOverrun = 35 + 238;
// Bounce, the tick up to the next reading, two more readings, and the tick that is prepared by then
// and that which is made: 6 ms and five ticks, less than two slow steps of 10 ms.
constexpr std::int64_t kSlowOverrun = 1;

const std::string kInputs =
    "inputs = { positive = 9, negative = { input = 14, active = \"open\" }, home = 3, step = 7 }\n";
const std::string kHomes =
    "home = { direction = \"negative\", position_steps = -50, most_steps = 15000 }\n";

// Two motors on one MCU; the keys are of m01.
std::string lab_with(const std::string& manner, const std::string& keys) {
  return with_keys(hall(1, 2, manner), "m01", keys);
}

// A stage: a limit switch at each end, that at the negative one opens, and a lever between.
void furnish(sim::VirtualMcu& mcu, std::int64_t home_at_steps) {
  mcu.attach_switch(0, {.at_steps = kEnd,
                        .positive_end = true,
                        .hysteresis_steps = 6,
                        .bounce_ns = 6'000'000,
                        .seed = 1,
                        .input = kPositive});
  mcu.attach_switch(0, {.at_steps = -kEnd,
                        .hysteresis_steps = 6,
                        .bounce_ns = 6'000'000,
                        .seed = 2,
                        .opens = true,
                        .input = kNegative});
  mcu.attach_switch(0, {.at_steps = home_at_steps,
                        .hysteresis_steps = 6,
                        .bounce_ns = 6'000'000,
                        .seed = 3,
                        .width_steps = 300,
                        .input = kHome});
}

class MotorInputs : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Manners, MotorInputs,
                         testing::Values("fine", "coarse", "fine_ticks", "fine_table"),
                         [](const auto& manner) { return std::string(manner.param); });

TEST_P(MotorInputs, EachLimitInhibitsItsDirectionAlone) {
  Lab lab(lab_with(GetParam(), kInputs));
  furnish(lab.bus(0).mcu(0), 100'000);
  lab.connect();
  EXPECT_EQ(lab.motor("m01").inputs, "");
  for (const int sign : {1, -1}) {
    const std::string end = sign > 0 ? "positive" : "negative";
    const Answer result = lab.ask(Ask::kMoveBy, {"m01", "m02"}, {sign * 20'000, sign * 100});
    EXPECT_EQ(result.motor_results, (std::vector<std::string>{"limit", "reached"})) << end;
    EXPECT_THAT(result.reason, HasSubstr(end + " end"));
    EXPECT_GE(sign * lab.shaft_steps("m01"), kEnd);
    EXPECT_LE(sign * lab.shaft_steps("m01"), kEnd + kOverrun);
    lab.run_for(0.2);
    EXPECT_EQ(lab.motor("m01").inputs, end);
    EXPECT_TRUE(lab.motor("m01").input);
    EXPECT_FALSE(lab.motor("m02").input);
    EXPECT_EQ(word(lab.motor("m01").inhibited), end);
    EXPECT_EQ(lab.last_reply(lab.send(Ask::kMoveBy, {"m01"}, {sign * 10})).result, "refused");
    EXPECT_EQ(lab.ask(Ask::kMoveTo, {"m01"}, {0}).result, "reached");
    lab.run_for(0.2);
    EXPECT_EQ(lab.motor("m01").inputs, "");
    EXPECT_EQ(word(lab.motor("m01").inhibited), "");
  }
  EXPECT_TRUE(lab.errors().empty());
}

TEST_P(MotorInputs, TheHomeSwitchIsFoundFromEitherSideAndFromEitherLimit) {
  constexpr std::int64_t kAt = -1200;
  sim::Plant plant(1);
  const auto table = tables::load(kShippedTables / "bushd2-constant.toml").value();
  const bool fine = std::string(GetParam()).starts_with("fine");
  const sim::PaceRules rules(table->view(), 2'560'000, BUSHD_MAX_SLOTS,
                             fine ? BUSHD_FORMAT_FINE : BUSHD_FORMAT_COARSE);
  plant.attach(0, 0, rules);
  plant.attach(0, 1, rules);
  Lab lab(lab_with(GetParam(), kInputs + kHomes), {}, &plant);
  plant.on_violation = [](sim::TimeNs, std::size_t, std::size_t, const std::string& what) {
    ADD_FAILURE() << what;
  };
  furnish(lab.bus(0).mcu(0), kAt);
  lab.connect();
  // Counted from the switch, at which it stands at -50.
  const auto go_to = [&](std::int64_t place) {
    const Answer away = lab.ask(Ask::kMoveBy, {"m01"}, {place - lab.shaft_steps("m01")});
    EXPECT_TRUE(away.result == "reached" || away.result == "limit") << away.reason;
  };
  for (const std::int64_t from : {std::int64_t{0}, std::int64_t{-4000}, std::int64_t{7000},
                                  std::int64_t{-7000}, std::int64_t{-1300}, std::int64_t{-1520}}) {
    SCOPED_TRACE(from);
    go_to(from);
    const Answer result = lab.wait(lab.send(Ask::kHome, {"m01"}), 60);
    ASSERT_EQ(result.result, "reached") << result.reason;
    const std::int64_t stands = lab.shaft_steps("m01");
    EXPECT_LE(std::abs(stands - kAt), kSlowOverrun);
    // Bounce and the tick up to the next reading end within a slow step.
    EXPECT_LE(std::abs(result.position_steps.at(0) + 50 - (stands - kAt)), 1);
    EXPECT_EQ(lab.motor("m01").trust, api::Trust::kKnown);
    EXPECT_EQ(word(lab.motor("m01").inhibited), "");
  }
}

TEST_P(MotorInputs, ALimitMayBeTheHomeSwitch) {
  Lab lab(lab_with(GetParam(),
                   "inputs = { positive = 9, negative = { input = 14, active = \"open\" }, "
                   "home = { input = 14, active = \"open\" } }\n" +
                       kHomes));
  furnish(lab.bus(0).mcu(0), 100'000);
  lab.connect();
  const Answer result = lab.ask(Ask::kHome, {"m01"});
  ASSERT_EQ(result.result, "reached") << result.reason;
  EXPECT_LE(std::abs(lab.shaft_steps("m01") + kEnd), kSlowOverrun);
  lab.run_for(0.2);
  EXPECT_EQ(lab.motor("m01").inputs, "negative home");
  EXPECT_EQ(word(lab.motor("m01").inhibited), "negative");
}

TEST(MotorInputsTold, ASwitchThatIsNotBetweenTheLimits) {
  Lab lab(lab_with("fine", kInputs + kHomes));
  furnish(lab.bus(0).mcu(0), -100'000);
  lab.connect();
  const Answer result = lab.wait(lab.send(Ask::kHome, {"m01"}), 60);
  EXPECT_THAT(result, Ends("fault", "was not found within home.most_steps, or up to its limits"));
  EXPECT_GE(lab.shaft_steps("m01"), kEnd) << "it has turned";
  EXPECT_EQ(result.position_steps.at(0), lab.shaft_steps("m01"));
}

TEST(MotorInputsTold, ALimitTooNearToTheHomeSwitch) {
  Lab lab(lab_with("fine", kInputs + kHomes));
  furnish(lab.bus(0).mcu(0), -kEnd - 10);
  lab.connect();
  const Answer result = lab.wait(lab.send(Ask::kHome, {"m01"}), 60);
  EXPECT_THAT(result, Ends("fault", "came to a limit switch while it looked slowly"));
  EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m01"}, {500}).result, "reached");
}

TEST(MotorInputsTold, TheStepSensorIsShownAndStopsNothing) {
  Lab lab(lab_with("fine", kInputs));
  lab.bus(0).mcu(0).set_inputs({1u << 7 | 1u << kNegative, 0});
  lab.connect();
  lab.run_for(0.2);
  EXPECT_EQ(lab.motor("m01").inputs, "step");
  EXPECT_FALSE(lab.motor("m01").input);
  EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m01"}, {50}).result, "reached");
  EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m01"}, {-50}).result, "reached");
}

TEST(MotorInputsTold, ANewDaemonFindsTheSameSwitches) {
  Lab lab(lab_with("fine", kInputs));
  furnish(lab.bus(0).mcu(0), 100'000);
  lab.connect();
  EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m01"}, {20'000}).result, "limit");
  lab.restart_daemon();
  lab.connect();
  EXPECT_EQ(lab.last_reply(lab.send(Ask::kMoveBy, {"m01"}, {1})).result, "refused");
  EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m01"}, {-1}).result, "reached");
}

}  // namespace
}  // namespace bushd::test
