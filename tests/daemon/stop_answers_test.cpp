// What stops, pauses, holds and disarmings say: what they have ended, and what not.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "daemon/lab.h"

namespace bushd::test {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

struct StopLab : ReadyLab {
  explicit StopLab(const std::string& keys = "") : ReadyLab(with_keys(hall(2, 2), "m01", keys)) {}
  void move_to(const std::string& motor, std::int64_t target, std::int64_t until) {
    move = send(Ask::kMoveTo, {motor}, {target});
    ASSERT_TRUE(run_until([&] { return shaft_steps(motor) >= until; }));
  }
  std::int64_t move = 0;
};

TEST(StopAnswers, ADoubledNameIsOne) {
  StopLab lab;
  for (const api::Request& stop :
       {api::Request(api::Stop{{"m01", "m01"}}), api::Request(api::Pause{{"m01", "axes", "m01"}}),
        api::Request(api::Disarm{{"m01", "m01"}}), api::Request(api::Hold{{"m01", "m01"}})}) {
    EXPECT_EQ(lab.ask(stop).result, "done") << api::name_of(stop);
  }
  EXPECT_EQ(lab.ask(api::Release{}).result, "done");
  lab.move_to("m01", 5000, 300);
  EXPECT_EQ(lab.ask(api::Stop{{"m01", "m01"}}).result, "done");
  EXPECT_EQ(lab.wait(lab.move).result, "stopped");
}

TEST(StopAnswers, WhatIsKnownIsStoppedAndTheOtherNamesAreTold) {
  StopLab lab;
  for (const api::Request& stop :
       {api::Request(api::Stop{{"nosuch", "m01", "nosuch"}}),
        api::Request(api::Pause{{"nosuch", "m01"}}), api::Request(api::Disarm{{"m01", "nosuch"}}),
        api::Request(api::Hold{{"nosuch", "m01"}})}) {
    SCOPED_TRACE(api::name_of(stop));
    lab.ask(api::Release{});
    lab.ask(Ask::kMoveTo, {"m01"}, {0});
    lab.move_to("m01", 5000, 300);
    EXPECT_THAT(lab.ask(stop), Ends("fault", "\"nosuch\"; 'bushctl status' lists them"));
    lab.run_for(2);
    const bool stops =
        std::holds_alternative<api::Stop>(stop) || std::holds_alternative<api::Pause>(stop);
    EXPECT_EQ(lab.shaft_steps("m01") < 4000, stops);
  }
}

TEST(StopAnswers, OfUnknownNamesAloneAreRefusals) {
  StopLab lab;
  for (const api::Request& stop :
       {api::Request(api::Stop{{"nosuch"}}), api::Request(api::Pause{{"nosuch"}}),
        api::Request(api::Disarm{{"nosuch"}}), api::Request(api::Hold{{"nosuch"}})}) {
    EXPECT_EQ(lab.ask(stop).result, "refused") << api::name_of(stop);
  }
}

TEST(StopAnswers, OfAnMcuThatIsOfflineNothingIsDone) {
  StopLab lab;
  lab.move_to("m01", 20'000, 300);
  lab.unplug(0);
  EXPECT_EQ(lab.wait(lab.move).result, "link");
  const Answer named = lab.ask(api::Stop{{"m01"}});
  EXPECT_THAT(named, Ends("link", "not online, so it is unknown whether they stand: hall:1"));
  EXPECT_THAT(named.reason, Not(HasSubstr("hall:2")));
  EXPECT_THAT(lab.ask(api::Stop{}), Ends("link", "hall:1 hall:2")) << "it was lost while it moved";
  EXPECT_THAT(lab.ask(api::Pause{{"m01"}}),
              Ends("link", "not online, so it is unknown whether they stand: hall:1"));
}

// A rack without power is no reason for every stop to fail.
TEST(StopAnswers, OfAllMotorsNameWhatRestedWhenItWasLost) {
  ReadyLab lab(hall(2, 2) +
               "[[bus]]\nname = \"annex\"\nport = \"/dev/annex\"\nbaud = 500000\ntick_us = 2560\n"
               "format = \"fine\"\n[[mcu]]\nbus = "
               "\"annex\"\naddress = 1\n[[motor]]\nname = \"far\"\nmcu = "
               "\"annex:1\"\noutput = 0\ngroup = \"axes\"\n");
  lab.unplug(1);
  lab.run_for(1);
  const Answer all = lab.ask(api::Stop{});
  EXPECT_EQ(all.result, "done");
  EXPECT_EQ(all.reason, "done; not online, so it is unknown whether they stand: annex:1");
  EXPECT_EQ(lab.ask(api::Stop{{"m01"}}).reason, "done");
  EXPECT_EQ(lab.ask(api::Stop{{"far"}}).result, "link");
}

TEST(StopAnswers, AnMcuThatIsLostMeanwhileIsTold) {
  StopLab lab;
  lab.move_to("m01", 20'000, 2000);
  const auto stop = lab.send(api::Stop{{"m01"}});
  lab.unplug(0);
  EXPECT_THAT(lab.wait(stop), Ends("link", "MCU hall:1 was lost meanwhile, so it is unknown"));
}

TEST(PauseAnswers, AMotorThatIsBeingStoppedIsNotPaused) {
  StopLab lab;
  lab.move_to("m01", 20'000, 2000);
  lab.send(api::Stop{{"m01"}});
  EXPECT_EQ(lab.ask(api::Pause{}).reason, "paused: 0 motors; not paused, being stopped: m01");
  EXPECT_EQ(lab.wait(lab.move).result, "stopped");
}

// Its ramp to the target is the ramp of a pause.
TEST(PauseAnswers, AMotorInItsLastStepsIsNotPaused) {
  StopLab lab("settle_ms = 300\n");
  lab.move_to("m01", 400, 398);
  const auto pause = lab.send(api::Pause{});
  EXPECT_EQ(lab.wait(lab.move).result, "reached");
  const std::int64_t reached_us = lab.now_us();
  EXPECT_EQ(lab.shaft_steps("m01"), 400);
  EXPECT_EQ(lab.wait(pause).reason, "paused: 0 motors; not paused, at their targets: m01");
  EXPECT_GE(reached_us, 300'000);
  EXPECT_EQ(lab.ask(api::Resume{}).reason, "resumed: 0 motors");
}

TEST(PauseAnswers, AMotorThatSettlesIsNotPausedAndSettlesOn) {
  StopLab lab("settle_ms = 500\n");
  lab.move_to("m01", 400, 400);
  lab.run_for(0.1);
  ASSERT_FALSE(lab.has_result(lab.move));
  const std::int64_t paused_us = lab.now_us();
  EXPECT_EQ(lab.ask(api::Pause{}).reason, "paused: 0 motors; not paused, at their targets: m01");
  EXPECT_EQ(lab.wait(lab.move).result, "reached");
  // 0.5 s after its last step, of which at most 0.1 s and what a poll takes had passed.
  EXPECT_GE(lab.now_us(), paused_us + 350'000) << "its settling time is not cut short";
}

TEST(PauseAnswers, WhatIsLeftAloneIsNamed) {
  StopLab lab("home = { direction = \"negative\", most_steps = 30000 }\n");
  lab.bus(0).mcu(0).attach_switch(0, {.at_steps = -20'000});
  lab.send(api::Home{{"m01"}});
  const auto armed = lab.send(api::Arm{.delay_us = 1000, .motors = motor_steps({"m03"}, {10})});
  lab.run_for(0.3);
  ASSERT_EQ(lab.motor("m03").activity, api::Activity::kArmed);
  lab.move_to("m02", 5000, 300);
  const Answer answer = lab.ask(api::Pause{});
  EXPECT_EQ(answer.result, "done");
  EXPECT_THAT(answer.reason,
              AllOf(HasSubstr("paused: 1 motor;"), HasSubstr("not paused, being homed: m01"),
                    HasSubstr("not paused, waiting for the trigger: m03")));
  // A hold lets nothing begin: what waits for the trigger would.
  EXPECT_EQ(lab.ask(api::Hold{}).result, "done");
  EXPECT_EQ(lab.wait(armed).result, "stopped");
}

TEST(PauseAnswers, AMotorThatGoesOnMeanwhileIsNotPaused) {
  StopLab lab;
  lab.move_to("m01", 20'000, 2000);
  const auto pause = lab.send(api::Pause{});
  const auto move = lab.send(Ask::kMoveTo, {"m01"}, {3000});
  EXPECT_EQ(lab.wait(pause).reason,
            "paused: 0 motors; not paused, going on by a later request: m01");
  EXPECT_EQ(lab.wait(move).result, "reached");
}

}  // namespace
}  // namespace bushd::test
