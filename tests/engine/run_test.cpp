#include "engine/run.h"

#include <cstdint>
#include <cstdlib>
#include <vector>

#include "engine/tables.h"

namespace bushd::test::run_test {
namespace {

enum class Format { kCoarse, kFine };

// Signed 1/256 steps of each tick, whatever the format.
struct Ticks {
  std::vector<int> displacements;
  size_t active = 0;

  void append(const Ticks& more) {
    displacements.insert(displacements.end(), more.displacements.begin(), more.displacements.end());
    active += more.active;
  }
};

int decode(const bushd_run& run, uint8_t byte, bool active) {
  const uint8_t direction = run.direction > 0 ? BUSHD_COARSE_DIRECTION : 0;
  EXPECT_EQ(byte & BUSHD_COARSE_DIRECTION, active ? direction : 0);
  return (byte & 0x7F) * 256 * run.direction;
}
int decode(const bushd_run&, int16_t displacement, bool) {
  return displacement;
}

template <class Displacement, class Expand>
Ticks expand_block(bushd_run* run, uint32_t tick_ns, size_t ticks, size_t stride, Expand expand) {
  constexpr Displacement kUntouched = 0x55;
  std::vector<Displacement> out(ticks * stride, kUntouched);
  Ticks block;
  block.active = expand(run, tick_ns, ticks, out.data(), stride);
  EXPECT_LE(block.active, ticks);
  if (block.active < ticks) {
    EXPECT_TRUE(bushd_run_done(run));
  }
  for (size_t i = 0; i < out.size(); ++i) {
    if (i % stride != 0) {
      EXPECT_EQ(out[i], kUntouched) << "wrote between its places";
    } else {
      block.displacements.push_back(decode(*run, out[i], i / stride < block.active));
    }
  }
  return block;
}

// The next ticks, in one call or in blocks and strides of any size.
Ticks expand(bushd_run* run, Format format, uint32_t tick_ns, size_t ticks,
             bool random_blocks = false) {
  Ticks all;
  while (all.displacements.size() < ticks) {
    size_t block = ticks - all.displacements.size();
    size_t stride = 1;
    if (random_blocks) {
      block = std::min(block, between<size_t>(1, 20));
      stride = between<size_t>(1, 3);
    }
    all.append(format == Format::kCoarse
                   ? expand_block<uint8_t>(run, tick_ns, block, stride, bushd_run_expand_coarse)
                   : expand_block<int16_t>(run, tick_ns, block, stride, bushd_run_expand_fine));
  }
  return all;
}

int64_t position(const Reference& reference, Format format, uint64_t ns) {
  return format == Format::kFine ? reference.position_at(ns)
                                 : static_cast<int64_t>(reference.steps_at(ns)) * 256;
}

// The displacements of ticks first .. first + ticks - 1 by the definition.
std::vector<int> expected(const Reference& reference, Format format, uint32_t tick_ns, size_t first,
                          size_t ticks, int direction, int64_t start = 0) {
  std::vector<int> all;
  int64_t before = first == 0 ? start : position(reference, format, uint64_t{first} * tick_ns);
  for (size_t n = first; n < first + ticks; ++n) {
    const int64_t after = position(reference, format, uint64_t{n + 1} * tick_ns);
    all.push_back(static_cast<int>(after - before) * direction);
    before = after;
  }
  return all;
}

// Ticks until the end of the reference, and some more; bounded so that a slow table does not stall
// the test.
size_t ticks_to_compare(const Reference& reference, uint32_t tick_ns) {
  const uint64_t units_ns =
      reference.steps() == 0
          ? 0
          : static_cast<uint64_t>(reference.step(reference.steps() - 1).end / 256);
  return static_cast<size_t>(std::min<uint64_t>(units_ns / tick_ns + 3, 2000));
}

// Ticks at whose beginning a step is still to be made.
size_t active_ticks(const Reference& reference, uint32_t tick_ns, size_t ticks) {
  size_t active = 0;
  while (active < ticks && reference.delay_at(uint64_t{active} * tick_ns) != 0) ++active;
  return active;
}

int64_t sum(const std::vector<int>& values) {
  int64_t total = 0;
  for (const int value : values) total += value;
  return total;
}

// A short, readable table: 5 4 3 | 3 | 2 3 6, with the sides unequal.
const Law kSmall{{5, 4, 3}, {6, 3, 2}, 3, 1000};

TEST(Run, FollowsTheRuleOnAMoveComputedByHand) {
  const TestTable table(kSmall, false);
  bushd_run run;
  bushd_run_start(&run, table.view(), 5, 1, 0);
  // Delays max(A(j-1), D(5-j), 3) = 5 4 3 3 6; steps at 5, 9, 12, 15, 21 us; ticks of 4 us.
  EXPECT_EQ(expand(&run, Format::kCoarse, 4000, 7).displacements,
            (std::vector<int>{0, 256, 512, 256, 0, 256, 0}));
}

TEST(Run, ShortMoveNeverReachesCruise) {
  const Law law{{50, 40, 30, 20, 10}, {50, 40, 30, 20, 10}, 10, 1000};
  const TestTable table(law, true);
  bushd_run run;
  bushd_run_start(&run, table.view(), 4, 1, 0);
  EXPECT_EQ(bushd_run_units_left(&run), 50u + 40u + 40u + 50u);
}

TEST(Run, OfNoStepsIsDone) {
  const TestTable table(kSmall, true);
  bushd_run run;
  bushd_run_start(&run, table.view(), 0, 1, 0);
  EXPECT_TRUE(bushd_run_done(&run));
  EXPECT_EQ(bushd_run_delay(&run), 0);
  uint8_t out[3] = {1, 1, 1};
  EXPECT_EQ(bushd_run_expand_coarse(&run, 4000, 3, out, 1), 0u);
  EXPECT_EQ(out[0] + out[1] + out[2], 0);
}

TEST(Run, OfTheMostStepsStartsInstantly) {
  const TestTable table(kSmall, true);
  bushd_run run;
  bushd_run_start(&run, table.view(), UINT32_MAX, 1, 0);
  EXPECT_EQ(bushd_run_steps_left(&run), UINT32_MAX);
  EXPECT_EQ(expand(&run, Format::kCoarse, 4000, 3).displacements, (std::vector<int>{0, 256, 512}));
}

TEST(Run, IdleTicksAfterTheEndAreZeroBytesInBothDirections) {
  const TestTable table(kSmall, true);
  for (const int direction : {1, -1}) {
    bushd_run run;
    bushd_run_start(&run, table.view(), 1, direction, 0);
    uint8_t out[4];
    EXPECT_EQ(bushd_run_expand_coarse(&run, 4000, 4, out, 1), 2u);
    EXPECT_EQ(out[2], 0);
    EXPECT_EQ(out[3], 0);
  }
}

void check_move(const TestTable& table, Format format) {
  const auto steps = between<uint32_t>(0, 300);
  const int direction = *rc::gen::element(1, -1);
  const uint32_t tick_ns = any_tick_ns(table.law());
  const Reference reference = Reference::move(table.law(), steps);
  const size_t ticks = ticks_to_compare(reference, tick_ns);
  RC_LOG() << "steps " << steps << " tick " << tick_ns << " ticks " << ticks << '\n';
  bushd_run run;
  bushd_run_start(&run, table.view(), steps, direction, 0);
  const auto got = expand(&run, format, tick_ns, ticks, true);
  RC_ASSERT(got.displacements == expected(reference, format, tick_ns, 0, ticks, direction));
  RC_ASSERT(got.active == active_ticks(reference, tick_ns, ticks));
  const uint64_t now = uint64_t{ticks} * tick_ns;
  RC_ASSERT(run.steps_done == reference.steps_at(now));
  RC_ASSERT(bushd_run_steps_left(&run) == steps - run.steps_done);
  if (bushd_run_done(&run)) RC_ASSERT(sum(got.displacements) == int64_t{steps} * 256 * direction);
}

TEST(Run, CoarseTicksAgreeWithTheDefinition) {
  holds("coarse, walked", [] { check_move(TestTable(any_law(), false), Format::kCoarse); });
  holds("coarse, indexed", [] { check_move(TestTable(any_law(), true), Format::kCoarse); });
}

TEST(Run, FineTicksAgreeWithTheDefinition) {
  holds("fine, walked", [] { check_move(TestTable(any_law(), false), Format::kFine); });
  holds("fine, indexed", [] { check_move(TestTable(any_law(), true), Format::kFine); });
}

TEST(Run, MayBeginInTheMiddleOfItsFirstTick) {
  holds("begins late, to the ns", [] {
    const TestTable table(any_law(), *rc::gen::arbitrary<bool>());
    const Format format = *rc::gen::element(Format::kCoarse, Format::kFine);
    const auto steps = between<uint32_t>(1, 300);
    const uint32_t tick_ns = any_tick_ns(table.law());
    const auto late_ns = between<uint32_t>(0, tick_ns - 1);
    Reference reference = Reference::move(table.law(), steps);
    reference.begin_late(late_ns);
    const size_t ticks = ticks_to_compare(reference, tick_ns);
    RC_LOG() << "steps " << steps << " tick " << tick_ns << " late " << late_ns << '\n';
    bushd_run run;
    bushd_run_start(&run, table.view(), steps, -1, 0);
    bushd_run_begin_late(&run, late_ns);
    RC_ASSERT(bushd_run_units_left(&run) == reference.units_left_at(0));
    const auto got = expand(&run, format, tick_ns, ticks, true);
    RC_ASSERT(got.displacements == expected(reference, format, tick_ns, 0, ticks, -1));
    RC_ASSERT(run.steps_done == reference.steps_at(uint64_t{ticks} * tick_ns));
  });
}

// Realistic tables are long and take many ticks: block by block through every part.
TEST(Run, LongMovesAgreeWithTheDefinitionTickByTick) {
  Law law;
  for (uint16_t i = 0; i < 238; ++i) law.accel.push_back(static_cast<uint16_t>(250 - i));
  law.accel.push_back(10);
  law.decel = law.accel;
  law.cruise = 10;
  law.unit_ns = 40000;
  for (const bool indexed : {false, true}) {
    const TestTable table(law, indexed);
    for (const uint32_t steps : {1u, 2u, 237u, 475u, 476u, 477u, 478u, 479u, 5000u}) {
      for (const Format format : {Format::kCoarse, Format::kFine}) {
        const Reference reference = Reference::move(law, steps);
        const size_t ticks = ticks_to_compare(reference, 2'560'000);
        bushd_run run;
        bushd_run_start(&run, table.view(), steps, -1, 0);
        ASSERT_EQ(expand(&run, format, 2'560'000, ticks).displacements,
                  expected(reference, format, 2'560'000, 0, ticks, -1))
            << steps << " steps";
        EXPECT_TRUE(bushd_run_done(&run));
      }
    }
  }
}

TEST(Run, TellsDelayAndTimeLeftAtEveryTick) {
  holds("delay and units_left == definition", [] {
    const TestTable table(any_law(), *rc::gen::arbitrary<bool>());
    const auto steps = between<uint32_t>(0, 100);
    const uint32_t tick_ns = any_tick_ns(table.law());
    const Format format = *rc::gen::element(Format::kCoarse, Format::kFine);
    const Reference reference = Reference::move(table.law(), steps);
    const size_t ticks = std::min<size_t>(ticks_to_compare(reference, tick_ns), 200);
    bushd_run run;
    bushd_run_start(&run, table.view(), steps, 1, 0);
    for (size_t n = 0; n <= ticks; ++n) {
      const uint64_t now = uint64_t{n} * tick_ns;
      RC_ASSERT(bushd_run_delay(&run) == reference.delay_at(now));
      RC_ASSERT(bushd_run_units_left(&run) == reference.units_left_at(now));
      expand(&run, format, tick_ns, 1);
    }
  });
}

TEST(Run, RampsDownFromAnyTick) {
  holds("ramp-down == definition", [] {
    const TestTable table(any_law(), *rc::gen::arbitrary<bool>());
    const auto steps = between<uint32_t>(0, 200);
    const int direction = *rc::gen::element(1, -1);
    const uint32_t tick_ns = any_tick_ns(table.law());
    const Format format = *rc::gen::element(Format::kCoarse, Format::kFine);
    Reference reference = Reference::move(table.law(), steps);
    const size_t all = ticks_to_compare(reference, tick_ns);
    // Once or twice: a ramp-down may itself be asked to ramp down.
    size_t at = between<size_t>(0, all);
    bushd_run run;
    bushd_run_start(&run, table.view(), steps, direction, 0);
    auto got = expand(&run, format, tick_ns, at, true);
    auto want = expected(reference, format, tick_ns, 0, at, direction);
    for (int again = between(0, 1); again >= 0; --again) {
      const uint32_t before = bushd_run_steps_left(&run);
      bushd_run_ramp_down(&run);
      RC_ASSERT(bushd_run_steps_left(&run) <= before);
      const uint64_t left = bushd_run_units_left(&run);
      reference.ramp_down_at(uint64_t{at} * tick_ns);
      RC_ASSERT(left == reference.units_left_at(uint64_t{at} * tick_ns));
      const size_t more =
          again > 0 ? between<size_t>(0, 20) : ticks_to_compare(reference, tick_ns) + 1;
      got.append(expand(&run, format, tick_ns, more, true));
      for (const int d : expected(reference, format, tick_ns, at, more, direction))
        want.push_back(d);
      at += more;
    }
    RC_ASSERT(got.displacements == want);
    RC_ASSERT(got.active == active_ticks(reference, tick_ns, at));
    RC_ASSERT(run.steps_done == reference.steps_at(uint64_t{at} * tick_ns));
    if (bushd_run_done(&run)) {
      RC_ASSERT(sum(got.displacements) ==
                static_cast<int64_t>(reference.steps()) * 256 * direction);
    }
  });
}

TEST(Run, RampDownBeforeTheFirstTickMakesTheFirstStepOnly) {
  const Law law{{50, 40, 30}, {50, 40, 30}, 30, 1000};
  const TestTable table(law, true);
  bushd_run run;
  bushd_run_start(&run, table.view(), 100, 1, 0);
  bushd_run_ramp_down(&run);
  EXPECT_EQ(bushd_run_steps_left(&run), 1u);  // D(0) = 50 <= 50: no step more is needed
}

// Codes of 10, 3, 1, 0.5 and 0.4 s: the last two are waited for.
TEST(Run, RampDownWaitsForNoStepThatIsFarAway) {
  const Law law{{10000, 3000, 1000, 500, 400}, {10000, 3000, 1000, 500, 400}, 400, 1'000'000};
  const TestTable table(law, true);
  struct Case {
    uint16_t delay;
    uint32_t since;  // ms of it are over
    uint32_t steps;  // that are still made
    uint32_t ms;     // until the last of them
  };
  for (const Case& c : {Case{400, 0, 2, 900},
                        {400, 399, 2, 501},
                        {500, 0, 1, 500},
                        {501, 0, 0, 0},
                        {501, 1, 1, 500},
                        {1000, 499, 0, 0},
                        {1000, 500, 1, 500},
                        {10000, 9499, 0, 0},
                        {10000, 9500, 1, 500}}) {
    SCOPED_TRACE(std::to_string(c.delay) + " ms, " + std::to_string(c.since) + " over");
    bushd_run run;
    bushd_run_start(&run, table.view(), 1000, 1, c.delay);
    while (bushd_run_delay(&run) != c.delay || run.accel_at != run.accel_end)
      bushd_run_take_step(&run);
    expand(&run, Format::kFine, 1'000'000, c.since);
    bushd_run_ramp_down(&run);
    EXPECT_EQ(bushd_run_steps_left(&run), c.steps);
    EXPECT_EQ(bushd_run_units_left(&run), c.ms);
  }
  // On the way down from cruise: D(3), and not the three slower ones.
  bushd_run run;
  bushd_run_start_ramp_down(&run, table.view(), 400, 0, -1);
  EXPECT_EQ(bushd_run_steps_left(&run), 2u);
  bushd_run_start_ramp_down(&run, table.view(), 399, 0, -1);
  EXPECT_EQ(bushd_run_steps_left(&run), 3u);
  EXPECT_EQ(bushd_run_units_left(&run), 399u + 400u + 500u);
  EXPECT_EQ(sum(expand(&run, Format::kFine, 20'000'000, 1000).displacements), -3 * 256);
}

// More codes are left out than the other side has: nothing is read beyond it (seen by ASan).
TEST(Run, LeavesOutMoreStepsThanTheAcceleratingSideHas) {
  const Law law{{500}, {10000, 3000, 1000, 600, 500}, 400, 1'000'000};
  const TestTable table(law, true);
  bushd_run run;
  bushd_run_start_ramp_down(&run, table.view(), 400, 0, 1);
  EXPECT_EQ(bushd_run_steps_left(&run), 2u);
  EXPECT_EQ(bushd_run_units_left(&run), 400u + 500u);
}

TEST(Run, TakesOverInTheMiddleOfAStep) {
  holds("taken over == definition", [] {
    const TestTable table(any_law(), *rc::gen::arbitrary<bool>());
    // A delay that a run of this table can have: not below cruise.
    const uint64_t delay =
        std::max<uint64_t>(table.law().cruise, any_long_shortest_delay(table.law()));
    const auto fraction = *rc::gen::arbitrary<uint8_t>();
    const int direction = *rc::gen::element(1, -1);
    const uint32_t tick_ns = any_tick_ns(table.law());
    const Format format = *rc::gen::element(Format::kCoarse, Format::kFine);
    const Reference reference = Reference::ramp_down(table.law(), delay, fraction);
    const size_t ticks = ticks_to_compare(reference, tick_ns);
    bushd_run run;
    bushd_run_start_ramp_down(&run, table.view(), delay, fraction, direction);
    RC_ASSERT(bushd_run_units_left(&run) == reference.units_left_at(0));
    const auto got = expand(&run, format, tick_ns, ticks, true);
    RC_ASSERT(got.displacements == expected(reference, format, tick_ns, 0, ticks, direction,
                                            format == Format::kFine ? fraction : 0));
    if (reference.steps() != 0) {
      for (const int d : got.displacements) RC_ASSERT(d * direction >= 0);
    }
    if (bushd_run_done(&run) && format == Format::kFine) {
      RC_ASSERT(sum(got.displacements) ==
                (static_cast<int64_t>(reference.steps()) * 256 - fraction) * direction);
    }
  });
}

// What an MCU makes of (delay, fraction) when its queue ends must be the steps that the daemon's
// own ramp-down of the same run makes, at most one unit of 1/256 step apart in time.
TEST(Run, TakeOverMakesAsManyStepsAsTheRunItselfRampingDown) {
  holds("take-over and ramp-down end at the same step", [] {
    const TestTable table(any_law(), true);
    const uint32_t tick_ns = any_tick_ns(table.law());
    bushd_run run;
    bushd_run_start(&run, table.view(), between<uint32_t>(1, 200), 1, 0);
    expand(&run, Format::kFine, tick_ns, between<size_t>(0, 60));
    RC_PRE(!bushd_run_done(&run));
    // A step that is half a second away is not made: a fraction tells that to 1/256 of a step.
    const int64_t unit_ns = table.view()->time_unit_ns;
    const auto step_ns = static_cast<int64_t>(bushd_run_delay(&run)) * unit_ns;
    const int64_t gone_ns = static_cast<int64_t>(run.since) * unit_ns + run.since_ns;
    RC_PRE(std::abs(step_ns - gone_ns - int64_t{BUSHD_RUN_WAITS_NS}) > step_ns / 256);
    bushd_run taken;
    bushd_run_start_ramp_down(&taken, table.view(), bushd_run_delay(&run), run.fraction, 1);
    bushd_run_ramp_down(&run);
    RC_ASSERT(bushd_run_steps_left(&taken) == bushd_run_steps_left(&run));
    RC_ASSERT(bushd_run_units_left(&taken) >= bushd_run_units_left(&run));
  });
}

TEST(Run, TakeOverAtRestIsDone) {
  const TestTable table(kSmall, true);
  bushd_run run;
  bushd_run_start_ramp_down(&run, table.view(), 0, 0, 1);
  EXPECT_TRUE(bushd_run_done(&run));
}

TEST(Run, ACopyReplaysTheSameTicks) {
  holds("copy == original", [] {
    const TestTable table(any_law(), *rc::gen::arbitrary<bool>());
    const uint32_t tick_ns = any_tick_ns(table.law());
    const Format format = *rc::gen::element(Format::kCoarse, Format::kFine);
    bushd_run run;
    bushd_run_start(&run, table.view(), between<uint32_t>(0, 200), 1, 0);
    expand(&run, format, tick_ns, between<size_t>(0, 60));
    bushd_run copy = run;
    const auto first = expand(&run, format, tick_ns, 60).displacements;
    RC_ASSERT(expand(&copy, format, tick_ns, 60).displacements == first);
  });
}

}  // namespace
}  // namespace bushd::test::run_test
