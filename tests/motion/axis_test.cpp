// An axis asked in any way gives the same ticks: those of the formula (tests/engine/reference.h),
// which also says where a stopped motor ends and when.
#include "motion/axis.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>

#include "engine/tables.h"
#include "motion/ramp.h"

namespace bushd::motion {
namespace {

using test::kTickNs;
using test::Law;
using test::ramp;
using test::Reference;

// What the ticks of a reference are in the format's code; `ticks` of them, zeros after the end.
std::vector<std::int16_t> ticks_of(const Reference& reference, int direction, std::uint32_t tick_ns,
                                   bushd_format format, std::size_t ticks) {
  const bool fine = format == BUSHD_FORMAT_FINE;
  std::vector<std::int16_t> out;
  std::int64_t before = 0;
  bool over = reference.steps() == 0;
  for (std::uint64_t t = 1; t <= ticks; ++t) {
    const auto made = static_cast<std::int64_t>(reference.steps_at(t * tick_ns));
    const std::int64_t now = fine ? reference.position_at(t * tick_ns) : made;
    const std::int64_t d = now - before;
    if (fine) {
      out.push_back(static_cast<std::int16_t>(d * direction));
    } else {
      out.push_back(static_cast<std::int16_t>(over || direction < 0 ? d : d | 0x80));
    }
    over = made == static_cast<std::int64_t>(reference.steps());
    before = now;
  }
  return out;
}

// The first tick after the last step, counted from the start.
Tick ticks_until_rest(const Reference& reference, std::uint32_t tick_ns) {
  Tick ticks = 0;
  while (reference.steps_at(static_cast<std::uint64_t>(ticks) * tick_ns) < reference.steps())
    ++ticks;
  // One that rests in the middle of a step has to be told so for a tick.
  const auto rest_ns = reference.rest_ns();
  return rest_ns ? std::max(ticks, static_cast<Tick>(*rest_ns / tick_ns) + 1) : ticks;
}

std::vector<std::int16_t> render(Axis& axis, Tick first, unsigned count) {
  std::vector<std::int16_t> out(count);
  axis.render(first, count, out.data(), 1);
  return out;
}

void ramp_down(Axis& axis, Tick at) {
  axis.stop();
  axis.change(at);
}

class AxisTest : public testing::TestWithParam<bushd_format> {
 protected:
  const bushd_format format = GetParam();
  const test::TestTable table{ramp(), true};
  Axis axis{*table.view(), kTickNs, format};
};
INSTANTIATE_TEST_SUITE_P(Formats, AxisTest, testing::Values(BUSHD_FORMAT_FINE, BUSHD_FORMAT_COARSE),
                         [](const auto& p) {
                           return p.param == BUSHD_FORMAT_FINE ? "Fine" : "Coarse";
                         });

TEST_P(AxisTest, AnySplitGivesTheTicksOfTheFormula) {
  for (const std::int64_t steps : {1, -2, 35, -36, 200}) {
    const auto reference = Reference::move(table.law(), static_cast<std::size_t>(std::abs(steps)));
    const Tick length = ticks_until_rest(reference, kTickNs);
    const auto total = static_cast<std::size_t>(length) + 40;
    const auto whole = ticks_of(reference, steps < 0 ? -1 : 1, kTickNs, format, total);
    for (unsigned split = 1; split < 90; split += split < 20 ? 1 : 13) {
      axis.start(0, steps, 1000);
      std::vector<std::int16_t> seen;
      // Ticks before the start are rest.
      for (const std::int16_t d : render(axis, 1000 - static_cast<Tick>(split), split))
        ASSERT_EQ(d, 0);
      while (seen.size() < total) {
        std::vector<std::int16_t> part(split * 3, 0x7777);
        const Tick first = 1000 + static_cast<Tick>(seen.size());
        const std::uint16_t delay = axis.render(first, split, part.data(), 3);
        const auto end_ns = (seen.size() + split) * std::uint64_t{kTickNs};
        ASSERT_EQ(delay, reference.delay_at(end_ns)) << "split " << split;
        for (unsigned i = 0; i < split; ++i) {
          seen.push_back(part[3 * i]);
          ASSERT_EQ(part[3 * i + 1], 0x7777) << "only its own column";
        }
      }
      seen.resize(total);
      ASSERT_EQ(seen, whole) << steps << " split " << split;
      axis.finish();
    }
  }
}

TEST_P(AxisTest, MayBeginInTheMiddleOfItsStartTick) {
  for (const std::uint32_t late_ns : {1u, 1'234'567u, kTickNs - 1}) {
    for (const Tick stop_at : {0, 1, 2, 9, 1000}) {
      auto reference = Reference::move(table.law(), 150);
      reference.begin_late(late_ns);
      axis.start(500, 150, 1000, late_ns);
      EXPECT_EQ(axis.end_tick(), 1000 + ticks_until_rest(reference, kTickNs));
      EXPECT_FALSE(axis.run_at(1000, 50)) << "no state that could be told";
      EXPECT_TRUE(axis.run_at(1001, 50));
      if (stop_at == 0) {
        ramp_down(axis, 1000);
        EXPECT_EQ(axis.end_tick(), 1000);
        axis.finish();
        continue;
      }
      if (stop_at < ticks_until_rest(reference, kTickNs)) {
        reference.ramp_down_at(static_cast<std::uint64_t>(stop_at) * kTickNs);
        ramp_down(axis, 1000 + stop_at);
      }
      EXPECT_EQ(axis.end_tick(), 1000 + ticks_until_rest(reference, kTickNs));
      EXPECT_EQ(axis.planned_end_steps(), 500 + static_cast<std::int64_t>(reference.steps()));
      EXPECT_EQ(render(axis, 1000, 200), ticks_of(reference, 1, kTickNs, format, 200));
      axis.executed(1003);
      EXPECT_EQ(axis.executed_steps(),
                500 + static_cast<std::int64_t>(reference.steps_at(3u * kTickNs)));
      axis.finish();
    }
  }
}

TEST_P(AxisTest, EarlierTicksCanBeAskedForAgain) {
  const auto reference = Reference::move(table.law(), 150);
  const auto whole = ticks_of(reference, -1, kTickNs, format, 300);
  test::holds("any order of asking, with executed ticks", [&] {
    axis.start(7, -150, 500);
    Tick executed = 480;
    for (int i = 0; i < 60; ++i) {
      if (test::between(0, 5) == 0) {
        executed = std::min<Tick>(executed + test::between(0, 20), 700);
        axis.executed(executed);
      }
      const Tick first = executed + test::between(0, 80);
      const auto count = test::between(1u, 40u);
      const auto part = render(axis, first, count);
      for (unsigned k = 0; k < count; ++k) {
        const Tick at = first + static_cast<Tick>(k) - 500;
        // After the end the coarse byte is 0 whatever the direction.
        const int expected = at < 0 || at >= 300 ? 0 : whole[static_cast<std::size_t>(at)];
        RC_ASSERT(part[k] == expected);
      }
    }
    axis.finish();
  });
}

TEST_P(AxisTest, EndAndTargetAreThoseOfTheFormula) {
  for (std::int64_t steps = 1; steps < 150; ++steps) {
    const auto reference = Reference::move(table.law(), static_cast<std::size_t>(steps));
    axis.start(-1000, steps % 2 ? steps : -steps, 70);
    EXPECT_EQ(axis.end_tick(), 70 + ticks_until_rest(reference, kTickNs)) << steps;
    EXPECT_EQ(axis.planned_end_steps(), -1000 + (steps % 2 ? steps : -steps));
    EXPECT_EQ(axis.target_steps(), axis.planned_end_steps());
    EXPECT_FALSE(axis.stopping());
    axis.executed(100);
    EXPECT_EQ(axis.end_tick(), 70 + ticks_until_rest(reference, kTickNs)) << "whatever is over";
    axis.finish();
  }
}

// A step exactly at a tick's end belongs to that tick, and the end follows.
TEST_P(AxisTest, EndOnATickBorder) {
  Law law;
  law.accel = law.decel = {64};
  law.cruise = 64;
  law.unit_ns = 40'000;  // one step a tick
  const test::TestTable even(law, false);
  Axis exact(*even.view(), kTickNs, format);
  exact.start(0, 5, 10);
  EXPECT_EQ(exact.end_tick(), 15);
  for (Tick at = 11; at <= 15; ++at) {
    exact.executed(at);
    EXPECT_EQ(exact.end_tick(), 15) << at;
  }
}

// Where a stop at `at` leads, from the formula alone.
Reference stopped_move(const Law& law, std::int64_t steps, Tick at) {
  auto reference = Reference::move(law, static_cast<std::size_t>(std::abs(steps)));
  reference.ramp_down_at(static_cast<std::uint64_t>(at) * kTickNs);
  return reference;
}

TEST_P(AxisTest, RampDownAtEveryTickOfShortAndLongMoves) {
  for (const std::int64_t steps : {1, 2, -9, 34, -60, 240}) {
    const int direction = steps < 0 ? -1 : 1;
    const Tick length = ticks_until_rest(
        Reference::move(table.law(), static_cast<std::size_t>(std::abs(steps))), kTickNs);
    for (Tick at = 1; at <= length + 2; ++at) {
      // What is executed by the time of the wish must not matter, nor what was asked for before.
      for (const Tick executed : {Tick{0}, at / 2, at}) {
        axis.start(50, steps, 3000);
        render(axis, 3000, 30);
        axis.executed(3000 + executed);
        ramp_down(axis, 3000 + at);
        const Reference reference = stopped_move(table.law(), steps, at);
        ASSERT_EQ(axis.planned_end_steps(),
                  50 + direction * static_cast<std::int64_t>(reference.steps()))
            << steps << " at " << at;
        ASSERT_EQ(axis.target_steps(), 50 + steps);
        ASSERT_EQ(axis.end_tick(), 3000 + ticks_until_rest(reference, kTickNs));
        const auto count = static_cast<std::size_t>(length) + 30;
        auto expected = ticks_of(reference, direction, kTickNs, format, count);
        expected.erase(expected.begin(), expected.begin() + executed);
        ASSERT_EQ(render(axis, 3000 + executed, static_cast<unsigned>(expected.size())), expected)
            << steps << " at " << at << " executed " << executed;
        axis.finish();
      }
    }
  }
}

TEST_P(AxisTest, LaterStopForgetsTheEarlierOne) {
  for (Tick first = 1; first < 150; first += 7) {
    for (const Tick later : {first + 1, first + 10, first + 60}) {
      axis.start(0, 240, 0);
      ramp_down(axis, first);
      render(axis, 0, static_cast<unsigned>(first) + 5);
      axis.executed(first);  // up to the stop, which has not yet been
      ramp_down(axis, later);
      const Reference reference = stopped_move(table.law(), 240, later);
      EXPECT_EQ(axis.planned_end_steps(), static_cast<std::int64_t>(reference.steps()));
      auto expected = ticks_of(reference, 1, kTickNs, format, 400);
      expected.erase(expected.begin(), expected.begin() + first);
      ASSERT_EQ(render(axis, first, 400 - static_cast<unsigned>(first)), expected)
          << first << ' ' << later;
      axis.finish();
    }
  }
}

TEST_P(AxisTest, StopAtOrBeforeTheStartMakesNoStep) {
  for (const Tick at : {100, 99, 50}) {
    axis.start(5, 300, 100);
    render(axis, 90, 40);
    ramp_down(axis, at);
    EXPECT_EQ(axis.planned_end_steps(), 5);
    EXPECT_EQ(axis.target_steps(), 305);
    EXPECT_EQ(axis.end_tick(), 100);
    EXPECT_EQ(axis.velocity_steps_per_s(), 0);
    std::vector<std::int16_t> out(60, 1);
    EXPECT_EQ(axis.render(90, 60, out.data(), 1), 0) << "at rest for good";
    EXPECT_EQ(out, std::vector<std::int16_t>(60, 0));
    axis.finish();
  }
}

TEST_P(AxisTest, StopOneTickAfterTheStartMakesTheFirstStepOnly) {
  axis.start(5, 300, 100);
  ramp_down(axis, 101);
  EXPECT_EQ(axis.planned_end_steps(),
            5 + static_cast<std::int64_t>(stopped_move(table.law(), 300, 1).steps()));
  EXPECT_GE(axis.planned_end_steps(), 6);
}

TEST_P(AxisTest, ExecutedThenRenderGoesOnWhereItWas) {
  const auto whole = ticks_of(Reference::move(table.law(), 100), 1, kTickNs, format, 300);
  for (Tick executed = 0; executed < 250; executed += 9) {
    axis.start(0, 100, 0);
    axis.executed(executed);
    axis.executed(executed / 2);  // an old report changes nothing
    EXPECT_EQ(render(axis, executed, 40),
              std::vector<std::int16_t>(whole.begin() + executed, whole.begin() + executed + 40));
    axis.finish();
  }
}

TEST_P(AxisTest, VelocityIsThatOfTheRunningStep) {
  EXPECT_EQ(axis.velocity_steps_per_s(), 0);
  for (const int direction : {1, -1}) {
    const auto reference = Reference::move(table.law(), 200);
    axis.start(0, 200 * direction, 40);
    const Tick end = axis.end_tick();
    for (Tick t = 40; t < end; ++t) {
      axis.executed(t);
      const std::uint16_t delay = reference.delay_at(static_cast<std::uint64_t>(t - 40) * kTickNs);
      ASSERT_DOUBLE_EQ(axis.velocity_steps_per_s(), direction * 1e9 / (delay * 40'000.0)) << t;
    }
    axis.executed(end);
    EXPECT_EQ(axis.velocity_steps_per_s(), 0);
    axis.finish();
    EXPECT_EQ(axis.velocity_steps_per_s(), 0);
  }
}

// With any table and tick, on both kinds of tables (indexed or walked).
TEST_P(AxisTest, AnyTableAnyStop) {
  test::holds("ticks and end are those of the formula", [&] {
    const test::TestTable any(test::any_law(), test::between(0, 1) != 0);
    const std::uint32_t tick_ns = test::any_tick_ns(any.law());
    RC_PRE(tick_ns >= 1u);
    auto reference = Reference::move(any.law(), static_cast<std::size_t>(test::between(1, 60)));
    const auto steps = static_cast<std::int64_t>(reference.steps());
    const Tick length = ticks_until_rest(reference, tick_ns);
    RC_PRE(length < 20'000);
    Axis random(*any.view(), tick_ns, format);
    random.start(0, steps, 0);
    RC_ASSERT(random.end_tick() == length);
    const Tick at = test::between<Tick>(1, length + 1);
    if (test::between(0, 1) != 0) random.executed(test::between<Tick>(0, at));
    ramp_down(random, at);
    reference.ramp_down_at(static_cast<std::uint64_t>(at) * tick_ns);
    RC_ASSERT(random.planned_end_steps() == static_cast<std::int64_t>(reference.steps()));
    const Tick end = ticks_until_rest(reference, tick_ns);
    RC_ASSERT(random.end_tick() == end);
    const auto count = static_cast<std::size_t>(std::max(end, at)) + 3;
    auto expected = ticks_of(reference, 1, tick_ns, format, count);
    expected.erase(expected.begin(), expected.begin() + at);
    RC_ASSERT(render(random, at, static_cast<unsigned>(expected.size())) == expected);
  });
}

}  // namespace
}  // namespace bushd::motion
