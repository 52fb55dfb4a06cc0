// Motors on a straight line, over the real firmware core: where they are relative to each other at
// any time, what stops, pauses and limits do to all of them, and what is told.
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
using testing::Not;

TEST(Lines, AllMotorsAreOnTheLineAtAnyTime) {
  for (const char* manner : {"fine", "coarse", "fine_table", "coarse_ticks"}) {
    expect_on_line_all_the_way(manner, kSteps, off_in_motion(manner));
  }
  expect_on_line_all_the_way("fine_ticks", kInMcus, kOffFine);
}

TEST(Lines, EqualMotorsTakeTheTimeOfOne) {
  StreamedLab lab(hall(1, 3));
  auto alone = api::Move{.motors = motor_steps({"m01"}, {2000}), .dry_run = true};
  auto line = line_to({"m01", "m02", "m03"}, {2000, 0, -2000});
  line.dry_run = true;
  const auto of_one = lab.ask(alone).plan;
  const auto of_line = lab.ask(line).plan;
  ASSERT_TRUE(of_one && of_line);
  EXPECT_EQ(of_line->duration_us, of_one->duration_us);
  EXPECT_EQ(of_line->motors[0].duration_us, of_one->motors[0].duration_us);
  EXPECT_EQ(of_line->limited_by, "m01");
  EXPECT_EQ(of_line->motors[2].steps, -2000);
  EXPECT_TRUE(of_line->traffic);
  EXPECT_EQ(lab.shaft_steps("m01"), 0);
}

TEST(Lines, StateTellsTheShareAndTheTimeLeft) {
  StreamedLab lab(hall(2, 1));
  const auto move = lab.send(line_to({"m01", "m02"}, {1000, 4000}));
  lab.run_until([&] { return lab.shaft_steps("m02") >= 2000; });
  lab.run_for(0.2);
  const api::MotorState state = lab.motor("m01");
  ASSERT_TRUE(state.line);
  EXPECT_NEAR(state.line->fraction, static_cast<double>(lab.motor("m02").position_steps) / 4000,
              0.01);
  EXPECT_EQ(state.target_steps, 1000);
  const auto now_us = lab.now_us();
  lab.wait(move);
  EXPECT_NEAR(static_cast<double>(state.line->left_us), static_cast<double>(lab.now_us() - now_us),
              3e5);
  lab.run_for(1.5);
  EXPECT_FALSE(lab.motor("m01").line);
}

void expect_on_line_after_a_stop(const std::vector<std::int64_t>& steps) {
  for (const char* manner : {"fine", "coarse"}) {
    for (const double after_s : {0.105, 0.12, 0.15, 0.3, 0.6, 0.9, 1.0}) {
      SCOPED_TRACE(std::string(manner) + " " + std::to_string(after_s));
      StreamedLab lab(hall(2, 2, manner));
      const auto move = lab.send(line_to(kMotors, steps));
      lab.run_for(after_s);
      EXPECT_EQ(lab.ask(Ask::kStop, {"m03"}).result, "done");
      const Answer result = lab.wait(move);
      EXPECT_THAT(result, Ends("stopped", "stopped on request, asked for by command"));
      EXPECT_THAT(result.reason, Not(HasSubstr("off it")));
      EXPECT_LE(off_line(lab, kMotors, steps), kOffAtRest);
      lab.run_for(0.5);
      EXPECT_EQ(lab.mcu_health("hall:1").rejected_frames, 0u);
      EXPECT_EQ(lab.mcu_health("hall:2").rejected_frames, 0u);
      // The motors' counters and remainders are whole: they move on from there.
      EXPECT_EQ(lab.ask(line_to(kMotors, {0, 0, 0, 0})).result, "reached");
      for (const std::string& motor : kMotors) EXPECT_EQ(lab.shaft_steps(motor), 0);
    }
  }
}

TEST(Lines, AStopOfOneLeavesAllOnTheLine) {
  expect_on_line_after_a_stop({-2500, 1201, -40, 2499});
  expect_on_line_after_a_stop({-2500, 2500, -40, 2500});  // by the MCUs
}

void expect_pause(const std::vector<std::int64_t>& steps) {
  for (const char* manner : {"fine", "coarse"}) {
    SCOPED_TRACE(manner);
    StreamedLab lab(hall(2, 2, manner));
    const auto move = lab.send(line_to(kMotors, steps));
    lab.run_until([&] { return lab.shaft_steps("m01") >= 700; });
    EXPECT_EQ(lab.ask(api::Pause{{"m02"}}).reason, "paused: 4 motors");
    EXPECT_LE(off_line(lab, kMotors, steps), kOffAtRest);
    EXPECT_TRUE(lab.motor("m01").paused);
    EXPECT_FALSE(lab.has_result(move));
    const std::int64_t stands = lab.shaft_steps("m01");
    lab.run_for(2);
    EXPECT_EQ(lab.shaft_steps("m01"), stands);
    EXPECT_EQ(lab.ask(api::Resume{{"m01"}}).reason, "resumed: 4 motors");
    double most = 0;
    lab.run_until([&] {
      most = std::max(most, off_line(lab, kMotors, steps));
      return lab.has_result(move);
    });
    EXPECT_LE(most, off_in_motion(manner));
    EXPECT_EQ(lab.last_reply(move).result, "reached");
    for (std::size_t i = 0; i < kMotors.size(); ++i) {
      EXPECT_EQ(lab.shaft_steps(kMotors[i]), steps[i]);
    }
    EXPECT_EQ(lab.mcu_health("hall:1").rejected_frames, 0u);
    EXPECT_EQ(lab.mcu_health("hall:2").rejected_frames, 0u);
  }
}

TEST(Lines, PausesAndGoesOn) {
  expect_pause(kSteps);
  expect_pause(kInMcus);
}

TEST(Lines, ResumedWhileTheyRampDownTheyStandFirst) {
  StreamedLab lab(hall(2, 2));
  const auto move = lab.send(line_to(kMotors, kSteps));
  lab.run_until([&] { return lab.shaft_steps("m01") >= 1500; });
  lab.send(api::Pause{});
  lab.run_for(0.05);
  lab.send(api::Resume{});
  EXPECT_EQ(lab.wait(move).result, "reached");
  EXPECT_EQ(lab.shaft_steps("m02"), -1201);
}

TEST(Lines, ASpeedIsThatOfEachMotor) {
  StreamedLab lab(hall(1, 2));
  auto line = line_to({"m01", "m02"}, {1000, 500});
  line.speed = api::Speed{.per_s = 100, .in_steps = true};
  const Answer result = lab.ask(line);
  EXPECT_EQ(result.result, "reached");
  EXPECT_LE(result.most_steps_per_s[0], 100.0);
  EXPECT_GT(result.most_steps_per_s[0], 99.0);
  EXPECT_NEAR(result.most_steps_per_s[1], 50.0, 0.5);
}

TEST(Lines, ADurationIsAsked) {
  StreamedLab lab(hall(1, 2));
  auto line = line_to({"m01", "m02"}, {1000, 300});
  line.duration_s = 12;
  line.dry_run = true;
  const auto plan = lab.ask(line).plan;
  ASSERT_TRUE(plan);
  EXPECT_NEAR(static_cast<double>(plan->duration_us), 12e6, 0.1e6);
  EXPECT_GE(plan->motors[0].duration_us, 12'000'000);
  line.duration_s = 0.1;
  EXPECT_THAT(lab.ask(line).reason, HasSubstr("the line takes at least"));
  EXPECT_THAT(lab.last_reply(lab.send(line)).reason, HasSubstr("limited by m01"));
  line.duration_s = 1e7;
  EXPECT_THAT(lab.ask(line).reason, HasSubstr("the line takes at most"));
}

TEST(Lines, ANearerEndAndAnotherSpeed) {
  StreamedLab lab(hall(2, 2));
  const auto move = lab.send(line_to(kMotors, {4000, -2000, 1000, 0}));
  lab.run_until([&] { return lab.shaft_steps("m01") >= 800; });
  auto slower = line_to(kMotors, {4000, -2000, 1000, 0});
  slower.speed = api::Speed{.per_s = 300, .in_steps = true};
  const auto second = lab.send(slower);
  EXPECT_THAT(lab.wait(move), Ends("stopped", "was given a new target by command"));
  lab.run_until([&] { return lab.shaft_steps("m01") >= 1200; });
  EXPECT_LE(off_line(lab, kMotors, {4000, -2000, 1000, 0}), kOffFine);
  // Named in another order, as a distance from the target.
  const auto third = lab.send(
      api::MoveLine{.motors = motor_steps({"m03", "m04", "m01", "m02"}, {-500, 0, -2000, 1000})});
  EXPECT_EQ(lab.wait(third).result, "reached");
  EXPECT_EQ(lab.last_reply(second).result, "stopped");
  EXPECT_EQ(lab.shaft_steps("m01"), 2000);
  EXPECT_EQ(lab.shaft_steps("m02"), -1000);
  EXPECT_EQ(lab.shaft_steps("m03"), 500);
}

TEST(Lines, AnEndThatComesTooLateIsReachedFromBeyond) {
  for (const std::int64_t steps : {-200, -400}) {  // the latter by the MCUs
    SCOPED_TRACE(steps);
    StreamedLab lab(hall(2, 2));
    const auto move = lab.send(line_to(kMotors, {4000, 10 * steps, 0, 4000}));
    lab.run_until([&] { return lab.shaft_steps("m01") >= 2000; });
    EXPECT_EQ(lab.ask(line_to(kMotors, {400, steps, 0, 400})).result, "reached");
    EXPECT_EQ(lab.last_reply(move).result, "stopped");
    EXPECT_EQ(lab.shaft_steps("m01"), 400);
    EXPECT_EQ(lab.shaft_steps("m02"), steps);
    EXPECT_EQ(lab.shaft_steps("m04"), 400);
  }
}

TEST(Lines, WhatIsNotOnTheLineIsRefused) {
  StreamedLab lab(hall(2, 2));
  const auto move = lab.send(line_to(kMotors, {4000, -2000, 1000, 0}));
  lab.run_for(0.5);
  const auto refusal = [&](const api::Request& request) { return lab.ask(request).reason; };
  EXPECT_THAT(
      refusal(line_to(kMotors, {2000, -1002, 500, 0})),
      HasSubstr(
          "m02: -1002 steps is not on the line that is under way, which leads through -1000"));
  EXPECT_THAT(refusal(line_to(kMotors, {5000, -2500, 1250, 0})),
              HasSubstr("m01: 5000 steps is beyond the ends"));
  EXPECT_THAT(refusal(line_to({"m01", "m02"}, {2000, -1000})), HasSubstr("name all of them"));
  EXPECT_THAT(refusal(request_of(Ask::kMoveTo, {"m01"}, {10})), HasSubstr("moves on a line"));
  EXPECT_THAT(refusal(api::Jog{.motor = "m01", .per_s = 10, .in_steps = true}),
              HasSubstr("moves on a line"));
  EXPECT_EQ(lab.wait(move).result, "reached");
}

TEST(Lines, BeginAtRestAndOnOneBus) {
  StreamedLab lab(
      hall(1, 2) +
      "\n[[bus]]\nname = \"lab\"\nport = \"/dev/null1\"\nbaud = 500000\ntick_us = 2560\n"
      "format = \"fine\"\n[[mcu]]\nbus = \"lab\"\naddress = 1\n"
      "[[motor]]\nname = \"far\"\nmcu = \"lab:1\"\noutput = 0\ngroup = \"axes\"\n");
  EXPECT_THAT(lab.ask(line_to({"m01", "far"}, {10, 10})).reason,
              HasSubstr("m01 is on bus hall and far on bus lab"));
  const auto move = lab.send(Ask::kMoveTo, {"m02"}, {500});
  lab.run_for(0.2);
  EXPECT_THAT(lab.ask(line_to({"m01", "m02"}, {10, 10})).reason, HasSubstr("begin it at rest"));
  lab.wait(move);
  EXPECT_EQ(lab.ask(line_to({"m01", "m02"}, {0, 500})).reason, "m01: stands at its target already");
}

TEST(Lines, SoftLimitsAreThoseOfEachMotor) {
  StreamedLab lab(with_keys(hall(1, 2), "m02", "soft_limits = [-100, 100]\n"));
  const std::string why = lab.ask(line_to({"m01", "m02"}, {1000, 101})).reason;
  EXPECT_THAT(why, HasSubstr("m02: target 101 steps is beyond the soft limit at 100"));
  EXPECT_EQ(lab.ask(line_to({"m01", "m02"}, {1000, 100})).result, "reached");
}

TEST(Lines, BacklashIsTakenUpWhenAllHaveArrived) {
  StreamedLab lab(with_keys(hall(1, 2), "m02", "backlash = 30\n"));
  const auto move = lab.send(line_to({"m01", "m02"}, {-600, -300}));
  lab.run_until([&] { return lab.shaft_steps("m01") == -600; });
  EXPECT_NEAR(static_cast<double>(lab.shaft_steps("m02")), -300, 1);
  std::int64_t lowest = 0;
  lab.run_until([&] {
    lowest = std::min(lowest, lab.shaft_steps("m02"));
    return lab.has_result(move);
  });
  EXPECT_EQ(lowest, -330);
  const Answer result = lab.last_reply(move);
  EXPECT_EQ(result.result, "reached");
  EXPECT_THAT(result.legs, ElementsAre(3, 3));
  EXPECT_EQ(lab.shaft_steps("m02"), -300);
  EXPECT_EQ(lab.shaft_steps("m01"), -600);
  // From its side it goes straight.
  EXPECT_THAT(lab.ask(line_to({"m01", "m02"}, {0, 0})).legs, ElementsAre(1, 1));
}

TEST(Lines, OneThatIsLostEndsTheOthersAlongTheLine) {
  for (const std::int64_t steps : {-3001, -6000}) {  // the latter by the MCUs
    SCOPED_TRACE(steps);
    StreamedLab lab(hall(2, 2));
    const auto move = lab.send(line_to(kMotors, {6000, steps, 500, 6000}));
    lab.run_until([&] { return lab.shaft_steps("m01") >= 2000; });
    lab.bus(0).reboot(1, 100'000'000);
    const Answer result = lab.wait(move);
    EXPECT_EQ(result.result, "link");
    EXPECT_EQ(result.motor_results[0], "stopped");
    EXPECT_EQ(result.motor_results[2], "link");
    EXPECT_LE(off_line(lab, {"m01", "m02"}, {6000, steps}), kOffAtRest)
        << "those that went on are on it";
    EXPECT_LT(lab.shaft_steps("m01"), 6000);
  }
}

void expect_end_at_a_limit(const std::vector<std::int64_t>& steps, const std::string& limited_by) {
  StreamedLab lab(with_keys(hall(2, 2), "m03", "limit = \"positive\"\n"));
  const auto move = lab.send(line_to(kMotors, steps));
  lab.run_until([&] { return lab.shaft_steps("m01") >= 2000; });
  lab.bus(0).mcu(1).set_inputs({0b001, 0});
  const Answer result = lab.wait(move);
  EXPECT_EQ(result.result, "limit");
  EXPECT_THAT(result.motor_results, ElementsAre("stopped", "stopped", "limit", "stopped"));
  EXPECT_THAT(result.reason, HasSubstr("m03: stopped by its limit switch at the positive end"));
  EXPECT_THAT(result.reason,
              HasSubstr("; the line was limited by " + limited_by + ", which was left at "));
  EXPECT_THAT(result.reason, HasSubstr("; m03 stands "));
  EXPECT_LE(off_line(lab, {"m01", "m02", "m04"}, {steps[0], steps[1], steps[3]}), kOffAtRest);
  const std::string why = lab.ask(line_to(kMotors, steps)).reason;
  EXPECT_THAT(why, HasSubstr("m03: its limit switch at the positive end is active"));
}

TEST(Lines, ALimitSwitchOfOneEndsTheOthersAlongTheLine) {
  expect_end_at_a_limit({6000, -3001, 1500, 5999}, "m04");
  expect_end_at_a_limit({6000, -6000, 6000, 301}, "m01");  // by the MCUs
}

struct NearlyArrived {
  explicit NearlyArrived(const std::string& settle)
      : lab(with_keys(
            with_keys(hall(2, 2), "m03", "limit = \"positive\"\nlimit_action = \"immediate\"\n"),
            "m01", settle)) {}
  // The other one meets its switch so many steps before the end.
  std::int64_t move(bool path, std::int64_t left) {
    const auto move =
        path ? lab.send(api::MovePath{.motors = two, .rows = 1, .positions = {2000, 2000}})
             : lab.send(line_to(two, {2000, 2000}));
    lab.run_until([&] { return lab.shaft_steps("m01") >= 2000 - left; });
    lab.bus(0).mcu(1).set_inputs({0b001, 0});
    lab.run_until([&] { return lab.shaft_steps("m01") >= 2000; }, 0.5);
    return move;
  }
  const std::vector<std::string> two{"m01", "m03"};
  StreamedLab lab;
};

TEST(Lines, OneThatArrivesSettlesThoughAnotherHasEnded) {
  for (const bool path : {false, true}) {
    int alone = 0;
    for (std::int64_t left = 1; left < 8; ++left) {
      SCOPED_TRACE(testing::Message() << (path ? "path" : "line") << ", " << left << " steps");
      NearlyArrived nearly("settle_ms = 400\n");
      const auto move = nearly.move(path, left);
      const std::int64_t arrived_us = nearly.lab.now_us();
      const Answer result = nearly.lab.wait(move);
      if (result.motor_results != std::vector<std::string>{"reached", "limit"}) continue;
      ++alone;
      EXPECT_GE(nearly.lab.now_us() - arrived_us, 400'000);
    }
    EXPECT_GE(alone, 1);
  }
}

// Frames are lost from shortly before its end on.
TEST(Lines, OneThatArrivesOnABadLineSettlesThoughAnotherHasEnded) {
  int alone = 0;
  for (unsigned seed = 1; seed <= 40; ++seed) {
    SCOPED_TRACE(seed);
    NearlyArrived nearly("settle_ms = 400\n");
    std::mt19937 random(seed);
    const auto move = nearly.lab.send(line_to(nearly.two, {2000, 2000}));
    const auto left = static_cast<std::int64_t>(1 + seed % 7);
    nearly.lab.run_until([&] { return nearly.lab.shaft_steps("m01") >= 1995 - left; });
    nearly.lab.on_send = [&random](std::size_t, std::vector<std::uint8_t>&) {
      return random() % 2 != 0;
    };
    nearly.lab.run_until([&] { return nearly.lab.shaft_steps("m01") >= 2000 - left; }, 0.5);
    nearly.lab.bus(0).mcu(1).set_inputs({0b001, 0});
    nearly.lab.run_until([&] { return nearly.lab.shaft_steps("m01") >= 2000; }, 0.5);
    const std::int64_t arrived_us = nearly.lab.now_us();
    const Answer result = nearly.lab.wait(move);
    if (result.motor_results != std::vector<std::string>{"reached", "limit"}) continue;
    ++alone;
    EXPECT_GE(nearly.lab.now_us() - arrived_us, 400'000);
  }
  EXPECT_GE(alone, 1);
}

// A stop ends that, too.
TEST(Lines, OneThatSettlesThoughAnotherHasEndedIsStopped) {
  NearlyArrived nearly("settle_ms = 5000\n");
  const auto move = nearly.move(false, 3);
  nearly.lab.run_for(0.5);
  EXPECT_FALSE(nearly.lab.has_result(move));
  const std::int64_t asked_us = nearly.lab.now_us();
  nearly.lab.wait(nearly.lab.send(Ask::kStop, {"m01"}));
  EXPECT_TRUE(nearly.lab.has_result(move));
  EXPECT_LT(nearly.lab.now_us() - asked_us, 1'000'000) << "a poll, and not the rest of the 5 s";
}

// Frames are lost: what is told of the line is where its motors stand.
TEST(Lines, WhatIsToldIsTrueOnABadLine) {
  for (unsigned seed = 1; seed <= 12; ++seed) {
    SCOPED_TRACE(seed);
    StreamedLab lab(hall(3, 2));
    std::mt19937 random(seed);
    lab.on_send = [&random](std::size_t, std::vector<std::uint8_t>&) { return random() % 12 != 0; };
    const std::vector<std::string> motors{"m01", "m02", "m03", "m04", "m05", "m06"};
    // Some are made by the MCUs.
    const std::vector<std::int64_t> steps =
        seed % 4 < 2 ? std::vector<std::int64_t>{9000, -4001, 1700, 12, -8999, 0}
                     : std::vector<std::int64_t>{9000, -9000, 170, 12, -9000, 0};
    const auto move = lab.send(line_to(motors, steps));
    lab.run_for(0.3 + 0.1 * static_cast<double>(seed));
    if (seed % 3 != 0) lab.ask(api::Pause{{"m02"}});
    if (seed % 3 == 1) lab.ask(api::Resume{});
    if (seed % 3 == 1) lab.run_for(0.4);
    lab.send(Ask::kStop, {"m05"});
    const Answer result = lab.wait(move);
    lab.run_for(1);
    const bool off = result.reason.find("steps off it") != std::string::npos;
    EXPECT_TRUE(result.result == "stopped" || result.result == "link") << result.reason;
    if (result.result == "stopped") {
      EXPECT_EQ(off_line(lab, motors, steps) > kOffAtRest, off) << result.reason;
    }
    for (std::size_t i = 0; i < motors.size(); ++i) {
      EXPECT_EQ(lab.shaft_steps(motors[i]), lab.motor(motors[i]).position_steps);
    }
    lab.on_send = nullptr;
    EXPECT_EQ(lab.ask(line_to(motors, {0, 0, 0, 0, 0, 0})).result, "reached");
  }
}

TEST(Lines, AnEmergencyStopEndsThem) {
  StreamedLab lab(hall(2, 2));
  const auto move = lab.send(line_to(kMotors, kSteps));
  lab.run_until([&] { return lab.shaft_steps("m01") >= 1000; });
  EXPECT_EQ(lab.ask(Ask::kEmergencyStop, {}).result, "done");
  const Answer result = lab.wait(move);
  EXPECT_THAT(result, Ends("stopped", "stopped by an emergency stop"));
  lab.run_for(0.5);
  EXPECT_EQ(lab.ask(Ask::kClearFaults, {}).result, "done");
  EXPECT_EQ(lab.ask(line_to(kMotors, {0, 0, 0, 0})).result, "reached");
}

TEST(Lines, AStopBeforeTheStartMovesNothing) {
  StreamedLab lab(hall(2, 2));
  const auto move = lab.send(line_to(kMotors, kSteps));
  lab.run_for(0.005);
  lab.ask(Ask::kStop, {"m01"});
  EXPECT_EQ(lab.wait(move).result, "stopped");
  for (const std::string& motor : kMotors) EXPECT_EQ(lab.shaft_steps(motor), 0);
  EXPECT_EQ(lab.ask(line_to(kMotors, kSteps)).result, "reached");
}

TEST(Lines, AreKeptLikeOtherMoves) {
  StreamedLab lab(hall(2, 2));
  lab.keep_positions();
  lab.connect();
  EXPECT_EQ(lab.ask(line_to(kMotors, kSteps)).result, "reached");
  const auto history = lab.send(api::GetHistory{.motor = "m02"});
  lab.wait(history);
  const auto past = lab.history(history);
  ASSERT_FALSE(past.empty());
  EXPECT_EQ(past.front().what, "line");
  EXPECT_EQ(past.front().to_steps, -1201);
}

}  // namespace
}  // namespace bushd::test
