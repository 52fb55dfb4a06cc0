// The run that an axis gives out for some ticks makes the ticks that it renders, also when an MCU
// takes it up from its state on the wire.
#include <gtest/gtest.h>

#include "engine/run_state.h"
#include "engine/tables.h"
#include "motion/axis.h"

namespace bushd::motion {
namespace {

using test::between;

class AxisRun : public testing::TestWithParam<bushd_format> {
 protected:
  std::vector<std::int16_t> expanded(bushd_run* run, std::uint32_t tick_ns, unsigned ticks) const {
    std::vector<std::int16_t> out(ticks);
    if (GetParam() == BUSHD_FORMAT_FINE) {
      bushd_run_expand_fine(run, tick_ns, ticks, out.data(), 1);
    } else {
      std::vector<std::uint8_t> bytes(ticks);
      bushd_run_expand_coarse(run, tick_ns, ticks, bytes.data(), 1);
      out.assign(bytes.begin(), bytes.end());
    }
    return out;
  }
};
INSTANTIATE_TEST_SUITE_P(Formats, AxisRun, testing::Values(BUSHD_FORMAT_FINE, BUSHD_FORMAT_COARSE),
                         [](const auto& p) {
                           return p.param == BUSHD_FORMAT_FINE ? "Fine" : "Coarse";
                         });

TEST_P(AxisRun, MakesTheTicksThatAreRendered) {
  test::holds("for any table, tick and changes", [&] {
    const test::TestTable table(test::any_law(), between(0, 1) != 0);
    const std::uint32_t tick_ns = test::any_tick_ns(table.law());
    Axis axis(*table.view(), tick_ns, GetParam());
    const auto steps = between<std::int64_t>(-80, 80);
    RC_PRE(steps != 0);
    RC_PRE(axis.duration_ticks(steps) < 3000);
    axis.start(-3, steps, 100);
    std::int64_t counted_fine = 0;
    std::int64_t position = -3;
    Tick now = 90;
    while (now < axis.end_tick()) {
      if (between(0, 3) == 0) {
        if (between(0, 1) == 0) {
          axis.stop();
        } else {
          axis.aim(between<std::int64_t>(-90, 90));
        }
      }
      if (axis.needs_change()) axis.change(now + between<Tick>(1, 12));
      const Tick first = now + between<Tick>(0, 30);
      const auto most = between(1u, 60u);
      const auto segment = axis.run_at(first, most);
      const bool runs = first >= 100 && first < axis.end_tick();
      const auto plan = axis.plan_at(first);
      // What comes to rest in the middle of a step, or before its slowest ones, is no state.
      RC_ASSERT(segment.has_value() == (runs && plan && bushd_run_has_state(&*plan)));
      if (segment) {
        RC_ASSERT(segment->ticks >= 1 && segment->ticks <= most);
        std::vector<std::int16_t> rendered(segment->ticks);
        const auto delay = axis.render(first, segment->ticks, rendered.data(), 1);
        bushd_run run = segment->run;
        RC_ASSERT(expanded(&run, tick_ns, segment->ticks) == rendered);
        // At a change the step that runs goes on, so its delay is the same before and after.
        RC_ASSERT(bushd_run_delay(&run) == delay);
        const auto state =
            bushd_run_save(&segment->run, tick_ns, static_cast<std::uint16_t>(segment->ticks));
        bushd_run there;
        RC_ASSERT(bushd_run_restore(&there, table.view(), &state));
        RC_ASSERT(expanded(&there, tick_ns, segment->ticks) == rendered);
      }
      // The steps that are over are those of the ticks that are over.
      for (const Tick until = now + between<Tick>(0, 20); now < until; ++now) {
        std::int16_t d = 0;
        axis.render(now, 1, &d, 1);
        if (GetParam() == BUSHD_FORMAT_COARSE) {
          position += (d & 0x80) != 0 ? d & 0x7F : -d;
        } else {
          counted_fine += d;
        }
        axis.executed(now + 1);
      }
      if (GetParam() == BUSHD_FORMAT_FINE) {
        position = -3 + counted_fine / 256;  // towards the beginning: a step begun is none
      }
      RC_ASSERT(axis.executed_steps() == position);
    }
  });
}

TEST_P(AxisRun, NothingAtRest) {
  test::Law law;
  law.accel = law.decel = {250, 100, 20};
  law.cruise = 10;
  law.unit_ns = 40'000;
  const test::TestTable table(law, true);
  Axis axis(*table.view(), 2'560'000, GetParam());
  EXPECT_FALSE(axis.run_at(0, 10));
  axis.start(0, 50, 100);
  EXPECT_FALSE(axis.run_at(99, 10));
  EXPECT_TRUE(axis.run_at(100, 10));
  EXPECT_FALSE(axis.run_at(axis.end_tick(), 10));
  axis.stop();
  ASSERT_TRUE(axis.change(100));
  EXPECT_FALSE(axis.run_at(100, 10)) << "cancelled";
  EXPECT_EQ(axis.executed_steps(), 0);
}

}  // namespace
}  // namespace bushd::motion
