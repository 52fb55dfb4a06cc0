// Motors that pause on the way to their targets, and motors that are held.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "daemon/lab.h"

namespace bushd::test {
namespace {

std::string lab_with_keys(const std::string& keys = "", const char* manner = "fine") {
  return with_keys(hall(1, 3, manner), "m01", keys);
}

TEST(Pauses, KeepTheTargetAndTheMove) {
  for (const char* manner : {"fine", "coarse", "fine_table", "coarse_ticks"}) {
    SCOPED_TRACE(manner);
    ReadyLab lab(lab_with_keys("", manner));
    const auto move = lab.send(Ask::kMoveTo, {"m01", "m02"}, {2000, 800});
    lab.run_until([&] { return lab.shaft_steps("m01") >= 500; });
    EXPECT_EQ(lab.ask(api::Pause{{"m01"}}).reason, "paused: 1 motor");
    const std::int64_t stands = lab.shaft_steps("m01");
    EXPECT_LT(stands, 1500);
    lab.run_for(5);
    EXPECT_EQ(lab.shaft_steps("m01"), stands);
    EXPECT_EQ(lab.shaft_steps("m02"), 800) << "goes on";
    EXPECT_FALSE(lab.has_result(move));
    EXPECT_TRUE(lab.motor("m01").paused);
    EXPECT_FALSE(lab.motor("m02").paused);
    EXPECT_EQ(lab.motor("m01").target_steps, 2000);
    EXPECT_EQ(lab.ask(api::Resume{}).reason, "resumed: 1 motor");
    EXPECT_EQ(lab.wait(move).result, "reached");
    EXPECT_EQ(lab.shaft_steps("m01"), 2000);
    EXPECT_FALSE(lab.motor("m01").paused);
    EXPECT_EQ(lab.mcu_health("hall:1").rejected_frames, 0);
    EXPECT_EQ(lab.mcu_health("hall:1").ramp_downs, 0u);
  }
}

TEST(Pauses, AreTakenBackWhileItRampsDown) {
  ReadyLab lab(lab_with_keys());
  const auto move = lab.send(Ask::kMoveTo, {"m01"}, {3000});
  lab.run_until([&] { return lab.shaft_steps("m01") >= 1000; });
  lab.send(api::Pause{});
  lab.run_for(0.05);
  lab.send(api::Resume{});
  EXPECT_EQ(lab.wait(move).result, "reached");
  EXPECT_EQ(lab.shaft_steps("m01"), 3000);
}

TEST(Pauses, OfAGroupAreOfItsMotors) {
  ReadyLab lab(lab_with_keys());
  const auto move = lab.send(Ask::kMoveTo, {"m01", "m03"}, {2000, -2000});
  lab.run_until([&] { return lab.shaft_steps("m01") >= 500; });
  EXPECT_EQ(lab.ask(api::Pause{{"axes"}}).reason, "paused: 2 motors");
  EXPECT_EQ(lab.ask(api::Pause{{"axis"}}).result, "refused");
  EXPECT_EQ(lab.ask(api::Pause{}).reason, "paused: 2 motors") << "as they are";
  EXPECT_EQ(lab.ask(api::Resume{{"axes"}}).reason, "resumed: 2 motors");
  EXPECT_EQ(lab.wait(move).result, "reached");
  EXPECT_EQ(lab.shaft_steps("m03"), -2000);
}

TEST(Pauses, AStopEndsThePausedMove) {
  ReadyLab lab(lab_with_keys());
  const auto move = lab.send(Ask::kMoveTo, {"m01"}, {2000});
  lab.run_until([&] { return lab.shaft_steps("m01") >= 500; });
  lab.ask(api::Pause{});
  const std::int64_t stands = lab.shaft_steps("m01");
  EXPECT_EQ(lab.ask(Ask::kStop, {}).result, "done");
  EXPECT_THAT(lab.wait(move), Ends("stopped", "stopped on request, asked for by command"));
  EXPECT_EQ(lab.ask(api::Resume{}).reason, "resumed: 0 motors");
  lab.run_for(0.5);
  EXPECT_EQ(lab.shaft_steps("m01"), stands);
  EXPECT_EQ(lab.motor("m01").activity, api::Activity::kResting);
  EXPECT_EQ(lab.ask(Ask::kMoveTo, {"m01"}, {0}).result, "reached");
}

TEST(Pauses, ANewTargetEndsThem) {
  ReadyLab lab(lab_with_keys());
  const auto move = lab.send(Ask::kMoveTo, {"m01"}, {2000});
  lab.run_until([&] { return lab.shaft_steps("m01") >= 500; });
  lab.ask(api::Pause{});
  EXPECT_EQ(lab.ask(Ask::kMoveTo, {"m01"}, {-100}).result, "reached");
  EXPECT_EQ(lab.last_reply(move).result, "stopped");
  EXPECT_EQ(lab.shaft_steps("m01"), -100);
}

// Before any report has told that it was stopped where it stood.
TEST(Pauses, ANewTargetRightAfterAStopBeginsFromRest) {
  ReadyLab lab(lab_with_keys("backlash = 40\n"));
  const auto move = lab.send(Ask::kMoveTo, {"m01"}, {2000});
  lab.run_until([&] { return lab.shaft_steps("m01") >= 500; });
  lab.ask(api::Pause{});
  const std::int64_t stands = lab.shaft_steps("m01");
  lab.send(Ask::kStop, {"m01"});
  const Answer reached = lab.ask(Ask::kMoveTo, {"m01"}, {stands + 500});
  EXPECT_EQ(reached.result, "reached");
  EXPECT_THAT(reached.legs, testing::ElementsAre(1)) << "straight, from that side";
  EXPECT_EQ(lab.last_reply(move).result, "stopped");
  const auto lines = [&](const std::string& event) {
    return std::ranges::count_if(lab.move_lines(), [&](const std::string& line) {
      return line.find("\"event\":\"" + event + "\"") != std::string::npos;
    });
  };
  EXPECT_EQ(lines("move"), 2);
  EXPECT_EQ(lines("result"), 2) << "each motion ends once in the log of moves";
}

TEST(Pauses, HoldInEveryLeg) {
  ReadyLab lab(lab_with_keys("backlash = 40\nbacklash_speed = 200.0\n"));
  const auto move = lab.send(Ask::kMoveTo, {"m01"}, {-600});
  lab.run_until([&] { return lab.shaft_steps("m01") <= -300; });
  lab.ask(api::Pause{});
  lab.run_for(1);
  lab.send(api::Resume{});
  lab.run_until([&] { return lab.shaft_steps("m01") == -640; });
  lab.run_until([&] { return lab.shaft_steps("m01") >= -630; });
  lab.ask(api::Pause{});
  lab.run_for(1);
  EXPECT_LT(lab.shaft_steps("m01"), -600);
  EXPECT_FALSE(lab.has_result(move));
  lab.send(api::Resume{});
  EXPECT_EQ(lab.wait(move).result, "reached");
  EXPECT_EQ(lab.shaft_steps("m01"), -600);
}

TEST(Pauses, BetweenTwoLegsTheNextOneWaits) {
  ReadyLab lab(lab_with_keys("backlash = 40\n"));
  const auto move = lab.send(Ask::kMoveTo, {"m01"}, {-600});
  lab.run_until([&] { return lab.shaft_steps("m01") == -640; });
  lab.ask(api::Pause{});
  lab.run_for(1);
  EXPECT_EQ(lab.shaft_steps("m01"), -640);
  EXPECT_EQ(lab.motor("m01").target_steps, -600);
  lab.send(api::Resume{});
  EXPECT_EQ(lab.wait(move).result, "reached");
  EXPECT_EQ(lab.shaft_steps("m01"), -600);
}

TEST(Pauses, ALostLinkEndsThePausedMove) {
  ReadyLab lab(lab_with_keys());
  const auto move = lab.send(Ask::kMoveTo, {"m01"}, {2000});
  lab.run_until([&] { return lab.shaft_steps("m01") >= 500; });
  lab.ask(api::Pause{});
  lab.unplug(0);
  EXPECT_EQ(lab.wait(move).result, "link");
  lab.plug(0);
  lab.connect();
  EXPECT_FALSE(lab.motor("m01").paused);
  EXPECT_EQ(lab.ask(Ask::kMoveTo, {"m01"}, {0}).result, "reached");
}

TEST(Pauses, APausedMotorIsNotTakenForOneAtRest) {
  Lab lab(lab_with_keys());
  lab.keep_positions();
  lab.connect();
  lab.send(Ask::kMoveTo, {"m01"}, {2000});
  lab.run_until([&] { return lab.shaft_steps("m01") >= 500; });
  lab.ask(api::Pause{});
  lab.run_for(2);
  EXPECT_EQ(lab.ask(Ask::kSetPosition, {"m01"}, {0}).result, "refused");
  EXPECT_EQ(lab.ask(Ask::kDisable, {"m01"}).result, "refused");
  lab.bus(0).reboot(0);
  lab.cut_pc_power();
  ASSERT_TRUE(lab.run_until([&] { return lab.all_ready(); }, 10));
  lab.run_for(0.5);
  EXPECT_EQ(lab.motor("m01").trust, api::Trust::kUncertain);
}

TEST(Pauses, EndJogs) {
  ReadyLab lab(lab_with_keys());
  const auto jog = lab.send(api::Jog{.motor = "m01", .per_s = 500, .in_steps = true});
  lab.run_for(0.3);
  lab.send_as("panel", api::Pause{});
  EXPECT_THAT(lab.wait(jog), Ends("stopped", "of panel paused it"));
}

TEST(Holds, RefuseWhatWouldBegin) {
  ReadyLab lab(lab_with_keys());
  const auto move = lab.send(Ask::kMoveTo, {"m01"}, {1000});
  lab.run_for(0.1);
  EXPECT_EQ(lab.ask(api::Hold{{"m01"}}).reason, "held: 1 motor");
  EXPECT_EQ(lab.wait(move).result, "reached") << "what is under way goes on";
  EXPECT_TRUE(lab.motor("m01").held);
  for (const api::Request& request :
       {request_of(Ask::kMoveTo, {"m01"}, {0}),
        api::Request(api::Jog{.motor = "m01", .per_s = 100, .in_steps = true})}) {
    const Answer refused = lab.ask(request);
    EXPECT_THAT(refused, Ends("refused", "m01: it is held by test since "));
  }
  EXPECT_EQ(lab.ask(Ask::kMoveTo, {"m02"}, {100}).result, "reached");
  EXPECT_EQ(lab.ask(api::Release{}).reason, "released: 1 motor");
  EXPECT_EQ(lab.ask(api::Release{}).reason, "done; none of them was held");
  EXPECT_EQ(lab.ask(Ask::kMoveTo, {"m01"}, {0}).result, "reached");
  EXPECT_EQ(lab.shaft_steps("m01"), 0);
}

TEST(Holds, KeepAPausedMotorWhereItIs) {
  ReadyLab lab(lab_with_keys());
  const auto move = lab.send(Ask::kMoveTo, {"m01"}, {2000});
  lab.run_until([&] { return lab.shaft_steps("m01") >= 500; });
  lab.ask(api::Pause{});
  lab.send(api::Hold{});
  const Answer refused = lab.ask(api::Resume{{"m01"}});
  EXPECT_THAT(refused, Ends("refused", "it is held"));
  lab.send(api::Release{});
  lab.send(api::Resume{});
  EXPECT_EQ(lab.wait(move).result, "reached");
}

}  // namespace
}  // namespace bushd::test
