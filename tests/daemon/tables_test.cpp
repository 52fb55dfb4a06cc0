// Which table a group has, who is told of it, and how it gets another one while the daemon runs.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/lab.h"
#include "daemon/lost_frames.h"

namespace bushd::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

// Ten times slower than bushd2-constant, so that a move tells which of them it used.
constexpr const char* kGlacier = R"(name = "glacier"
revision = 3
time_unit_ns = 40000
accel = [250, 200, 150, 100]
)";

// SHA-256 of "40000 100 4 250 200 150 100 100 150 200 250 ", its first 8 digits.
constexpr const char* kGlacierHash = "4259a0ec";

// More than 127 steps in a tick of 2560 us.
constexpr const char* kTooFast = R"(name = "rocket"
time_unit_ns = 1000
accel = [250, 20]
)";

std::string table_of(Lab& lab, const std::string& motor) {
  const api::TableRef table = lab.description(motor).table;
  return table.name + "@" + std::to_string(table.revision);
}

std::int64_t milliseconds_of_move(Lab& lab, std::int64_t steps) {
  const std::int64_t start = lab.now_us();
  EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m01"}, {steps}).result, "reached");
  return (lab.now_us() - start) / 1000;
}

// Group "axes" of hall() and another one, "ends", with the last motor of the first MCU.
std::string two_groups(int mcus, int motors) {
  std::string toml = hall(mcus, motors);
  toml += "[[group]]\nname = \"ends\"\ntable = \"bushd2-scurve\"\n";
  toml += "[[motor]]\nname = \"end\"\nmcu = \"hall:1\"\noutput = 15\ngroup = \"ends\"\n";
  return toml;
}

TEST(TableInService, IsToldByDescriptionAndResultWithRevisionAndHash) {
  ReadyLab lab(hall(1, 2, "fine", "glacier"), kGlacier);
  const api::TableRef glacier{.name = "glacier", .revision = 3, .hash = kGlacierHash};
  EXPECT_EQ(lab.description("m01").table, glacier);
  EXPECT_THAT(lab.ask(Ask::kMoveBy, {"m01", "m02"}, {5, 0}).tables, ElementsAre(glacier, glacier));
}

TEST(UseTable, ServesTheNextMoveAndIsKept) {
  ReadyLab lab(hall(2, 2), kGlacier);
  // Cruise is 10 units of 40 us a step, then 100: 1000 steps take well under 2 s, then at least 4
  // s.
  EXPECT_LT(milliseconds_of_move(lab, 1000), 2000);
  EXPECT_THAT(lab.wait(lab.use("axes", "glacier")), Ends("done", "axes has glacier@3 (4259a0ec)"));
  EXPECT_EQ(table_of(lab, "m04"), "glacier@3");
  EXPECT_THAT(lab.kept(), ElementsAre("glacier"));
  EXPECT_TRUE(lab.all_ready());
  for (int mcu : {0, 1}) EXPECT_EQ(lab.bus(0).mcu(mcu).core().tables.bank[0].revision, 3u);
  EXPECT_GE(milliseconds_of_move(lab, 1000), 4000);
  EXPECT_EQ(lab.shaft_steps("m01"), 2000);
  EXPECT_EQ(lab.motor("m01").trust, api::Trust::kKnown);
}

TEST(UseTable, MoveUnderWayKeepsItsTableAndNoneBeginsByTheOldOne) {
  ReadyLab lab(two_groups(1, 2), kGlacier);
  const auto move = lab.send(Ask::kMoveBy, {"m01"}, {2000});
  lab.run_for(0.5);
  const auto use = lab.use("axes", "glacier");
  lab.run_for(0.1);
  EXPECT_EQ(lab.last_reply(use).phase, Answer::kAccepted);
  EXPECT_EQ(table_of(lab, "m01"), "bushd2-constant@0");
  for (const char* motor : {"m02", "end"}) {
    const Answer refused = lab.ask(Ask::kMoveBy, {motor}, {5});
    EXPECT_EQ(refused.phase, Answer::kRefused);
    EXPECT_THAT(refused.reason, HasSubstr("about to get another table, for group axes"));
  }
  // The one that moves may be given a new target, and still keeps its table.
  const auto farther = lab.send(Ask::kMoveBy, {"m01"}, {500});
  EXPECT_EQ(lab.wait(move).result, "stopped");
  const Answer reached = lab.wait(farther);
  EXPECT_EQ(reached.result, "reached");
  EXPECT_EQ(reached.tables.at(0).name, "bushd2-constant");
  EXPECT_EQ(lab.wait(use).result, "done");
  EXPECT_EQ(table_of(lab, "m01"), "glacier@3");
  EXPECT_EQ(table_of(lab, "end"), "bushd2-scurve@0");
  EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m02", "end"}, {5, 5}).result, "reached");
  EXPECT_EQ(lab.shaft_steps("m01"), 2500);
}

// The parts of a group move may end long before its result.
TEST(UseTable, ResultTellsTheTableOfTheMoveAlsoIfItHasChangedSince) {
  ReadyLab lab(two_groups(2, 2), kGlacier);
  const auto move = lab.send(Ask::kMoveBy, {"m04", "end"}, {4000, 5});
  lab.run_for(0.5);
  EXPECT_EQ(lab.wait(lab.use("ends", "glacier")).result, "done");
  EXPECT_EQ(table_of(lab, "end"), "glacier@3");
  const Answer result = lab.wait(move);
  EXPECT_EQ(result.result, "reached");
  EXPECT_EQ(result.tables.at(1).name, "bushd2-scurve");
}

TEST(UseTable, WhatDoesNotFitIsRefusedAndTheOldOneStays) {
  ReadyLab lab(hall(1, 2), kGlacier);
  lab.write_file("rocket.toml", kTooFast);
  lab.write_file("bad.toml", "name = \"bad\"\ntime_unit_ns = 40000\naccel = [1, 2]\n");
  std::string many = "name = \"many\"\ntime_unit_ns = 40000\naccel = [";
  for (int i = 0; i < 20000; ++i) many += std::to_string(30000 - i) + ", ";
  lab.write_file("many.toml", many + "10]\n");
  const std::pair<const char*, const char*> cases[] = {
      {"rocket", "tick: makes up to 129 steps in a tick of 2560 us; allowed: 127"},
      {"bad", "bad.toml:3:"},
      {"many", "MCU hall:1 has memory for"},
      {"none", "there is no table \"none\""},
      {"glacier@7", "glacier"},
      {"../glacier", "is not a table's name"},
      {"", "no table is named"}};
  for (const auto& [table, reason] : cases) {
    const Answer refused = lab.wait(lab.use("axes", table));
    EXPECT_EQ(refused.phase, Answer::kRefused) << table;
    EXPECT_THAT(refused.reason, HasSubstr(reason));
  }
  EXPECT_THAT(lab.wait(lab.use("nobody", "glacier")).reason, HasSubstr("no group \"nobody\""));
  EXPECT_EQ(table_of(lab, "m01"), "bushd2-constant@0");
  EXPECT_LT(milliseconds_of_move(lab, 1000), 2000);
}

TEST(UseTable, LastOfThoseThatWaitCounts) {
  ReadyLab lab(hall(1, 1), kGlacier);
  const auto move = lab.send(Ask::kMoveBy, {"m01"}, {2000});
  lab.run_for(0.5);
  const auto first = lab.use("axes", "glacier");
  const auto second = lab.use("axes", "bushd2-scurve");
  const Answer superseded = lab.wait(first);
  EXPECT_THAT(superseded, Ends("stopped", "superseded by command"));
  // Even by the one that is in service already: it was not meant.
  const auto third = lab.use("axes", "bushd2-constant");
  EXPECT_EQ(lab.wait(second).result, "stopped");
  EXPECT_EQ(lab.wait(third).result, "done");
  EXPECT_EQ(lab.motor("m01").moving, 1);
  EXPECT_EQ(lab.wait(move).result, "reached");
  EXPECT_EQ(table_of(lab, "m01"), "bushd2-constant@0");
}

// An MCU that is not there cannot move by the old table either: it gets the new one when it comes.
TEST(UseTable, McuThatIsOfflineGetsItWhenItComes) {
  ReadyLab lab(hall(2, 1), kGlacier);
  lab.unplug(0);
  EXPECT_THAT(lab.wait(lab.use("axes", "glacier")),
              Ends("done", "not online, they get it when they come: hall:1 hall:2"));
  lab.plug(0);
  lab.connect();
  for (int mcu : {0, 1}) EXPECT_EQ(lab.bus(0).mcu(mcu).core().tables.bank[0].revision, 3u);
}

TEST(UseTable, McuThatIsLostWhileItGetsTheTableLeavesAllWithTheOldOne) {
  ReadyLab lab(hall(2, 1), kGlacier);
  // The second MCU hears nothing of the table.
  lab.on_send = loses(2, BUSHD_MSG_TABLE_DATA);
  const Answer used = lab.wait(lab.use("axes", "glacier"));
  EXPECT_THAT(used, Ends("fault", "MCU hall:2 did not confirm it in time"));
  EXPECT_THAT(used.reason, HasSubstr("group axes keeps bushd2-constant"));
  EXPECT_TRUE(lab.kept().empty());
  lab.on_send = {};
  lab.connect();
  EXPECT_LT(milliseconds_of_move(lab, 1000), 2000);
}

// One that comes while another gets the table may have to give it back: it begins no move by it.
TEST(UseTable, McuThatComesDuringTheChangeWaitsForItsEnd) {
  ReadyLab lab(hall(2, 1), kGlacier);
  lab.bus(0).deafen(1, (lab.now_us() + 2'000'000) * 1000);
  ASSERT_TRUE(lab.mcu_comes_to("hall:2", api::McuState::kOffline, 3));
  // The first MCU hears nothing of the table.
  lab.on_send = loses(1, BUSHD_MSG_TABLE_DATA);
  const auto use = lab.use("axes", "glacier");
  ASSERT_TRUE(lab.mcu_comes_to("hall:2", api::McuState::kReady, 8));
  ASSERT_FALSE(lab.has_result(use));
  const Answer refused = lab.ask(Ask::kMoveBy, {"m02"}, {100});
  EXPECT_EQ(refused.phase, Answer::kRefused);
  EXPECT_THAT(refused.reason, HasSubstr("about to get another table"));
  EXPECT_EQ(lab.wait(use).result, "fault");
  lab.on_send = {};
  lab.connect();
  EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m02"}, {100}).result, "reached");
  EXPECT_EQ(table_of(lab, "m02"), "bushd2-constant@0");
}

TEST(UseTable, SurvivesALineThatLosesFrames) {
  ReadyLab lab(hall(2, 2), kGlacier);
  int sent = 0;
  lab.on_send = [&sent](std::size_t, std::vector<std::uint8_t>&) { return ++sent % 4 != 0; };
  EXPECT_EQ(lab.wait(lab.use("axes", "glacier")).result, "done");
  lab.on_send = {};
  EXPECT_GE(milliseconds_of_move(lab, 1000), 4000);
}

TEST(ReloadTables, ChangedTableServesTheNextMove) {
  ReadyLab lab(hall(1, 1, "fine", "glacier"), kGlacier);
  std::string changed = kGlacier;
  changed.replace(changed.find("revision = 3"), 12, "revision = 4");
  lab.write_file("glacier.toml", changed);
  const auto move = lab.send(Ask::kMoveBy, {"m01"}, {100});
  const auto reload = lab.reload();
  EXPECT_EQ(lab.wait(move).tables.at(0).revision, 3u);
  // Another revision is another table, also with the same codes: the MCU is to tell which one it
  // has.
  EXPECT_THAT(lab.wait(reload).reason, HasSubstr("group axes has glacier@4"));
  EXPECT_EQ(lab.bus(0).mcu(0).core().tables.bank[0].revision, 4u);
  EXPECT_EQ(table_of(lab, "m01"), "glacier@4");
}

TEST(ReloadTables, BadTableKeepsItsGroupOnTheOldOneAndNoOther) {
  ReadyLab lab(two_groups(1, 1), kGlacier);
  ASSERT_EQ(lab.wait(lab.use("ends", "glacier")).result, "done");
  EXPECT_EQ(lab.wait(lab.reload()).reason, "no table has changed");
  std::string changed = kGlacier;
  lab.write_file("glacier.toml", changed.replace(changed.find("revision = 3"), 12, "revision = 9"));
  lab.write_file("bushd2-constant.toml",
                 "name = \"bushd2-constant\"\ntime_unit_ns = 0\naccel = [9]\n");
  const Answer reloaded = lab.wait(lab.reload());
  EXPECT_THAT(reloaded, Ends("fault", "group ends has glacier@9"));
  EXPECT_THAT(reloaded.reason, HasSubstr("group axes keeps bushd2-constant"));
  EXPECT_THAT(reloaded.reason, HasSubstr("bushd2-constant.toml:2:"));
  EXPECT_EQ(table_of(lab, "end"), "glacier@9");
  EXPECT_LT(milliseconds_of_move(lab, 1000), 2000);
  EXPECT_EQ(lab.wait(lab.reload()).phase, Answer::kRefused);
}

TEST(ReloadTables, GroupsWithTheSameTableShareItInTheMcus) {
  ReadyLab lab(two_groups(1, 1), kGlacier);
  for (const char* group : {"axes", "ends"}) {
    ASSERT_EQ(lab.wait(lab.use(group, "glacier")).result, "done");
  }
  const bushd_mcu& core = lab.bus(0).mcu(0).core();
  EXPECT_EQ(core.tables.valid, 1);
  std::string changed = kGlacier;
  lab.write_file("glacier.toml", changed.replace(changed.find("revision = 3"), 12, "revision = 5"));
  ASSERT_EQ(lab.wait(lab.reload()).result, "done");
  EXPECT_EQ(core.tables.bank[0].revision, 5u);
  EXPECT_EQ(core.tables.valid, 1);
}

}  // namespace
}  // namespace bushd::test
