// Runs that get a new end in flight, against the slow reference; and the reference against what a
// table allows at all.
#include <cstdint>
#include <vector>

#include "engine/run.h"
#include "engine/tables.h"

namespace bushd::test::retarget_test {
namespace {

constexpr std::size_t kMostTicks = 1500;

struct Flight {
  bushd_run run;
  Reference reference;
  uint32_t tick_ns;
  bool fine;
  int direction;
  uint64_t ticks = 0;

  uint64_t now_ns() const { return ticks * tick_ns; }

  // The next ticks of both, in blocks of any size, which must agree.
  void fly(uint64_t count) {
    while (count > 0) {
      const auto block = static_cast<std::size_t>(std::min(count, between<uint64_t>(1, 20)));
      fly_block(block);
      count -= block;
      RC_ASSERT(bushd_run_delay(&run) == reference.long_delay_at(now_ns()));
      RC_ASSERT(bushd_run_steps_left(&run) == reference.steps() - reference.steps_at(now_ns()));
      RC_ASSERT(bushd_run_units_left(&run) == reference.units_left_at(now_ns()));
    }
  }

  void fly_block(std::size_t block) {
    std::vector<int16_t> fine_ticks(block);
    std::vector<uint8_t> coarse_ticks(block);
    if (fine) {
      bushd_run_expand_fine(&run, tick_ns, block, fine_ticks.data(), 1);
    } else {
      bushd_run_expand_coarse(&run, tick_ns, block, coarse_ticks.data(), 1);
    }
    for (std::size_t n = 0; n < block; ++n) {
      const uint64_t from_ns = now_ns();
      ++ticks;
      if (fine) {
        const int64_t want = reference.position_at(now_ns()) - reference.position_at(from_ns);
        RC_ASSERT(fine_ticks[n] == want * direction);
      } else {
        const std::size_t want = reference.steps_at(now_ns()) - reference.steps_at(from_ns);
        const bool forward = direction > 0 && reference.long_delay_at(from_ns) != 0;
        RC_ASSERT(coarse_ticks[n] == (want | (forward ? BUSHD_COARSE_DIRECTION : 0u)));
      }
    }
  }
};

// By the delays alone: each is at least the next one of the accelerating side, and the one before a
// longer one was at least the one before it on the decelerating side.
void allowed(const Law& law, const Reference& reference) {
  const Wide unit = Wide{law.unit_ns} * 256;
  const auto delay = [&](std::size_t i) { return reference.step(i).delay / unit; };
  std::size_t k = 0;  // the running delay is at least A(k), k as small as it can be taken
  for (std::size_t i = 0; i < reference.steps(); ++i) {
    const Wide least = std::max(law.accel_at(k), Wide{law.cruise});
    RC_ASSERT(delay(i) >= least);
    ++k;
    while (k > 1 && std::max(law.accel_at(k - 1), Wide{law.cruise}) < delay(i)) --k;
  }
  if (reference.steps() != 0) RC_ASSERT(delay(reference.steps() - 1) >= law.decel_at(0));
  for (std::size_t i = 1; i < reference.steps(); ++i) {
    std::size_t r = 0;  // the last index of the first D(r) <= this delay
    while (law.decel_at(r) > delay(i)) ++r;
    while (r < law.decel.size() && law.decel_at(r + 1) == law.decel_at(r)) ++r;
    RC_ASSERT(delay(i - 1) >= std::min(law.decel_at(r + 1), delay(i)));
  }
}

TEST(Retarget, ChangesAtAnyTickFollowTheDefinition) {
  holds("retarget == definition, and the table allows it", [] {
    const Law law = any_law();
    const TestTable table(law, *rc::gen::arbitrary<bool>());
    const auto steps = between<uint32_t>(1, 120);
    const uint64_t first_shortest_delay = any_long_shortest_delay(law);
    Flight flight{.run = {},
                  .reference = Reference::move(law, steps, first_shortest_delay),
                  .tick_ns = any_tick_ns(law),
                  .fine = *rc::gen::arbitrary<bool>(),
                  .direction = *rc::gen::element(1, -1)};
    bushd_run_start(&flight.run, table.view(), steps, flight.direction, first_shortest_delay);
    for (int changes = between(1, 4); changes > 0; --changes) {
      const uint64_t left = flight.reference.units_left_at(flight.now_ns()) * law.unit_ns;
      flight.fly(std::min<uint64_t>(between<uint64_t>(0, left / flight.tick_ns + 1), kMostTicks));
      const auto after = between<uint32_t>(0, between(0, 1) != 0 ? 10 : 150);
      const bushd_run before = flight.run;
      const uint64_t shortest_delay = any_long_shortest_delay(law);
      const bool taken = bushd_run_retarget(&flight.run, after, shortest_delay);
      RC_ASSERT(taken == flight.reference.retarget_at(flight.now_ns(), after, shortest_delay));
      if (!taken) {
        RC_ASSERT(bushd_run_delay(&flight.run) == bushd_run_delay(&before));
        RC_ASSERT(bushd_run_steps_left(&flight.run) == bushd_run_steps_left(&before));
      }
    }
    const uint64_t left = flight.reference.units_left_at(flight.now_ns()) * law.unit_ns;
    flight.fly(std::min<uint64_t>(left / flight.tick_ns + 2, kMostTicks));
    allowed(law, flight.reference);
  });
}

const Law kRamp{{50, 40, 30, 20, 10}, {50, 40, 30, 20, 10}, 10, 1000};

// The delays of the steps still to be made, from the run's ticks of one unit.
std::vector<uint32_t> delays_left(bushd_run run) {
  std::vector<uint32_t> delays(1, 0);
  while (!bushd_run_done(&run)) {
    uint8_t steps = 0;
    bushd_run_expand_coarse(&run, 1000, 1, &steps, 1);
    ++delays.back();
    if ((steps & 0x7F) != 0) delays.push_back(0);
  }
  delays.pop_back();
  return delays;
}

bushd_run after_units(const TestTable& table, uint32_t steps, uint32_t units) {
  bushd_run run;
  bushd_run_start(&run, table.view(), steps, 1, 0);
  std::vector<uint8_t> unused(units);
  bushd_run_expand_coarse(&run, 1000, units, unused.data(), 1);
  return run;
}

TEST(Retarget, FartherWhileSpeedingUpIsTheLongerMove) {
  const TestTable table(kRamp, true);
  bushd_run run = after_units(table, 4, 50);  // 50 | 40 40 50
  ASSERT_TRUE(bushd_run_retarget(&run, 9, 0));
  EXPECT_EQ(delays_left(run), (std::vector<uint32_t>{40, 30, 20, 10, 10, 10, 20, 30, 40, 50}));
}

TEST(Retarget, FartherAtCruiseStaysAtCruise) {
  const TestTable table(kRamp, true);
  bushd_run run = after_units(table, 12, 150);
  ASSERT_EQ(bushd_run_delay(&run), 10);
  ASSERT_TRUE(bushd_run_retarget(&run, 7, 0));
  EXPECT_EQ(delays_left(run), (std::vector<uint32_t>{10, 10, 10, 10, 20, 30, 40, 50}));
}

TEST(Retarget, FartherWhileSlowingDownSpeedsUpFromThere) {
  const TestTable table(kRamp, true);
  bushd_run run = after_units(table, 10, 160);  // 50 40 30 20 10 10 | 20 30 40 50
  ASSERT_EQ(bushd_run_delay(&run), 20);
  ASSERT_TRUE(bushd_run_retarget(&run, 8, 0));
  EXPECT_EQ(delays_left(run), (std::vector<uint32_t>{20, 10, 10, 10, 10, 20, 30, 40, 50}));
}

TEST(Retarget, ADelayThatTheAcceleratingSideDoesNotHaveGoesOnWithTheNextShorterOne) {
  const TestTable table({{50, 40, 30, 20, 10}, {45, 35, 25, 15}, 10, 1000}, false);
  bushd_run run = after_units(table, 10, 175);
  ASSERT_EQ(bushd_run_delay(&run), 25);
  ASSERT_TRUE(bushd_run_retarget(&run, 5, 0));
  EXPECT_EQ(delays_left(run), (std::vector<uint32_t>{25, 20, 15, 25, 35, 45}));
}

TEST(Retarget, NearerEndsAsSoonAsTheTableAllowsAndNotBefore) {
  const TestTable table(kRamp, true);
  bushd_run run = after_units(table, 1000, 500);
  EXPECT_FALSE(bushd_run_retarget(&run, 3, 0));
  EXPECT_EQ(bushd_run_steps_left(&run), 1000 - run.steps_done);
  ASSERT_TRUE(bushd_run_retarget(&run, 4, 0));
  EXPECT_EQ(delays_left(run), (std::vector<uint32_t>{10, 20, 30, 40, 50}));
}

TEST(Retarget, SlowsDownToASpeedLimitAlongTheDeceleratingSideAndSpeedsUpFromItAgain) {
  const TestTable table(kRamp, true);
  bushd_run run = after_units(table, 1000, 500);
  ASSERT_EQ(bushd_run_delay(&run), 10);
  ASSERT_TRUE(bushd_run_retarget(&run, 9, 35));
  EXPECT_EQ(delays_left(run), (std::vector<uint32_t>{10, 20, 30, 35, 35, 35, 35, 35, 40, 50}));
  std::vector<uint8_t> unused(10 + 20 + 30 + 35);
  bushd_run_expand_coarse(&run, 1000, unused.size(), unused.data(), 1);
  ASSERT_TRUE(bushd_run_retarget(&run, 6, 20));
  EXPECT_EQ(delays_left(run), (std::vector<uint32_t>{35, 30, 20, 20, 30, 40, 50}));
}

TEST(Retarget, ASpeedLimitSlowerThanTheTablesSlowestDelayIsReachedByItsWholeSide) {
  const TestTable table(kRamp, true);
  bushd_run run = after_units(table, 1000, 500);
  ASSERT_TRUE(bushd_run_retarget(&run, 6, 60));
  EXPECT_EQ(delays_left(run), (std::vector<uint32_t>{10, 20, 30, 40, 50, 60, 60}));
}

TEST(Retarget, ARunThatIsDoneHasNoTarget) {
  const TestTable table(kRamp, true);
  bushd_run run = after_units(table, 1, 50);
  EXPECT_FALSE(bushd_run_retarget(&run, 5, 0));
  EXPECT_TRUE(bushd_run_done(&run));
}

TEST(Retarget, TheMostStepsAreTakenInstantly) {
  const TestTable table(kRamp, true);
  bushd_run run = after_units(table, 30, 95);
  ASSERT_TRUE(bushd_run_retarget(&run, UINT32_MAX - 10, 0));
  EXPECT_EQ(bushd_run_steps_left(&run), UINT32_MAX - 9);
  EXPECT_EQ(bushd_run_delay(&run), 30);
}

}  // namespace
}  // namespace bushd::test::retarget_test
