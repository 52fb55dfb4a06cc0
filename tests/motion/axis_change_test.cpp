// An axis that is given new targets and stops in flight, against a naive simulation: the steps of
// tests/engine/reference.h, changed where the MCU took a change and not where it did not.
#include <gtest/gtest.h>

#include <cstdlib>
#include <optional>

#include "engine/tables.h"
#include "motion/axis.h"
#include "motion/ramp.h"

namespace bushd::motion {
namespace {

using test::between;
using test::kTickNs;
using test::Law;
using test::ramp;
using test::Reference;

// What the MCU will do, tick by tick from the start on, and where that leads.
struct Plan {
  Law law;
  std::int64_t from;
  std::uint32_t tick_ns;
  int direction;
  std::uint16_t shortest_delay;
  Reference steps;

  Plan(Law the_law, std::int64_t from_steps, std::int64_t by, std::uint32_t tick,
       std::uint16_t the_shortest_delay = 0)
      : law(std::move(the_law)),
        from(from_steps),
        tick_ns(tick),
        direction(by < 0 ? -1 : 1),
        shortest_delay(the_shortest_delay),
        steps(Reference::move(law, static_cast<std::size_t>(std::abs(by)), shortest_delay)) {}

  std::uint64_t ns(Tick tick) const { return static_cast<std::uint64_t>(tick) * tick_ns; }
  std::int64_t end_steps() const {
    return from + direction * static_cast<std::int64_t>(steps.steps());
  }
  Tick end_tick() const {
    Tick tick = 0;
    while (steps.steps_at(ns(tick)) < steps.steps()) ++tick;
    // One that rests in the middle of a step has to be told so for a tick.
    const auto rest_ns = steps.rest_ns();
    return rest_ns ? std::max(tick, static_cast<Tick>(*rest_ns / tick_ns) + 1) : tick;
  }
  std::int16_t displacement(Tick tick, bushd_format format) const {
    if (format == BUSHD_FORMAT_FINE) {
      const std::int64_t d = steps.position_at(ns(tick + 1)) - steps.position_at(ns(tick));
      return static_cast<std::int16_t>(d * direction);
    }
    const std::size_t d = steps.steps_at(ns(tick + 1)) - steps.steps_at(ns(tick));
    const bool over = steps.delay_at(ns(tick)) == 0;
    return static_cast<std::int16_t>(over || direction < 0 ? d : d | 0x80);
  }
  // Both at ticks counted from the start.
  void stop(Tick at) {
    if (at > 0) return steps.ramp_down_at(ns(at));
    *this = Plan(law, from, 0, tick_ns, shortest_delay);
  }
  void aim(Tick at, std::int64_t target, std::uint16_t to_shortest_delay = 0) {
    if (at <= 0) {
      *this = Plan(law, from, target - from, tick_ns, to_shortest_delay);
      return;
    }
    const auto next = from + direction * static_cast<std::int64_t>(steps.steps_at(ns(at)) + 1);
    const std::int64_t after = (target - next) * direction;
    if (after < 0 ||
        !steps.retarget_at(ns(at), static_cast<std::size_t>(after), to_shortest_delay)) {
      return stop(at);
    }
    shortest_delay = to_shortest_delay;
  }
};

class AxisChange : public testing::TestWithParam<bushd_format> {
 protected:
  const bushd_format format = GetParam();
  const test::TestTable table{ramp(), true};
  Axis axis{*table.view(), kTickNs, format};

  std::vector<std::int16_t> rendered(Tick first, unsigned count) {
    std::vector<std::int16_t> out(count);
    axis.render(first, count, out.data(), 1);
    return out;
  }
  void expect_plan(const Plan& plan, Tick start, Tick from_tick) {
    EXPECT_EQ(axis.planned_end_steps(), plan.end_steps());
    EXPECT_EQ(axis.end_tick(), start + plan.end_tick());
    std::vector<std::int16_t> want;
    for (Tick t = from_tick; t < axis.end_tick() + 5; ++t) {
      want.push_back(t < start ? std::int16_t{0} : plan.displacement(t - start, format));
    }
    EXPECT_EQ(rendered(from_tick, static_cast<unsigned>(want.size())), want);
  }
};
INSTANTIATE_TEST_SUITE_P(Formats, AxisChange,
                         testing::Values(BUSHD_FORMAT_FINE, BUSHD_FORMAT_COARSE),
                         [](const auto& p) {
                           return p.param == BUSHD_FORMAT_FINE ? "Fine" : "Coarse";
                         });

TEST_P(AxisChange, NewTargetsAtEveryTickOfAMove) {
  for (const int direction : {1, -1}) {
    const Tick length = Plan(ramp(), 0, 150, kTickNs).end_tick();
    for (Tick at = 1; at < length; at += 3) {
      for (const std::int64_t way : {400, 151, 150, 149, 90, 20, 1, 0, -30}) {
        axis.start(7, 150 * direction, 1000);
        rendered(1000, 40);
        axis.executed(1000 + at / 2);
        const std::int64_t target = 7 + way * direction;
        Plan plan(ramp(), 7, 150 * direction, kTickNs);
        plan.aim(at, target);
        const bool differs = plan.end_steps() != 7 + 150 * direction;
        axis.aim(target);
        ASSERT_TRUE(axis.needs_change());
        ASSERT_EQ(axis.change(1000 + at), differs) << way << " at " << at;
        ASSERT_FALSE(axis.needs_change());
        ASSERT_EQ(axis.end_steps(), target);
        if (differs) expect_plan(plan, 1000, 1000 + at / 2);
        axis.finish();
      }
    }
  }
}

TEST_P(AxisChange, ATargetBeforeTheStartIsAnotherMoveFromTheBeginning) {
  for (const std::int64_t target : {300, -40, 8, 6, 7}) {
    for (const Tick at : {1000, 980}) {
      axis.start(7, 150, 1000);
      rendered(970, 60);
      axis.aim(target);
      ASSERT_TRUE(axis.change(at));
      expect_plan(Plan(ramp(), 7, target - 7, kTickNs), 1000, 970);
      const auto taken = axis.executed(std::max<Tick>(axis.end_tick(), 1000));
      ASSERT_TRUE(taken);
      EXPECT_EQ(taken->at, at);
      axis.finish();
    }
  }
}

TEST_P(AxisChange, TooLateChangesNothing) {
  axis.start(0, 20, 1000);
  const Tick end = axis.end_tick();
  axis.aim(40);
  EXPECT_FALSE(axis.change(end));
  EXPECT_EQ(axis.planned_end_steps(), 20);
  EXPECT_EQ(axis.target_steps(), 40);
  EXPECT_FALSE(axis.needs_change());
  EXPECT_FALSE(axis.executed(end));
}

TEST_P(AxisChange, TheSecondChangeWaitsForTheFirst) {
  axis.start(0, 400, 1000);
  axis.aim(800);
  ASSERT_TRUE(axis.change(1050));
  axis.stop();
  EXPECT_FALSE(axis.needs_change()) << "the MCU may have taken the first one";
  EXPECT_FALSE(axis.executed(1050));
  const auto taken = axis.executed(1051);
  ASSERT_TRUE(taken);
  EXPECT_EQ(taken->at, 1050);
  EXPECT_EQ(taken->target_steps, 800);
  EXPECT_TRUE(axis.needs_change());
  ASSERT_TRUE(axis.change(1060));
  EXPECT_TRUE(axis.stopping());
  EXPECT_EQ(axis.executed(1061)->target_steps, std::nullopt);
}

// Any table, any sequence of wishes at any time, any of the changes not taken by the MCU.
TEST_P(AxisChange, AnySequenceOfChangesIsThatOfTheSimulation) {
  test::holds("ticks, end and target are those of the simulation", [&] {
    const test::TestTable any(test::any_law(), between(0, 1) != 0);
    const std::uint32_t tick_ns = test::any_tick_ns(any.law());
    const auto random_steps = [] { return between<std::int64_t>(-60, 60); };
    const std::int64_t by = random_steps();
    RC_PRE(by != 0);
    const std::uint16_t first_shortest_delay =
        between(0, 1) != 0 ? test::any_shortest_delay(any.law()) : 0;
    Plan plan(any.law(), 5, by, tick_ns, first_shortest_delay);
    RC_PRE(plan.end_tick() < 3000);
    Axis random(*any.view(), tick_ns, format);
    random.start(5, by, 0, 0, first_shortest_delay);
    Tick now = -10;              // executed up to here
    std::optional<Plan> before;  // without the change that is not yet executed
    Tick change_at = 0;
    for (int event = 0; event < 30; ++event) {
      if (between(0, 2) == 0) {
        if (between(0, 2) == 0) {
          random.stop();
        } else {
          random.aim(5 + random_steps(),
                     between(0, 1) != 0 ? test::any_shortest_delay(any.law()) : 0);
        }
      }
      const bool failed = before && now <= std::max<Tick>(change_at, 0) && between(0, 3) == 0;
      if (failed) plan = *before;
      if (failed || random.needs_change()) {
        before.reset();
        const Tick at = now + between<Tick>(1, 12);
        Plan changed = plan;
        random.stopping() ? changed.stop(at)
                          : changed.aim(at, random.target_steps(),
                                        static_cast<std::uint16_t>(random.shortest_delay()));
        const bool over = at >= std::max<Tick>(plan.end_tick(), 1);
        const auto cruise = [&](std::uint16_t shortest_delay) {
          return std::max(any.law().cruise, shortest_delay);
        };
        const bool faster_or_slower =
            !random.stopping() && cruise(static_cast<std::uint16_t>(random.shortest_delay())) !=
                                      cruise(plan.shortest_delay);
        const bool differs = !over && (changed.end_steps() != plan.end_steps() || faster_or_slower);
        RC_ASSERT(random.change(at) == differs);
        if (differs) {
          before = plan;
          plan = changed;
          change_at = at;
        }
      }
      RC_ASSERT(random.planned_end_steps() == plan.end_steps());
      RC_ASSERT(random.end_tick() == plan.end_tick());
      const Tick first = now + between<Tick>(0, 20);
      std::vector<std::int16_t> got(between<std::size_t>(1, 30));
      const auto delay = random.render(first, static_cast<unsigned>(got.size()), got.data(), 1);
      const Tick end = first + static_cast<Tick>(got.size());
      for (Tick t = first; t < end; ++t) {
        RC_ASSERT(got[static_cast<std::size_t>(t - first)] ==
                  (t < 0 ? 0 : plan.displacement(t, format)));
      }
      // Ticks up to a change go on until it comes, whatever it makes of the running step.
      const Plan& told = before && end == change_at && end > 0 ? *before : plan;
      RC_ASSERT(delay == told.steps.delay_at(plan.ns(std::max<Tick>(end, 0))));
      now += between<Tick>(0, 15);
      const auto taken = random.executed(now);
      const bool passed =
          before && (now > std::max<Tick>(change_at, 0) || (now >= 0 && now >= plan.end_tick()));
      RC_ASSERT(taken.has_value() == passed);
      if (passed) {
        RC_ASSERT(taken->at == change_at);
        before.reset();
      }
      if (now >= plan.end_tick()) break;
    }
  });
}

}  // namespace
}  // namespace bushd::motion
