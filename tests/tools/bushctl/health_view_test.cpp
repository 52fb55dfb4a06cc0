#include "tools/bushctl/health_view.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace bushctl {
namespace {

using testing::Contains;
using testing::HasSubstr;

bushd::client::Status health() {
  bushd::client::Status status;
  status.healths.push_back(
      {.part = {},
       .snapshot = {
           .bus = "hall",
           .port_state = "open",
           .latency = {{1000, 7}, {INT64_MAX, 1}},
           .mcus = {{.mcu = "hall:1"}, {.mcu = "hall:2", .repeats = 9, .low_water_ticks = 117}}}});
  return status;
}

TEST(HealthView, TableHasBusesLatenciesAndMcus) {
  const auto lines = health_table(health());
  EXPECT_THAT(lines[1], HasSubstr("open"));
  EXPECT_THAT(lines, Contains(HasSubstr("<1 ms  more")));
  EXPECT_THAT(lines.back(), testing::AllOf(HasSubstr("hall:2"), HasSubstr("117")));
}

TEST(HealthView, ABusWithoutStartsAtOnceHasNoMargin) {
  auto status = health();
  EXPECT_THAT(health_table(status)[1], HasSubstr("  -  open"));
  status.healths[0].snapshot.start_margin_us = 2'000;
  EXPECT_THAT(health_table(status)[1], HasSubstr("  2.0  open"));
}

TEST(HealthView, WhatIsNotThereIsNullInJson) {
  const auto bus = nlohmann::json::parse(health_json(health()))["buses"][0];
  EXPECT_TRUE(bus["mcus"][0]["low_water_ticks"].is_null());
  EXPECT_EQ(bus["mcus"][1]["low_water_ticks"], 117);
  EXPECT_EQ(bus["mcus"][1]["repeats"], 9);
  EXPECT_EQ(bus["latency"][0]["below_us"], 1000);
  EXPECT_TRUE(bus["latency"][1]["below_us"].is_null());
}

TEST(HealthView, TextsDoNotSteerTheTerminal) {
  auto hostile = health();
  hostile.healths[0].snapshot.port_state = "\x1b[2J";
  hostile.healths[0].snapshot.mcus[0].unique_id = "\x07";
  for (const std::string& line : health_table(hostile)) {
    EXPECT_EQ(line.find_first_of("\x1b\x07"), std::string::npos);
  }
}

}  // namespace
}  // namespace bushctl
