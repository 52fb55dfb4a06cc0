#include "tools/bushctl/health_view.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "lcm/messages.h"

namespace bushctl {
namespace {

using testing::Contains;
using testing::HasSubstr;

bushd::lcm::Health health() {
  bushd::lcm::Health all{.sequence = 4, .buses = {bushd::test::health_part(4, 0, 1, 2)}};
  all.buses[0].mcus[1].low_water_ticks = 117;
  all.buses[0].mcus[1].repeats = 9;
  return all;
}

TEST(HealthView, TableHasBusesLatenciesAndMcus) {
  const auto lines = health_table(health());
  EXPECT_THAT(lines[1], HasSubstr("open"));
  EXPECT_THAT(lines, Contains(HasSubstr("<1 ms  more")));
  EXPECT_THAT(lines.back(), testing::AllOf(HasSubstr("hall:2"), HasSubstr("117")));
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
  hostile.buses[0].port_state = "\x1b[2J";
  hostile.buses[0].mcus[0].unique_id = "\x07";
  for (const std::string& line : health_table(hostile)) {
    EXPECT_EQ(line.find_first_of("\x1b\x07"), std::string::npos);
  }
}

}  // namespace
}  // namespace bushctl
