// `inputs` of a motor: which inputs of its MCU are its switches, and what older keys say of them.
#include <gtest/gtest.h>

#include <string>

#include "config/config.h"
#include "config/config_file.h"
#include "config/refused_keys.h"

namespace bushd::config {
namespace {

using test::kGood;
using test::loaded;
using test::of_slit;

// Inputs of "slit", output 15 of "roof:255", beside those of another motor of that MCU, from line
// 38 on (after its output in 41).
std::string with_two(const std::string& keys, const std::string& others) {
  return of_slit(keys) + "[[motor]]\nname = \"blade\"\nmcu = \"roof:255\"\noutput = 2\n" + others +
         "group = \"slits\"\n";
}

MotorInputs inputs_of(const std::string& keys) {
  return loaded(of_slit(keys)).motors[1].inputs;
}

constexpr const char* kHome = "home = { direction = \"positive\", most_steps = 100 }\n";

TEST(MotorInputs, AnyInputsOfTheMcu) {
  const MotorInputs inputs =
      inputs_of("inputs = { positive = 3, negative = 0, home = 14, step = 9 }\n");
  EXPECT_EQ(inputs.positive, Input{3});
  EXPECT_EQ(inputs.negative, Input{0});
  EXPECT_EQ(inputs.home, Input{14});
  EXPECT_EQ(inputs.step, Input{9});
  EXPECT_FALSE(inputs.own);
}

TEST(MotorInputs, EachHasItsLevel) {
  const MotorInputs inputs = inputs_of(
      "inputs = { positive = { input = 3, active = \"open\" }, negative = { input = 0 }, "
      "home = { input = 14, active = \"closed\" } }\n");
  EXPECT_EQ(inputs.positive, (Input{.number = 3, .active_open = true}));
  EXPECT_EQ(inputs.negative, Input{0});
  EXPECT_EQ(inputs.home, Input{14});
}

TEST(MotorInputs, AsASectionOfItsOwn) {
  const auto config = loaded(kGood + "[motor.inputs]\npositive = 3\nhome = { input = 3 }\n");
  EXPECT_EQ(config.motors[1].inputs.positive, Input{3});
  EXPECT_EQ(config.motors[1].inputs.home, Input{3}) << "a limit may be the home switch";
}

TEST(MotorInputs, OlderKeysMeanTheInputOfTheOutput) {
  MotorInputs inputs = inputs_of(std::string("limit = \"both\"\n") + kHome);
  EXPECT_EQ(inputs.positive, Input{15});
  EXPECT_EQ(inputs.negative, Input{15});
  EXPECT_EQ(inputs.home, Input{15});
  EXPECT_EQ(inputs.own, Input{15});
  inputs = inputs_of(std::string("input_active = \"open\"\n") + kHome);
  EXPECT_EQ(inputs.home, (Input{.number = 15, .active_open = true}));
  EXPECT_FALSE(inputs.positive || inputs.negative);
}

TEST(MotorInputs, BothKindsOfKeysGoTogether) {
  MotorInputs inputs = inputs_of(std::string("inputs = { home = 4 }\nlimit = \"both\"\n") + kHome);
  EXPECT_EQ(inputs.home, Input{4});
  EXPECT_EQ(inputs.positive, Input{15});
  EXPECT_EQ(inputs.negative, Input{15});
  inputs = inputs_of(std::string("inputs = { positive = 4, negative = 5 }\n") + kHome);
  EXPECT_EQ(inputs.home, Input{15}) << "what `home` has always meant";
  // One says at which level, the other does not.
  inputs =
      inputs_of(std::string("inputs = { positive = { input = 15, active = \"open\" } }\n") + kHome);
  EXPECT_EQ(inputs.home, (Input{.number = 15, .active_open = true}));
}

TEST(MotorInputs, ALimitActionNeedsALimitOfEitherKind) {
  const auto config = loaded(of_slit("inputs = { negative = 4 }\nlimit_action = \"immediate\"\n"));
  EXPECT_EQ(config.motors[1].limit_action, BUSHD_STOP_IMMEDIATE);
}

TEST(MotorInputs, TwoMotorsMayShareALimit) {
  EXPECT_EQ(test::error_of(with_two("inputs = { positive = 3, negative = 4, home = 5 }\n",
                                    "inputs = { positive = 4, negative = 3, home = 6 }\n")),
            "no error");
}

TEST(MotorInputs, OneThatNobodyNeedsMayBeAnothersWithoutAWord) {
  EXPECT_EQ(test::error_of(with_two("", "inputs = { home = 15 }\n")), "no error");
}

TEST(MotorInputs, WhatCannotBeIsRefusedWithItsLineAndKey) {
  const test::RefusedKey bad[] = {
      {of_slit("inputs = 3\n"), 37,
       "motor[1].inputs: is 3; allowed: a table such as { positive = 3,"},
      {of_slit("inputs = {}\n"), 37, "motor[1].inputs: is empty; allowed: a table such as"},
      {of_slit("inputs = { left = 3 }\n"), 37,
       "motor[1].inputs.left: unknown key; allowed here: positive, negative, home, step"},
      {of_slit("inputs = { positive = 16 }\n"), 37,
       "motor[1].inputs.positive: is 16; allowed: a whole number 0..15; or { input = N"},
      {of_slit("inputs = { home = -1 }\n"), 37, "motor[1].inputs.home: is -1; allowed: a whole"},
      {of_slit("inputs = { step = \"3\" }\n"), 37,
       "motor[1].inputs.step: is the string \"3\"; allowed: a whole"},
      {of_slit("inputs = { home = { active = \"open\" } }\n"), 37,
       "motor[1].inputs.home.input: is missing; allowed: a whole"},
      {of_slit("inputs = { home = { input = 16 } }\n"), 37,
       "motor[1].inputs.home.input: is 16; allowed: a whole"},
      {of_slit("inputs = { home = { input = 1, level = 0 } }\n"), 37,
       "motor[1].inputs.home.level: unknown key"},
      {of_slit("inputs = { home = { input = 1, active = \"low\" } }\n"), 37,
       "motor[1].inputs.home.active: is \"low\"; allowed: \"closed\" or \"open\""},
      {of_slit("inputs = { positive = 3, home = { input = 3, active = \"open\" } }\n"), 37,
       "motor[1].inputs.positive: is input 3, active when closed, but as home switch of motor "
       "\"slit\" it is active when open; allowed: one level an input"},
      {of_slit("inputs = { positive = 3, step = 3 }\n"), 37,
       "motor[1].inputs.step: is input 3, the positive limit of motor \"slit\"; allowed: an input "
       "of its own. Connect the sensor to another input"},
      {of_slit("limit = \"positive\"\ninputs = { positive = 3 }\n"), 38,
       "motor[1].inputs.positive: is input 3, but `limit` says that the positive limit of motor "
       "\"slit\" is input 15, the number of its output; allowed: one of the two keys"},
      {of_slit("input_active = \"closed\"\nlimit = \"negative\"\n"
               "inputs = { home = { input = 15, active = \"open\" } }\n"),
       38,
       "motor[1].limit: is input 15, active when closed, but as home switch of motor \"slit\" it "
       "is active when open"},
      {of_slit("inputs = { home = 3 }\nlimit_action = \"ramp\"\n"), 38,
       "motor[1].limit_action: applies only with a limit"},
      {with_two("inputs = { home = 3 }\n", "inputs = { negative = 3 }\n"), 43,
       "motor[2].inputs.negative: is input 3 of MCU \"roof:255\", the home switch of motor "
       "\"slit\"; as negative limit of motor \"blade\" it cannot be shared; allowed: an input that "
       "no other motor has (limits of several motors may share one). Connect it to another input"},
      {with_two("inputs = { step = 2 }\n", "limit = \"both\"\n"), 43,
       "motor[2].limit: is input 2 of MCU \"roof:255\", the step sensor of motor \"slit\""},
      {with_two(std::string("inputs = { positive = 2 }\n"), kHome), 43,
       "motor[2].home: is input 2 of MCU \"roof:255\", the positive limit of motor \"slit\""},
      {with_two("inputs = { positive = 3 }\n",
                "inputs = { negative = { input = 3, active = \"open\" } }\n"),
       43,
       "motor[2].inputs.negative: is input 3 of MCU \"roof:255\", the positive limit of motor "
       "\"slit\", which is active when closed; as negative limit of motor \"blade\" it is active "
       "when open; allowed: one level an input"},
      {with_two("inputs = { positive = 2 }\n", "input_active = \"open\"\n"), 43,
       "motor[2].input_active: makes input 2 of MCU \"roof:255\" active when open, but as positive "
       "limit of motor \"slit\" it is active when closed"},
      {with_two("input_active = \"open\"\n", "inputs = { positive = 15 }\n"), 37,
       "motor[1].input_active: makes input 15 of MCU \"roof:255\" active when open"},
  };
  test::expect_refused(bad);
}

}  // namespace
}  // namespace bushd::config
