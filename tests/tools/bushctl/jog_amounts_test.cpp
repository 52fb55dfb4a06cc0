// Speeds and steps of a jog panel.
#include "tools/bushctl/jog_amounts.h"

#include <gtest/gtest.h>

namespace bushctl {
namespace {

using bushd::tables::TableContent;
using bushd::units::Scale;

// 100 to 1000 steps/s.
const TableContent kTable{.name = "t", .time_unit_ns = 1000, .accel = {10'000, 5000, 1000}};
const Scale kMm{.unit = "mm", .steps_per_unit = {.numerator = 400, .denominator = 1}};

TEST(JogAmounts, BeginAsTheTableDoesAndWithAFewSteps) {
  const JogAmounts amounts = jog_amounts(&kTable, kMm, false);
  EXPECT_EQ(amounts.unit, "mm");
  EXPECT_DOUBLE_EQ(amounts.speed, 0.25);
  EXPECT_DOUBLE_EQ(amounts.step, 0.05) << "20 steps: 10 are 0.025";
}

TEST(JogAmounts, OfAMotorWithoutAUnitAreSteps) {
  for (const bool in_steps : {false, true}) {
    const JogAmounts amounts = jog_amounts(&kTable, in_steps ? kMm : Scale{}, in_steps);
    EXPECT_EQ(amounts.unit, "steps");
    EXPECT_DOUBLE_EQ(amounts.speed, 100);
    EXPECT_DOUBLE_EQ(amounts.step, 10);
  }
}

TEST(JogAmounts, AStepIsARoundNumberOfAtLeastTenSteps) {
  const auto step_of = [](std::int64_t steps, std::int64_t units) {
    const Scale scale{.unit = "deg", .steps_per_unit = {.numerator = steps, .denominator = units}};
    return jog_amounts(&kTable, scale, false).step;
  };
  EXPECT_DOUBLE_EQ(step_of(1000, 1), 0.01);
  EXPECT_DOUBLE_EQ(step_of(999, 1), 0.02);
  EXPECT_DOUBLE_EQ(step_of(200, 1), 0.05);
  EXPECT_DOUBLE_EQ(step_of(1, 3), 50);
}

TEST(JogAmounts, StayWithinTheTable) {
  JogAmounts amounts = jog_amounts(&kTable, kMm, false);
  amounts.change_speed(1);
  EXPECT_DOUBLE_EQ(amounts.speed, 0.5);
  amounts.change_speed(5);
  EXPECT_DOUBLE_EQ(amounts.speed, 2.5) << "1000 steps/s";
  amounts.change_speed(-20);
  EXPECT_DOUBLE_EQ(amounts.speed, 2.5 / (1 << 20)) << "twenty times the half of it";
  amounts.change_speed(-20);
  // A step an hour is what the daemon takes.
  EXPECT_GT(amounts.speed * 400, 1.0 / 3600);
  EXPECT_LT(amounts.speed * 400, 1.001 / 3600);
  amounts.change_step(-20);
  EXPECT_DOUBLE_EQ(amounts.step * 400, 1);
}

TEST(JogAmounts, StepsStayWhole) {
  JogAmounts amounts = jog_amounts(&kTable, {}, false);
  amounts.change_step(-2);
  EXPECT_EQ(amounts.step, 2);
  amounts.change_step(-2);
  EXPECT_EQ(amounts.step, 1);
}

// What somebody has given counts, however fast: it may be made slower, not faster.
TEST(JogAmounts, AreNotChangedByTheirBounds) {
  JogAmounts amounts = jog_amounts(&kTable, kMm, false);
  amounts.speed = 7;
  amounts.change_speed(1);
  EXPECT_EQ(amounts.speed, 7);
  amounts.change_speed(-1);
  EXPECT_EQ(amounts.speed, 3.5);
}

TEST(JogAmounts, WithoutATableNoSpeedIsKnown) {
  JogAmounts amounts = jog_amounts(nullptr, kMm, false);
  EXPECT_EQ(amounts.speed, 0);
  amounts.speed = 3;
  amounts.change_speed(1);
  EXPECT_EQ(amounts.speed, 6);
}

}  // namespace
}  // namespace bushctl
