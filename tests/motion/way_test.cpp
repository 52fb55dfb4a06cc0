#include "motion/way.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "engine/tables.h"

namespace bushd::motion {
namespace {

using test::Law;
using test::TestTable;
using testing::HasSubstr;

Law law(std::uint16_t cruise) {
  return {.accel = {1000, 500, cruise}, .decel = {1000, cruise}, .cruise = cruise, .unit_ns = 1000};
}

class WayTest : public testing::Test {
 protected:
  TestTable quick_{law(100), true};
  TestTable slow_{law(400), true};
};

TEST_F(WayTest, LeadsAllMotorsToTheirEnds) {
  const Way way(
      {{quick_.view(), 100, 1100, 0}, {slow_.view(), 5, -95, 0}, {quick_.view(), 7, 7, 0}});
  EXPECT_EQ(way.longest(), 1000u);
  EXPECT_EQ(way.increment(1), 100u);
  EXPECT_EQ(way.position_at(0, 0), 100);
  EXPECT_EQ(way.position_at(1, 500), 5 - 50);
  EXPECT_EQ(way.position_at(0, 1000), 1100);
  EXPECT_EQ(way.position_at(1, 1000), -95);
  EXPECT_EQ(way.position_at(2, 1000), 7);
  const LineShare share = way.share(1, 10, 900);
  EXPECT_EQ(share.direction, -1);
  EXPECT_EQ(share.increment, 100u);
  EXPECT_EQ(share.from, 10u);
  EXPECT_EQ(share.to, 900u);
  EXPECT_EQ(way.share(0, 0, 1).direction, 1);
}

TEST_F(WayTest, IsAsFastAsTheMotorThatLimitsIt) {
  const Way even({{quick_.view(), 0, 1000, 0}, {slow_.view(), 0, 1000, 0}});
  EXPECT_EQ(even.limiting(), 1u);
  EXPECT_EQ(even.most_steps_per_s(0), 2500.0);
  const Way uneven({{quick_.view(), 0, 1000, 0}, {slow_.view(), 0, -100, 0}});
  EXPECT_EQ(uneven.limiting(), 0u);
  EXPECT_EQ(uneven.most_steps_per_s(1), 1000.0);
  const Way limited({{quick_.view(), 0, 1000, 0}, {slow_.view(), 0, -100, 2000}});
  EXPECT_EQ(limited.limiting(), 1u);
  EXPECT_EQ(limited.most_steps_per_s(1), 500.0);
}

TEST_F(WayTest, OfNoStepsTakesNoTime) {
  const Way way({{quick_.view(), 3, 3, 0}, {slow_.view(), -4, -4, 0}});
  EXPECT_EQ(way.longest(), 0u);
  EXPECT_EQ(way.duration_ns(), 0.0);
  EXPECT_EQ(way.position_at(1, 0), -4);
}

TEST_F(WayTest, TakesAsLongAsIsAsked) {
  Way way({{quick_.view(), 0, 1000, 0}, {slow_.view(), 0, 100, 0}});
  const double least_s = way.duration_ns() * 1e-9;
  ASSERT_TRUE(way.take(1.0, 1e12));
  EXPECT_GE(way.duration_ns(), 1e9);
  EXPECT_LT(way.duration_ns(), 1.001e9);
  EXPECT_THAT(Way({{quick_.view(), 0, 1000, 0}}).take(least_s / 2, 1e12).error().message,
              HasSubstr("the line takes at least"));
  EXPECT_THAT(way.take(4e6, 1e16).error().message, HasSubstr("the line takes at most 3.6e+06 s"));
  EXPECT_THAT(way.take(50.0, 3e10).error().message, HasSubstr("the line takes at most 30 s"));
  EXPECT_FALSE(way.take(-1, 1e12));
  EXPECT_FALSE(way.take(0.0 / 0.0, 1e12));
}

// Both bounds have more than six digits, and the nearest six are beyond them.
TEST_F(WayTest, WhatARefusalTellsIsTaken) {
  const auto told = [](const Result<void>& refused) {
    const std::string& text = refused.error().message;
    return std::stod(text.substr(text.find(" at ") + std::string(" at least ").size()));
  };
  Way slow({{quick_.view(), 0, 1000, 0}});
  const auto too_long = slow.take(1e8, 2748779.069e9);
  ASSERT_FALSE(too_long);
  EXPECT_EQ(too_long.error().message,
            "duration of 1e+08 s: the line takes at most 2.74877e+06 s; ask for that or less");
  EXPECT_TRUE(slow.take(2.74877e6, 2748779.069e9));
  // 1000 + 500 + 400 x 12345 + 1000 us.
  Way quick({{slow_.view(), 0, 12348, 0}});
  const auto too_short = quick.take(1, 1e16);
  ASSERT_FALSE(too_short);
  EXPECT_GE(told(too_short) * 1e9, quick.duration_ns()) << too_short.error().message;
  // By six digits, so up to 1e-5 of it more.
  EXPECT_LT(told(too_short) * 1e9, quick.duration_ns() * 1.00001);
  EXPECT_TRUE(quick.take(told(too_short), 1e16));
}

// Its table has longer time units then, so that its MCUs can be told.
TEST_F(WayTest, TakesLongerThan16BitsOfItsUnitsTell) {
  for (const double asked_s : {70.0, 1000.0, 3.6e6}) {
    Way way({{quick_.view(), 0, 1000, 0}, {slow_.view(), 0, 100, 0}});
    ASSERT_TRUE(way.take(asked_s, 1e16));
    EXPECT_GE(way.duration_ns(), asked_s * 1e9);
    EXPECT_LT(way.duration_ns(), asked_s * 1e9 * (1 + 2.0 / UINT16_MAX));
    EXPECT_TRUE(bushd_delay_is_code(way.shortest_delay()));
  }
}

TEST_F(WayTest, TakesOtherSpeedLimits) {
  Way way({{quick_.view(), 0, 1000, 0}, {quick_.view(), 0, 100, 0}});
  way.set_shortest_delays(std::vector<bushd_delay>{0, 4000});
  EXPECT_EQ(way.shortest_delay(), 400U);
  EXPECT_EQ(way.motors()[1].shortest_delay, 4000U);
  EXPECT_EQ(way.most_steps_per_s(1), 250.0);
}

}  // namespace
}  // namespace bushd::motion
