// Names that stand for several motors: slit*, m0[12], @group.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "api/name_pattern.h"
#include "daemon/lab.h"

namespace bushd::test {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

TEST(NamePatterns, StandForMotorsByNameOrByGroup) {
  EXPECT_TRUE(api::names_motor("slit*", "slit-left", "slits"));
  EXPECT_FALSE(api::names_motor("slit*", "theta", "slits"));
  EXPECT_TRUE(api::names_motor("@slits", "theta", "slits"));
  EXPECT_TRUE(api::names_motor("@s*", "theta", "slits"));
  EXPECT_FALSE(api::names_motor("@slits", "slits", "stages"));
  EXPECT_TRUE(api::names_motor("m0[1-3]", "m02", ""));
  EXPECT_FALSE(api::names_motor("m0[1-3]", "m04", ""));
  EXPECT_FALSE(api::names_motor("@*", "gap", "")) << "a computed axis is in no group";
  EXPECT_FALSE(api::names_motor("theta", "thetax", "")) << "what is no pattern is a name";
}

// m01..m08, all of the group "axes".
class LabWithPatterns : public testing::Test {
 protected:
  LabWithPatterns() { lab.connect(); }
  std::vector<std::string> moving() {
    std::vector<std::string> names;
    for (int i = 1; i <= 8; ++i) {
      const std::string name = "m0" + std::to_string(i);
      if (lab.motor(name).moving) names.push_back(name);
    }
    return names;
  }
  Lab lab{hall(2, 4, "fine")};
};

TEST_F(LabWithPatterns, MoveStopAndPauseTakeThemAlike) {
  const auto move = lab.send(api::Move{.motors = {{"m0[1-3]", 4000}, {"m08", 4000}}});
  lab.run_for(0.3);
  EXPECT_THAT(moving(), ElementsAre("m01", "m02", "m03", "m08"));
  EXPECT_EQ(lab.ask(api::Pause{{"*3"}}).result, "done");
  EXPECT_TRUE(lab.motor("m03").paused);
  EXPECT_FALSE(lab.motor("m01").paused);
  EXPECT_EQ(lab.ask(api::Resume{{"m0?"}}).result, "done");
  EXPECT_EQ(lab.ask(api::Stop{{"m0[12]"}}).result, "done");
  EXPECT_THAT(moving(), ElementsAre("m03", "m08"));
  EXPECT_EQ(lab.ask(api::Stop{{"@*"}}).result, "done");
  EXPECT_THAT(moving(), ElementsAre());
  EXPECT_THAT(lab.last_reply(move).motors, ElementsAre("m01", "m02", "m03", "m08"));
  EXPECT_EQ(lab.ask(api::Hold{{"m01", "m0*"}}).result, "done");
  EXPECT_TRUE(lab.motor("m08").held);
}

TEST_F(LabWithPatterns, WhatStandsForNoMotorIsRefusedAndAStopStopsTheOthers) {
  EXPECT_THAT(lab.last_reply(lab.send(api::Move{.motors = {{"slit*", 1}}})).reason,
              HasSubstr("there is no motor with a name like \"slit*\"; 'bushctl status'"));
  EXPECT_THAT(
      lab.last_reply(lab.send(api::Move{.motors = {{"@axse", 1}}})).reason,
      HasSubstr("there is no group with a motor for \"@axse\" (did you mean \"@axes\"?); "));
  EXPECT_THAT(lab.last_reply(lab.send(api::Move{.motors = {{"m0*", 1}, {"m01", 2}}})).reason,
              HasSubstr("m01 is named twice"));
  lab.send(api::Move{.motors = {{"m01", 4000}}});
  lab.run_for(0.3);
  EXPECT_THAT(lab.ask(api::Stop{{"slit*", "m0*"}}).reason, HasSubstr("slit*"));
  EXPECT_TRUE(lab.run_until([this] { return !lab.motor("m01").moving; }, 5));
  EXPECT_LT(lab.motor("m01").position_steps, 4000);
}

}  // namespace
}  // namespace bushd::test
