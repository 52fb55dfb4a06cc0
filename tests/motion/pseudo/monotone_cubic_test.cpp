#include "motion/pseudo/monotone_cubic.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace bushd::pseudo {
namespace {

// Values of scipy 1.17.1, PchipInterpolator, at sixteenths of the way.
TEST(MonotoneCubic, IsThatOfFritschAndButland) {
  struct Known {
    std::vector<double> x;
    std::vector<double> y;
    std::vector<double> between;
  };
  const Known all[] = {
      {{0, 1, 2.5, 3, 7},
       {0, 0.1, 4, 4.5, 5},
       {0.0211437136627907, 0.07834302325581395, 0.5034966906687159, 1.8318564554931838,
        3.308675021440346, 4.166159349448987, 4.517219897398014, 4.628040431701031,
        4.722489071875504, 4.801456097475032, 4.865831788053217, 4.916506423163661,
        4.954370282359959, 4.980313645195715, 4.995226791224528}},
      {{5000, 6000, 8000, 9000, 12000},
       {23.2956, 19.2376, 14.3095, 12.6942, 9.4879},
       {21.349113063237738, 19.650863261072434, 18.291632349169937, 17.090193985955086,
        16.01726747344293, 15.05639482953079, 14.191465399265352, 13.429886608417748,
        12.778501760930467, 12.20114399642042, 11.646523092125632, 11.12191911506729,
        10.635543441285472, 10.195607446820265, 9.810322507711746}}};
  for (const Known& known : all) {
    ASSERT_FALSE(MonotoneCubic::flaw(known.x, known.y).has_value());
    const MonotoneCubic curve(known.x, known.y);
    const double way = known.x.back() - known.x.front();
    for (std::size_t k = 1; k < 16; ++k) {
      // Both in doubles, with some ten roundings each.
      const double expected = known.between[k - 1];
      EXPECT_NEAR(curve.at(known.x.front() + way * static_cast<double>(k) / 16), expected,
                  20 * 2.3e-16 * std::abs(expected));
    }
  }
}

TEST(MonotoneCubic, TwoPointsAreALine) {
  const MonotoneCubic line({1, 3}, {10, 4});
  EXPECT_DOUBLE_EQ(line.at(2), 7);
  EXPECT_DOUBLE_EQ(line.where(5.5), 2.5);
  EXPECT_FALSE(line.rises());
}

TEST(MonotoneCubic, BeyondItsEndsItStays) {
  const MonotoneCubic curve({1, 2, 4}, {10, 30, 35});
  EXPECT_EQ(curve.at(0), 10);
  EXPECT_EQ(curve.at(9), 35);
  EXPECT_EQ(curve.where(0), 1);
  EXPECT_EQ(curve.where(99), 4);
}

TEST(MonotoneCubic, NamesTheFirstPointThatIsWrong) {
  const auto flaw = [](const std::vector<double>& x, const std::vector<double>& y) {
    const auto found = MonotoneCubic::flaw(x, y);
    return found ? std::to_string(found->point) + ": " + found->message : "none";
  };
  EXPECT_EQ(flaw({1, 2, 3}, {1, 2, 3}), "none");
  EXPECT_EQ(flaw({1}, {1}), "0: a curve takes two points or more");
  EXPECT_EQ(flaw({1, 2, 2}, {1, 2, 3}), "2: 2 does not rise from 2");
  EXPECT_EQ(flaw({1, 2, 3, 4}, {1, 2, 2, 3}), "2: 2 after 2; all must rise, or all fall");
  EXPECT_EQ(flaw({1, 2, 3}, {3, 2, 2.5}), "2: 2.5 after 2; all must rise, or all fall");
  EXPECT_EQ(flaw({1, 2, 3}, {1, NAN, 3}), "1: is not finite");
}

struct Points {
  std::vector<double> x;
  std::vector<double> y;
};

// Steep and flat, near and far, rising and falling.
Points arbitrary_points() {
  const int count = *rc::gen::inRange(2, 12);
  Points points{{*rc::gen::inRange(-1000, 1000) * 1.0}, {*rc::gen::inRange(-1000, 1000) * 1.0}};
  const double sign = *rc::gen::element(-1, 1);
  for (int i = 1; i < count; ++i) {
    points.x.push_back(points.x.back() +
                       std::pow(10.0, *rc::gen::inRange(-2, 4)) * *rc::gen::inRange(1, 10));
    points.y.push_back(points.y.back() +
                       sign * std::pow(10.0, *rc::gen::inRange(-2, 4)) * *rc::gen::inRange(1, 10));
  }
  return points;
}

RC_GTEST_PROP(MonotoneCubicProperty, MeetsItsPointsAndNeverTurns, ()) {
  const Points points = arbitrary_points();
  const MonotoneCubic curve(points.x, points.y);
  const double sign = points.y[1] > points.y[0] ? 1 : -1;
  // What y and the products that make it up are rounded by.
  const double tiny = 1e-15 * (std::abs(points.y.front()) + std::abs(points.y.back()));
  for (std::size_t i = 0; i + 1 < points.x.size(); ++i) {
    RC_ASSERT(curve.at(points.x[i]) == points.y[i]);
    double before = points.y[i];
    for (int k = 1; k <= 50; ++k) {
      const double x = points.x[i] + (points.x[i + 1] - points.x[i]) * k / 50;
      const double y = k == 50 ? points.y[i + 1] : curve.at(x);
      RC_ASSERT(sign * (y - before) >= -tiny);
      before = y;
    }
  }
}

RC_GTEST_PROP(MonotoneCubicProperty, LeadsBackToWhereItCameFrom, ()) {
  const Points points = arbitrary_points();
  const MonotoneCubic curve(points.x, points.y);
  const double share = *rc::gen::inRange(0, 10'001) / 10'000.0;
  const double y = points.y.front() + share * (points.y.back() - points.y.front());
  // An x is a double: its last digit, times the steepest slope there is, three chords.
  double steepest = 0;
  for (std::size_t i = 0; i + 1 < points.x.size(); ++i) {
    steepest = std::max(
        steepest, std::abs((points.y[i + 1] - points.y[i]) / (points.x[i + 1] - points.x[i])));
  }
  const double digit = 2.3e-16 * std::max(std::abs(points.x.front()), std::abs(points.x.back()));
  const double tiny = 1e-15 * (std::abs(points.y.front()) + std::abs(points.y.back()));
  RC_ASSERT(std::abs(curve.at(curve.where(y)) - y) <= 2 * 3 * steepest * digit + tiny);
}

}  // namespace
}  // namespace bushd::pseudo
