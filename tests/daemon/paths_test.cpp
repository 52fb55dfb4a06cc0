// Motors on a path, over the real firmware core: where they are, what stops, pauses and limits do
// to all of them, and what is refused.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <random>
#include <string>
#include <vector>

#include "daemon/on_line.h"

namespace bushd::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

const std::vector<std::string> kOnPath{"m01", "m02", "m03"};
// Round corners, a sharp one, one where a motor turns round, one that rests.
const std::vector<double> kPoints{400,  0,   0,  //
                                  800,  50,  7,  //
                                  1100, 200, 7,  //
                                  1100, 600, 7,  //
                                  700,  900, -20};

api::MovePath path_of(const std::vector<std::string>& motors, std::vector<double> points) {
  const auto rows = static_cast<std::int32_t>(points.size() / motors.size());
  return {.motors = motors, .rows = rows, .positions = std::move(points)};
}

TEST(Paths, AllMotorsAreOnThePathAtAnyTime) {
  for (const char* manner : {"fine", "coarse", "fine_table"}) {
    for (const auto corners :
         {api::MovePath::Corners::kContinuous, api::MovePath::Corners::kExact}) {
      SCOPED_TRACE(manner);
      ReadyLab lab(hall(2, 2, manner));
      api::MovePath path = path_of(kOnPath, kPoints);
      path.corners = corners;
      const auto move = lab.send(path);
      double most = 0;
      lab.run_until([&] {
        most = std::max(most, off_polyline(lab, kOnPath, kPoints));
        return lab.has_result(move);
      });
      EXPECT_LE(most, off_in_motion(manner));
      const Answer result = lab.last_reply(move);
      EXPECT_EQ(result.result, "reached") << result.reason;
      EXPECT_THAT(result.position_steps, ElementsAre(700, 900, -20));
      expect_clean(lab);
    }
  }
}

TEST(Paths, PauseAndResumeKeepThePath) {
  ReadyLab lab(hall(2, 2));
  const auto move = lab.send(path_of(kOnPath, kPoints));
  double most = 0;
  for (const std::int64_t at : {300, 790, 1099}) {
    lab.run_until([&] {
      most = std::max(most, off_polyline(lab, kOnPath, kPoints));
      return lab.shaft_steps("m01") >= at;
    });
    EXPECT_EQ(lab.ask(api::Pause{}).result, "done");
    lab.run_for(0.1);
    EXPECT_LE(off_polyline(lab, kOnPath, kPoints), kOffAtRest);
    lab.send(api::Resume{});
  }
  lab.run_until([&] {
    most = std::max(most, off_polyline(lab, kOnPath, kPoints));
    return lab.has_result(move);
  });
  EXPECT_LE(most, kOffFine);
  EXPECT_EQ(lab.last_reply(move).result, "reached") << lab.last_reply(move).reason;
  EXPECT_THAT(lab.last_reply(move).position_steps, ElementsAre(700, 900, -20));
  EXPECT_THAT(lab.errors(), IsEmpty());
}

TEST(Paths, AStopRampsAllDownAlongIt) {
  ReadyLab lab(hall(2, 2));
  const auto move = lab.send(path_of(kOnPath, kPoints));
  lab.run_until([&] { return lab.shaft_steps("m02") >= 100; });
  lab.ask(api::Stop{{"m03"}});
  lab.run_until([&] { return lab.has_result(move); });
  EXPECT_THAT(lab.last_reply(move), Ends("stopped", "the path has ended, which was left at"));
  EXPECT_LE(off_polyline(lab, kOnPath, kPoints), kOffAtRest);
  EXPECT_THAT(lab.errors(), IsEmpty());
}

TEST(Paths, ALimitOfOneRampsTheOthersDownAlongIt) {
  ReadyLab lab(with_keys(hall(2, 2), "m01", "limit = \"positive\"\n"));
  const std::vector<double> points{500, 100, -40, 2000, 900, -300, 2500, 2000, 600};
  const auto move = lab.send(path_of(kOnPath, points));
  lab.run_until([&] { return lab.shaft_steps("m01") >= 800; });
  lab.bus(0).mcu(0).set_inputs({0b001, 0});
  const Answer result = lab.wait(move);
  EXPECT_EQ(result.result, "limit") << result.reason;
  EXPECT_THAT(result.motor_results, ElementsAre("limit", "stopped", "stopped"));
  EXPECT_THAT(result.reason, HasSubstr("m01: stopped by its limit switch at the positive end"));
  // The columns of the others.
  EXPECT_LE(off_polyline(lab, {"m02", "m03"}, {100, -40, 900, -300, 2000, 600}), kOffAtRest);
  EXPECT_LT(lab.shaft_steps("m02"), 1500);
}

// Frames are lost: those that have stopped earlier than others catch up when they are resumed, and
// what is told is where motors stand.
TEST(Paths, WhatIsToldIsTrueOnABadLine) {
  const std::vector<std::string> motors{"m01", "m02", "m03", "m04", "m05"};
  std::vector<double> points;
  for (int i = 1; i <= 40; ++i) {
    points.insert(points.end(), {i * 200.0, std::round(1500 * std::sin(i * 0.4)), i * -120.0,
                                 std::round(600 * std::cos(i * 0.2)) - 600, 7});
  }
  for (unsigned seed = 1; seed <= 12; ++seed) {
    SCOPED_TRACE(seed);
    ReadyLab lab(hall(3, 2));
    std::mt19937 random(seed);
    lab.on_send = [&random](std::size_t, std::vector<std::uint8_t>&) { return random() % 12 != 0; };
    const auto move = lab.send(path_of(motors, points));
    for (unsigned pause = 0; pause < seed % 3; ++pause) {
      lab.run_for(0.5 + 0.1 * static_cast<double>(seed));
      lab.ask(api::Pause{{"m02"}});
      lab.ask(api::Resume{});
    }
    lab.run_for(0.6);
    if (seed % 2 == 0) lab.send(Ask::kStop, {"m05"});
    const Answer result = lab.wait(move);
    lab.run_for(1);
    const bool off = result.reason.find("steps off it") != std::string::npos;
    EXPECT_TRUE(result.result == "stopped" || result.result == "link" || result.result == "reached")
        << result.reason;
    if (result.result != "link") {
      EXPECT_EQ(off_polyline(lab, motors, points) > kOffAtRest, off) << result.reason;
    }
    if (result.result == "reached") {
      EXPECT_THAT(result.position_steps, ElementsAre(8000, -432, -4800, -687, 7));
    }
    for (const std::string& motor : motors) {
      EXPECT_EQ(lab.shaft_steps(motor), lab.motor(motor).position_steps);
    }
  }
}

TEST(Paths, AStopBeforeTheStartMovesNothing) {
  ReadyLab lab(hall(2, 2));
  const auto move = lab.send(path_of(kOnPath, kPoints));
  lab.run_for(0.005);
  lab.ask(api::Stop{{"m01"}});
  EXPECT_EQ(lab.wait(move).result, "stopped");
  EXPECT_EQ(lab.shaft_steps("m01"), 0);
  EXPECT_THAT(lab.errors(), IsEmpty());
}

TEST(Paths, PointsComeInSeveralRequests) {
  ReadyLab lab(hall(1, 2));
  std::vector<double> points;
  for (int i = 1; i <= 50; ++i) points.insert(points.end(), {i * 20.0, (i % 5) * 3.0});
  const std::vector<std::string> motors{"m01", "m02"};
  const auto part = [&](std::size_t first, std::size_t end) {
    api::MovePath path = path_of(motors, {points.begin() + static_cast<std::ptrdiff_t>(first * 2),
                                          points.begin() + static_cast<std::ptrdiff_t>(end * 2)});
    path.rows = 50;
    path.first_row = static_cast<std::int32_t>(first);
    return path;
  };
  const auto first = lab.send(part(0, 20));
  EXPECT_EQ(lab.wait(first).result, "done");
  ASSERT_EQ(lab.replies(first).size(), 2u);
  EXPECT_EQ(lab.replies(first).front().phase, Answer::kAccepted);
  EXPECT_EQ(lab.ask(part(20, 40)).result, "done");
  EXPECT_EQ(lab.shaft_steps("m01"), 0);
  EXPECT_EQ(lab.ask(part(40, 50)).result, "reached");
  EXPECT_EQ(lab.shaft_steps("m01"), 1000);
  // Not in their order.
  EXPECT_EQ(lab.ask(part(0, 20)).result, "done");
  EXPECT_THAT(lab.ask(part(30, 50)).reason,
              HasSubstr("points from 31 on where those from 21 on were to come"));
  EXPECT_THAT(lab.ask(part(20, 50)).reason, HasSubstr("send it again"));
}

TEST(Paths, PointsAreMeantByOneOffset) {
  ReadyLab lab(with_keys(hall(1, 2), "m01", "unit = \"mm\"\nsteps_per_unit = 400\n"));
  api::MovePath path = path_of({"m01", "m02"}, {0.5, 100});
  path.rows = 2;
  EXPECT_EQ(lab.ask(path).result, "done");
  const auto configure = [](const char* key, const char* value) {
    return api::Configure{.kind = api::Configure::Kind::kChange, .changes = {{"m01", key, value}}};
  };
  for (const api::Request& change :
       std::vector<api::Request>{configure("direction", "negative"), configure("offset", "20"),
                                 api::SetPosition{.motors = {{"m01", api::UserUnits{10}}}}}) {
    path.first_row = 0;
    path.positions = {0.5, 100};
    EXPECT_EQ(lab.ask(path).result, "done");
    ASSERT_EQ(lab.ask(change).result, "done");
    path.first_row = 1;
    path.positions = {10.25, 0};
    EXPECT_THAT(lab.ask(path), Ends("refused", "m01: its offset or direction has changed"));
    EXPECT_EQ(lab.shaft_steps("m01"), 0);
  }
  path.first_row = 0;
  path.positions = {10.5, 100, 10.25, 0};
  EXPECT_EQ(lab.ask(path).result, "reached");
  EXPECT_EQ(lab.shaft_steps("m01"), -100);
}

TEST(Paths, AreRefusedIfWhatTheyWereCheckedByHasChangedWhileTheyWerePlanned) {
  ReadyLab lab(
      with_keys(hall(1, 2), "m01", "unit = \"mm\"\nsteps_per_unit = 400\nsoft_limits = [-5, 5]\n"));
  const auto configure = [](const char* key, const char* value) {
    return api::Configure{.kind = api::Configure::Kind::kChange, .changes = {{"m01", key, value}}};
  };
  api::MovePath path = path_of({"m01", "m02"}, {0.5, 100, 0.25, 0});
  const std::vector<std::pair<api::Request, std::string>> changes{
      {configure("direction", "negative"), "m01: its offset or direction has changed"},
      {configure("direction", "positive"), "m01: its offset or direction has changed"},
      {configure("offset", "1"), "m01: its offset or direction has changed"},
      {api::SetPosition{.motors = {{"m01", api::UserUnits{0}}}},
       "m01: its offset or direction has changed"},
      {configure("soft_limits", "[-1, 0.25]"), "point 1, m01: target 0.5"}};
  for (const auto& [change, reason] : changes) {
    SCOPED_TRACE(reason);
    path.dry_run = !path.dry_run;
    const auto planned = lab.send(path);
    ASSERT_FALSE(lab.has_result(planned));
    ASSERT_EQ(lab.ask(change).result, "done");
    EXPECT_THAT(lab.wait(planned), Ends("refused", reason));
    EXPECT_EQ(lab.shaft_steps("m01"), 0);
  }
  ASSERT_EQ(lab.ask(configure("soft_limits", "[-1, 0.5]")).result, "done");
  path.dry_run = false;
  EXPECT_EQ(lab.ask(path).result, "reached");
}

TEST(Paths, ADryRunTellsWhenEachPointIsReached) {
  ReadyLab lab(hall(1, 2));
  api::MovePath path = path_of({"m01", "m02"}, {500, 0, 500, 0, 500, 500});
  path.corners = api::MovePath::Corners::kExact;
  path.dry_run = true;
  const auto plan = lab.ask(path).plan;
  ASSERT_TRUE(plan);
  const auto alone =
      lab.ask(api::Move{.motors = motor_steps({"m01"}, {500}), .dry_run = true}).plan;
  ASSERT_TRUE(alone);
  ASSERT_EQ(plan->points_us.size(), 3u);
  EXPECT_EQ(plan->points_us[0], alone->motors[0].duration_us);
  EXPECT_EQ(plan->points_us[1], plan->points_us[0]);
  EXPECT_EQ(plan->points_us[2], 2 * alone->motors[0].duration_us);
  EXPECT_EQ(plan->motors[1].steps, 500);
  EXPECT_EQ(lab.shaft_steps("m01"), 0);
}

TEST(Paths, ADryRunOfOneThatLeadsBackTellsHowLongItTakes) {
  ReadyLab lab(hall(1, 2));
  auto path = path_of({"m01", "m02"}, {500, 0, 0, 0});
  path.dry_run = true;
  const auto plan = lab.ask(path).plan;
  ASSERT_TRUE(plan);
  EXPECT_EQ(plan->motors[0].steps, 0);
  EXPECT_GE(plan->duration_us, plan->points_us.back());
  EXPECT_GT(plan->ticks, 0);
  ASSERT_TRUE(plan->traffic);
  EXPECT_GT(plan->traffic->frames, 0);
}

TEST(Paths, SpeedsOfPointsSlowASingleMotorDown) {
  ReadyLab lab(hall(1, 1));
  api::MovePath path = path_of({"m01"}, {1000, 1500, 3000});
  path.dry_run = true;
  const auto fast = lab.ask(path).plan;
  path.speeds = {0, 100, 0};
  const auto slow = lab.ask(path).plan;
  ASSERT_TRUE(fast && slow);
  EXPECT_GE(slow->points_us[1] - slow->points_us[0], 5'000'000);
  EXPECT_LT(slow->points_us[1] - slow->points_us[0], 5'100'000);
  EXPECT_LT(fast->points_us[1] - fast->points_us[0], 2'500'000);
  path.positions = {1000, 500, 3000};
  EXPECT_THAT(lab.ask(path).reason, HasSubstr("point 2, m01"));
}

TEST(Paths, RefusesWhatCannotBe) {
  ReadyLab lab(hall(1, 2));
  const auto why = [&](const api::MovePath& path) { return lab.ask(path).reason; };
  EXPECT_THAT(why(path_of({"m01", "m02"}, {100, 0, 3e9, 0})), HasSubstr("point 2, m01"));
  EXPECT_THAT(why(path_of({"m01", "m02"}, {100, 0.5})), HasSubstr("point 1, m02"));
  EXPECT_THAT(why(path_of({"m01", "nobody"}, {100, 0})), HasSubstr("nobody"));
  EXPECT_THAT(why(path_of({"m01"}, {})), HasSubstr("1 to 100000"));
  lab.send(api::Move{.motors = motor_steps({"m01"}, {5000})});
  EXPECT_THAT(why(path_of({"m01", "m02"}, {100, 10})), HasSubstr("stop it or wait"));
}

}  // namespace
}  // namespace bushd::test
