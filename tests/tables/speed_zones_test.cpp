#include "tables/speed_zones.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "results.h"
#include "tables/table.h"

namespace bushd::tables {
namespace {

using test::good;
using testing::AllOf;
using testing::HasSubstr;

TEST(SpeedZones, AreReadFromAFile) {
  const auto zones =
      good(parse_zones("description = \"slow at both ends\"\ntable = \"feed\"\nby = \"position\"\n"
                       "steps_per_unit = 12.5\nzones = [[10, 1], [5, 2.5], [-3, 0.5]]\nend = -8\n",
                       "in.envelope"));
  EXPECT_EQ(zones, (SpeedZones{.description = "slow at both ends",
                               .table = "feed",
                               .by = SpeedZones::By::kPosition,
                               .steps_per_unit = 12.5,
                               .zones = {{10, 1}, {5, 2.5}, {-3, 0.5}},
                               .end = -8}));
}

TEST(SpeedZones, GoByDistancesInStepsIfTheFileSaysNoMore) {
  const auto zones = good(parse_zones("table = \"t\"\nzones = [[0, 100]]\nend = 30\n", "f"));
  EXPECT_EQ(zones.by, SpeedZones::By::kDistance);
  EXPECT_EQ(zones.steps_of(7), 7);
}

TEST(SpeedZones, WrittenAsTextAreReadAgain) {
  const SpeedZones zones{.description = "a \"b\"\n",
                         .table = "t",
                         .steps_per_unit = 1.0 / 3,
                         .zones = {{0, 0.1}, {-0.3, 1e-3}},
                         .end = -1e6};
  const auto read = good(parse_zones(to_text(zones), "f"));
  EXPECT_EQ(read, zones);
}

TEST(SpeedZones, WhatIsWrongIsRefusedWithItsLineKeyAndRemedy) {
  struct Case {
    const char* text;
    const char* place;
    const char* why;
  };
  for (const Case& one : {
           Case{"zones = [[0, 1]]\nend = 9\n", "in.envelope:1", "table: is missing"},
           Case{"table = \"\"\nzones = [[0, 1]]\nend = 9\n", ":1:9: table", "is empty"},
           Case{"table = \"t\"\nzones = [[0, 1]]\n", "end", "is missing"},
           Case{"table = \"t\"\nend = 9\n", "zones", "is missing"},
           Case{"table = \"t\"\nzones = []\nend = 9\n", ":2:9: zones", "has 0 zones"},
           Case{"table = \"t\"\nzones = [5]\nend = 9\n", "zones[0]", "is 5; allowed: a pair"},
           Case{"table = \"t\"\nzones = [[0, 1, 2]]\nend = 9\n", "zones[0]", "is 3 numbers"},
           Case{"table = \"t\"\nzones = [[0, 0]]\nend = 9\n", "zones[0]",
                "has the speed 0; allowed: above 0"},
           Case{"table = \"t\"\nzones = [[0, nan]]\nend = 9\n", "zones[0]", "a speed above 0"},
           Case{"table = \"t\"\nzones = [[1, 1]]\nend = 9\n", "zones[0]",
                "begins at 1; allowed by distance: 0"},
           Case{"table = \"t\"\nzones = [[0, 1], [5, 2], [5, 3]]\nend = 9\n", "zones[2]",
                "begins at 5; allowed: between 5, where the zone before begins, and the end, 9"},
           Case{"table = \"t\"\nzones = [[0, 1], [-5, 2]]\nend = 9\n", "zones[1]", "begins at -5"},
           Case{"table = \"t\"\nzones = [[0, 1], [9, 2]]\nend = 9\n", "zones[1]", "begins at 9"},
           Case{"table = \"t\"\nzones = [[0, 1]]\nend = 0\n", "end", "is 0"},
           Case{"table = \"t\"\nzones = [[0, 1]]\nend = 3e9\n", "end", "allowed: up to 2147483647"},
           Case{"table = \"t\"\nby = \"position\"\nzones = [[-2e9, 1]]\nend = 2e9\n", "end",
                "is 4000000000 steps from where the first zone begins; allowed: up to 2147483647"},
           Case{"table = \"t\"\nsteps_per_unit = 0\nzones = [[0, 1]]\nend = 9\n",
                ":2:18: steps_per_unit", "is 0; allowed: a number above 0"},
           Case{"table = \"t\"\nby = \"time\"\nzones = [[0, 1]]\nend = 9\n", "by",
                "is \"time\"; allowed: \"distance\" or \"position\""},
           Case{"table = \"t\"\nzone = [[0, 1]]\nend = 9\n", "zone",
                "unknown key; allowed here: description, table, by, steps_per_unit, zones, end"},
       }) {
    EXPECT_THAT(test::error_of(parse_zones(one.text, "in.envelope")),
                AllOf(HasSubstr(one.place), HasSubstr(one.why)))
        << one.text;
  }
}

TEST(SpeedZones, ASpeedAboveThatOfTheTableIsRefused) {
  const auto table =
      make({.name = "t", .time_unit_ns = 1'000'000, .accel = {20, 10}, .cruise = 10});
  const SpeedZones zones{.table = "t", .zones = {{0, 50}, {9, 100}, {20, 120}}, .end = 30};
  EXPECT_EQ(test::error_of(check_speeds(zones, (*table)->view())),
            "zones[2]: has 120 steps/s, and the table \"t\" reaches 100; use a lower speed or a "
            "faster table");
  SpeedZones slower = zones;
  slower.zones[2].speed = 100;
  EXPECT_TRUE(check_speeds(slower, (*table)->view()));
  slower.steps_per_unit = 2;
  EXPECT_FALSE(check_speeds(slower, (*table)->view()));
}

TEST(SpeedZones, ANameIsThatOfAFileInTheFolderOfTables) {
  EXPECT_EQ(envelope_path("in", "/etc/bushd/tables"), "/etc/bushd/tables/in.envelope");
  EXPECT_EQ(envelope_path("./in.envelope", "/etc"), "./in.envelope");
  EXPECT_EQ(envelope_path("a/in", "/etc"), "a/in");
}

}  // namespace
}  // namespace bushd::tables
