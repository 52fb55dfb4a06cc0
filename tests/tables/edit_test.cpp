// Changes of a table's content.
#include "tables/edit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <numeric>

#include "tables/random_table.h"

namespace bushd::test {
namespace {

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
  EXPECT_THAT(scale_speed(kUneven, 0.01).error().text(), HasSubstr("a longer time unit"));
  EXPECT_FALSE(scale_speed(kUneven, 0));
}

TEST(TableEdit, AnotherUnitKeepsTheDelaysOrMakesThemLonger) {
  EXPECT_THAT(resample_unit(kMirrored, 100)->accel, ElementsAre(9000, 7000, 5000));
  EXPECT_THAT(resample_unit(kMirrored, 300'000)->accel, ElementsAre(3, 3, 2));
  EXPECT_EQ(resample_unit(kMirrored, 300'000)->time_unit_ns, 300'000U);
}

TEST(TableEdit, AccelerationIsScaledAtTheSameSpeeds) {
  EXPECT_TRUE(rc::check("ends stay, time and steps shrink or grow by the factor", [] {
    TableContent content = random_case(1000).content;
    const double factor = random_in(25, 400) / 100.0;
    const auto scaled = scale_acceleration(content, factor);
    RC_ASSERT(scaled.has_value());
    RC_ASSERT(scaled->accel.front() == content.accel.front());
    RC_ASSERT(scaled->accel.back() == content.accel.back());
    const auto steps = static_cast<double>(content.accel.size() - 1);
    RC_ASSERT(scaled->accel.size() == 1 + std::ceil(steps / factor - 1e-6));
    const auto sum = [](const std::vector<std::uint16_t>& codes) {
      return std::accumulate(codes.begin() + 1, codes.end(), 0.0);
    };
    // Where steps / factor is no whole number, the side is stretched to the next one.
    const double ratio = static_cast<double>(scaled->accel.size() - 1) / std::max(1.0, steps);
    if (steps >= 1) {
      // The last code is that of before, which may be faster than the mean of the last stretch.
      RC_ASSERT(sum(scaled->accel) <=
                sum(content.accel) * ratio + static_cast<double>(scaled->accel.size()));
      RC_ASSERT(sum(scaled->accel) >= sum(content.accel) * ratio - content.accel.front());
    }
  }));
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

}  // namespace
}  // namespace bushd::test
