#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <cmath>
#include <cstdlib>
#include <limits>
#include <string>

#include "base/units/coordinates.h"
#include "base/units/ratio.h"

namespace bushd::units {
namespace {

using testing::HasSubstr;

Coordinates with(const std::string& steps_per_unit, bool negative = false, double offset = 0) {
  return Coordinates::make({"mm", *parse_ratio(steps_per_unit), negative, offset, {}}).value();
}

TEST(Ratio, IsWhatIsWritten) {
  EXPECT_EQ(parse_ratio("400"), (Ratio{400, 1}));
  EXPECT_EQ(parse_ratio("0.1"), (Ratio{1, 10}));
  EXPECT_EQ(parse_ratio("400/1.25"), (Ratio{320, 1}));
  EXPECT_EQ(parse_ratio("1/3"), (Ratio{1, 3}));
  EXPECT_EQ(parse_ratio("2.5e-3"), (Ratio{1, 400}));
  EXPECT_EQ(parse_ratio("9223372036854775807"), (Ratio{INT64_MAX, 1}));
  EXPECT_EQ(ratio_of(0.1), (Ratio{1, 10}));
  EXPECT_EQ(ratio_of(1e-3), (Ratio{1, 1000}));
  EXPECT_EQ(to_text(*parse_ratio("400/1.25")), "320");
  EXPECT_EQ(to_text(*parse_ratio("0.3")), "3/10");
}

TEST(Ratio, IsRefusedWithItsReason) {
  for (const char* text : {"", " 4", "4 ", "x", "1/", "/2", "1/2/3", "0x10", "1e", "1e500", "--1",
                           "1.2.3", "nan", "inf", "."}) {
    ASSERT_FALSE(parse_ratio(text)) << text;
    EXPECT_THAT(parse_ratio(text).error().message, HasSubstr("no number")) << text;
  }
  EXPECT_THAT(parse_ratio("-3").error().message, HasSubstr("not above 0"));
  EXPECT_THAT(parse_ratio("0").error().message, HasSubstr("not above 0"));
  EXPECT_THAT(parse_ratio("1/0").error().message, HasSubstr("divides by 0"));
  EXPECT_THAT(parse_ratio("9223372036854775808").error().message, HasSubstr("too many digits"));
  EXPECT_FALSE(ratio_of(std::numeric_limits<double>::infinity()));
  EXPECT_FALSE(ratio_of(std::nan("")));
}

TEST(Coordinates, WithoutAUnitAreSteps) {
  const Coordinates steps;
  EXPECT_EQ(steps.unit(), "steps");
  EXPECT_EQ(steps.user_of(-7), -7);
  EXPECT_EQ(steps.dial_of(-7), -7);
  EXPECT_EQ(steps.steps_of_user(12), 12);
  EXPECT_EQ(steps.precision(), 0);
}

TEST(Coordinates, DialAndUser) {
  const Coordinates slit = with("320", false, 10);
  EXPECT_EQ(slit.dial_of(640), 2);
  EXPECT_EQ(slit.user_of(640), 12);
  EXPECT_EQ(slit.steps_of_dial(2), 640);
  EXPECT_EQ(slit.steps_of_user(12), 640);
  EXPECT_EQ(slit.steps_of_distance(-0.5), -160);
  const Coordinates turned = with("320", true, 10);
  EXPECT_EQ(turned.dial_of(640), 2);
  EXPECT_EQ(turned.user_of(640), 8);
  EXPECT_EQ(turned.steps_of_user(8), 640);
  EXPECT_EQ(turned.steps_of_distance(-0.5), 160);
}

// A tenth is no double: in binary arithmetic 0.15 x 10 is below one and a half.
TEST(Coordinates, TiesAreThoseOfTheDecimalText) {
  const Coordinates tenths = with("10");
  EXPECT_EQ(tenths.steps_of_dial(0.15), 2);
  EXPECT_EQ(tenths.steps_of_dial(-0.15), -2);
  EXPECT_EQ(tenths.steps_of_dial(0.14999999999999999), 2);  // the same double
  EXPECT_EQ(tenths.steps_of_dial(0.1499999), 1);
  EXPECT_EQ(with("10", false, 0.1).steps_of_user(0.25), 2);
}

TEST(Coordinates, ShownAsPeopleWriteThem) {
  EXPECT_EQ(with("400", false, 0.1).user_of(12345), 30.9625);
  EXPECT_EQ(with("10", false, 0.2).user_of(1), 0.3);  // 0.1 + 0.2 is another double
  EXPECT_EQ(with("320", true, 1).text(160), "0.5000 mm");
  EXPECT_EQ(Coordinates().text(-7), "-7 steps");
  EXPECT_EQ(with("320").precision(), 4);
  EXPECT_EQ(with("1000").precision(), 5);
  EXPECT_EQ(with("0.5").precision(), 1);
}

TEST(Coordinates, BeyondWhatCanBeCounted) {
  const Coordinates mm = with("400");
  EXPECT_EQ(mm.steps_of_dial(5368709.1175), Coordinates::kMaxSteps);
  EXPECT_THAT(mm.steps_of_dial(5368709.12).error().message, HasSubstr("within +-2147483647 steps"));
  EXPECT_THAT(mm.steps_of_user(1e300).error().message, HasSubstr("within +-"));
  EXPECT_THAT(mm.steps_of_user(std::nan("")).error().message, HasSubstr("no finite number"));
  EXPECT_THAT(Coordinates::make({"mm", {400, 1}, false, 1e14, {}}).error().message,
              HasSubstr("could not be told apart"));
}

TEST(Coordinates, LimitsAreNeverRoundedOutwards) {
  const Coordinates thirds = with("3");
  EXPECT_EQ(thirds.first_step_from(0.4), 2);
  EXPECT_EQ(thirds.last_step_to(0.4), 1);
  EXPECT_EQ(thirds.first_step_from(-0.4), -1);
  EXPECT_EQ(thirds.last_step_to(-0.4), -2);
  EXPECT_EQ(with("10").first_step_from(0.3), 3);
  EXPECT_EQ(with("10").last_step_to(0.3), 3);
  EXPECT_EQ(thirds.last_step_to(1e300), Coordinates::kMaxSteps);
  EXPECT_EQ(thirds.first_step_from(-1e300), -Coordinates::kMaxSteps);
}

TEST(Coordinates, SettingMovesTheOffset) {
  const Coordinates set = with("400", true, 3).with_user(12.5, 400).value();
  EXPECT_EQ(set.user_of(400), 12.5);
  EXPECT_EQ(set.scale().offset, 13.5);
  EXPECT_EQ(set.dial_of(400), 1);
}

TEST(Coordinates, WhatIsShownMeansItsStep) {
  EXPECT_TRUE(rc::check("of any scale", [] {
    const Ratio ratio{*rc::gen::inRange<std::int64_t>(1, 1'000'000'000'000),
                      *rc::gen::inRange<std::int64_t>(1, 1'000'000'000'000)};
    const double per_unit =
        static_cast<double>(ratio.numerator) / static_cast<double>(ratio.denominator);
    const auto offset_steps = *rc::gen::inRange<std::int64_t>(-(1LL << 49), 1LL << 49);
    const Scale scale{
        "mm", ratio, *rc::gen::arbitrary<bool>(), static_cast<double>(offset_steps) / per_unit, {}};
    const auto coordinates = Coordinates::make(scale);
    RC_ASSERT(coordinates.has_value());
    const auto steps = *rc::gen::inRange(-Coordinates::kMaxSteps, Coordinates::kMaxSteps + 1);
    RC_ASSERT(coordinates->steps_of_user(coordinates->user_of(steps)) == steps);
    RC_ASSERT(coordinates->steps_of_dial(coordinates->dial_of(steps)) == steps);
  }));
}

// By integers alone: position and offset are of six decimals, so the steps are
// (user - offset) n / (d 10^6).
TEST(Coordinates, NearestStepByIntegers) {
  EXPECT_TRUE(rc::check("ties away from 0", [] {
    const auto numerator = *rc::gen::inRange<std::int64_t>(1, 10'000'000);
    const auto denominator = *rc::gen::inRange<std::int64_t>(1, 1000);
    const auto user = *rc::gen::inRange<std::int64_t>(-1'000'000, 1'000'001);
    const auto offset = *rc::gen::inRange<std::int64_t>(-1'000'000, 1'000'001);
    const bool negative = *rc::gen::arbitrary<bool>();
    const auto ratio = parse_ratio(std::to_string(numerator) + "/" + std::to_string(denominator));
    const auto coordinates =
        Coordinates::make({"mm", *ratio, negative, static_cast<double>(offset) / 1e6, {}});
    const std::int64_t above = (negative ? offset - user : user - offset) * numerator;
    const std::int64_t below = denominator * 1'000'000;
    const std::int64_t magnitude = (2 * std::abs(above) + below) / (2 * below);
    RC_ASSERT(coordinates->steps_of_user(static_cast<double>(user) / 1e6) ==
              (above < 0 ? -magnitude : magnitude));
  }));
}

TEST(Steps, AddUpToTheNearestWholeNumber) {
  constexpr std::int64_t kHalf = std::int64_t{1} << 31;
  EXPECT_EQ((Steps{3, kHalf} + Steps{1, 1}), (Steps{5, 1 - kHalf}));
  EXPECT_EQ((Steps{-3, -kHalf} + Steps{0, -1}), (Steps{-4, kHalf - 1}));
  EXPECT_EQ((Steps{5, -kHalf} + Steps{-10, 0}), (Steps{-5, -kHalf})) << "whole steps are whole";
  const auto blade = Coordinates::make({.unit = "mm", .steps_per_unit = {10, 1}, .negative = true});
  ASSERT_TRUE(blade);
  Steps sum;
  for (int i = 0; i < 1000; ++i) sum = sum + *blade->unrounded_of_distance(0.04);
  EXPECT_EQ(sum.whole, -400);
  EXPECT_LE(std::abs(sum.parts), 500) << "half a part each";
  EXPECT_EQ(*blade->unrounded_of_user(0.25), (Steps{-3, kHalf})) << "a tie, away from 0";
  EXPECT_NEAR(blade->user_of(Steps{-3, kHalf}), 0.25, 1e-15);
}

// The slowest speed that a refusal tells is none that is refused, whatever the scale.
TEST(Coordinates, TheSlowestSpeedThatIsToldIsAllowed) {
  for (const char* steps_per_unit : {"1", "7", "400", "1600", "400/1.25", "1/3", "12345.678"}) {
    const Coordinates axis = with(steps_per_unit);
    const auto refused = axis.delay_at(1e-12, 20);
    ASSERT_FALSE(refused);
    const std::string& text = refused.error().message;
    const double told = std::stod(text.substr(text.find("which is ") + 9));
    EXPECT_TRUE(axis.delay_at(told, 20)) << text;
    EXPECT_FALSE(axis.delay_at(told * 0.9999, 20)) << text;
  }
}

}  // namespace
}  // namespace bushd::units
