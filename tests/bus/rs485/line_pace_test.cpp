// The time of a line of several ports: when it begins, what puts it off, and what is measured.
#include "bus/rs485/line_pace.h"

#include <gtest/gtest.h>

#include <memory>
#include <utility>

namespace bushd::link {
namespace {

struct FakePort final : LinePort {
  RunProgress progress{0, 0};
  RunProgress progress_at(std::int64_t) const override { return progress; }
};

constexpr std::int64_t kMs = 1'000'000;

TEST(LinePace, BeginsWhenAllAreReady) {
  auto pace = std::make_shared<LinePace>(2);
  LinePace::Place a(pace);
  LinePace::Place b(pace);
  EXPECT_FALSE(a.ready(10 * kMs));
  EXPECT_FALSE(a.ready(11 * kMs));
  EXPECT_FALSE(b.begun());
  EXPECT_TRUE(b.ready(20 * kMs));
  EXPECT_TRUE(a.begun());
  EXPECT_EQ(a.due_ns(5 * kMs), 20 * kMs + LinePace::kStartNs + 5 * kMs);
  EXPECT_EQ(b.run_ns(a.due_ns(7 * kMs)), 7 * kMs);
}

TEST(LinePace, OneThatLeavesBeforeIsNotWaitedFor) {
  auto pace = std::make_shared<LinePace>(2);
  LinePace::Place a(pace);
  {
    const LinePace::Place b(pace);
    EXPECT_FALSE(a.ready(10 * kMs));
  }
  EXPECT_TRUE(a.ready(12 * kMs));
  EXPECT_EQ(a.due_ns(0), 12 * kMs + LinePace::kStartNs);
}

TEST(LinePace, IsPutOffByTheSlowestAndNeverPutForward) {
  auto pace = std::make_shared<LinePace>(2);
  LinePace::Place a(pace);
  LinePace::Place b(pace);
  a.ready(0);
  b.ready(0);
  const std::int64_t due_ns = b.due_ns(100 * kMs);
  a.cannot_be_before(due_ns + LinePace::kLateNs, 100 * kMs);
  EXPECT_EQ(b.due_ns(100 * kMs), due_ns) << "within the tolerance";
  a.cannot_be_before(due_ns + LinePace::kLateNs + 3 * kMs, 100 * kMs);
  EXPECT_EQ(b.due_ns(100 * kMs), due_ns + 3 * kMs);
  b.cannot_be_before(due_ns, 100 * kMs);
  EXPECT_EQ(a.due_ns(100 * kMs), due_ns + 3 * kMs);
}

TEST(LinePace, MeasuresWhatOneIsAheadOfTheSlowest) {
  auto pace = std::make_shared<LinePace>(2, kMs);
  FakePort at_a;
  FakePort at_b;
  LinePace::Place a(pace);
  a.give_to(&at_a);
  EXPECT_EQ(pace->most_ahead_ns(), kMs) << "of the run before";
  {
    LinePace::Place b(pace);
    b.give_to(&at_b);
    at_a.progress = {0, 3 * kMs};
    at_b.progress = {0, 33 * kMs};
    EXPECT_EQ(a.measure(0), 0);
    EXPECT_EQ(pace->most_ahead_ns(), kMs);
    at_a.progress = {8 * kMs, 10 * kMs};
    EXPECT_EQ(a.measure(0), 0) << "b may be as far";
    EXPECT_EQ(pace->most_ahead_ns(), 5 * kMs) << "before b went on";
    at_a.progress = {40 * kMs, 50 * kMs};
    EXPECT_EQ(a.measure(0), 7 * kMs);
    EXPECT_EQ(b.measure(0), 0);
    EXPECT_EQ(pace->most_ahead_ns(), 30 * kMs);
    at_b.progress = {33 * kMs, INT64_MAX};
    EXPECT_EQ(a.measure(0), 0) << "b has made its last step";
    EXPECT_EQ(pace->most_ahead_ns(), 30 * kMs);
  }
  EXPECT_EQ(a.measure(0), 0) << "b has left";
}

}  // namespace
}  // namespace bushd::link
