#include "motion/pseudo/curved_axis.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

namespace bushd::pseudo {
namespace {

using testing::DoubleEq;
using testing::ElementsAre;

csv::NumberTable table(const std::string& text) {
  return csv::parse_numbers(text, "energy.csv", 1000).value();
}

const std::string kEnergy =
    "gap,energy,theta\n15.32,5000,23.2956\n14.90,6000,19.2376\n14.55,8000,14.3095\n";

TEST(CurvedAxis, ItsMotorsFollowACurveEach) {
  const auto axis = CurvedAxis::make(table(kEnergy), "energy", {"theta", "gap"});
  ASSERT_TRUE(axis.has_value()) << axis.error().text();
  EXPECT_EQ(axis->range(), (Range{5000, 8000}));
  EXPECT_THAT(axis->motors_for(6000).value(), ElementsAre(DoubleEq(19.2376), DoubleEq(14.9)));
  const std::vector<double> motors{19.2376, 14.95};
  EXPECT_NEAR(axis->position(motors), 6000, 1e-9);
  EXPECT_EQ(axis->beyond(motors), 0);
  EXPECT_EQ(axis->deviations(motors)[0], 0);
  EXPECT_NEAR(axis->deviations(motors)[1], 0.05, 1e-12);
  const std::vector<double> beyond{24, 14.95};
  EXPECT_EQ(axis->position(beyond), 5000);
  EXPECT_NEAR(axis->beyond(beyond), 24 - 23.2956, 1e-12);
}

TEST(CurvedAxis, BeyondTheCalibrationThereIsNothing) {
  const auto axis = CurvedAxis::make(table(kEnergy), "energy", {"theta"});
  for (const double bad : {4999.9, 8000.1, std::nan(""), HUGE_VAL}) {
    const auto motors = axis->motors_for(bad);
    ASSERT_FALSE(motors.has_value());
    EXPECT_THAT(motors.error().text(),
                testing::HasSubstr("is beyond the calibration; allowed: 5000 to 8000"));
  }
}

TEST(CurvedAxis, WhatIsWrongInTheFileIsToldWithItsLine) {
  const auto error = [](const std::string& text, const std::vector<std::string>& motors) {
    const auto made = CurvedAxis::make(table(text), "energy", motors);
    return made ? std::string("none") : made.error().text();
  };
  EXPECT_EQ(error(kEnergy, {"phi"}),
            "energy.csv: no column \"phi\"; there are: gap, energy, theta");
  EXPECT_EQ(error("energy,theta\n1,5\n\n2,6\n3,5.5\n", {"theta"}),
            "energy.csv:5: theta over energy: 5.5 after 6; all must rise, or all fall");
  EXPECT_EQ(error("energy,theta\n1,5\n1,6\n", {"theta"}),
            "energy.csv:3: theta over energy: 1 does not rise from 1");
  EXPECT_EQ(error("energy,theta\n1,5\n", {"theta"}),
            "energy.csv:2: theta over energy: a curve takes two points or more");
}

// A sine bar, height = 100 sin(angle), with a point each half degree: whatever the curve is between
// them, each step of 1 um has a place on it that leads back to it.
TEST(CurvedAxis, ThereAndBackIsTheSameStep) {
  std::string text = "angle,height\n";
  for (int i = -60; i <= 60; ++i) {
    const double angle = i / 2.0;
    text += std::to_string(angle) + "," +
            std::to_string(100 * std::sin(angle * std::numbers::pi / 180)) + "\n";
  }
  const auto axis = CurvedAxis::make(table(text), "angle", {"height"});
  ASSERT_TRUE(axis.has_value()) << axis.error().text();
  constexpr double kStep = 0.001;
  for (int step = -49'999; step < 50'000; step += 37) {
    const std::vector<double> height{step * kStep};
    const auto back = axis->motors_for(axis->position(height)).value();
    EXPECT_EQ(std::lround(back[0] / kStep), step);
  }
}

}  // namespace
}  // namespace bushd::pseudo
