// A motor's part of a line's run, step by step and tick by tick, against exact fractions.
#include "heritage/serial_pulse/steps.h"

#include <algorithm>
#include <cstdio>
#include <random>

#include "engine/properties.h"
#include "tables/envelope.h"

namespace bushd::serial_pulse {
namespace {

using test::between;
using test::holds;

__extension__ using Exact = __int128;

// Codes of one side, never rising; kept by the table that points to them.
struct OwnTable {
  std::vector<std::uint16_t> accel;
  std::vector<std::uint16_t> decel;
  bushd_table table{};

  OwnTable() : accel(side()), decel(side()) {
    const std::uint16_t least = std::min(accel.back(), decel.back());
    table.accel.code = accel.data();
    table.accel.count = static_cast<std::uint16_t>(accel.size());
    table.decel.code = decel.data();
    table.decel.count = static_cast<std::uint16_t>(decel.size());
    table.cruise = between<std::uint16_t>(1, least);
    table.time_unit_ns = between<std::uint32_t>(1'000, 100'000);
  }
  OwnTable(const OwnTable&) = delete;
  OwnTable& operator=(const OwnTable&) = delete;

  static std::vector<std::uint16_t> side() {
    std::vector<std::uint16_t> codes(between<std::size_t>(1, 60));
    for (std::uint16_t& code : codes) code = between<std::uint16_t>(5, 2'000);
    std::ranges::sort(codes, std::greater<>());
    return codes;
  }
  // Before step j of n from rest to rest, ns.
  std::int64_t delay_ns(std::uint32_t j, std::uint32_t n) const {
    const auto of = [&](const std::vector<std::uint16_t>& codes, std::uint32_t i) {
      return i < codes.size() ? codes[i] : table.cruise;
    };
    return std::int64_t{std::max({of(accel, j - 1), of(decel, n - j), table.cruise})} *
           table.time_unit_ns;
  }
};

// When step j of a motor with `increment` falls, in ns from the beginning of a run of all of the
// line by this table: exactly, and rounded up.
std::int64_t exact_time_ns(const OwnTable& table, std::uint32_t increment, std::uint32_t longest,
                           std::uint32_t j) {
  // s = ((2 j - 1) L + N) / 2N
  const Exact numerator = Exact{2} * j * longest - longest + increment;
  const Exact denominator = Exact{2} * increment;
  const auto step = static_cast<std::uint32_t>((numerator + denominator - 1) / denominator);
  std::int64_t before_ns = 0;
  for (std::uint32_t k = 1; k < step; ++k) before_ns += table.delay_ns(k, longest);
  const Exact part = numerator - Exact{step - 1} * denominator;
  const Exact part_ns = part * table.delay_ns(step, longest);
  return before_ns + static_cast<std::int64_t>((part_ns + denominator - 1) / denominator);
}

link::MotorPlan plan_of(const bushd_table& table, std::uint32_t increment, std::uint32_t longest) {
  link::MotorPlan plan{.run = {},
                       .line = link::MotorPlan::Line{
                           .increment = increment, .longest = longest, .from = 0, .direction = 1}};
  bushd_run_start(&plan.run, &table, longest, 1, 0);
  return plan;
}

TEST(StepsOnALine, FallWhereTheLawSays) {
  holds("each step at its exact time, rounded up", [] {
    const OwnTable table;
    const auto longest = between<std::uint32_t>(1, 400);
    const auto increment = between<std::uint32_t>(1, longest);
    Steps steps(plan_of(table.table, increment, longest));
    RC_ASSERT(steps.left() == increment);
    std::int64_t at_ns = 0;
    for (std::uint32_t j = 1; j <= increment; ++j) {
      at_ns += static_cast<std::int64_t>(steps.take_ns());
      RC_ASSERT(at_ns == exact_time_ns(table, increment, longest, j));
      RC_ASSERT(steps.time_ns() == at_ns);
    }
    RC_ASSERT(steps.left() == 0u);
    RC_ASSERT(steps.take_ns() == 0u);
  });
}

// At the end of a tick those have been made whose time has come, but for what 1/256 of a step of
// the run hides: never more of them.
TEST(StepsOnALine, TicksAreNotAheadOfThem) {
  holds("made by ticks are made by steps", [] {
    const OwnTable table;
    const auto longest = between<std::uint32_t>(1, 400);
    const auto increment = between<std::uint32_t>(0, longest);
    const auto tick_ns = between<std::uint32_t>(300'000, 5'000'000);
    // The precondition of runs by ticks.
    RC_PRE(std::uint64_t{table.table.cruise} * table.table.time_unit_ns * 100 > tick_ns);
    const link::MotorPlan plan = plan_of(table.table, increment, longest);
    Ticks ticks(plan);
    Steps steps(plan);
    std::vector<std::int64_t> times;
    for (std::int64_t at_ns = 0; steps.left() > 0;) {
      at_ns += static_cast<std::int64_t>(steps.take_ns());
      times.push_back(at_ns);
    }
    std::int64_t now_ns = 0;
    while (!ticks.over()) {
      ticks.pass(tick_ns);
      now_ns += tick_ns;
      const auto due = std::ranges::upper_bound(times, now_ns) - times.begin();
      RC_ASSERT(ticks.made() <= static_cast<std::uint32_t>(due));
      RC_ASSERT(ticks.made() + 1 >= static_cast<std::uint32_t>(due));
    }
    RC_ASSERT(ticks.made() == increment);
  });
}

// Two motors with tables of their own go by the envelope of both, also where the run is made to
// ramp down: neither has two steps closer together than its own table allows.
TEST(StepsOnALine, KeepToTheTableOfEachMotor) {
  holds("no interval is shorter than the motor's table has it", [] {
    const OwnTable own[2];
    const auto longest = between<std::uint32_t>(2, 400);
    const std::uint32_t increments[2] = {longest, between<std::uint32_t>(1, longest)};
    const std::vector<tables::LinePart> parts = {
        {.table = &own[0].table, .increment = increments[0]},
        {.table = &own[1].table, .increment = increments[1]}};
    const tables::Envelope envelope(parts, longest);
    const auto end_at = between<std::uint32_t>(0, longest);  // of the first one's steps
    for (const std::size_t i : {0u, 1u}) {
      const link::MotorPlan plan = plan_of(envelope.view(), increments[i], longest);
      Steps steps(plan);
      const Ticks ticks(plan);
      std::vector<std::int64_t> delays;
      const std::uint64_t before = std::uint64_t{end_at} * increments[i] / longest;
      while (steps.left() > 0) {
        if (before > 0 && delays.size() == before) steps.ramp_down(ticks);
        if (steps.left() == 0) break;
        delays.push_back(static_cast<std::int64_t>(steps.take_ns()));
      }
      const auto n = static_cast<std::uint32_t>(delays.size());
      for (std::uint32_t j = 2; j <= n; ++j) {
        RC_ASSERT(delays[j - 1] >= own[i].delay_ns(j, n));
      }
    }
  });
}

// A motor of few steps may make none between two changes of the run.
TEST(StepsOnALine, TwoChangesBetweenTwoStepsOfAMotor) {
  constexpr std::uint32_t kLongest = 4000;
  constexpr std::uint32_t kIncrement = 4;
  const std::vector<std::uint16_t> codes = {10};
  bushd_table table{};
  table.accel.code = table.decel.code = codes.data();
  table.accel.count = table.decel.count = 1;
  table.cruise = 10;
  table.time_unit_ns = 40'000;
  const link::MotorPlan plan = plan_of(table, kIncrement, kLongest);
  Steps steps(plan);
  std::vector<std::int64_t> made_ns;
  made_ns.push_back(static_cast<std::int64_t>(steps.take_ns()));
  // The run by itself, with its shortest delay changed where it has made so many steps.
  std::vector<std::int64_t> ends_ns = {0};
  bushd_run run = plan.run;
  for (const auto& [at, shortest_delay] :
       {std::pair<std::uint32_t, std::uint16_t>{604, 100}, {1400, 50}}) {
    while (run.steps_done < at) {
      ends_ns.push_back(ends_ns.back() +
                        static_cast<std::int64_t>(bushd_run_take_step(&run)) * table.time_unit_ns);
    }
    ASSERT_TRUE(bushd_run_retarget(&run, bushd_run_steps_left(&run) - 1, shortest_delay));
    steps.become(run);
  }
  while (bushd_run_steps_left(&run) > 0) {
    ends_ns.push_back(ends_ns.back() +
                      static_cast<std::int64_t>(bushd_run_take_step(&run)) * table.time_unit_ns);
  }
  while (steps.left() > 0) {
    made_ns.push_back(made_ns.back() + static_cast<std::int64_t>(steps.take_ns()));
  }
  ASSERT_EQ(made_ns.size(), kIncrement);
  for (std::size_t j = 0; j < kIncrement; ++j) {
    // Half of the run's step behind 500, 1500, 2500, 3500.
    const std::size_t before = 500 + 1000 * j;
    EXPECT_EQ(made_ns[j], (ends_ns[before] + ends_ns[before + 1]) / 2) << j;
  }
}

}  // namespace
}  // namespace bushd::serial_pulse
