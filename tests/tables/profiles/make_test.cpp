// Single cases of making tables: what is refused, and the profiles that take other parameters.
#include "tables/profiles/make.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <cmath>

#include "results.h"
#include "tables/random_table.h"

namespace bushd::test {
namespace {

using tables::profiles::make_content;
using tables::profiles::Profile;
using tables::profiles::Spec;
using testing::ElementsAre;
using testing::HasSubstr;

Spec constant(double start_hz, double max_hz, double acceleration) {
  Spec spec{.name = "t", .start_hz = start_hz, .max_hz = max_hz};
  spec.accel = {.profile = Profile::kConstant, .acceleration = acceleration};
  return spec;
}

std::string refusal(const Spec& spec) {
  const auto content = make_content(spec);
  return content ? std::string("was made") : content.error().text();
}

TEST(MakeTable, ConstantAccelerationByHand) {
  // t_k = (sqrt(100^2 + 2 * 5000 k) - 100) / 5000: 8.2843, 14.6410, 20 ms; then 200 steps/s.
  Spec spec = constant(100, 200, 5000);
  spec.time_unit_ns = 1000;
  EXPECT_THAT(make_content(spec)->accel, ElementsAre(10000, 8285, 6357, 5359, 5000));
}

TEST(MakeTable, StartAtMaximumIsOneCode) {
  Spec spec = constant(100, 100, 1);
  EXPECT_EQ(make_content(spec)->accel.size(), 1U);
}

TEST(MakeTable, EightBitsAreCodesFromTenToTwoHundredAndFifty) {
  Spec spec = constant(100, 2500, 0);
  spec.accel.acceleration.reset();
  spec.accel.codes = 238;
  spec.code_bits = 8;
  const auto content = good(make_content(spec));
  EXPECT_EQ(content.accel.size(), 238U);
  EXPECT_EQ(content.accel.front(), 250);
  EXPECT_EQ(content.accel.back(), 10);
  EXPECT_EQ(content.time_unit_ns, 40000U);
  spec.max_hz = 2800;
  EXPECT_THAT(refusal(spec), HasSubstr("allowed: 10 or more, so that one code changes the speed by "
                                       "10 % at most"));
}

TEST(MakeTable, ThirtyTwoBitsAreRefusedWithTheRemedy) {
  Spec spec = constant(100, 200, 1000);
  spec.code_bits = 32;
  EXPECT_THAT(refusal(spec), HasSubstr("takes a longer --time-unit"));
}

TEST(MakeTable, PiecewiseTakesUpBacklashAndApproachesSlowly) {
  Spec spec{.name = "t", .start_hz = 100, .max_hz = 1000, .stop_hz = 200, .time_unit_ns = 1000};
  spec.accel = {.profile = Profile::kPiecewise, .legs = {{20, 100}, {99, 1000}}};
  spec.decel = {.profile = Profile::kPiecewise, .legs = {{96, 200}, {50, 200}}};
  const auto content = good(make_content(spec));
  for (std::size_t i = 0; i <= 20; ++i) EXPECT_EQ(content.accel[i], 10000) << i;
  EXPECT_LT(content.accel[21], 10000);
  EXPECT_EQ(content.accel.size(), 1 + 20 + 99 + 1U);
  ASSERT_EQ(content.decel->size(), 1 + 96 + 50 + 1U);
  for (std::size_t i = 0; i <= 50; ++i) {
    EXPECT_EQ((*content.decel)[content.decel->size() - 1 - i], 5000) << i;
  }
}

TEST(MakeTable, PtoTakesTimesOfBothSides) {
  Spec spec{.name = "t", .start_hz = 100, .max_hz = 1000};
  spec.accel = {.profile = Profile::kPto, .time_s = 0.2};
  EXPECT_THAT(refusal(spec), HasSubstr("--decel-time"));
  spec.decel = {.profile = Profile::kPto, .time_s = 0.1};
  const auto content = good(make_content(spec));
  EXPECT_EQ(content.accel.size(), 112U);  // (100 + 1000) / 2 * 0.2 = 110 steps
  EXPECT_EQ(content.decel->size(), 57U);
}

TEST(MakeTable, ScurveWithAJerkHasAStraightPart) {
  Spec spec{.name = "t", .start_hz = 100, .max_hz = 2100};
  spec.accel = {.profile = Profile::kScurve, .acceleration = 10000, .jerk = 100000};
  // 0.1 s up to 10000, 0.1 s at it, 0.1 s down: 500 + 1000 + 500 steps/s; by symmetry 330 steps.
  EXPECT_EQ(make_content(spec)->accel.size(), 332U);
}

TEST(MakeTable, LongestSideThatAnMcuCanAddressIsMade) {
  for (const Profile profile : {Profile::kConstant, Profile::kScurve, Profile::kExponential}) {
    Spec spec{.name = "t", .start_hz = 100, .max_hz = 20000};
    spec.accel = {.profile = profile, .codes = 65535};
    const auto content = good(make_content(spec));
    EXPECT_EQ(content.accel.size(), 65535U);
  }
}

TEST(MakeTable, CruisingInTheBandIsRefused) {
  Spec spec = constant(100, 800, 1000);
  spec.skip = {.low_hz = 600, .high_hz = 1000, .factor = 4};
  EXPECT_THAT(refusal(spec), HasSubstr("the maximum speed 800 lies in the band 600:1000"));
  spec.max_hz = 2000;
  spec.start_hz = 700;
  EXPECT_THAT(refusal(spec), HasSubstr("the start speed 700 lies in the band"));
}

TEST(MakeTable, BandNeedsToKnowHowQuickly) {
  Spec spec = constant(100, 2000, 1000);
  spec.skip = {.low_hz = 600, .high_hz = 1000};
  EXPECT_THAT(refusal(spec), HasSubstr("--skip-acceleration A or xFACTOR"));
}

TEST(MakeTable, WhatCannotWorkIsRefusedWithTheReason) {
  EXPECT_THAT(refusal(constant(0, 100, 1)), HasSubstr("above 0"));
  EXPECT_THAT(refusal(constant(200, 100, 1)), HasSubstr("up to the maximum, 100"));
  EXPECT_THAT(refusal(constant(100, 200, -1)), HasSubstr("above 0"));
  EXPECT_THAT(refusal(constant(1, 20000, 100)), HasSubstr("Use a steeper ramp"));
  EXPECT_THAT(refusal(constant(0.001, 1000, 100)),
              HasSubstr("allowed: 10 or more, so that one code changes the speed by 10 %"));
  Spec both = constant(100, 200, 10);
  both.accel.time_s = 1;
  EXPECT_THAT(refusal(both), HasSubstr("needs one of --acceleration, --time and --codes"));
}

TEST(MakeTable, StartTooSlowForTheUnitNamesTheRemedy) {
  Spec spec = constant(10, 200, 1000);
  spec.time_unit_ns = 100;
  EXPECT_THAT(refusal(spec), HasSubstr("longer --time-unit or start faster"));
}

TEST(MakeTable, EndsAreNotFasterByTheLeastShare) {
  EXPECT_TRUE(rc::check("of a code", [] {
    const int fast = random_in(100, 3000);
    const int slow = random_in(2 * fast, 20 * fast);
    const double share = std::pow(10.0, -random_in(1, 9));  // above a whole number of units
    const std::uint32_t unit_ns = 200;
    Spec spec{.name = "t",
              .start_hz = 1e9 / (unit_ns * (slow + share)),
              .max_hz = 1e9 / (unit_ns * (fast + share)),
              .time_unit_ns = unit_ns};
    spec.accel = {.profile = Profile::kConstant,
                  .codes = static_cast<std::uint32_t>(random_in(3, 500))};
    const auto content = good(make_content(spec));
    RC_ASSERT(content.accel.front() == slow + 1);
    RC_ASSERT(content.accel.back() == fast + 1);
  }));
}

TEST(MakeTable, EndsThatAreWholeCodesStayThese) {
  EXPECT_TRUE(rc::check("with speeds as a double holds them", [] {
    const int fast = random_in(100, 3000);
    const int slow = random_in(2 * fast, 20 * fast);
    Spec spec{.name = "t", .start_hz = 5e6 / slow, .max_hz = 5e6 / fast, .time_unit_ns = 200};
    spec.accel = {.profile = Profile::kConstant,
                  .codes = static_cast<std::uint32_t>(random_in(3, 500))};
    const auto content = good(make_content(spec));
    RC_ASSERT(content.accel.front() == slow);
    RC_ASSERT(content.accel.back() == fast);
  }));
}

}  // namespace
}  // namespace bushd::test
