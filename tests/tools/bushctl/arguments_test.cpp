#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tools/bushctl/move_arguments.h"

namespace bushctl {
namespace {

namespace api = bushd::api;
using testing::HasSubstr;
using Motors = std::vector<api::MotorSteps>;

TEST(MoveArguments, PairsAreRelative) {
  const auto move = parse_move({"theta", "-400", "chi", "+20"});
  ASSERT_TRUE(move);
  EXPECT_EQ(move->kind, api::Move::Kind::kRelative);
  EXPECT_EQ(move->motors, (Motors{{"theta", -400}, {"chi", 20}}));
}

TEST(MoveArguments, ToIsAbsolute) {
  const auto move = parse_move({"theta", "--to", "-400", "chi", "--to=20"});
  ASSERT_TRUE(move);
  EXPECT_EQ(move->kind, api::Move::Kind::kAbsolute);
  EXPECT_EQ(move->motors, (Motors{{"theta", -400}, {"chi", 20}}));
}

TEST(MoveArguments, AMixtureIsRefusedAndSaysWhichMotor) {
  for (const auto& words : {std::vector<std::string>{"theta", "5", "chi", "--to", "6"},
                            std::vector<std::string>{"theta", "--to", "6", "chi", "5"}}) {
    const auto move = parse_move(words);
    ASSERT_FALSE(move);
    EXPECT_THAT(move.error().text(), HasSubstr("chi"));
  }
}

TEST(MoveArguments, WhatIsNoWholeNumberIsRefused) {
  for (const char* word : {"1.5", "", "x", "-", "+", "+-3", "5x", " 5", "99999999999999999999"}) {
    EXPECT_FALSE(parse_move({"theta", word})) << word;
    EXPECT_FALSE(parse_set("theta", word)) << word;
  }
}

TEST(MoveArguments, WhatIsMissingIsNamed) {
  EXPECT_THAT(parse_move({}).error().text(), HasSubstr("no motor"));
  EXPECT_THAT(parse_move({"theta"}).error().text(), HasSubstr("number of steps is missing"));
  EXPECT_THAT(parse_move({"theta", "--to"}).error().text(), HasSubstr("wants the position"));
  EXPECT_THAT(parse_move({"--to", "5", "theta"}).error().text(), HasSubstr("motor's name"));
}

TEST(ArmArguments, ArePairsWithAnEdgeAndADelay) {
  const auto arm = parse_arm({"theta", "-400", "chi", "20"}, "falling", 1500);
  ASSERT_TRUE(arm);
  EXPECT_EQ(arm->motors, (Motors{{"theta", -400}, {"chi", 20}}));
  EXPECT_EQ(arm->edge, api::Edge::kFalling);
  EXPECT_EQ(arm->delay_us, 1500);
  EXPECT_EQ(parse_arm({"theta", "1"}, "rising", 50)->edge, api::Edge::kRising);
  EXPECT_THAT(parse_arm({"theta", "--to", "5"}, "rising", 50).error().text(),
              HasSubstr("by steps"));
  EXPECT_FALSE(parse_arm({}, "rising", 50));
}

TEST(ReferenceArguments, NameAMotorAndWhereItPulses) {
  const auto compare = parse_position_compare(
      "theta", "-7", {.direction = "negative", .delay_us = 30, .width_us = 4});
  ASSERT_TRUE(compare);
  EXPECT_EQ(compare->motor, "theta");
  EXPECT_EQ(compare->position_steps, -7);
  EXPECT_EQ(compare->arrivals, api::Directions{.negative = true});
  EXPECT_EQ(compare->delay_us, 30);
  EXPECT_EQ(compare->width_us, 4);
  EXPECT_EQ(parse_position_compare("theta", "5", {})->arrivals,
            (api::Directions{.positive = true, .negative = true}));
  EXPECT_EQ(parse_position_compare("theta", "5", {.direction = "positive"})->arrivals,
            api::Directions{.positive = true});
  EXPECT_FALSE(parse_position_compare("theta", "off", {})->arrivals.any());
  EXPECT_FALSE(parse_position_compare("theta", "on", {}));
}

TEST(SetArguments, NameOneMotorAndItsPosition) {
  const auto set = parse_set("theta", "-7");
  ASSERT_TRUE(set);
  EXPECT_EQ(set->motors, (Motors{{"theta", -7}}));
}

}  // namespace
}  // namespace bushctl
