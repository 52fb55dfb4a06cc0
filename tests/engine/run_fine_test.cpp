// The share of the running delay in fine ticks, against a checker that keeps the time since the
// last step in ns and divides 128-bit numbers for each tick by itself.
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <cstdint>
#include <numeric>
#include <vector>

#include "engine/run.h"
#include "engine/tables.h"

namespace bushd::test::run_fine_test {
namespace {

// A run whose steps have the delays of `side` from slow to fast, then `cruise` steps of its
// fastest, then those of `side` back.
class Delays {
 public:
  Delays(const std::vector<uint16_t>& side, uint64_t cruise, uint64_t cruise_delay)
      : side_(side), cruise_(cruise), cruise_delay_(cruise_delay) {}

  uint64_t steps() const { return 2 * side_.size() + cruise_; }
  uint64_t at(uint64_t step) const {
    if (step < side_.size()) return side_[step];
    if (step < side_.size() + cruise_) return cruise_delay_;
    return side_[steps() - 1 - step];
  }

 private:
  const std::vector<uint16_t>& side_;
  uint64_t cruise_;
  uint64_t cruise_delay_;
};

class Checker {
 public:
  Checker(const Delays& delays, uint64_t unit_ns) : delays_(delays), unit_ns_(unit_ns) {}

  bool done() const { return step_ == delays_.steps(); }
  // The displacement of the next tick.
  int next(uint64_t tick_ns) {
    ns_ += tick_ns;
    while (!done() && ns_ >= delay_ns()) {
      ns_ -= delay_ns();
      ++step_;
    }
    const Wide position = Wide{step_} * 256 + (done() ? 0 : ns_ * 256 / delay_ns());
    const Wide moved = position - position_;
    position_ = position;
    return static_cast<int>(moved);
  }

 private:
  Wide delay_ns() const { return Wide{delays_.at(step_)} * unit_ns_; }

  const Delays& delays_;
  uint64_t unit_ns_;
  uint64_t step_ = 0;
  Wide ns_ = 0;
  Wide position_ = 0;
};

// A prime number of ticks a call, so that blocks begin everywhere.
constexpr size_t kBlockTicks = 61;

// Compares up to `most` ticks. Returns the first that differs, or their number.
size_t agreeing_ticks(bushd_run run, const Delays& delays, uint32_t tick_ns, size_t most) {
  Checker checker(delays, run.table->time_unit_ns);
  int16_t out[kBlockTicks];
  size_t ticks = 0;
  while (!checker.done() && ticks < most) {
    bushd_run_expand_fine(&run, tick_ns, kBlockTicks, out, 1);
    for (size_t i = 0; i < kBlockTicks; ++i, ++ticks) {
      if (out[i] != checker.next(tick_ns) * run.direction) return ticks;
    }
  }
  return ticks;
}

// From slow to fast.
std::vector<uint16_t> delays_down(uint16_t slowest, uint16_t fastest, uint16_t stride) {
  std::vector<uint16_t> side;
  for (int delay = slowest; delay >= fastest; delay -= stride) {
    side.push_back(static_cast<uint16_t>(delay));
  }
  return side;
}

void expect_exact(const std::vector<uint16_t>& side, uint32_t unit_ns, uint32_t tick_ns) {
  const Delays delays(side, 5, side.back());
  const uint64_t units =
      2 * std::accumulate(side.begin(), side.end(), uint64_t{0}) + 5u * side.back();
  SCOPED_TRACE(testing::Message() << side.front() << " to " << side.back() << " units of "
                                  << unit_ns << " ns, ticks of " << tick_ns << " ns");
  for (const bool indexed : {true, false}) {
    const TestTable table({side, side, side.back(), unit_ns}, indexed);
    for (const int direction : {1, -1}) {
      bushd_run run;
      bushd_run_start(&run, table.view(), static_cast<uint32_t>(delays.steps()), direction, 0);
      EXPECT_GE(agreeing_ticks(run, delays, tick_ns, SIZE_MAX), units * unit_ns / tick_ns);
    }
  }
}

// In a table of all of these the slowest would be so much longer than the fastest that it had no
// blocks.
TEST(RunFine, SharesAreExactInEveryUnitOfEveryDelay) {
  struct Length {
    uint32_t unit_ns;
    uint32_t tick_ns;
  };
  for (const Length& c : {Length{1, 1}, Length{7, 10}, Length{1000, 999}, Length{3, 1},
                          Length{200, 500}, Length{25'000'003, 25'000'000}}) {
    expect_exact(delays_down(700, 100, 1), c.unit_ns, c.tick_ns);
    expect_exact(delays_down(99, 15, 1), c.unit_ns, c.tick_ns);
    expect_exact(delays_down(14, 3, 1), c.unit_ns, c.tick_ns);
    expect_exact(delays_down(2, 1, 1), c.unit_ns, c.tick_ns);
  }
}

// Where 256 times a delay has 24 bits, and a side has up to 2^31 units.
TEST(RunFine, SharesAreExactOfLongDelays) {
  expect_exact(delays_down(65535, 9000, 16), 1009, 1009 * 1783);
  expect_exact(delays_down(65535, 9000, 16), 1009, 1009 * 1783 + 500);
  expect_exact(delays_down(65535, 9000, 1), 1, 9'000 * 100);
}

TEST(RunFine, SharesInCruiseAreExactForAnyDelayAndTick) {
  holds("cruise == checker", [] {
    const auto unit_ns =
        *rc::gen::element<uint32_t>(1, 7, 100, 200, 999, 40'000, 123'457, 20'000'003);
    const auto code = between<uint16_t>(1, *rc::gen::element<uint16_t>(3, 300, 65535));
    const uint64_t longest = BUSHD_LONGEST_DELAY_NS / unit_ns;
    const uint64_t delay =
        between(0, 1) == 0
            ? code
            : std::min(longest, uint64_t{code} * *rc::gen::element<uint64_t>(1, 1000, 1'000'000));
    const uint64_t fastest_ns = std::min<uint64_t>(code, delay) * unit_ns;
    const auto most_ns =
        static_cast<uint32_t>(std::min<uint64_t>(fastest_ns * 127 - 1, 100'000'000));
    const auto tick_ns = between<uint32_t>(1, most_ns);
    const std::vector<uint16_t> side{code};
    const TestTable table({side, side, code, unit_ns}, *rc::gen::arbitrary<bool>());
    const std::vector<uint16_t> none;
    const Delays delays(none, 100'000, delay);
    RC_LOG() << "delay " << delay << " x " << unit_ns << " ns, ticks of " << tick_ns << " ns\n";
    bushd_run run;
    bushd_run_start(&run, table.view(), static_cast<uint32_t>(delays.steps()), -1, delay);
    constexpr size_t kMost = 3000;
    const uint64_t all = delay * unit_ns * delays.steps() / tick_ns;
    RC_ASSERT(agreeing_ticks(run, delays, tick_ns, kMost) >= std::min<uint64_t>(kMost, all));
  });
}

// Their way is beyond 32 bits of 1/256 step.
TEST(RunFine, MayMakeAnyNumberOfTicksInOneCall) {
  const std::vector<uint16_t> side{1000};
  const TestTable table({side, side, 1000, 1}, true);
  constexpr uint32_t kSteps = 20'000'000;
  bushd_run run;
  bushd_run_start(&run, table.view(), kSteps, 1, 0);
  std::vector<int16_t> out(160'000);
  EXPECT_EQ(bushd_run_expand_fine(&run, 126'500, out.size(), out.data(), 1), 158'103u);
  EXPECT_EQ(std::accumulate(out.begin(), out.end(), int64_t{0}), int64_t{kSteps} * 256);
  EXPECT_EQ(run.steps_done, kSteps);
}

}  // namespace
}  // namespace bushd::test::run_fine_test
