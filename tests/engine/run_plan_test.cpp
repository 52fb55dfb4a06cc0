#include "engine/run_plan.h"

#include <cstdint>
#include <vector>

#include "engine/tables.h"

namespace bushd::test::run_plan_test {
namespace {

// The delays that the run still makes, taken one after the other.
std::vector<uint16_t> delays_left(bushd_run run) {
  std::vector<uint16_t> delays;
  while (!bushd_run_done(&run)) {
    const uint32_t before = run.steps_done;
    const auto delay = static_cast<uint16_t>(bushd_run_delay(&run));
    // Up to its end, and not a ns more.
    const uint32_t unit_ns = run.table->time_unit_ns;
    const uint64_t ns = uint64_t{delay - run.since} * unit_ns - run.since_ns;
    uint8_t unused = 0;
    bushd_run_expand_coarse(&run, static_cast<uint32_t>(ns), 1, &unused, 1);
    if (run.steps_done != before + 1) {
      ADD_FAILURE() << run.steps_done - before << " steps in the time of one";
      break;
    }
    delays.push_back(delay);
  }
  return delays;
}

// A run in any of its parts: speeding up, at cruise, braking, or ramping down.
bushd_run any_run(const TestTable& table) {
  bushd_run run;
  const auto steps = between<uint32_t>(1, 120);
  bushd_run_start(&run, table.view(), steps, 1, any_shortest_delay(table.law()));
  const auto advance = [&run](uint32_t most) {
    for (auto n = between<uint32_t>(0, most); n > 0 && !bushd_run_done(&run); --n) {
      const uint64_t unit_ns = run.table->time_unit_ns;
      const uint64_t ns = uint64_t{bushd_run_delay(&run) - run.since} * unit_ns - run.since_ns;
      uint8_t unused = 0;
      bushd_run_expand_coarse(&run, static_cast<uint32_t>(ns), 1, &unused, 1);
    }
  };
  advance(steps - 1);
  if (between(0, 1) == 0) {
    bushd_run_retarget(&run, between<uint32_t>(0, 200), any_shortest_delay(table.law()));
    advance(10);
  }
  return run;
}

// The time of a step must fit the 32 bits of a tick.
Law quick_law() {
  Law law = any_law();
  law.unit_ns = 1000;
  return law;
}

TEST(RunPlan, TellsTheTimeOfTheLastSteps) {
  holds("the delays of the last steps, added up", [] {
    const TestTable table(quick_law(), between(0, 1) == 0);
    const bushd_run run = any_run(table);
    const std::vector<uint16_t> delays = delays_left(run);
    uint64_t units = 0;
    for (size_t steps = 0; steps <= delays.size(); ++steps) {
      if (steps > 0) units += delays[delays.size() - steps];
      RC_ASSERT(bushd_run_units_of_last(&run, static_cast<uint32_t>(steps)) == units);
    }
  });
}

// Nothing is left out of a ramp-down that is under way.
TEST(RunPlan, RampsDownOnceOnly) {
  holds("a second time changes nothing", [] {
    const TestTable table(quick_law(), false);
    bushd_run run = any_run(table);
    bushd_run_ramp_down_once(&run);
    const std::vector<uint16_t> delays = delays_left(run);
    bushd_run_ramp_down_once(&run);
    RC_ASSERT(delays_left(run) == delays);
    // The running step may be slower than the decelerating side begins.
    for (size_t i = 2; i < delays.size(); ++i) RC_ASSERT(delays[i] >= delays[i - 1]);
  });
}

TEST(RunPlan, RampsDownToTheEndOfTheTableFromWhereItStands) {
  holds("the last delays are those of the decelerating side", [] {
    const TestTable table(quick_law(), false);
    bushd_run run = any_run(table);
    RC_PRE(!bushd_run_done(&run));
    bushd_run_ramp_down_once(&run);
    const std::vector<uint16_t> delays = delays_left(run);
    for (size_t i = 1; i < delays.size(); ++i) {
      RC_ASSERT(Wide{delays[delays.size() - i]} == table.law().decel_at(i - 1));
    }
  });
}

TEST(RunPlan, IsSlowByItsShortestDelayAndTheTick) {
  const TestTable table({{300, 28}, {400, 29}, 27, 10'000}, false);
  const TestTable fast({{300, 28}, {400, 29}, 26, 10'000}, false);
  const auto is_slow = [](const TestTable& of, uint16_t shortest_delay, uint32_t tick_ns) {
    return bushd_run_is_slow(of.view(), shortest_delay, tick_ns, BUSHD_SLOW_LINE_DELAY_NS);
  };
  EXPECT_TRUE(is_slow(table, 0, 2'400'000));
  EXPECT_FALSE(is_slow(table, 0, 2'399'999));
  EXPECT_FALSE(is_slow(fast, 0, 20'000'000));
  EXPECT_FALSE(is_slow(fast, 26, 2'560'000));
  EXPECT_TRUE(is_slow(fast, 27, 2'560'000));
  EXPECT_FALSE(bushd_run_is_slow(table.view(), 39, 2'560'000, BUSHD_SHARED_LINE_DELAY_NS));
  EXPECT_TRUE(bushd_run_is_slow(table.view(), 40, 2'560'000, BUSHD_SHARED_LINE_DELAY_NS));
}

}  // namespace
}  // namespace bushd::test::run_plan_test
