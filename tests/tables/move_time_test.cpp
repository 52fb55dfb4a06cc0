#include "tables/move_time.h"

#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <algorithm>

#include "tables/random_table.h"

namespace bushd::test {
namespace {

TEST(MoveTime, IsTheSumOfTheDelays) {
  EXPECT_TRUE(rc::check("any number of steps", [] {
    const auto table = tables::make(random_case(1000).content);
    const bushd_table& view = (*table)->view();
    const auto steps = static_cast<std::uint32_t>(random_in(0, 300));
    std::uint64_t units = 0;
    std::uint16_t fastest = 0;
    for (std::uint32_t j = 1; j <= steps; ++j) {
      const std::uint16_t delay = bushd_table_delay(&view, j, steps);
      units += delay;
      fastest = j == 1 ? delay : std::min(fastest, delay);
    }
    const auto time = tables::move_time(view, steps);
    RC_ASSERT(time.time_ns == units * view.time_unit_ns);
    RC_ASSERT(time.fastest_code == fastest);
  }));
}

TEST(MoveTime, OfTheLongestMoveDoesNotOverflow) {
  const auto table = tables::make({.name = "t", .time_unit_ns = 1'000'000, .accel = {900, 500}});
  EXPECT_EQ(tables::move_time((*table)->view(), 2147483647).time_ns,
            (2147483645ULL * 500 + 2 * 900) * 1'000'000);
}

}  // namespace
}  // namespace bushd::test
