// Jogs: a motor that moves on for as long as its client keeps it going, from the request to the
// shaft.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>

#include "daemon/lab.h"

namespace bushd::test {
namespace {

using testing::HasSubstr;

constexpr const char* kInMm = "unit = \"mm\"\nsteps_per_unit = 400\nsoft_limits = [-2.5, 5.0]\n";

// Two motors on one MCU by a table of 40 us: 100 to 2500 steps/s. `keys` are of m01.
std::string lab_with(const std::string& keys, const char* manner = "fine") {
  return with_keys(hall(1, 2, manner), "m01", keys);
}

api::Jog jog(double steps_per_s) {
  return {.motor = "m01", .per_s = steps_per_s, .in_steps = true};
}

api::Jog ended_after(std::int64_t steps) {
  return {.motor = "m01", .steps_after = steps};
}

// A client that renews its jog in time, until `done`.
bool keep_going(Lab& lab, const std::function<bool()>& done, double limit_s = 20) {
  for (double left_s = limit_s; left_s > 0; left_s -= 0.2) {
    if (lab.run_until(done, 0.2)) return true;
    lab.send(api::Jog{.motor = "m01", .renew = true});
  }
  return false;
}

double speed(const Lab& lab) {
  return lab.motor("m01").velocity_steps_per_s;
}

TEST(Jogs, MoveOnAtTheirSpeedUntilTheirClientEndsThem) {
  for (const char* manner : {"fine", "coarse", "fine_table", "coarse_ticks"}) {
    SCOPED_TRACE(manner);
    ReadyLab lab(lab_with("", manner));
    const auto first = lab.send(jog(700));
    EXPECT_TRUE(keep_going(lab, [&] { return lab.shaft_steps("m01") > 1500; }));
    EXPECT_DOUBLE_EQ(speed(lab), 1e9 / (36 * 40'000.0)) << "not faster than asked";
    EXPECT_FALSE(lab.has_result(first));
    const auto last = lab.send(jog(0));
    const Answer ended = lab.wait(first);
    EXPECT_THAT(ended, Ends("done", "ended by its client"));
    EXPECT_EQ(ended.position_steps[0], lab.shaft_steps("m01"));
    EXPECT_EQ(lab.wait(last).result, "done");
    EXPECT_EQ(lab.motor("m01").activity, api::Activity::kResting);
    EXPECT_EQ(lab.motor("m01").trust, api::Trust::kKnown);
    EXPECT_EQ(lab.mcu_health("hall:1").rejected_frames, 0);
  }
}

TEST(Jogs, TakeAnotherSpeedAndDirectionThroughRest) {
  ReadyLab lab(lab_with(""));
  const auto first = lab.send(jog(500));
  const auto speed_is = [&](double steps_per_s) {
    return keep_going(lab, [&] { return speed(lab) == steps_per_s; });
  };
  EXPECT_TRUE(speed_is(500));
  EXPECT_THAT(lab.ask(jog(1250)), Ends("done"));
  EXPECT_TRUE(speed_is(1250));
  lab.send(jog(250));
  EXPECT_TRUE(speed_is(250));
  const std::int64_t turn = lab.shaft_steps("m01");
  lab.send(jog(-500));
  EXPECT_TRUE(speed_is(-500));
  EXPECT_TRUE(keep_going(lab, [&] { return lab.shaft_steps("m01") < turn - 300; }));
  EXPECT_EQ(lab.replies(first).size(), 1u) << "one motion, and no result yet";
  lab.send(jog(0));
  EXPECT_EQ(lab.wait(first).result, "done");
  EXPECT_EQ(lab.replies(first).size(), 2u);
}

TEST(Jogs, StopAtTheSoftLimitExactly) {
  for (const bool negative : {false, true}) {
    SCOPED_TRACE(negative);
    ReadyLab lab(lab_with(std::string(kInMm) + (negative ? "direction = \"negative\"\n" : "")));
    const auto up = lab.send(api::Jog{.motor = "m01", .per_s = 3});
    EXPECT_TRUE(keep_going(lab, [&] { return lab.has_result(up); }));
    EXPECT_THAT(lab.last_reply(up), Ends("limit", "stands at its soft limit"));
    EXPECT_EQ(lab.shaft_steps("m01"), negative ? -1000 : 2000);
    lab.run_for(0.6);
    const Answer refused = lab.ask(api::Jog{.motor = "m01", .per_s = 3});
    EXPECT_THAT(refused, Ends("refused", "jog it the other way"));
    const auto down = lab.send(api::Jog{.motor = "m01", .per_s = -3});
    EXPECT_TRUE(keep_going(lab, [&] { return lab.has_result(down); }));
    EXPECT_EQ(lab.shaft_steps("m01"), negative ? 2000 : -1000);
  }
}

TEST(Jogs, OfAClientThatFallsSilentRampDown) {
  ReadyLab lab(lab_with(""));
  const auto first = lab.send(jog(1000));
  EXPECT_THAT(lab.wait(first, 5), Ends("stopped", "has not renewed it within 500 ms"));
  EXPECT_LT(lab.shaft_steps("m01"), 1000);
  api::Jog patient = jog(100);
  patient.keepalive_ms = 3000;
  const auto second = lab.send(patient);
  lab.run_for(2.9);
  EXPECT_FALSE(lab.has_result(second));
  EXPECT_EQ(lab.wait(second).result, "stopped");
}

TEST(Jogs, OfAClientThatIsGoneRampDownAtOnce) {
  ReadyLab lab(lab_with(""));
  const auto first = lab.send_as("remote", jog(1000));
  lab.run_for(0.3);
  const std::int64_t there = lab.shaft_steps("m01");
  lab.leave("remote");
  EXPECT_THAT(lab.wait(first).reason, HasSubstr("its client has gone"));
  EXPECT_LT(lab.shaft_steps("m01"), there + 150);
}

TEST(Jogs, WhoIsStoppedByOthersMustLetGoFirst) {
  ReadyLab lab(lab_with(""));
  const auto first = lab.send_as("remote", jog(1000));
  lab.run_for(0.3);
  const auto stop = lab.send(Ask::kStop, {"m01"});
  EXPECT_THAT(lab.wait(lab.send_as("remote", jog(1000))).reason, HasSubstr("is being stopped"));
  EXPECT_EQ(lab.wait(stop).result, "done");
  EXPECT_THAT(lab.last_reply(first), Ends("stopped", "stopped on request, asked for by command"));
  const std::int64_t stands = lab.shaft_steps("m01");
  for (int i = 0; i < 5; ++i) {
    EXPECT_THAT(lab.wait(lab.send_as("remote", jog(1000))).reason, HasSubstr("let go first"));
    EXPECT_EQ(lab.wait(lab.send_as("remote", {api::Jog{.motor = "m01", .renew = true}})).result,
              "refused");
    lab.run_for(0.2);
  }
  EXPECT_EQ(lab.shaft_steps("m01"), stands);
  lab.send_as("remote", jog(0));
  const auto again = lab.send_as("remote", jog(1000));
  lab.run_for(0.2);
  EXPECT_GT(lab.shaft_steps("m01"), stands);
  EXPECT_EQ(lab.wait(again).result, "stopped");
}

// What was said of an end that its client has taken back is no longer true.
TEST(Jogs, TakenUpAgainAreStoppedByOthersAsEver) {
  for (const bool silent : {false, true}) {
    SCOPED_TRACE(silent);
    ReadyLab lab(lab_with(""));
    const auto first = lab.send_as("remote", jog(2000));
    lab.run_for(silent ? 0.52 : 0.4);
    if (!silent) lab.send_as("remote", jog(0));
    lab.run_for(0.02);
    EXPECT_EQ(lab.wait(lab.send_as("remote", jog(2000))).reason, "m01: changed");
    lab.run_for(0.2);
    EXPECT_EQ(lab.ask(Ask::kStop, {"m01"}).result, "done");
    EXPECT_THAT(lab.last_reply(first),
                Ends("stopped", "m01: stopped on request, asked for by command"));
    EXPECT_THAT(lab.wait(lab.send_as("remote", jog(2000))).reason, HasSubstr("let go first"));
  }
}

TEST(Jogs, ThatAnotherClientEndsSoManyStepsAfterAreStopped) {
  ReadyLab lab(lab_with(""));
  const auto first = lab.send_as("remote", jog(1000));
  lab.run_for(0.3);
  EXPECT_EQ(lab.ask(ended_after(500)).result, "done");
  EXPECT_THAT(lab.last_reply(first), Ends("stopped", "stands 500 steps after the stop event at"));
  EXPECT_THAT(lab.last_reply(first).reason, HasSubstr("ended by command"));
  lab.run_for(1);
  const auto unbegun = lab.send_as("other", jog(1000));
  lab.send(ended_after(500));
  EXPECT_EQ(lab.wait(unbegun).result, "stopped");
}

// While it ramps down nothing is to be done for it, also when it is renewed no more.
TEST(Jogs, ThatOthersStopLetTheDaemonSleep) {
  ReadyLab lab(lab_with(""));
  const auto first = lab.send(jog(2500));
  lab.run_for(0.48);
  lab.send_as("remote", {api::Stop{{"m01"}}});
  lab.run_for(0.04);
  ASSERT_FALSE(lab.has_result(first)) << "it ramps down";
  lab.core().step(lab.now_us());
  EXPECT_GT(lab.core().next_wake_us(), lab.now_us());
  EXPECT_EQ(lab.wait(first).result, "stopped");
}

TEST(Jogs, AwayFromTheRangeAreRefusedInMotionToo) {
  ReadyLab lab(lab_with(kInMm));
  lab.ask(Ask::kSetPosition, {"m01"}, {6000});
  const auto first = lab.send(jog(-1000));
  lab.run_for(0.4);
  const Answer refused = lab.ask(jog(1000));
  EXPECT_THAT(refused, Ends("refused", "beyond its soft limit"));
  EXPECT_EQ(lab.wait(first).result, "stopped");
  EXPECT_LT(lab.motor("m01").position_steps, 6000);
}

TEST(Jogs, OfAnotherClientTakeOver) {
  ReadyLab lab(lab_with(""));
  const auto move = lab.send(Ask::kMoveBy, {"m01"}, {5000});
  lab.run_for(0.5);
  const auto first = lab.send_as("remote", jog(-400));
  EXPECT_THAT(lab.wait(move), Ends("stopped", "was given a new target by command"));
  const auto second = lab.send_as("panel", jog(300));
  EXPECT_THAT(lab.wait(first).reason, HasSubstr("of panel; it moves on"));
  EXPECT_EQ(lab.wait(lab.send_as("remote", jog(-400))).result, "refused") << "it holds its key";
  lab.send_as("remote", jog(0));
  const Answer ended = lab.wait(second);
  EXPECT_THAT(ended, Ends("stopped", "ended by command"));
  EXPECT_EQ(ended.position_steps[0], lab.shaft_steps("m01"));
}

TEST(Jogs, EndSoManyStepsAfterTheStopEvent) {
  ReadyLab lab(lab_with(kInMm));
  const auto first = lab.send(jog(250));
  EXPECT_TRUE(keep_going(lab, [&] { return lab.shaft_steps("m01") >= 300; }));
  const std::int64_t at_event = lab.shaft_steps("m01");
  lab.send(ended_after(200));
  const Answer ended = lab.wait(first);
  EXPECT_EQ(ended.result, "done") << ended.reason;
  const std::int64_t from = lab.shaft_steps("m01") - 200;
  EXPECT_THAT(ended.reason, HasSubstr(fmt::format("200 steps after the stop event at {:.4f} mm",
                                                  static_cast<double>(from) / 400)));
  // The daemon reckons where the motor is by its estimate of the MCU's clock, which is right to far
  // less than the 4 ms of a step: at most the step that is just being made may be counted or not.
  EXPECT_LE(std::abs(from - at_event), 1);
}

TEST(Jogs, ThatCannotEndSoSoonSaySo) {
  ReadyLab lab(lab_with(kInMm));
  const auto fast = lab.send(jog(2500));
  EXPECT_TRUE(keep_going(lab, [&] { return lab.shaft_steps("m01") >= 300; }));
  lab.send(ended_after(1));
  const Answer ended = lab.wait(fast);
  EXPECT_THAT(ended, Ends("stopped", "its table needs"));
  EXPECT_EQ(ended.position_steps[0], lab.shaft_steps("m01")) << "and does not come back";
  lab.run_for(0.6);
  const auto near = lab.send(jog(-250));
  lab.run_for(0.3);
  lab.send(ended_after(4000));
  EXPECT_THAT(lab.wait(near).reason, HasSubstr("would be beyond its soft limit"));
  EXPECT_GT(lab.shaft_steps("m01"), -1000);
}

TEST(Jogs, ThatCannotBeAreRefusedWithTheFigure) {
  ReadyLab lab(lab_with(kInMm));
  const auto reason = [&lab](const api::Jog& request) {
    const Answer answer = lab.ask(request);
    EXPECT_EQ(answer.result, "refused");
    return answer.reason;
  };
  EXPECT_THAT(reason({.motor = "m01", .per_s = 6e-7}),
              HasSubstr("m01: 6e-07 mm/s would take 4166.67 s a step"));
  for (const double bad : {std::nan(""), HUGE_VAL}) reason({.motor = "m01", .per_s = bad});
  EXPECT_THAT(reason({.motor = "m01", .per_s = 1, .keepalive_ms = 49}), HasSubstr("50 to 10000"));
  EXPECT_THAT(reason({.motor = "m01", .per_s = 1, .steps_after = 5}), HasSubstr("of speed 0"));
  EXPECT_THAT(reason({.motor = "m17", .per_s = 1}), HasSubstr("no motor"));
  EXPECT_THAT(reason({.motor = "m01", .renew = true}), HasSubstr("no jog of this client"));
  EXPECT_EQ(lab.ask(jog(0)).reason, "m01 does not jog");
  const Answer end = lab.ask(ended_after(-5));
  EXPECT_EQ(end.result, "fault");
  EXPECT_THAT(end.reason, testing::AllOf(HasSubstr("allowed: 0 to"), HasSubstr("does not jog")));
  EXPECT_EQ(lab.shaft_steps("m01"), 0);
}

TEST(Jogs, AreMarkedBeforeTheyBegin) {
  Lab lab(lab_with(""));
  lab.keep_positions();
  lab.connect();
  lab.run_for(1);
  lab.disk_us = 20'000;
  const auto first = lab.send(jog(500));
  EXPECT_TRUE(lab.replies(first).empty()) << "the disk has not been told yet";
  lab.run_for(0.3);
  EXPECT_GT(lab.shaft_steps("m01"), 0);
  lab.send(jog(0));
  EXPECT_EQ(lab.wait(first).result, "done");
  lab.run_for(1);
  // One that is ended before the disk knows has never begun.
  const std::int64_t stands = lab.shaft_steps("m01");
  const auto held = lab.send(jog(500));
  lab.send(jog(0));
  EXPECT_EQ(lab.wait(held).result, "stopped");
  lab.run_for(1);
  EXPECT_EQ(lab.shaft_steps("m01"), stands);
}

TEST(Jogs, EndWithTheirMcu) {
  ReadyLab lab(lab_with(""));
  const auto first = lab.send(jog(500));
  lab.run_for(0.3);
  lab.unplug(0);
  EXPECT_EQ(lab.wait(first).result, "link");
  lab.plug(0);
  lab.connect();
  EXPECT_EQ(lab.ask(Ask::kMoveTo, {"m01"}, {0}).result, "reached");
  EXPECT_EQ(lab.shaft_steps("m01"), 0);
}

TEST(Jogs, OfALongWayGoOnAsLongAsTheyAreRenewed) {
  // At this speed a run to the end of what is counted would last longer than any run may.
  ReadyLab lab(lab_with(""));
  const auto first = lab.send(jog(0.5));
  EXPECT_TRUE(keep_going(lab, [&] { return lab.shaft_steps("m01") == 2; }, 6));
  lab.send(jog(0));
  EXPECT_EQ(lab.wait(first, 10).result, "done");
}

}  // namespace
}  // namespace bushd::test
