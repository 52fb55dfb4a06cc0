// What types say of themselves as JSON.
#include "base/fields_json.h"

#include <gtest/gtest.h>

#include "api/snapshot.h"
#include "base/json_text.h"

namespace bushd::api {
namespace {

TEST(FieldsJson, HaveTheirNamesInTheirOrder) {
  EXPECT_EQ(
      json_text(json_of(MovePlan{
          .duration_us = 1,
          .ticks = 2,
          .traffic = MovePlan::Traffic{.frames = 3, .bytes = 4},
          .limited_by = "a",
          .motors = {{.motor = "a", .steps = 5, .duration_us = 6, .peak_steps_per_s = 7.5}},
          .points_us = {8, 9}})),
      R"({"duration_us":1,"ticks":2,"frames":3,"bytes":4,"limited_by":"a","motors":[)"
      R"({"motor":"a","steps":5,"duration_us":6,"peak_steps_per_s":7.5}],"points_us":[8,9]})");
}

TEST(FieldsJson, ATypeWithinIsAnObject) {
  const auto entry = json_of(TableEntry{.name = "n", .table = {.name = "t", .revision = 2}});
  EXPECT_EQ(entry["table"]["name"], "t");
  EXPECT_EQ(entry["table"]["revision"], 2);
}

TEST(FieldsJson, WordsAreWords) {
  const auto motor = json_of(MotorState{.activity = Activity::kHoming});
  EXPECT_EQ(motor["activity"], "home");
  EXPECT_EQ(motor["trust"], "known");
}

TEST(FieldsJson, WhatSaysNothingIsNull) {
  const auto unknown = json_of(MotorState{.position_steps = 3, .trust = Trust::kUnknown});
  for (const char* name : {"position_steps", "user_position", "dial_position", "target_steps",
                           "user_target", "heard_utime_us", "line_fraction", "line_left_s"}) {
    EXPECT_TRUE(unknown.at(name).is_null()) << name;
  }
  const auto known = json_of(MotorState{
      .position_steps = 3, .line = MotorState::Line{.fraction = 0.5, .left_us = 2'000'000}});
  EXPECT_EQ(known["position_steps"], 3);
  EXPECT_EQ(known["line_fraction"], 0.5);
  EXPECT_EQ(known["line_left_s"], 2);
  const auto free = json_of(MotorDescription{});
  EXPECT_EQ(free["soft_limits"], false);
  EXPECT_TRUE(free["user_low"].is_null());
  const auto limited = json_of(MotorDescription{.soft_limits = units::SoftLimits{-1, 2}});
  EXPECT_EQ(limited["dial_high"], 2);
  EXPECT_TRUE(json_of(McuHealth{})["low_water_ticks"].is_null());
  EXPECT_TRUE(json_of(MovePlan{})["frames"].is_null());
  const auto bus = json_of(HealthSnapshot{.latency = {{7, 1}, {INT64_MAX, 2}}});
  EXPECT_EQ(bus["latency"][0]["below_us"], 7);
  EXPECT_TRUE(bus["latency"][1]["below_us"].is_null());
}

}  // namespace
}  // namespace bushd::api
