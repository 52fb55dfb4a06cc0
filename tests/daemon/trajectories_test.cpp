// Motors that follow trajectories of times and positions, over the real firmware core: what is
// checked and said beforehand, where they are at any time, and what ends one motor's part does to
// the others.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "daemon/on_line.h"

namespace bushd::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using Part = api::Follow::Part;

const std::vector<std::string> kFollowing{"m01", "m03"};  // of two MCUs

api::Follow part_of(Part part, std::vector<double> time_s = {},
                    std::vector<double> positions = {}) {
  return {.part = part,
          .array = 7,
          .motors = kFollowing,
          .time_s = std::move(time_s),
          .positions = std::move(positions)};
}

// To 120 and -60 steps and back, at up to 100 steps/s.
api::Follow there_and_back(Part part = Part::kLastRows) {
  return part_of(part, {0, 1.2, 1.7, 3.1}, {0, 0, 120, -60, 120, -60, 0, 0});
}

// Where m01 is to be.
double expected(double s) {
  if (s < 1.2) return 100 * s;
  return s < 1.7 ? 120 : std::max(0.0, 120 - 120 / 1.4 * (s - 1.7));
}

// Loads and runs it in a hall of two MCUs, for 0.7 s.
struct UnderWay {
  UnderWay() : lab(hall(2, 2)) {
    lab.connect();
    lab.ask(there_and_back());
    run = lab.send(part_of(Part::kRun));
    lab.run_for(0.7);
  }
  Lab lab;
  std::int64_t run = 0;
};

class Trajectories : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Format, Trajectories, testing::Values("fine", "coarse"));

TEST(TrajectoriesAndLimits, AreToldFromTheLowestPositionToTheHighest) {
  ReadyLab lab(with_keys(
      hall(1, 1), "m01",
      "unit = \"mm\"\nsteps_per_unit = 10\ndirection = \"negative\"\nsoft_limits = [-5, 20]\n"));
  const Answer refused = lab.ask(api::Follow{.part = Part::kLastRows,
                                             .array = 1,
                                             .motors = {"m01"},
                                             .time_s = {0, 9},
                                             .positions = {0, 30}});
  EXPECT_THAT(refused.reason,
              testing::HasSubstr("m01 would go to 30.000 mm; allowed: -20.000 mm to 5.000 mm"));
}

TEST_P(Trajectories, AllMotorsAreWhereTheRowsSayAtAnyTime) {
  ReadyLab lab(hall(2, 2, GetParam()));
  const Answer loaded = lab.ask(there_and_back());
  EXPECT_EQ(loaded.result, "done") << loaded.reason;
  EXPECT_EQ(loaded.reason, "4 rows can be followed");
  ASSERT_TRUE(loaded.plan);
  EXPECT_EQ(loaded.plan->duration_us, 3'100'000);
  const auto run = lab.send(part_of(Part::kRun));
  lab.run_until([&] { return lab.shaft_steps("m01") != 0; });
  // Its first step is half a step's way after the beginning.
  const double begun_s = static_cast<double>(lab.now_us()) * 1e-6 - 0.005;
  double most = 0;
  lab.run_until([&] {
    const double s = static_cast<double>(lab.now_us()) * 1e-6 - begun_s;
    most = std::max(most, std::abs(static_cast<double>(lab.shaft_steps("m01")) - expected(s)));
    return lab.has_result(run);
  });
  // Half a step. A tick has 0.256 of one at 100 steps/s: by that the step that told the beginning
  // may have been off, as may any other, and so much is made where a row ends amid a tick.
  EXPECT_LE(most, 0.5 + 3 * 100 * 2.56e-3);
  const Answer result = lab.last_reply(run);
  EXPECT_EQ(result.result, "reached") << result.reason;
  EXPECT_THAT(result.position_steps, ElementsAre(0, 0));
  EXPECT_EQ(lab.shaft_steps("m03"), 0);
  expect_clean(lab);
}

TEST(Trajectory, WhatCannotBeFollowedIsNamedAndNothingMoves) {
  ReadyLab lab(hall(2, 2));
  const Answer fast = lab.ask(part_of(Part::kLastRows, {0, 1}, {0, 0, 20, 150}));
  EXPECT_EQ(fast.result, "fault");
  EXPECT_EQ(
      fast.reason,
      "row 1 (0 s): m03 is to change at once to 150 steps/s; allowed: 100 steps/s; with times "
      "stretched by 1.500 all motors can follow it");
  EXPECT_THAT(lab.ask(part_of(Part::kRun)).reason, HasSubstr("no such trajectory"));
  auto stretched = part_of(Part::kLastRows, {0, 1}, {0, 0, 20, 150});
  stretched.stretch = 1.5;
  EXPECT_EQ(lab.ask(stretched).result, "done");
  EXPECT_EQ(lab.shaft_steps("m03"), 0);
}

TEST(Trajectory, RowsAreCheckedForWhatTheyAre) {
  ReadyLab lab(hall(2, 2));
  const auto refusal = [&](const api::Follow& follow) {
    const Answer answer = lab.ask(follow);
    EXPECT_EQ(answer.result, "refused");
    return answer.reason;
  };
  EXPECT_EQ(refusal(part_of(Part::kRows, {0, 1}, {0, 0, 1})),
            "3 positions are told for 2 rows of 2 motors");
  EXPECT_EQ(refusal(part_of(Part::kRows, {0, 0}, {0, 0, 1, 1})),
            "row 2: at 0 s, and not later than the row before");
  EXPECT_THAT(refusal(part_of(Part::kRows, {0, std::nan("")}, {0, 0, 1, 1})),
              HasSubstr("row 2: a"));
  EXPECT_THAT(refusal(part_of(Part::kRows, {0, 1}, {0, 0, 1, HUGE_VAL})), HasSubstr("row 2: m03:"));
  EXPECT_THAT(refusal(part_of(Part::kLastRows, {0}, {0, 0})), HasSubstr("two rows"));
  auto stretch = there_and_back();
  stretch.stretch = 0;
  EXPECT_THAT(refusal(stretch), HasSubstr("stretched by 0"));
}

TEST(Trajectory, MotorsStandAtTheFirstRow) {
  ReadyLab lab(hall(2, 2));
  lab.ask(part_of(Part::kLastRows, {0, 1}, {3, 0, 10, 10}));
  EXPECT_EQ(lab.ask(part_of(Part::kRun)).reason,
            "m01 stands at 0 steps, and the trajectory begins at 3 steps; move it there first");
}

TEST(Trajectory, RowsMayComeWhileItRunsAndAnOpenEndRampsDown) {
  ReadyLab lab(hall(2, 2));
  EXPECT_EQ(lab.ask(part_of(Part::kRows, {0, 1.5}, {0, 0, 120, 60})).reason,
            "2 rows can be followed so far");
  const auto run = lab.send(part_of(Part::kRun));
  lab.run_for(0.5);
  EXPECT_EQ(lab.ask(part_of(Part::kRows, {3}, {240, 100})).result, "done");
  lab.run_for(2.35);
  // Its queue is filled beyond the last row.
  const Answer late = lab.ask(part_of(Part::kRows, {4}, {300, 100}));
  EXPECT_THAT(late.reason, HasSubstr("come too late"));
  const Answer end = lab.wait(run);
  EXPECT_THAT(end,
              Ends("stopped", "no further rows of its trajectory came; ramped down by its table"));
  EXPECT_NEAR(static_cast<double>(end.position_steps[0]), 241, 1);
  EXPECT_EQ(lab.shaft_steps("m01"), end.position_steps[0]);
  EXPECT_THAT(lab.errors(), IsEmpty());
}

TEST(Trajectory, AStopOfOneStopsAll) {
  UnderWay trajectory;
  Lab& lab = trajectory.lab;
  EXPECT_THAT(lab.ask(api::Pause{}).reason, HasSubstr("follows a trajectory"));
  EXPECT_THAT(lab.ask(Ask::kMoveBy, {"m01"}, {10}).reason, HasSubstr("follows a trajectory"));
  lab.send(Ask::kStop, {"m03"});
  EXPECT_EQ(lab.wait(trajectory.run).result, "stopped");
  EXPECT_LT(lab.shaft_steps("m01"), 119);
  EXPECT_EQ(lab.shaft_steps("m01"), lab.motor("m01").position_steps);
  EXPECT_EQ(lab.shaft_steps("m03"), lab.motor("m03").position_steps);
  EXPECT_THAT(lab.errors(), IsEmpty());
}

TEST(Trajectory, ALostMcuRampsDownTheOthers) {
  UnderWay trajectory;
  Lab& lab = trajectory.lab;
  lab.bus(0).reboot(1, 2'000'000'000);
  EXPECT_THAT(lab.wait(trajectory.run).motor_results, ElementsAre("stopped", "link"));
  EXPECT_EQ(lab.shaft_steps("m01"), lab.motor("m01").position_steps);
  EXPECT_LT(lab.shaft_steps("m01"), 119);
}

TEST(Trajectory, AnEmergencyStopEndsIt) {
  UnderWay trajectory;
  Lab& lab = trajectory.lab;
  lab.ask(Ask::kEmergencyStop, {});
  EXPECT_EQ(lab.wait(trajectory.run).result, "stopped");
  EXPECT_EQ(lab.shaft_steps("m01"), lab.motor("m01").position_steps);
  EXPECT_EQ(lab.shaft_steps("m03"), lab.motor("m03").position_steps);
}

// One that has come to its last row waits for its settling time, though another one has ended.
TEST(Trajectory, OneThatArrivesSettlesThoughAnotherHasEnded) {
  int alone = 0;
  for (std::int64_t left = 1; left < 8; ++left) {
    SCOPED_TRACE(left);
    ReadyLab lab(with_keys(
        with_keys(hall(2, 2), "m03", "limit = \"positive\"\nlimit_action = \"immediate\"\n"), "m01",
        "settle_ms = 400\n"));
    lab.ask(part_of(Part::kLastRows, {0, 1.2}, {0, 0, 120, 120}));
    const auto run = lab.send(part_of(Part::kRun));
    ASSERT_TRUE(lab.run_until([&] { return lab.shaft_steps("m01") >= 120 - left; }));
    lab.bus(0).mcu(1).set_inputs({0b001, 0});
    lab.run_until([&] { return lab.shaft_steps("m01") >= 120; }, 0.5);
    const std::int64_t arrived_us = lab.now_us();
    const Answer result = lab.wait(run);
    if (result.motor_results != std::vector<std::string>{"reached", "limit"}) continue;
    ++alone;
    EXPECT_GE(lab.now_us() - arrived_us, 400'000);
  }
  EXPECT_GE(alone, 1);
}

}  // namespace
}  // namespace bushd::test
