// What a line cannot carry at once is refused, or waits, when it is asked for; what its MCUs make
// by themselves takes none of it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "daemon/lab.h"

namespace bushd::test {
namespace {

using testing::Each;
using testing::HasSubstr;

// Sixteen MCUs of sixteen motors at 1152000 baud: their polls take two thirds of the line, and the
// ticks of all motors would take three times what it carries.
std::string crowd(const std::string& manner, const std::string& streams) {
  std::string toml = hall(16, 16, manner);
  const std::string before = "baud = 500000\n";
  return toml.replace(
      toml.find(before), before.size(),
      "baud = 1152000\n" + (streams.empty() ? "" : "streams = \"" + streams + "\"\n"));
}

std::vector<std::string> motors(int from, int to) {
  std::vector<std::string> names;
  for (int m = from; m <= to; ++m) names.push_back((m < 10 ? "m0" : "m") + std::to_string(m));
  return names;
}

std::vector<std::int64_t> each(std::size_t count, std::int64_t steps) {
  return std::vector<std::int64_t>(count, steps);
}

TEST(LineRoom, TableRunsOfAllMotorsTakeNone) {
  ReadyLab lab(crowd("fine_table", ""));
  const auto all = motors(1, 256);
  const Answer result = lab.ask(Ask::kMoveBy, all, each(all.size(), 400));
  EXPECT_EQ(result.result, "reached") << result.reason;
  EXPECT_THAT(result.motor_results, Each("reached"));
}

// Each tick of a motor: two bytes in 2.56 ms, and its share of the frame.
TEST(LineRoom, WhatDoesNotFitIsRefusedWithWhatTakesHowMuch) {
  ReadyLab lab(crowd("fine_ticks", "refuse"));
  const auto few = motors(1, 16);
  const auto first = lab.send(Ask::kMoveBy, few, each(16, 20'000));
  lab.run_for(0.3);
  EXPECT_EQ(lab.last_reply(first).phase, Answer::kAccepted);
  const Answer refused = lab.ask(Ask::kMoveBy, motors(17, 32), each(16, 400));
  EXPECT_EQ(refused.phase, Answer::kRefused);
  EXPECT_THAT(refused.reason, HasSubstr("bus hall has no room for it: polls take "));
  EXPECT_THAT(refused.reason, HasSubstr("Wait until others have ended, or set streams = "));
  EXPECT_EQ(lab.shaft_steps("m17"), 0);
  const Answer never = lab.ask(Ask::kMoveBy, motors(33, 128), each(96, 400));
  EXPECT_EQ(never.phase, Answer::kRefused);
  EXPECT_THAT(never.reason, HasSubstr("Move fewer motors at once"));
  EXPECT_EQ(lab.ask(Ask::kStop, {}).result, "done") << "a stop is not asked for room";
  EXPECT_EQ(lab.ask(Ask::kMoveBy, motors(17, 32), each(16, 400)).result, "reached");
  EXPECT_EQ(lab.mcu_health("hall:1").ramp_downs, 0u);
}

TEST(LineRoom, WhatDoesNotFitWaitsWhereItMay) {
  ReadyLab lab(crowd("fine_ticks", "queue"));
  const auto first = lab.send(Ask::kMoveBy, motors(1, 16), each(16, 2'000));
  lab.run_for(0.3);
  const auto second = lab.send(Ask::kMoveBy, motors(17, 32), each(16, 400));
  const auto third = lab.send(Ask::kMoveBy, motors(33, 48), each(16, 400));
  lab.run_for(0.3);
  EXPECT_EQ(lab.shaft_steps("m17"), 0);
  EXPECT_FALSE(lab.has_result(first));
  EXPECT_EQ(lab.ask(Ask::kStop, motors(33, 48)).result, "done");
  EXPECT_EQ(lab.wait(third).result, "stopped") << "it waits no more";
  EXPECT_EQ(lab.wait(second).result, "reached");
  EXPECT_TRUE(lab.has_result(first)) << "there was room when the first had ended";
  EXPECT_EQ(lab.shaft_steps("m17"), 400);
  EXPECT_EQ(lab.shaft_steps("m33"), 0);
  const Answer never = lab.ask(Ask::kMoveBy, motors(33, 128), each(96, 400));
  EXPECT_EQ(never.phase, Answer::kRefused) << "it never fits";
}

TEST(LineRoom, ALineIsStreamedWhereSomeOfItMove) {
  ReadyLab lab(crowd("fine", "queue"));
  const auto line = lab.send(api::MoveLine{.motors = motor_steps(motors(1, 16), each(16, 20'000))});
  lab.run_for(0.5);
  const Answer refused = lab.ask(api::MoveLine{
      .motors = motor_steps(motors(1, 60), each(60, 20'000)), .speed = api::Speed{.per_s = 500}});
  EXPECT_EQ(refused.phase, Answer::kRefused);
  EXPECT_FALSE(lab.has_result(line));
  const auto other =
      lab.send(api::MoveLine{.motors = motor_steps(motors(129, 144), each(16, 400))});
  EXPECT_EQ(lab.wait(other).result, "reached") << "made by an MCU that makes no other line";
  EXPECT_EQ(lab.ask(Ask::kStop, {}).result, "done");
}

// A motor that its MCU moves is streamed from its new target on.
TEST(LineRoom, NewTargetsAreStreamed) {
  ReadyLab lab(crowd("fine_table", "refuse"));
  const auto all = motors(1, 256);
  const auto move = lab.send(Ask::kMoveBy, all, each(all.size(), 30'000));
  lab.run_for(0.5);
  EXPECT_EQ(lab.ask(Ask::kMoveBy, all, each(all.size(), 100)).phase, Answer::kRefused);
  EXPECT_FALSE(lab.has_result(move)) << "it goes on";
  EXPECT_EQ(lab.ask(Ask::kMoveBy, {"m01"}, {100}).result, "reached");
  EXPECT_EQ(lab.wait(move).motor_results.front(), "stopped");
  EXPECT_EQ(lab.shaft_steps("m01"), 30'100);
}

// Paths and trajectories are told tick by tick, of which the line carries those of some 24 motors.
TEST(LineRoom, PathsAndTrajectoriesAreAskedWhenTheyBegin) {
  ReadyLab lab(crowd("fine_table", "refuse"));
  const auto many = motors(1, 40);
  const std::vector<double> there(many.size(), 100);
  const Answer path = lab.ask(api::MovePath{.motors = many, .rows = 1, .positions = there});
  EXPECT_EQ(path.phase, Answer::kRefused);
  EXPECT_THAT(path.reason, HasSubstr("bus hall has no room for it: polls take "));
  std::vector<double> rows(many.size(), 0);
  rows.insert(rows.end(), there.begin(), there.end());
  rows.insert(rows.end(), there.begin(), there.end());
  api::Follow trajectory{.part = api::Follow::Part::kLastRows,
                         .array = 1,
                         .motors = many,
                         .time_s = {0, 2, 3},
                         .positions = rows};
  EXPECT_EQ(lab.ask(trajectory).result, "done") << "rows alone move nothing";
  const Answer run =
      lab.ask(api::Follow{.part = api::Follow::Part::kRun, .array = 1, .motors = many});
  EXPECT_EQ(run.phase, Answer::kRefused);
  EXPECT_THAT(run.reason, HasSubstr("has no room for it"));
  EXPECT_EQ(lab.shaft_steps("m01"), 0);
  const auto few = lab.send(
      api::MovePath{.motors = motors(1, 16), .rows = 1, .positions = std::vector<double>(16, 100)});
  EXPECT_EQ(lab.wait(few).result, "reached");
}

// It would begin when its key may have been let go long ago.
TEST(LineRoom, AJogThatDoesNotFitIsRefusedAlsoWhereOthersWait) {
  ReadyLab lab(crowd("fine_table", "queue"));
  const auto path = lab.send(api::MovePath{
      .motors = motors(1, 20), .rows = 1, .positions = std::vector<double>(20, 20'000)});
  lab.run_for(0.5);
  Answer last;
  std::string motor;
  for (int m = 21; m <= 256 && last.phase != Answer::kRefused; ++m) {
    motor = motors(m, m).front();
    last = lab.last_reply(
        lab.send(api::Jog{.motor = motor, .per_s = 50, .in_steps = true, .keepalive_ms = 5'000}));
    lab.run_for(0.01);
  }
  ASSERT_EQ(last.phase, Answer::kRefused);
  EXPECT_THAT(last.reason, HasSubstr("has no room for it"));
  EXPECT_THAT(last.reason, testing::Not(HasSubstr("queue")));
  EXPECT_FALSE(lab.has_result(path));
  EXPECT_EQ(lab.ask(Ask::kStop, {}).result, "done");
  EXPECT_EQ(lab.shaft_steps(motor), 0);
  EXPECT_EQ(lab.mcu_health("hall:1").ramp_downs, 0u);
}

// Where one bus has no room, nothing moves on the other.
TEST(LineRoom, AMoveOfTwoBusesNeedsRoomOnBoth) {
  ReadyLab lab(crowd("fine_ticks", "refuse") +
               "[[bus]]\nname = \"annex\"\nport = \"/dev/null1\"\nbaud = 500000\ntick_us = 2560\n"
               "format = \"fine\"\n[[mcu]]\nbus = \"annex\"\naddress = 1\n[[motor]]\nname = \"a\"\n"
               "mcu = \"annex:1\"\noutput = 0\ngroup = \"axes\"\n");
  const auto first = lab.send(Ask::kMoveBy, motors(1, 16), each(16, 2'000));
  lab.run_for(0.3);
  std::vector<std::string> both = motors(17, 32);
  both.emplace_back("a");
  const Answer refused = lab.ask(Ask::kMoveBy, both, each(17, 400));
  EXPECT_EQ(refused.phase, Answer::kRefused);
  EXPECT_THAT(refused.reason, HasSubstr("bus hall has no room for it"));
  EXPECT_EQ(lab.ask(Ask::kMoveBy, {"a"}, {100}).result, "reached");
  EXPECT_EQ(lab.shaft_steps("a"), 100) << "of the second move alone";
  EXPECT_EQ(lab.wait(first).result, "reached");
  EXPECT_EQ(lab.ask(Ask::kMoveBy, both, each(17, 400)).result, "reached");
}

}  // namespace
}  // namespace bushd::test
