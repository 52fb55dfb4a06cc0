#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "api/printed.h"
#include "tools/bushctl/move_arguments.h"

namespace bushctl {
namespace {

namespace api = bushd::api;
using testing::HasSubstr;
using Motors = std::vector<api::MotorAmount>;
using User = api::UserUnits;
constexpr Numbers kUser = Numbers::kUser;
constexpr Numbers kSteps = Numbers::kSteps;

TEST(MoveArguments, PairsAreRelative) {
  EXPECT_EQ(parse_move({"theta", "-400", "chi", "+20"}, kUser),
            (api::Move{.motors = {{"theta", User{-400}}, {"chi", User{20}}}}));
}

TEST(MoveArguments, ToIsAbsolute) {
  EXPECT_EQ(parse_move({"theta", "--to", "-400", "chi", "--to=20"}, kUser),
            (api::Move{.kind = api::Move::Kind::kAbsolute,
                       .motors = {{"theta", User{-400}}, {"chi", User{20}}}}));
}

TEST(MoveArguments, AMixtureIsRefusedAndSaysWhichMotor) {
  for (const auto& words : {std::vector<std::string>{"theta", "5", "chi", "--to", "6"},
                            std::vector<std::string>{"theta", "--to", "6", "chi", "5"}}) {
    const auto move = parse_move(words, kUser);
    ASSERT_FALSE(move);
    EXPECT_THAT(move.error().text(), HasSubstr("chi"));
  }
}

TEST(MoveArguments, InUnitsOrInSteps) {
  EXPECT_EQ(parse_move({"theta", "-1.25"}, kUser)->motors, (Motors{{"theta", User{-1.25}}}));
  EXPECT_EQ(parse_move({"theta", "2e-3"}, kUser)->motors, (Motors{{"theta", User{0.002}}}));
  EXPECT_EQ(parse_move({"theta", "-400"}, kSteps)->motors, (Motors{{"theta", -400}}));
}

TEST(MoveArguments, AlongALineAreThoseOfAMove) {
  EXPECT_EQ(parse_move_line({"a", "--to", "10", "b", "--to=-3.5"}, kUser, {}),
            (api::MoveLine{.kind = api::Move::Kind::kAbsolute,
                           .motors = {{"a", User{10}}, {"b", User{-3.5}}}}));
  EXPECT_EQ(parse_move_line({"a", "4"}, kUser, {.duration = "12.5"})->duration_s, 12.5);
  for (const char* wrong : {"0", "-1", "soon", "inf"}) {
    EXPECT_FALSE(parse_move_line({"a", "4"}, kUser, {.duration = wrong})) << wrong;
  }
  EXPECT_FALSE(parse_move_line({}, kUser, {}));
  EXPECT_EQ(parse_move_line({"a", "4"}, kSteps, {.law = "elementary", .feed = "2.5"}),
            (api::MoveLine{.motors = {{"a", 4}},
                           .law = api::MoveLine::Law::kElementary,
                           .feed = api::Speed{.per_s = 2.5, .in_steps = true}}));
  EXPECT_EQ(parse_move_line({"a", "4"}, kUser, {.feed = "0"}).error().message,
            "--feed: \"0\" is not a number above 0");
}

TEST(MoveArguments, WhatIsNoNumberIsRefused) {
  for (const char* word : {"", "x", "-", "+", "+-3", "5x", " 5", "1,5", "nan", "inf", "0x10"}) {
    EXPECT_FALSE(parse_move({"theta", word}, kUser)) << word;
    EXPECT_FALSE(parse_set("theta", word, kUser, false)) << word;
    EXPECT_FALSE(parse_move({"theta", word}, kSteps)) << word;
  }
  for (const char* word : {"1.5", "99999999999999999999"}) {
    EXPECT_FALSE(parse_move({"theta", word}, kSteps)) << word;
    EXPECT_FALSE(parse_set("theta", word, kSteps, false)) << word;
  }
}

TEST(MoveArguments, WhatIsMissingIsNamed) {
  EXPECT_THAT(parse_move({}, kUser).error().text(), HasSubstr("no motor"));
  EXPECT_THAT(parse_move({"theta"}, kUser).error().text(), HasSubstr("distance is missing"));
  EXPECT_THAT(parse_move({"theta", "--to"}, kUser).error().text(), HasSubstr("wants the position"));
  EXPECT_THAT(parse_move({"--to", "5", "theta"}, kUser).error().text(), HasSubstr("motor's name"));
}

TEST(ArmArguments, ArePairsWithAnEdgeAndADelay) {
  EXPECT_EQ(parse_arm({"theta", "-400", "chi", "20"}, kUser, "falling", 1500),
            (api::Arm{.edge = api::Edge::kFalling,
                      .delay_us = 1500,
                      .motors = {{"theta", User{-400}}, {"chi", User{20}}}}));
  EXPECT_EQ(parse_arm({"theta", "1"}, kUser, "rising", 50)->edge, api::Edge::kRising);
  EXPECT_THAT(parse_arm({"theta", "--to", "5"}, kUser, "rising", 50).error().text(),
              HasSubstr("by a distance"));
  EXPECT_FALSE(parse_arm({}, kUser, "rising", 50));
}

TEST(ArmArguments, OfALineAreThoseOfALineAndATrigger) {
  EXPECT_EQ(parse_arm_line({"a", "--to", "10", "b", "--to=-3.5"}, kUser, "falling", 1500, "2.5"),
            (api::ArmLine{.edge = api::Edge::kFalling,
                          .delay_us = 1500,
                          .kind = api::Move::Kind::kAbsolute,
                          .motors = {{"a", User{10}}, {"b", User{-3.5}}},
                          .duration_s = 2.5}));
  EXPECT_EQ(parse_arm_line({"a", "4"}, kUser, "rising", 50, "")->kind, api::Move::Kind::kRelative);
  EXPECT_FALSE(parse_arm_line({"a", "4"}, kUser, "rising", 50, "0"));
  EXPECT_FALSE(parse_arm_line({"a"}, kUser, "rising", 50, ""));
}

TEST(ReferenceArguments, NameAMotorAndWhereItPulses) {
  EXPECT_EQ(parse_position_compare("theta", "-7", kUser,
                                   {.direction = "negative", .delay_us = 30, .width_us = 4}),
            (api::PositionCompare{.motor = "theta",
                                  .position = User{-7},
                                  .arrivals = {.negative = true},
                                  .delay_us = 30,
                                  .width_us = 4}));
  EXPECT_EQ(parse_position_compare("theta", "5", kUser, {})->arrivals,
            (api::Directions{.positive = true, .negative = true}));
  EXPECT_EQ(parse_position_compare("theta", "5", kUser, {.direction = "positive"})->arrivals,
            api::Directions{.positive = true});
  EXPECT_FALSE(parse_position_compare("theta", "off", kUser, {})->arrivals.any());
  EXPECT_FALSE(parse_position_compare("theta", "on", kUser, {}));
}

TEST(SetArguments, NameOneMotorAndItsPosition) {
  EXPECT_EQ(parse_set("theta", "-7", kSteps, false), (api::SetPosition{.motors = {{"theta", -7}}}));
  EXPECT_EQ(parse_set("theta", "-7.5", kUser, true),
            (api::SetPosition{.motors = {{"theta", User{-7.5}}}, .dial = true}));
}

}  // namespace
}  // namespace bushctl
