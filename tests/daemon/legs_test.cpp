// Moves of several legs: a motor with backlash comes to its targets from one side.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "daemon/lab.h"

namespace bushd::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

// 100 to 2500 steps/s; the last approach of m01 is upwards, over 40 steps.
std::string lab_with_backlash(const std::string& keys = "", const char* manner = "fine") {
  return with_keys(hall(1, 2, manner), "m01",
                   "unit = \"mm\"\nsteps_per_unit = 400\nbacklash = 0.1\n" + keys);
}

struct Way {
  std::int64_t lowest = 0;
  std::int64_t highest = 0;
  double fastest_up = 0;
};

// What the shaft does until the request has its result.
Way way_of(Lab& lab, std::int64_t request) {
  Way way{lab.shaft_steps("m01"), lab.shaft_steps("m01"), 0};
  lab.run_until([&] {
    way.lowest = std::min(way.lowest, lab.shaft_steps("m01"));
    way.highest = std::max(way.highest, lab.shaft_steps("m01"));
    way.fastest_up = std::max(way.fastest_up, lab.motor("m01").velocity_steps_per_s);
    return lab.has_result(request);
  });
  lab.run_for(0.006);
  return way;
}

TEST(Legs, AgainstTheBacklashAMoveComesBackFromBeyond) {
  for (const char* manner : {"fine", "coarse", "fine_table"}) {
    SCOPED_TRACE(manner);
    ReadyLab lab(lab_with_backlash("", manner));
    const auto down = lab.send(Ask::kMoveTo, {"m01"}, {-600});
    const Way way = way_of(lab, down);
    const Answer ended = lab.last_reply(down);
    EXPECT_EQ(ended.result, "reached") << ended.reason;
    EXPECT_THAT(ended.legs, ElementsAre(2));
    EXPECT_EQ(lab.replies(down).size(), 2u) << "one result";
    EXPECT_EQ(way.lowest, -640);
    EXPECT_EQ(lab.shaft_steps("m01"), -600);
    const auto up = lab.send(Ask::kMoveTo, {"m01"}, {-100});
    EXPECT_EQ(way_of(lab, up).highest, -100) << "straight: it comes from that side";
    EXPECT_THAT(lab.last_reply(up).legs, ElementsAre(1));
    EXPECT_EQ(lab.motor("m01").position_steps, -100);
  }
}

TEST(Legs, TheLastApproachHasItsOwnSpeed) {
  ReadyLab lab(lab_with_backlash("backlash_speed = 0.5\n"));
  // Farther than the backlash, so not as slow all the way.
  const auto up = lab.send(Ask::kMoveTo, {"m01"}, {1000});
  EXPECT_GT(way_of(lab, up).fastest_up, 500);
  EXPECT_THAT(lab.last_reply(up).legs, ElementsAre(2));
  EXPECT_EQ(lab.shaft_steps("m01"), 1000);
  const auto near = lab.send(Ask::kMoveTo, {"m01"}, {1030});
  EXPECT_DOUBLE_EQ(way_of(lab, near).fastest_up, 200);
  EXPECT_THAT(lab.last_reply(near).legs, ElementsAre(1));
  const auto down = lab.send(Ask::kMoveTo, {"m01"}, {0});
  const Way way = way_of(lab, down);
  EXPECT_EQ(way.lowest, -40);
  EXPECT_DOUBLE_EQ(way.fastest_up, 200);
  EXPECT_DOUBLE_EQ(lab.last_reply(down).most_steps_per_s[0], 2500);
}

TEST(Legs, ANegativeOneIsUsedFromAbove) {
  std::string toml = lab_with_backlash();
  toml.replace(toml.find("0.1"), 3, "-0.1");
  ReadyLab lab(toml);
  const auto up = lab.send(Ask::kMoveTo, {"m01"}, {600});
  EXPECT_EQ(way_of(lab, up).highest, 640);
  EXPECT_EQ(lab.shaft_steps("m01"), 600);
  ReadyLab turned(lab_with_backlash("direction = \"negative\"\n"));
  const auto there = turned.send(Ask::kMoveTo, {"m01"}, {600});
  EXPECT_EQ(way_of(turned, there).highest, 640) << "upwards on the user's scale is down here";
}

TEST(Legs, LimitsHoldForEveryLegBeforeTheFirst) {
  ReadyLab lab(lab_with_backlash("soft_limits = [-1.0, 5.0]\n"));
  const Answer refused = lab.ask(Ask::kMoveTo, {"m01"}, {-390});
  EXPECT_THAT(refused, Ends("refused", "m01: the start of its last approach, for backlash"));
  EXPECT_THAT(refused.reason, HasSubstr("soft limit at -1.00"));
  EXPECT_EQ(lab.shaft_steps("m01"), 0);
  EXPECT_EQ(lab.ask(Ask::kMoveTo, {"m01"}, {-360}).result, "reached");
}

TEST(Legs, AStopEndsTheMoveInEveryLeg) {
  ReadyLab lab(lab_with_backlash("backlash_speed = 0.25\n"));
  const auto first = lab.send(Ask::kMoveTo, {"m01"}, {-600});
  lab.run_until([&] { return lab.shaft_steps("m01") <= -300; });
  lab.send(Ask::kStop, {"m01"});
  const Answer in_first = lab.wait(first);
  EXPECT_THAT(in_first, Ends("stopped", "m01: stopped on request, asked for by command 2 of test"));
  lab.run_for(1);
  EXPECT_EQ(in_first.position_steps[0], lab.shaft_steps("m01")) << "no other leg follows";
  const auto second = lab.send(Ask::kMoveTo, {"m01"}, {-1000});
  lab.run_until([&] { return lab.shaft_steps("m01") == -1040; });
  lab.run_until([&] { return lab.shaft_steps("m01") >= -1030; });
  lab.send(Ask::kStop, {"m01"});
  const Answer in_second = lab.wait(second);
  EXPECT_EQ(in_second.result, "stopped");
  EXPECT_EQ(in_second.position_steps[0], lab.shaft_steps("m01"));
  EXPECT_LT(lab.shaft_steps("m01"), -1000);
}

TEST(Legs, AStopWhereALegEndsIsNoArrival) {
  ReadyLab lab(lab_with_backlash());
  const auto move = lab.send(Ask::kMoveTo, {"m01"}, {-600});
  lab.run_until([&] { return lab.shaft_steps("m01") == -640; });
  lab.send(Ask::kStop, {"m01"});
  EXPECT_EQ(lab.wait(move).result, "stopped");
  EXPECT_EQ(lab.shaft_steps("m01"), -640);
}

TEST(Legs, ANewTargetInAnyLegIsReachedFromTheRightSide) {
  ReadyLab lab(lab_with_backlash());
  for (const int at : {-200, -630}) {
    SCOPED_TRACE(at);
    ASSERT_EQ(lab.ask(Ask::kMoveTo, {"m01"}, {0}).result, "reached");
    const auto first = lab.send(Ask::kMoveTo, {"m01"}, {-600});
    lab.run_until([&] { return lab.shaft_steps("m01") <= at; });
    if (at == -630) lab.run_until([&] { return lab.shaft_steps("m01") == -640; });
    const auto second = lab.send(Ask::kMoveTo, {"m01"}, {-350});
    EXPECT_EQ(lab.motor("m01").activity, api::Activity::kMoving);
    EXPECT_EQ(lab.wait(second).result, "reached");
    EXPECT_EQ(lab.last_reply(first).result, "stopped");
    EXPECT_EQ(lab.shaft_steps("m01"), -350);
    lab.run_for(0.5);
    EXPECT_EQ(lab.shaft_steps("m01"), -350) << "nothing of the move before is left";
  }
}

TEST(Legs, ALostLinkEndsTheMoveInTheFirstLeg) {
  ReadyLab lab(lab_with_backlash());
  const auto move = lab.send(Ask::kMoveTo, {"m01"}, {-600});
  lab.run_until([&] { return lab.shaft_steps("m01") <= -300; });
  lab.unplug(0);
  EXPECT_EQ(lab.wait(move).result, "link");
  lab.plug(0);
  lab.connect();
  lab.run_for(1);
  EXPECT_EQ(lab.motor("m01").position_steps, lab.shaft_steps("m01"));
  EXPECT_EQ(lab.motor("m01").activity, api::Activity::kResting);
}

TEST(Legs, TheResultComesWhenItHasSettled) {
  ReadyLab lab(lab_with_backlash("settle_ms = 800\n"));
  const auto move = lab.send(Ask::kMoveTo, {"m01"}, {-200});
  lab.run_until([&] { return lab.shaft_steps("m01") == -240; });
  lab.run_until([&] { return lab.shaft_steps("m01") == -200; });
  lab.run_for(0.7);
  EXPECT_FALSE(lab.has_result(move));
  lab.run_for(0.3);
  EXPECT_EQ(lab.last_reply(move).result, "reached");
  // What settles is there: a stop does not make it wait, and takes nothing back.
  const auto again = lab.send(Ask::kMoveTo, {"m01"}, {100});
  lab.run_until([&] { return lab.shaft_steps("m01") == 100; });
  lab.run_for(0.1);
  lab.send(Ask::kStop, {"m01"});
  lab.run_for(0.2);
  ASSERT_TRUE(lab.has_result(again));
  EXPECT_EQ(lab.last_reply(again).result, "reached");
}

TEST(Legs, ANewTargetWhileItSettlesIsGoneTo) {
  ReadyLab lab(lab_with_backlash("settle_ms = 800\n"));
  const auto move = lab.send(Ask::kMoveTo, {"m01"}, {100});
  lab.run_until([&] { return lab.shaft_steps("m01") == 100; });
  lab.run_for(0.2);
  EXPECT_EQ(lab.ask(Ask::kMoveTo, {"m01"}, {300}).result, "reached");
  EXPECT_EQ(lab.last_reply(move).result, "stopped");
  EXPECT_EQ(lab.shaft_steps("m01"), 300);
}

TEST(Legs, ADryRunShowsThem) {
  ReadyLab lab(lab_with_backlash("backlash_speed = 0.25\n"));
  const Answer planned = lab.ask(api::Move{
      .kind = api::Move::Kind::kAbsolute, .motors = {{"m01", -600}, {"m02", 50}}, .dry_run = true});
  ASSERT_TRUE(planned.plan) << planned.reason;
  ASSERT_EQ(planned.plan->motors.size(), 3u);
  EXPECT_EQ(planned.plan->motors[0].steps, -640);
  EXPECT_EQ(planned.plan->motors[1].motor, "m01");
  EXPECT_EQ(planned.plan->motors[1].steps, 40);
  EXPECT_DOUBLE_EQ(planned.plan->motors[1].peak_steps_per_s, 100);
  EXPECT_EQ(planned.plan->motors[2].steps, 50);
  EXPECT_GE(planned.plan->duration_us,
            planned.plan->motors[0].duration_us + planned.plan->motors[1].duration_us);
  EXPECT_FALSE(planned.plan->traffic);
}

TEST(Legs, TheMotorIsMarkedAsMovingFromTheFirstToTheLast) {
  Lab lab(lab_with_backlash("settle_ms = 500\n"));
  lab.keep_positions();
  lab.connect();
  lab.run_for(1);
  const auto move = lab.send(Ask::kMoveTo, {"m01"}, {-600});
  lab.run_until([&] { return lab.shaft_steps("m01") == -640; });
  lab.run_until([&] { return lab.shaft_steps("m01") >= -635; });
  EXPECT_FALSE(lab.has_result(move));
  lab.bus(0).reboot(0);
  lab.cut_pc_power();
  ASSERT_TRUE(lab.run_until([&] { return lab.all_ready(); }, 10));
  lab.run_for(0.5);
  EXPECT_EQ(lab.motor("m01").trust, api::Trust::kUncertain) << "never restored: it moved";
}

}  // namespace
}  // namespace bushd::test
