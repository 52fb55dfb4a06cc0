// What is said of positions that nobody knows: before the first report, after a lost link, after
// restarts. And that the logs keep what was known.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "daemon/lab.h"

namespace bushd::test {
namespace {

using testing::HasSubstr;

// As it is found, without anybody who says where the motors stand.
void find(Lab& lab) {
  ASSERT_TRUE(lab.run_until([&] { return lab.all_ready(); }, 10));
}

nlohmann::json last_event(const Lab& lab, const std::string& event) {
  nlohmann::json found;
  for (const std::string& line : lab.move_lines()) {
    const auto one = nlohmann::json::parse(line);
    if (one["event"] == event) found = one;
  }
  return found;
}

TEST(Trust, AnMcuThatWasNeverHeardHasUnknownPositions) {
  Lab lab(hall(1, 1));
  lab.unplug(0);
  lab.run_for(2);
  EXPECT_EQ(lab.motor("m01").trust, api::Trust::kUnknown);
}

TEST(Trust, UntilTheFirstReportOfARestartedDaemonThePositionIsUnknown) {
  ReadyLab lab(hall(1, 1));
  lab.send(Ask::kMoveBy, {"m01"}, {9000});
  lab.run_for(1);
  lab.restart_daemon();
  bool seen = false;
  ASSERT_TRUE(lab.run_until(
      [&] {
        if (!lab.has_state("hall:1")) return false;
        const auto motor = lab.motor("m01");
        seen |= motor.trust == api::Trust::kUnknown;
        EXPECT_NE(motor.trust, api::Trust::kKnown);
        return lab.all_ready();
      },
      30));
  EXPECT_TRUE(seen);
  EXPECT_EQ(lab.motor("m01").position_steps, lab.shaft_steps("m01"));
}

TEST(Trust, NobodyHasSaidWhereItStandsAfterTheDaemonsStart) {
  Lab lab(hall(1, 2));
  find(lab);
  EXPECT_EQ(lab.motor("m01").trust, api::Trust::kUncertain);
  EXPECT_EQ(lab.ask(Ask::kSetPosition, {"m01"}, {7}).result, "done");
  EXPECT_EQ(lab.motor("m01").trust, api::Trust::kKnown);
  EXPECT_EQ(lab.motor("m02").trust, api::Trust::kUncertain);
  EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m02"}, {5}).result, "reached")
      << "as far as anybody knows no step is lost";
  EXPECT_EQ(lab.motor("m02").trust, api::Trust::kUncertain);
}

// Stopped immediately at speed, so that it may have overrun: the next daemon cannot know that.
TEST(Trust, ARestartOfTheDaemonMakesNothingKnown) {
  std::string toml = hall(1, 1);
  toml.insert(toml.find("[[group]]"), "emergency_stop = \"immediate\"\n");
  ReadyLab lab(toml);
  const auto move = lab.send(Ask::kMoveBy, {"m01"}, {9000});
  lab.run_for(1);
  lab.send(Ask::kEmergencyStop, {});
  EXPECT_EQ(lab.wait(move).result, "stopped");
  EXPECT_EQ(lab.motor("m01").trust, api::Trust::kUncertain);
  EXPECT_EQ(lab.ask(Ask::kClearFaults, {}).result, "done");
  lab.restart_daemon();
  find(lab);
  EXPECT_EQ(lab.motor("m01").trust, api::Trust::kUncertain);
}

TEST(Trust, ARestartOfDaemonAndMcuMakesNothingKnown) {
  ReadyLab lab(hall(1, 1));
  EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m01"}, {50}).result, "reached");
  lab.bus(0).reboot(0);
  lab.restart_daemon();
  find(lab);
  EXPECT_EQ(lab.motor("m01").position_steps, 0);
  EXPECT_EQ(lab.motor("m01").trust, api::Trust::kUncertain);
}

TEST(Trust, WhatWasHeardLastIsStaleAndCorrectedInTheLogOfMoves) {
  for (const char* manner : {"fine", "fine_table"}) {
    ReadyLab lab(hall(1, 2, manner));
    lab.send(Ask::kMoveBy, {"m01"}, {9000});
    lab.run_for(1.3);
    lab.unplug(0);
    lab.run_for(0.01);
    const auto stale = lab.motor("m01");
    EXPECT_EQ(stale.trust, api::Trust::kStale);
    EXPECT_EQ(lab.motor("m02").trust, api::Trust::kStale) << "its MCU may have lost power";
    lab.run_for(3);
    EXPECT_EQ(lab.motor("m01").position_steps, stale.position_steps);
    lab.plug(0);
    find(lab);
    const std::int64_t stands = lab.shaft_steps("m01");
    EXPECT_GT(stands, stale.position_steps);
    EXPECT_EQ(lab.motor("m01").trust, api::Trust::kKnown) << "its MCU has counted on";
    const auto corrected = last_event(lab, "corrected");
    ASSERT_FALSE(corrected.is_null());
    EXPECT_EQ(corrected["motor"], "m01");
    EXPECT_EQ(corrected["from_steps"], stale.position_steps);
    EXPECT_EQ(corrected["position_steps"], stands);
  }
}

// A count that begins anew says nothing of where the motor stands; what was known before does.
TEST(Trust, WhereMotorsStoodBeforeTheirMcuRestartedIsInTheLog) {
  ReadyLab lab(hall(1, 1));
  EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m01"}, {50}).result, "reached");
  lab.bus(0).reboot(0, 50'000'000);
  ASSERT_TRUE(lab.run_until([&] { return lab.motor("m01").trust == api::Trust::kUnknown; }, 5));
  find(lab);
  EXPECT_EQ(lab.motor("m01").trust, api::Trust::kUncertain);
  const auto restarted = last_event(lab, "restarted");
  ASSERT_FALSE(restarted.is_null());
  EXPECT_EQ(restarted["motor"], "m01");
  EXPECT_EQ(restarted["from_steps"], 50);
  EXPECT_EQ(restarted["position_steps"], 0);
}

TEST(Trust, WhoSetAPositionIsInTheLog) {
  ReadyLab lab(hall(1, 1));
  EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m01"}, {50}).result, "reached");
  const auto set = lab.send(Ask::kSetPosition, {"m01"}, {7});
  EXPECT_EQ(lab.wait(set).result, "done");
  const auto event = last_event(lab, "set");
  EXPECT_EQ(event["from_steps"], 50);
  EXPECT_EQ(event["position_steps"], 7);
  EXPECT_EQ(event["number"], set);
  EXPECT_THAT(event["client"].get<std::string>(), HasSubstr("test"));
}

}  // namespace
}  // namespace bushd::test
