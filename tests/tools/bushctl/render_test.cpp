// How positions are shown that nobody knows.
#include "tools/bushctl/render.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

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
  EXPECT_TRUE(shown["user"].is_null());
  EXPECT_TRUE(shown["dial"].is_null());
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

}  // namespace
}  // namespace bushctl
