// Changes of a table's content.
#include "tables/edit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <algorithm>
#include <cmath>

#include "tables/gentler.h"
#include "tables/random_table.h"

namespace bushd::test {
namespace {

using tables::check;
using tables::content_hash;
using tables::greatest_shortfall;
using tables::resample_codes;
using tables::resample_unit;
using tables::reverse;
using tables::scale_acceleration;
using tables::scale_speed;
using tables::SideKey;
using tables::TableContent;
using testing::ElementsAre;
using testing::HasSubstr;

const TableContent kMirrored{.name = "t", .time_unit_ns = 1000, .accel = {900, 700, 500}};
const TableContent kUneven{.name = "t",
                           .time_unit_ns = 1000,
                           .accel = {900, 500},
                           .decel = {{400, 600, 800}},
                           .cruise = 400};

TEST(TableEdit, MirroredTableStaysMirroredUnlessItsDecelIsNamed) {
  const std::uint16_t code = 650;
  EXPECT_FALSE(set_codes(kMirrored, SideKey::kAccel, 1, {&code, 1})->decel);
  const auto braking = set_codes(kMirrored, SideKey::kDecel, 1, {&code, 1});
  EXPECT_THAT(braking->accel, ElementsAre(900, 700, 500));
  EXPECT_THAT(*braking->decel, ElementsAre(500, 650, 900));
}

TEST(TableEdit, CodesComeAndGo) {
  const std::vector<std::uint16_t> codes{660, 550};
  EXPECT_THAT(insert_codes(kMirrored, SideKey::kAccel, 2, codes)->accel,
              ElementsAre(900, 700, 660, 550, 500));
  EXPECT_THAT(*insert_codes(kUneven, SideKey::kDecel, 3, {{801, 802}})->decel,
              ElementsAre(400, 600, 800, 801, 802));
  EXPECT_THAT(delete_codes(kMirrored, SideKey::kAccel, 0, 2)->accel, ElementsAre(500));
  EXPECT_THAT(delete_codes(kMirrored, SideKey::kAccel, 0, 3).error().text(), HasSubstr("is empty"));
  EXPECT_THAT(delete_codes(kMirrored, SideKey::kAccel, 2, 2).error().text(),
              HasSubstr("no index 3; allowed: 0..2"));
}

TEST(TableEdit, ReversedTwiceIsTheSame) {
  const auto once = reverse(kUneven);
  EXPECT_THAT(once->accel, ElementsAre(800, 600, 400));
  EXPECT_THAT(*once->decel, ElementsAre(500, 900));
  EXPECT_EQ(*reverse(*once), kUneven);
  EXPECT_EQ(*reverse(kMirrored), kMirrored);
}

TEST(TableEdit, SpeedsAreScaledByTheCodes) {
  EXPECT_THAT(scale_speed(kMirrored, 2)->accel, ElementsAre(450, 350, 250));
  EXPECT_THAT(scale_speed(kMirrored, 3)->accel, ElementsAre(300, 234, 167));
  EXPECT_EQ(scale_speed(kMirrored, 3)->time_unit_ns, 1000U);
  EXPECT_FALSE(scale_speed(kUneven, 0));
}

TEST(TableEdit, SpeedsThatLeaveTheTimeUnitGetOneThatHoldsThem) {
  // In 100 us the codes stay as they are, and nothing is rounded.
  const auto slow = scale_speed(kUneven, 0.01);
  ASSERT_TRUE(slow);
  EXPECT_EQ(slow->time_unit_ns, 100'000U);
  EXPECT_THAT(slow->accel, ElementsAre(900, 500));
  EXPECT_THAT(*slow->decel, ElementsAre(400, 600, 800));
  EXPECT_EQ(*slow->cruise, 400);
  const auto back = scale_speed(*slow, 5000);
  ASSERT_TRUE(back);
  EXPECT_EQ(back->time_unit_ns, 1U);
  EXPECT_THAT(back->accel, ElementsAre(18000, 10000));
}

TEST(TableEdit, TheUnitIsOneThatRoundsLeast) {
  // 60 us and 40 us over 0.7: 85714.286 and 57142.857 ns. The finest unit is 2 ns.
  const TableContent content{.name = "t", .time_unit_ns = 1, .accel = {60000, 40000}};
  const auto slow = scale_speed(content, 0.7);
  ASSERT_TRUE(slow);
  const double shortfall = greatest_shortfall(content, *slow, 0.7);
  for (std::uint32_t unit_ns = 2; unit_ns < 60; ++unit_ns) {
    const double slowest = std::ceil(60000 / 0.7 / unit_ns) * unit_ns;
    const double fastest = std::ceil(40000 / 0.7 / unit_ns) * unit_ns;
    EXPECT_LE(shortfall, std::max(1 - 60000 / 0.7 / slowest, 1 - 40000 / 0.7 / fastest) + 1e-15);
  }
}

TEST(TableEdit, LongSideGetsALongerUnitBeforeItsSumLeaves31Bits) {
  // 40000 codes of 30000 are 1.2e9 units; half as fast they would be 2.4e9.
  const TableContent content{
      .name = "t", .time_unit_ns = 1000, .accel = std::vector<std::uint16_t>(40000, 30000)};
  const auto slow = scale_speed(content, 0.5);
  ASSERT_TRUE(slow);
  EXPECT_EQ(slow->time_unit_ns, 2000U);
  EXPECT_EQ(slow->accel.front(), 30000);
  EXPECT_FALSE(check(*slow));
}

TEST(TableEdit, ScaledSpeedsAreNeverFasterAndNearlyThose) {
  EXPECT_TRUE(rc::check("by any factor, in the old unit or another", [] {
    const TableContent content = random_case(1000).content;
    const double factor = std::pow(10.0, random_in(-400, 400) / 100.0);
    const auto scaled = scale_speed(content, factor);
    if (!scaled) return;
    RC_ASSERT(!check(*scaled));
    for (std::size_t i = 0; i < content.accel.size(); ++i) {
      const double wanted = content.accel[i] * (content.time_unit_ns / factor);
      const double is = 1.0 * scaled->accel[i] * scaled->time_unit_ns;
      RC_ASSERT(is >= wanted * (1 - 1e-12));
      RC_ASSERT(is < wanted + scaled->time_unit_ns);
    }
  }));
}

TEST(TableEdit, AnotherUnitKeepsTheDelaysOrMakesThemLonger) {
  EXPECT_THAT(resample_unit(kMirrored, 100)->accel, ElementsAre(9000, 7000, 5000));
  EXPECT_THAT(resample_unit(kMirrored, 300'000)->accel, ElementsAre(3, 3, 2));
  EXPECT_EQ(resample_unit(kMirrored, 300'000)->time_unit_ns, 300'000U);
}

// Steps/s^2, of the pair of delays slower, faster: from the middle of one to that of the other.
double acceleration(double slower_s, double faster_s) {
  return (1 / faster_s - 1 / slower_s) / (0.5 * (slower_s + faster_s));
}

// The codes of a side in use, slow to fast, and the cruise delay if that is another one.
std::vector<double> run_codes(const TableContent& content, bool decel) {
  std::vector<double> codes(content.accel.begin(), content.accel.end());
  if (decel && content.decel) codes.assign(content.decel->rbegin(), content.decel->rend());
  const double cruise = content.cruise.value_or(content.accel.back());
  if (cruise < codes.back()) codes.push_back(cruise);
  return codes;
}

double peak(const std::vector<double>& codes) {
  double peak = 0;
  for (std::size_t i = 1; i < codes.size(); ++i) {
    peak = std::max(peak, acceleration(codes[i - 1], codes[i]));
  }
  return peak;
}

// A code stands for a delay of up to a unit less: what any such delays have at least.
double least_peak(const std::vector<double>& codes) {
  double peak = 0;
  for (std::size_t i = 1; i < codes.size(); ++i) {
    if (codes[i - 1] - 1 <= codes[i]) continue;
    peak =
        std::max(peak, (1 / codes[i] - 1 / (codes[i - 1] - 1)) / (0.5 * (codes[i - 1] + codes[i])));
  }
  return peak;
}

TEST(TableEdit, ScaledAccelerationIsTheFactorAtMost) {
  EXPECT_TRUE(rc::check("ends stay, and the greatest acceleration falls by the factor", [] {
    const TableContent content = random_case(1000).content;
    const double factor = random_in(25, 400) / 100.0;
    const auto scaled = scale_acceleration(content, factor);
    RC_ASSERT(scaled.has_value());
    for (const bool decel : {false, true}) {
      const auto before = run_codes(content, decel);
      const auto after = run_codes(*scaled, decel);
      RC_ASSERT(after.front() == before.front());
      RC_ASSERT(after.back() == before.back());
      RC_ASSERT(least_peak(after) <= factor * peak(before) * (1 + 1e-6));
    }
  }));
}

TEST(TableEdit, ScalingByOneChangesNothing) {
  EXPECT_TRUE(rc::check("and back in place", [] {
    const TableContent content = random_case(1000).content;
    const auto scaled = scale_acceleration(content, 1);
    RC_ASSERT(scaled.has_value());
    RC_ASSERT(run_codes(*scaled, false) == run_codes(content, false));
    RC_ASSERT(run_codes(*scaled, true) == run_codes(content, true));
  }));
}

// The codes of constant acceleration from rest: the mean speeds of steps whose ends have the speeds
// sqrt(2 a k).
TableContent constant_acceleration(double acceleration, std::size_t count) {
  TableContent content{.name = "t", .time_unit_ns = 100};
  const auto time_at = [&](std::size_t k) {
    return std::sqrt(2.0 * static_cast<double>(k) / acceleration);
  };
  for (std::size_t k = 1; k <= count; ++k) {
    content.accel.push_back(
        static_cast<std::uint16_t>(std::ceil((time_at(k + 1) - time_at(k)) * 1e7)));
  }
  return content;
}

TEST(TableEdit, ScaledRampHasNoStairs) {
  const TableContent content = constant_acceleration(20'000, 400);
  for (const double factor : {0.05, 0.3, 0.5, 0.8, 1.5, 3.0}) {
    const auto scaled = scale_acceleration(content, factor);
    ASSERT_TRUE(scaled.has_value());
    const auto& codes = scaled->accel;
    // Steps and the time of the ramp grow by what the acceleration shrinks.
    EXPECT_NEAR(static_cast<double>(codes.size()), 400 / factor, 0.02 * 400 / factor + 2);
    for (std::size_t i = 1; i + 1 < codes.size(); ++i) {
      const double slower_s = codes[i - 1] * 1e-7;
      const double faster_s = codes[i] * 1e-7;
      const double wanted = factor * 20'000;
      // What a unit of the old codes and one of the new ones may make.
      const double noise = 2 * 1e-7 / (faster_s * faster_s * faster_s);
      EXPECT_NEAR(acceleration(slower_s, faster_s), wanted, noise * (1 + factor) + 0.01 * wanted)
          << "factor " << factor << ", code " << i << ": " << codes[i - 1] << ", " << codes[i];
    }
  }
}

TEST(TableEdit, ResampledUpwardsHasNoStairsEither) {
  EXPECT_TRUE(rc::check("the rise of the speed's square falls by the steps", [] {
    const TableContent content = random_case(1000).content;
    const auto before = std::vector<double>(content.accel.begin(), content.accel.end());
    const auto count = before.size() * static_cast<std::size_t>(random_in(1, 5));
    const auto made = resample_codes(content, count);
    RC_ASSERT(made.has_value());
    const std::vector<double> after(made->accel.begin(), made->accel.end());
    RC_ASSERT(after.size() == count);
    const auto rise = [](double slower, double faster) {
      return 1 / (faster * faster) - 1 / (slower * slower);
    };
    double greatest = 0;
    for (std::size_t i = 1; i < before.size(); ++i) {
      greatest = std::max(greatest, rise(before[i - 1], before[i]));
    }
    const double ratio =
        static_cast<double>(before.size() - 1) / std::max(1.0, static_cast<double>(count - 1));
    for (std::size_t i = 1; i < after.size(); ++i) {
      if (after[i - 1] - 1 < after[i]) continue;
      RC_ASSERT(rise(after[i - 1] - 1, after[i]) <= greatest * ratio * (1 + 1e-6));
    }
  }));
}

TEST(TableEdit, SpeedsAreNotFasterThanAskedByTheLeastShare) {
  const TableContent content{.name = "t", .time_unit_ns = 1000, .accel = {2107}};
  EXPECT_THAT(scale_speed(content, 1 - 2e-10)->accel, ElementsAre(2108));
  EXPECT_THAT(scale_speed(content, 1)->accel, ElementsAre(2107));
  EXPECT_THAT(scale_speed(content, 0.7)->accel, ElementsAre(3010));
}

TEST(TableEdit, DelaysShorterThanAUnitAreRefused) {
  EXPECT_THAT(scale_speed(kMirrored, 1e9).error().text(),
              HasSubstr("a delay becomes 0.0009 time units; allowed: 1 or more, as nothing shorter "
                        "can be said. No time unit is shorter than 1 ns"));
  EXPECT_THAT(scale_speed(kMirrored, 501)->accel, ElementsAre(1797, 1398, 999));
  EXPECT_THAT(scale_speed(kMirrored, 1e-9).error().text(),
              HasSubstr("the slowest delay becomes 900000 s; allowed: up to 65535 s"));
  EXPECT_THAT(resample_unit(kMirrored, 1'000'000'000).error().text(),
              HasSubstr("allowed: 1 or more"));
}

TEST(TableEdit, ResampledSidesHaveTheNumberOfCodesAskedFor) {
  EXPECT_TRUE(rc::check("and stay monotone", [] {
    const TableContent content = random_case(1000).content;
    const auto count = static_cast<std::size_t>(random_in(1, 300));
    const auto made = resample_codes(content, count);
    RC_ASSERT(made.has_value());
    RC_ASSERT(made->accel.size() == count);
    if (made->decel) RC_ASSERT(made->decel->size() == count);
  }));
}

TEST(Gentler, IsTheTableOfScaledAccelerationMadeOnce) {
  tables::Gentler gentler;
  for (const TableContent& content : {constant_acceleration(20'000, 400), kUneven}) {
    const auto table = tables::make(content).value();
    EXPECT_EQ(gentler.of(table, 1).value(), table);
    const auto half = gentler.of(table, 0.5).value();
    EXPECT_EQ(gentler.of(table, 0.5).value(), half);
    EXPECT_EQ(gentler.of(tables::make(content).value(), 0.5).value(), half)
        << "of the same content";
    EXPECT_NE(gentler.of(table, 0.25).value(), half);
    EXPECT_EQ(half->content_hash(), content_hash(*scale_acceleration(content, 0.5)));
    EXPECT_EQ(half->name(), "t");
    EXPECT_EQ(half->path(), "");
  }
  const auto table = tables::make(constant_acceleration(20'000, 400)).value();
  EXPECT_THAT(gentler.of(table, 0.001).error().text(),
              HasSubstr("has 400000 codes; allowed: 16384. Use a greater share"));
}

}  // namespace
}  // namespace bushd::test
