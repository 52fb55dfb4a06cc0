// How positions are shown, those that nobody knows too, and how far a move has come.
#include "tools/bushctl/render.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "client/status_json.h"
#include "tools/bushctl/progress.h"

namespace bushctl {
namespace {

namespace api = bushd::api;
using testing::HasSubstr;

constexpr std::int64_t kHeard = 1'700'000'000'000'000;

bushd::client::Status status_of(const api::MotorState& motor) {
  bushd::client::Status status;
  status.states.resize(1);
  status.states[0].snapshot = {.bus = "hall", .mcu = "hall:1", .motors = {motor}};
  status.descriptions.resize(1);
  status.descriptions[0].snapshot = {.motors = {{.name = motor.name}}};
  return status;
}

TEST(Render, AnUnknownPositionIsNoNumber) {
  const api::MotorState motor{.name = "theta", .trust = api::Trust::kUnknown};
  EXPECT_THAT(motor_line(status_of(motor), 0, 0), HasSubstr("theta position - target -"));
  EXPECT_THAT(motor_line(status_of(motor), 0, 0), HasSubstr("unknown"));
  const auto shown = nlohmann::json::parse(json(status_of(motor)))["motors"][0];
  EXPECT_TRUE(shown["position_steps"].is_null());
  EXPECT_TRUE(shown["target_steps"].is_null());
  EXPECT_TRUE(shown["user_position"].is_null());
  EXPECT_TRUE(shown["dial_position"].is_null());
  EXPECT_TRUE(shown["heard_utime_us"].is_null());
  EXPECT_EQ(shown["trust"], "unknown");
}

TEST(Render, AStalePositionHasItsTime) {
  const api::MotorState motor{.name = "theta",
                              .position_steps = 42,
                              .trust = api::Trust::kStale,
                              .uncertain_reason = "lost",
                              .heard_utime_us = kHeard};
  EXPECT_THAT(motor_line(status_of(motor), 0, 0), HasSubstr("position 42"));
  EXPECT_THAT(motor_line(status_of(motor), 0, 0), HasSubstr("stale heard 2023-11-1"));
  EXPECT_THAT(table(status_of(motor)).at(1), HasSubstr("stale  heard 2023-11-1"));
  const auto shown = nlohmann::json::parse(json(status_of(motor)))["motors"][0];
  EXPECT_EQ(shown["position_steps"], 42);
  EXPECT_EQ(shown["heard_utime_us"], kHeard);
  EXPECT_EQ(shown["uncertain_reason"], "lost");
}

TEST(Render, ABusHasItsPort) {
  auto status = status_of({.name = "theta"});
  status.states.push_back(status.states.front());
  status.descriptions.push_back(status.descriptions.front());
  for (auto& description : status.descriptions) {
    description.snapshot.address = 1;
    description.snapshot.port = "/dev/ttyUSB1";
  }
  const auto lines = table(status);
  ASSERT_GE(lines.size(), 2u);
  EXPECT_THAT(lines.end()[-2], testing::StartsWith("BUS"));
  EXPECT_EQ(lines.back(), "hall  /dev/ttyUSB1") << "once for all of its MCUs";
  EXPECT_EQ(nlohmann::json::parse(json(status))["mcus"][0]["port"], "/dev/ttyUSB1");
  for (auto& description : status.descriptions) description.snapshot.port.clear();
  EXPECT_EQ(table(status).back(), "hall  not open");
}

// 400 steps are a mm, user positions fall where steps rise; -10 .. 30 mm for the user.
bushd::client::Status stage_at(double user, std::int64_t steps) {
  bushd::client::Status status = status_of({.name = "x",
                                            .position_steps = steps,
                                            .user = user,
                                            .target_steps = -2000,
                                            .user_target = 5,
                                            .velocity_steps_per_s = -100,
                                            .moving = true});
  auto& stage = status.descriptions[0].snapshot.motors[0];
  stage.scale = {.unit = "mm",
                 .steps_per_unit = *bushd::units::parse_ratio("400"),
                 .negative = true,
                 .decimals = 2};
  stage.soft_limits = bushd::units::SoftLimits{.low = -30, .high = 10};
  return status;
}

TEST(Render, BarsShowWhereAMotorStandsBetweenItsLimits) {
  EXPECT_THAT(table(stage_at(-10, 4000)).at(1), HasSubstr(" -10 |x--------------| 30 "));
  EXPECT_THAT(table(stage_at(10, -4000)).at(1), HasSubstr(" -10 |-------x-------| 30 "));
  EXPECT_THAT(table(stage_at(30, -12000)).at(1), HasSubstr(" -10 |--------------x| 30 "));
  EXPECT_THAT(table(stage_at(31, -12400)).at(1), HasSubstr(" -10 |-------------->| 30 "));
  EXPECT_THAT(table(stage_at(-11, 4400)).at(1), HasSubstr(" -10 |<--------------| 30 "));
  auto unknown = stage_at(0, 0);
  unknown.states[0].snapshot.motors[0].trust = api::Trust::kUnknown;
  EXPECT_THAT(table(unknown).at(1), HasSubstr(" -10 |---------------| 30 "));
}

TEST(Render, SpeedsAreInTheMotorsUnit) {
  EXPECT_THAT(table(stage_at(0, 0)).at(1), HasSubstr(" 0.25 mm/s "));
  EXPECT_THAT(motor_line(stage_at(0, 0), 0, 0), HasSubstr("velocity 0.25 mm/s moving"));
}

TEST(Render, SaysHowAMotorStandsAndWhatBoundsIt) {
  auto status = stage_at(2, -800);
  EXPECT_EQ(stand_text(status, 0, 0), "2.00 mm, 0.25 mm/s");
  EXPECT_EQ(bounds_text(status, 0, 0), "-10 .. 30");
  api::MotorState& motor = status.states[0].snapshot.motors[0];
  motor.moving = false;
  motor.trust = api::Trust::kUncertain;
  motor.inhibited.positive = true;
  status.descriptions[0].snapshot.motors[0].soft_limits.reset();
  EXPECT_EQ(stand_text(status, 0, 0), "2.00 mm, at rest");
  EXPECT_EQ(bounds_text(status, 0, 0), "uncertain | limit positive | no soft limits");
}

TEST(Render, TellsOfPositionsThatWereRoundedToAStep) {
  const api::Move move{
      .kind = api::Move::Kind::kAbsolute,
      .motors = {{"x", api::UserUnits{12.345}}, {"y", api::UserUnits{-2.5}}, {"z", 400}}};
  const auto reached = [](const std::string& motor, double user) {
    return api::MotorResult{.motor = motor,
                            .outcome = api::Outcome::kReached,
                            .user = user,
                            .unit = "mm",
                            .precision = 4};
  };
  std::vector<api::MotorResult> results{reached("x", 12.34481), reached("y", -2.5),
                                        reached("z", 1)};
  const auto lines_of = [&](const api::Request& request) {
    return rounding_lines(request, api::Completed{.reason = "r", .detail = results});
  };
  EXPECT_THAT(lines_of(move), testing::ElementsAre("x: at 12.3448 mm, asked 12.345"));
  // Results come in an order of their own, and of motors that nobody has named: an axis is computed
  // from them.
  std::ranges::reverse(results);
  results.insert(results.begin(), reached("left", -2.001));
  EXPECT_THAT(lines_of(move), testing::ElementsAre("x: at 12.3448 mm, asked 12.345"));
  results.back().outcome = api::Outcome::kStopped;
  EXPECT_THAT(lines_of(move), testing::IsEmpty());
  EXPECT_THAT(lines_of(api::Stop{}), testing::IsEmpty());
}

TEST(Progress, ShowsTheWayFromWhereItWasSeenFirst) {
  Progress progress({"x", "elsewhere"});
  EXPECT_EQ(progress.text(stage_at(0, 0), 10), "x [>         ] 0 %, at 0.00 of 5.00 mm, 20 s left");
  EXPECT_EQ(progress.text(stage_at(2, -800), 10),
            "x [====>     ] 40 %, at 2.00 of 5.00 mm, 12 s left");
  EXPECT_EQ(progress.text(stage_at(2, -800), 0), "x 40 %, at 2.00 of 5.00 mm, 12 s left");
  EXPECT_EQ(progress.text(stage_at(5, -2000), 10), "");
}

TEST(Progress, KnowsNoTimeWhereTheSpeedTellsNone) {
  Progress progress({"x"});
  auto begins = stage_at(0, 0);
  begins.states[0].snapshot.motors[0].velocity_steps_per_s = 0;
  EXPECT_EQ(progress.text(begins, 0), "x 0 %, at 0.00 of 5.00 mm");
  auto turns = stage_at(0, 0);
  turns.states[0].snapshot.motors[0].velocity_steps_per_s = 100;  // away from the target
  EXPECT_EQ(progress.text(turns, 0), "x 0 %, at 0.00 of 5.00 mm");
}

TEST(Progress, ShowsTheMotorThatTakesLongest) {
  Progress progress({"x", "y"});
  auto both = stage_at(0, 0);
  api::MotorState y = both.states[0].snapshot.motors[0];
  y.name = "y";
  y.velocity_steps_per_s = -50;
  both.states[0].snapshot.motors.push_back(y);
  both.descriptions[0].snapshot.motors.push_back(both.descriptions[0].snapshot.motors[0]);
  both.descriptions[0].snapshot.motors[1].name = "y";
  EXPECT_THAT(progress.text(both, 0), testing::StartsWith("y 0 %"));
  EXPECT_EQ(Progress({"z"}).text(both, 0), "");
}

}  // namespace
}  // namespace bushctl
