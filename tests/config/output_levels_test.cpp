// The keys that say at which levels drivers do what they are to do.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "config/config_file.h"

namespace bushd::config {
namespace {

using test::error_of;
using test::kGood;
using test::loaded;
using test::of_mcu;
using test::of_motor;
using testing::HasSubstr;

bushd_set_outputs outputs_of(const std::string& text) {
  return loaded(text).mcus[0].outputs;
}

TEST(OutputLevels, AreHighWithoutAKey) {
  const bushd_set_outputs outputs = outputs_of(kGood);
  EXPECT_EQ(outputs.enabled, BUSHD_ENABLED_HIGH);
  EXPECT_EQ(outputs.step_low, 0);
  EXPECT_EQ(outputs.direction_low, 0);
}

TEST(OutputLevels, OfAnMcuAreThoseOfAllItsOutputs) {
  const bushd_set_outputs outputs = outputs_of(
      of_mcu("enable_active = \"low\"\nstep_active = \"low\"\ndirection_active = \"high\"\n"));
  EXPECT_EQ(outputs.enabled, BUSHD_ENABLED_LOW);
  EXPECT_EQ(outputs.step_low, 0xFFFF);
  EXPECT_EQ(outputs.direction_low, 0);
}

TEST(OutputLevels, OfAMotorCountBeforeThoseOfItsMcu) {
  const bushd_set_outputs outputs = outputs_of(of_mcu(
      "step_active = \"low\"\n", of_motor("step_active = \"high\"\ndirection_active = \"low\"\n")));
  EXPECT_EQ(outputs.step_low, 0xFFFE);
  EXPECT_EQ(outputs.direction_low, 0x0001);
}

TEST(OutputLevels, AreHighOrLow) {
  EXPECT_THAT(error_of(of_mcu("enable_active = \"open\"\n")),
              HasSubstr("mcu[0].enable_active: is \"open\"; allowed: \"high\" or \"low\""));
}

TEST(OutputLevels, OfWindingsAreRefused) {
  const std::string phases = "steps = \"phases\"\n";
  EXPECT_THAT(error_of(of_mcu(phases + "step_active = \"low\"\n")),
              HasSubstr("mcu[0].step_active: says nothing with steps = \"phases\""));
  EXPECT_THAT(error_of(of_mcu(phases, of_motor("direction_active = \"low\"\n"))),
              HasSubstr("motor[0].direction_active: says nothing with steps = \"phases\""));
  EXPECT_EQ(outputs_of(of_mcu(phases + "enable_active = \"low\"\n")).enabled, BUSHD_ENABLED_LOW);
}

TEST(OutputLevels, CommonDirIsNoMotors) {
  const std::string common = "direction = \"common\"\nsteps = \"staggered\"\nstep_us = 300\n";
  EXPECT_THAT(error_of(of_mcu(common, of_motor("direction_active = \"low\"\n"))),
              HasSubstr("have one DIR (direction = \"common\"): write it into its [[mcu]]"));
  EXPECT_EQ(outputs_of(of_mcu(common + "direction_active = \"low\"\n")).direction_low, 0xFFFF);
}

}  // namespace
}  // namespace bushd::config
