// Tables renewed while the daemon runs.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/lab.h"

namespace bushd::test {
namespace {

// Ten times slower than the shipped table of that name, so that a move tells which of them it used.
constexpr const char* kSlow = R"(name = "bushd2-constant"
time_unit_ns = 40000
accel = [250, 200, 150, 100]
)";

std::int64_t milliseconds_of_move(Lab& lab, std::int64_t steps) {
  const std::int64_t start = lab.now_us();
  EXPECT_EQ(lab.wait(lab.send(command_t::MOVE_RELATIVE, {"m01"}, {steps})).result, "reached");
  return (lab.now_us() - start) / 1000;
}

TEST(Reload, ChangedTableServesTheNextMove) {
  Lab lab(hall(2, 2));
  lab.connect();
  // Cruise is 10 units of 40 us a step, then 100: 1000 steps take well under 2 s, then at least 4
  // s.
  EXPECT_LT(milliseconds_of_move(lab, 1000), 2000);
  lab.write_file("bushd2-constant.toml", kSlow);
  ASSERT_TRUE(lab.reload_tables());
  lab.connect();
  EXPECT_GE(milliseconds_of_move(lab, 1000), 4000);
  EXPECT_EQ(lab.shaft_steps("m01"), 2000);
  EXPECT_EQ(lab.motor("m01").trust, "known");
}

// Another revision is another table, also with the same codes: the MCU is to tell which one it has.
TEST(Reload, RevisionsReachTheMcus) {
  Lab lab(hall(1, 2));
  lab.write_file("bushd2-constant.toml", std::string(kSlow) + "revision = 3\n");
  ASSERT_TRUE(lab.reload_tables());
  lab.connect();
  const bushd_mcu& core = lab.bus(0).mcu(0).core();
  EXPECT_EQ(core.table[0].revision, 3u);
  lab.write_file("bushd2-constant.toml", std::string(kSlow) + "revision = 4\n");
  ASSERT_TRUE(lab.reload_tables());
  lab.connect();
  EXPECT_TRUE(core.table[0].valid);
  EXPECT_EQ(core.table[0].revision, 4u);
}

TEST(Reload, RefusedWhileAMotorOfTheGroupMoves) {
  Lab lab(hall(1, 2));
  lab.connect();
  const auto move = lab.send(command_t::MOVE_RELATIVE, {"m02"}, {1000});
  lab.run_for(0.5);
  lab.write_file("bushd2-constant.toml", kSlow);
  const auto refused = lab.reload_tables();
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().text(), testing::HasSubstr("m02 moves"));
  EXPECT_EQ(lab.wait(move).result, "reached");
  EXPECT_EQ(lab.shaft_steps("m02"), 1000);
  EXPECT_TRUE(lab.reload_tables());
}

TEST(Reload, BadFileLeavesTheOldTableInService) {
  Lab lab(hall(1, 1));
  lab.connect();
  lab.write_file("bushd2-constant.toml",
                 "name = \"bushd2-constant\"\ntime_unit_ns = 40000\naccel = [1, 2]\n");
  const auto refused = lab.reload_tables();
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().text(), testing::HasSubstr("bushd2-constant.toml:3"));
  EXPECT_LT(milliseconds_of_move(lab, 1000), 2000);
}

TEST(Reload, OtherChangesNeedARestart) {
  Lab lab(hall(1, 2));
  lab.connect();
  lab.write_file("bushd.toml", hall(1, 3));
  const auto refused = lab.reload_tables();
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().text(), testing::HasSubstr("restart"));
}

}  // namespace
}  // namespace bushd::test
