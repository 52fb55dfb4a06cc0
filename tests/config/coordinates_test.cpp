// Keys about units and soft limits.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <utility>

#include "config/config.h"
#include "config/config_file.h"

namespace bushd::config {
namespace {

using test::ConfigFile;
using test::error_of;
using test::kGood;
using test::loaded;
using test::of_slit;
using testing::HasSubstr;

TEST(ConfigCoordinates, WithoutAUnitPositionsAreSteps) {
  const auto config = loaded(kGood);
  const Motor& motor = config.motors[1];
  EXPECT_EQ(motor.coordinates.unit(), "steps");
  EXPECT_EQ(motor.coordinates.user_of(-5), -5);
  EXPECT_EQ(motor.coordinates.precision(), 0);
  EXPECT_EQ(motor.description, "");
  EXPECT_FALSE(motor.soft_limits.has_value());
}

TEST(ConfigCoordinates, AllKeys) {
  const auto config =
      loaded(of_slit("description = \"lower blade\"\nunit = \"mm\"\n"
                     "steps_per_unit = \"400/1.25\"\ndirection = \"negative\"\n"
                     "offset = 2.5\nprecision = 3\nsoft_limits = [-5, 5.5]\n"));
  const Motor& motor = config.motors[1];
  EXPECT_EQ(motor.description, "lower blade");
  EXPECT_EQ(motor.coordinates.scale(), (units::Scale{"mm", {320, 1}, true, 2.5, 3}));
  ASSERT_TRUE(motor.soft_limits.has_value());
  EXPECT_EQ(motor.soft_limits->low, -5);
  EXPECT_EQ(motor.soft_limits->high, 5.5);
}

TEST(ConfigCoordinates, NumbersOfStepsPerUnit) {
  for (const auto& [text, ratio] : {std::pair{"0.1", units::Ratio{1, 10}},
                                    {"400", units::Ratio{400, 1}},
                                    {"\"1/3\"", units::Ratio{1, 3}}}) {
    const auto config =
        loaded(of_slit("unit = \"deg\"\nsteps_per_unit = " + std::string(text) + "\n"));
    EXPECT_EQ(config.motors[1].coordinates.scale().steps_per_unit, ratio);
  }
}

TEST(ConfigCoordinates, ZeroAndEmptyTextAreNone) {
  const auto config = loaded(of_slit("backlash = 0\nunit = \"\"\ndescription = \"\"\n"));
  const Motor& motor = config.motors[1];
  EXPECT_EQ(motor.backlash, 0);
  EXPECT_FALSE(motor.coordinates.has_unit());
  EXPECT_EQ(motor.description, "");
}

TEST(ConfigCoordinates, WhatCannotBeIsRefusedWithItsLineAndKey) {
  const std::string unit = "unit = \"mm\"\nsteps_per_unit = 400\n";
  for (const auto& [keys, error] : {
           std::pair<std::string, const char*>{"unit = \"\"\nsteps_per_unit = 1\n",
                                               "38:18: motor[1].steps_per_unit: needs `unit`"},
           {"unit = \"m\\u001bm\"\nsteps_per_unit = 1\n", "motor[1].unit: is not allowed"},
           {"unit = \"steps\"\nsteps_per_unit = 1\n", "37:8: motor[1].unit: is \"steps\", which"},
           {"unit = \"mm\"\n", "motor[1].steps_per_unit: is missing"},
           {"unit = \"mm\"\nsteps_per_unit = -400\n",
            "38:18: motor[1].steps_per_unit: is not above 0; allowed: a number above 0, such as "
            "400, or a ratio, such as \"400/1.25\". The direction has a key of its own"},
           {"unit = \"mm\"\nsteps_per_unit = nan\n", "motor[1].steps_per_unit: is the floating"},
           {"unit = \"mm\"\nsteps_per_unit = \"4OO\"\n", "motor[1].steps_per_unit: is no number"},
           {"unit = \"mm\"\nsteps_per_unit = true\n", "motor[1].steps_per_unit: is true"},
           {"steps_per_unit = 400\n", "motor[1].steps_per_unit: needs `unit`"},
           {"offset = 1\n", "37:10: motor[1].offset: needs `unit`"},
           {unit + "offset = 1e20\n", "motor[1].offset: an offset of 1e+20 mm is more than"},
           {unit + "offset = inf\n", "motor[1].offset: is the floating-point number inf"},
           {unit + "direction = \"up\"\n", "motor[1].direction: is \"up\"; allowed: \"negative\""},
           {unit + "precision = 13\n", "motor[1].precision: is 13; allowed: a whole number 0..12"},
           {"acceleration = 1.5\n",
            "37:16: motor[1].acceleration: is 1.5; allowed: a number above 0 and at most 1"},
           {"acceleration = 1e-6\n", "codes; allowed: 16384. Use a greater share"},
           {unit + "backlash = 1\nbacklash_speed = 1e-9\n", "motor[1].backlash_speed: 1e-09 mm/s"},
           {"soft_limits = [0]\n", "motor[1].soft_limits: has 1 elements; allowed: [lowest"},
           {"soft_limits = [0, \"x\"]\n", "motor[1].soft_limits[1]: is the string \"x\""},
           {"soft_limits = [5, 4]\n", "37:15: motor[1].soft_limits: has no step from 5 to 4"},
           {"soft_limits = 7\n", "motor[1].soft_limits: is 7; allowed: [lowest, highest]"},
           {"description = 7\n", "motor[1].description: is 7"},
       }) {
    EXPECT_THAT(error_of(of_slit(keys)), HasSubstr(error)) << keys;
  }
}

TEST(ConfigCoordinates, Backlash) {
  const auto without = ConfigFile(kGood).load();
  EXPECT_EQ(without->motors[1].backlash, 0);
  EXPECT_EQ(without->motors[1].settle_ms, 0);
  const auto config =
      loaded(of_slit("unit = \"mm\"\nsteps_per_unit = 400\nbacklash = -0.1\n"
                     "backlash_speed = 0.5\nsettle_ms = 50\n"));
  const Motor& motor = config.motors[1];
  EXPECT_EQ(motor.backlash, -0.1);
  EXPECT_EQ(motor.backlash_speed, 0.5);
  EXPECT_EQ(motor.settle_ms, 50);
}

// Every move and every homing would be refused later.
TEST(ConfigCoordinates, ASpeedBelowAStepAnHourIsRefused) {
  const std::string mm = "unit = \"mm\"\nsteps_per_unit = 400\n";
  const auto home = [](const std::string& speed) {
    return "home = { direction = \"negative\", most_steps = 9, speed = " + speed + " }\n";
  };
  for (const auto& [keys, reason] : std::initializer_list<std::pair<std::string, std::string>>{
           {"max_speed = 1e-9\n",
            "37:13: motor[1].max_speed: 1e-09 steps/s would take 1e+09 s a "
            "step; allowed: up to an hour a step, which is 0.000277778"},
           {mm + "max_speed = 6e-7\n",
            "39:13: motor[1].max_speed: 6e-07 mm/s would take 4166.67 s"},
           {"max_speed = 1e-300\n", "motor[1].max_speed: "},
           {home("1e-9"), "motor[1].home.speed: 1e-09 steps/s would take 1e+09 s a step"},
           {mm + home("6e-7"), "motor[1].home.speed: 6e-07 mm/s would take 4166.67 s a step"}}) {
    EXPECT_THAT(error_of(of_slit(keys)), HasSubstr(reason)) << keys;
  }
  for (const std::string& keys : {mm + "max_speed = 7e-7\n", mm + home("7e-7")}) {
    EXPECT_EQ(error_of(of_slit(keys)), "no error");
  }
}

TEST(ConfigCoordinates, ABadBacklashIsRefusedWithItsLine) {
  const std::string mm = "unit = \"mm\"\nsteps_per_unit = 400\n";
  for (const auto& [keys, reason] : std::initializer_list<std::pair<std::string, std::string>>{
           {mm + "backlash = 0.001\n", "39:12: motor[1].backlash: is 0.001, which is no step"},
           {"backlash = 0.5\n", "37:12: motor[1].backlash: "},
           {"backlash = 3e9\n", "37:12: motor[1].backlash: "},
           {"backlash = nan\n", "37:12: motor[1].backlash: "},
           {"backlash_speed = 5\n", "motor[1].backlash_speed: needs `backlash`"},
           {"backlash = 5\nbacklash_speed = 0\n", "motor[1].backlash_speed: is 0"},
           {"backlash = 5\nbacklash_speed = 1e-9\n",
            "38:18: motor[1].backlash_speed: 1e-09 steps/s would take 1e+09 s a step; allowed: up "
            "to an hour a step"},
           {"settle_ms = -1\n", "37:13: motor[1].settle_ms: "},
           {"settle_ms = 60001\n", "37:13: motor[1].settle_ms: "}}) {
    EXPECT_THAT(error_of(of_slit(keys)), HasSubstr(reason)) << keys;
  }
}

}  // namespace
}  // namespace bushd::config
