#include "motion/motor_scale.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace bushd::motion {
namespace {

using testing::HasSubstr;

// 4 steps to a millimetre; user positions are 0.5 mm ahead of the dial.
MotorScale millimetres() {
  return MotorScale(units::Coordinates::make({"mm", {4, 1}, false, 0.5, 2}).value(),
                    units::SoftLimits{0, 10}, 5.0);
}

TEST(MotorScale, AmountsAreStepsOrUserUnits) {
  const MotorScale scale = millimetres();
  EXPECT_EQ(scale.steps_of_position(std::int64_t{7}).value(), 7);
  EXPECT_EQ(scale.steps_of_position(words::UserUnits{2.5}).value(), 8);
  EXPECT_EQ(scale.distance_of(words::UserUnits{2.5}).value().whole, 10);
  const auto halves = MotorScale().steps_of_position(words::UserUnits{2.5});
  ASSERT_FALSE(halves);
  EXPECT_THAT(halves.error().message, HasSubstr("no whole number of steps"));
}

TEST(MotorScale, SoftLimitsBindTheWayOutOnly) {
  const MotorScale scale = millimetres();
  EXPECT_EQ(scale.lowest(), 0) << "soft limits are on the dial";
  EXPECT_EQ(scale.highest(), 40);
  EXPECT_TRUE(scale.may_move_to(40, 0));
  EXPECT_FALSE(scale.may_move_to(41, 0));
  EXPECT_TRUE(scale.may_move_to(45, 50)) << "towards the limit";
  EXPECT_FALSE(scale.may_move_to(51, 50));
  EXPECT_FALSE(scale.stands_within_soft_limits(50));
  EXPECT_EQ(MotorScale().highest(), MotorScale::kMaxPosition);
}

TEST(MotorScale, TheSlowerOfTwoSpeedsCounts) {
  const MotorScale scale = millimetres();
  // 5 mm/s are 20 steps/s: 50 ms a step.
  EXPECT_EQ(scale.shortest_delay_at({}, 1'000'000).value(), 50u);
  EXPECT_EQ(scale.shortest_delay_at(words::Speed{.per_s = 2.5}, 1'000'000).value(), 100u);
  EXPECT_EQ(scale.shortest_delay_at(words::Speed{.per_s = 50}, 1'000'000).value(), 50u);
  EXPECT_EQ(scale.shortest_delay_at(words::Speed{.per_s = 10, .in_steps = true}, 1'000'000).value(),
            100u);
}

}  // namespace
}  // namespace bushd::motion
