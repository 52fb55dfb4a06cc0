#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tools/bushctl/move_arguments.h"

namespace bushctl {
namespace {

using bushd::command_t;
using testing::ElementsAre;
using testing::HasSubstr;

TEST(MoveArguments, PairsAreRelative) {
  const auto command = parse_move({"theta", "-400", "chi", "+20"});
  ASSERT_TRUE(command);
  EXPECT_EQ(command->kind, command_t::MOVE_RELATIVE);
  EXPECT_THAT(command->motors, ElementsAre("theta", "chi"));
  EXPECT_THAT(command->steps, ElementsAre(-400, 20));
}

TEST(MoveArguments, ToIsAbsolute) {
  const auto command = parse_move({"theta", "--to", "-400", "chi", "--to=20"});
  ASSERT_TRUE(command);
  EXPECT_EQ(command->kind, command_t::MOVE_ABSOLUTE);
  EXPECT_THAT(command->steps, ElementsAre(-400, 20));
}

TEST(MoveArguments, AMixtureIsRefusedAndSaysWhichMotor) {
  for (const auto& words : {std::vector<std::string>{"theta", "5", "chi", "--to", "6"},
                            std::vector<std::string>{"theta", "--to", "6", "chi", "5"}}) {
    const auto command = parse_move(words);
    ASSERT_FALSE(command);
    EXPECT_THAT(command.error().text(), HasSubstr("chi"));
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
  const auto command = parse_arm({"theta", "-400", "chi", "20"}, "falling", 1500);
  ASSERT_TRUE(command);
  EXPECT_EQ(command->kind, command_t::ARM);
  EXPECT_THAT(command->motors, ElementsAre("theta", "chi"));
  EXPECT_THAT(command->steps, ElementsAre(-400, 20));
  EXPECT_EQ(command->edge, command_t::FALLING);
  EXPECT_EQ(command->delay_us, 1500);
  EXPECT_EQ(parse_arm({"theta", "1"}, "rising", 50)->edge, command_t::RISING);
  EXPECT_THAT(parse_arm({"theta", "--to", "5"}, "rising", 50).error().text(),
              HasSubstr("by steps"));
  EXPECT_FALSE(parse_arm({}, "rising", 50));
}

TEST(ReferenceArguments, NameAMotorAndWhereItPulses) {
  const auto command =
      parse_reference("theta", "-7", {.direction = "negative", .delay_us = 30, .width_us = 4});
  ASSERT_TRUE(command);
  EXPECT_EQ(command->kind, command_t::REFERENCE);
  EXPECT_THAT(command->motors, ElementsAre("theta"));
  EXPECT_THAT(command->steps, ElementsAre(-7));
  EXPECT_EQ(command->arrivals, command_t::NEGATIVE);
  EXPECT_EQ(command->delay_us, 30);
  EXPECT_EQ(command->width_us, 4);
  EXPECT_EQ(parse_reference("theta", "5", {})->arrivals, 3);
  EXPECT_EQ(parse_reference("theta", "5", {.direction = "positive"})->arrivals, 1);
  EXPECT_EQ(parse_reference("theta", "off", {})->arrivals, 0);
  EXPECT_FALSE(parse_reference("theta", "on", {}));
}

TEST(SetArguments, NameOneMotorAndItsPosition) {
  const auto command = parse_set("theta", "-7");
  ASSERT_TRUE(command);
  EXPECT_EQ(command->kind, command_t::SET_POSITION);
  EXPECT_THAT(command->motors, ElementsAre("theta"));
  EXPECT_THAT(command->steps, ElementsAre(-7));
}

}  // namespace
}  // namespace bushctl
