// What the motors ask of a segment's steps, against the same asked step by step.
#include "motion/path_segment.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <vector>

#include "engine/tables.h"

namespace bushd::motion {
namespace {

using test::any_law;
using test::between;
using test::TestTable;

std::vector<std::uint32_t> expanded(const Profile& profile) {
  std::vector<std::uint32_t> all;
  for (const Delays& delays : profile) all.insert(all.end(), delays.steps, delays.delay);
  return all;
}

Profile any_profile(std::uint32_t steps) {
  Profile profile;
  while (steps > 0) {
    const auto some = between<std::uint32_t>(1, steps);
    profile.push_back({some, between<std::uint32_t>(1, 9)});
    steps -= some;
  }
  return profile;
}

struct Segment {
  std::vector<std::unique_ptr<TestTable>> tables;
  std::vector<PathShare> shares;
  std::uint32_t steps;  // of the longest motor
  std::uint32_t flat = 1;
};

// Motors whose tables have one time unit, or twice the path's.
Segment any_segment() {
  Segment segment;
  segment.steps = between<std::uint32_t>(1, *rc::gen::element<std::uint32_t>(1, 9, 200));
  const int motors = between(1, 5);
  for (int m = 0; m < motors; ++m) {
    segment.tables.push_back(std::make_unique<TestTable>(any_law(), true));
    const std::uint32_t own = m == 0 ? segment.steps : between<std::uint32_t>(1, segment.steps);
    const std::uint64_t unit = between<std::uint64_t>(1, 2);
    segment.shares.push_back({.table = segment.tables.back()->view(),
                              .steps = own,
                              .longest = segment.steps,
                              .direction = 1,
                              .numerator = own * unit,
                              .denominator = segment.steps,
                              .ratio = static_cast<double>(own) / segment.steps});
    segment.flat =
        std::max(segment.flat, segment.shares.back().scaled(segment.tables.back()->law().cruise));
  }
  return segment;
}

std::vector<PathRamp> any_ramps(const Segment& segment) {
  std::vector<PathRamp> ramps;
  for (const PathShare& share : segment.shares) {
    if (between(0, 3) != 0) ramps.push_back({&share, between<std::int64_t>(0, 50)});
  }
  return ramps;
}

// After so many steps of the run, from the border at which the ramps begin.
std::uint32_t asked(const std::vector<PathRamp>& ramps, bool decel, std::uint64_t made) {
  std::uint32_t most = 0;
  for (const PathRamp& ramp : ramps) {
    const PathShare& share = *ramp.share;
    const auto own = static_cast<std::int64_t>(made * share.steps / share.longest);
    most = std::max(most, share.at(decel, ramp.place + own));
  }
  return most;
}

TEST(PathSegment, MergesRampsAsEveryStepWouldAskForThem) {
  EXPECT_TRUE(rc::check("each step is the slowest motor's", [] {
    const Segment segment = any_segment();
    const std::vector<PathRamp> up = any_ramps(segment);
    const std::vector<PathRamp> down = any_ramps(segment);
    std::vector<std::uint32_t> expected;
    for (std::uint32_t k = 0; k < segment.steps; ++k) {
      expected.push_back(
          std::max({segment.flat, asked(up, false, k), asked(down, true, segment.steps - 1 - k)}));
    }
    RampMerger merger;
    Profile merged = any_profile(3);  // of an earlier segment
    merger.merge(up, down, segment.flat, segment.steps, merged);
    RC_ASSERT(expanded(merged) == expected);
    merger.merge(up, down, segment.flat, segment.steps, merged);  // it keeps nothing
    RC_ASSERT(expanded(merged) == expected);
    std::uint64_t units = 0;
    for (const std::uint32_t delay : expected) units += delay;
    RC_ASSERT(units_of(merged) == units);
  }));
}

TEST(PathSegment, FindsTheFirstIndexThatAsksForNoMore) {
  EXPECT_TRUE(rc::check("as a search from the beginning does", [] {
    const Segment segment = any_segment();
    const PathShare& share = segment.shares.back();
    const bool decel = between(0, 1) != 0;
    const std::int64_t count = decel ? share.table->decel.count : share.table->accel.count;
    const std::uint32_t near = share.at(decel, between<std::int64_t>(0, count));
    const std::uint32_t delay = between(0, 1) != 0 ? near : between<std::uint32_t>(1, 70'000);
    std::int64_t first = 0;
    while (first < count && share.at(decel, first) > delay) ++first;
    RC_ASSERT(share.first_at_most(decel, delay) == first);
    const bool equal = first < count && share.at(decel, first) == delay;
    RC_ASSERT(share.place(decel, delay, -1) == first + (equal ? 1 : 0));
    // Among equal delays its own ramp goes on where it is, or behind them at most.
    std::int64_t behind = first;
    while (behind < count && share.at(decel, behind) == delay) ++behind;
    const auto reached = between<std::int64_t>(0, count);
    RC_ASSERT(share.place(decel, delay, reached) == std::clamp(reached, first, behind));
  }));
}

TEST(PathSegment, RoundsUpWhereSixtyFourBitsAreTooFew) {
  // 2^31-1 steps in units 2^20 times those of the path: 65535 times as much is more than 2^66.
  const std::uint64_t own = std::uint64_t{2'147'483'647} << 20;
  TestTable table({.accel = {65535, 9}, .decel = {9}, .cruise = 9, .unit_ns = 1}, true);
  const PathShare wide{.table = table.view(),
                       .steps = 1,
                       .longest = 1,
                       .direction = 1,
                       .numerator = own,
                       .denominator = own - 1,
                       .ratio = 1};
  EXPECT_EQ(wide.scaled(65535), 65536u);  // a little more than the code
  EXPECT_EQ(wide.first_at_most(false, 65536), 0);
  EXPECT_EQ(wide.first_at_most(false, 65535), 1);
}

TEST(PathSegment, ProfilesAreWhatTheirStepsAre) {
  EXPECT_TRUE(rc::check("raised, compared, and in part", [] {
    const auto steps = between<std::uint32_t>(1, 40);
    const Profile one = any_profile(steps);
    const Profile other = any_profile(steps);
    const std::vector<std::uint32_t> each = expanded(one);
    const std::vector<std::uint32_t> with = expanded(other);
    std::vector<std::uint32_t> greater;
    for (std::uint32_t k = 0; k < steps; ++k) greater.push_back(std::max(each[k], with[k]));
    RC_ASSERT(expanded(greater_of(one, other)) == greater);

    const auto first = between<std::uint32_t>(0, steps);
    const auto most = between<std::uint32_t>(0, 50);
    const std::uint32_t end = std::min(steps, first + most);
    RC_ASSERT(expanded(part_of(one, first, most)) ==
              std::vector<std::uint32_t>(each.begin() + first, each.begin() + end));

    const auto least = between<std::uint32_t>(1, 9);
    Profile raised = one;
    raise_first(raised, most, least);
    std::vector<std::uint32_t> at_least = each;
    for (std::uint32_t k = 0; k < std::min(most, steps); ++k) {
      at_least[k] = std::max(at_least[k], least);
    }
    RC_ASSERT(expanded(raised) == at_least);

    raised = one;
    raise_last(raised, least);
    at_least = each;
    at_least.back() = std::max(at_least.back(), least);
    RC_ASSERT(expanded(raised) == at_least);
  }));
}

}  // namespace
}  // namespace bushd::motion
