// `velocity` of a motor: its local motion by the velocity loop.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "config/config.h"
#include "config/config_file.h"

namespace bushd::config {
namespace {

using test::error_of;
using test::loaded;
using test::of_motor;
using testing::HasSubstr;

// The velocity of "theta".
std::string with_velocity(const std::string& velocity,
                          const std::string& before = "local = true\n") {
  return of_motor(before + "velocity = " + velocity + "\n");
}

TEST(Velocity, IsReadOfAMotorWithLocalInputs) {
  const auto config = loaded(
      with_velocity("{ min_steps_per_s = 100, max_steps_per_s = 1500, steps_per_s2 = 500 }"));
  const auto& velocity = config.motors[0].drive.velocity;
  ASSERT_TRUE(velocity);
  EXPECT_EQ(velocity->min_steps_per_s, 100);
  EXPECT_EQ(velocity->max_steps_per_s, 1500);
  EXPECT_EQ(velocity->steps_per_s2, 500);
  EXPECT_FALSE(config.motors[1].drive.velocity);
}

TEST(Velocity, WhatIsWrongIsNamed) {
  const std::string good = "{ min_steps_per_s = 100, max_steps_per_s = 1500, steps_per_s2 = 500 }";
  EXPECT_THAT(error_of(with_velocity(good, "")),
              HasSubstr("motor[0].velocity: is how local inputs move a motor; allowed: only with "
                        "`local = true`"));
  EXPECT_THAT(error_of(with_velocity("{ min_steps_per_s = 100, max_steps_per_s = 1500 }")),
              HasSubstr("steps_per_s2"));
  EXPECT_THAT(
      error_of(with_velocity("{ min_steps_per_s = 100, max_steps_per_s = 99, steps_per_s2 = 1 }")),
      HasSubstr("max_steps_per_s: is 99; allowed: a whole number 100..40000 steps/s"));
  EXPECT_THAT(
      error_of(with_velocity("{ min_steps_per_s = 1, max_steps_per_s = 40001, steps_per_s2 = 1 }")),
      HasSubstr("max_steps_per_s: is 40001; allowed: a whole number 1..40000 steps/s"));
  EXPECT_THAT(
      error_of(with_velocity("{ min_steps_per_s = 0, max_steps_per_s = 9, steps_per_s2 = 1 }")),
      HasSubstr("min_steps_per_s: is 0; allowed: a whole number 1..40000 steps/s"));
}

}  // namespace
}  // namespace bushd::config
