// A motor on a line, tick by tick, against the rule of the line and a naive simulation of its run
// (tests/engine/reference.h), with a stop or a nearer end on the way.
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <vector>

#include "engine/slots.h"
#include "engine/tables.h"
#include "motion/axis.h"
#include "motion/first_interval.h"
#include "motion/ramp.h"

namespace bushd::motion {
namespace {

using test::any_law;
using test::any_shortest_delay;
using test::between;
using test::Law;
using test::Reference;
using test::TestTable;
using test::Wide;

struct Line {
  std::vector<std::unique_ptr<TestTable>> tables;
  std::shared_ptr<const tables::Envelope> envelope;
  LineShare share;  // of the motor that is looked at
  std::uint16_t shortest_delay = 0;
  std::uint32_t tick_ns = 0;
  bushd_format format = BUSHD_FORMAT_FINE;

  // The part of a step counts in the run's position too.
  const bushd_table& own() const { return *tables.back()->view(); }
  // The envelope as the reference has tables.
  Law law() const {
    const bushd_table& table = envelope->view();
    return {.accel = {table.accel.code, table.accel.code + table.accel.count},
            .decel = {table.decel.code, table.decel.code + table.decel.count},
            .cruise = table.cruise,
            .unit_ns = table.time_unit_ns};
  }
};

// Two motors, of which the last one is looked at.
Line any_line() {
  Line line;
  std::vector<tables::LinePart> parts;
  auto longest = between<std::uint32_t>(1, *rc::gen::element<std::uint32_t>(3, 20, 150));
  const auto increment = between(0, 2) == 0 ? longest : between<std::uint32_t>(0, longest);
  Law first = any_law();
  for (const std::uint32_t steps : {longest, increment}) {
    Law law = any_law();
    law.unit_ns = first.unit_ns;
    line.tables.push_back(std::make_unique<TestTable>(law, true));
    parts.push_back({line.tables.back()->view(), steps});
  }
  const bool elementary = between(0, 1) == 0;
  bushd_elementary printed;
  bushd_elementary_clear(&printed);
  const auto coordinate = between<std::uint8_t>(0, 15);
  if (elementary) {
    const std::uint8_t other = coordinate < 15 ? std::uint8_t{15} : std::uint8_t{2};
    bushd_elementary_add(&printed, other, longest);
    bushd_elementary_add(&printed, coordinate, increment);
    longest = printed.sum;
    for (std::size_t i = 0; i < 2; ++i) {
      if (parts[i].increment == 0) continue;
      const std::uint8_t of = i == 0 ? other : coordinate;
      parts[i].apart = bushd_elementary_apart(&printed, of);
      parts[i].late = bushd_elementary_late(&printed, of);
    }
  }
  line.envelope = std::make_shared<const tables::Envelope>(parts, longest);
  line.tick_ns = test::any_tick_ns(line.law());
  // So that a line takes some thousand ticks at most.
  const double slowest_ns = 65535.0 * line.envelope->view().time_unit_ns;
  line.tick_ns = std::max(line.tick_ns,
                          static_cast<std::uint32_t>(std::min(2e7, slowest_ns * longest / 3000)));
  const std::uint64_t most =
      std::uint64_t{line.envelope->view().cruise} * line.envelope->view().time_unit_ns * 127 - 1;
  line.tick_ns = static_cast<std::uint32_t>(std::min<std::uint64_t>(line.tick_ns, most));
  line.format = between(0, 1) == 0 ? BUSHD_FORMAT_FINE : BUSHD_FORMAT_COARSE;
  if (between(0, 2) == 0) {
    line.shortest_delay = between<std::uint16_t>(1, line.envelope->view().accel.code[0]);
  }
  line.share = {.table = line.envelope,
                .blocks = std::make_shared<RunBlocks>(),
                .elementary = elementary ? std::make_shared<const bushd_elementary>(printed)
                                         : std::shared_ptr<const bushd_elementary>(),
                .coordinate = coordinate,
                .increment = increment,
                .longest = longest,
                .direction = between(0, 1) == 0 ? 1 : -1,
                .from = between(0, 1) == 0 ? 0 : between<std::uint32_t>(0, longest - 1),
                .to = longest,
                .in_mcus = between(0, 1) == 0};
  return line;
}

// In which tick the run begins: a streamed line that goes on tells in its first tick what motors
// stand from their whole steps.
Tick run_begin(const Line& line, Tick start) {
  const bool stands =
      line.share.from > 0 && !line.share.in_mcus && line.format == BUSHD_FORMAT_FINE;
  return start + (stands ? 1 : 0);
}

// The printed function of two coordinates, F = a_k b - b_k a: what this motor has made after each
// elementary step.
std::vector<std::int64_t> printed_steps(const LineShare& share) {
  const bool is_alpha = share.coordinate < 15;
  const std::int64_t own = share.increment;
  const std::int64_t other = std::int64_t{share.longest} - own;
  std::vector<std::int64_t> made{0};
  std::int64_t others_made = 0;
  while (made.size() <= share.longest) {
    const std::int64_t f = own * others_made - other * made.back();
    const bool steps = own != 0 && (is_alpha ? f >= 0 : f > 0);
    if (!steps) ++others_made;
    made.push_back(made.back() + (steps ? 1 : 0));
  }
  return made;
}

std::int64_t made_at(const LineShare& share, std::uint32_t step) {
  if (share.elementary) return printed_steps(share)[step];
  bushd_line line;
  bushd_line_start(&line, share.increment, share.longest);
  bushd_line_go_to(&line, step);
  return line.made;
}

// In 1/256 step from the line's beginning, for the run's position in the same.
std::int64_t place_at(const Line& line, std::int64_t run_256, std::int64_t rest_256) {
  const Wide n = line.share.increment;
  const Wide l = line.share.longest;
  const Wide x = Wide{line.share.from} * 256 + run_256;
  if (line.share.elementary) {
    const std::vector<std::int64_t> made = printed_steps(line.share);
    const auto s = static_cast<std::size_t>(x / 256);
    const auto [before, after] = std::ranges::equal_range(made, made[s]);
    const Wide since = x - 256 * (made[s] == 0 ? 0 : before - made.begin());
    const Wide apart = after - before;
    const std::int64_t place =
        made[s] * 256 + (after == made.end() ? 0 : static_cast<std::int64_t>(since / apart));
    const std::int64_t told = std::min(place, rest_256);
    return line.format == BUSHD_FORMAT_FINE ? told : told / 256 * 256;
  }
  const Wide ruled = (2 * n * x + 256 * (l - n)) / (2 * l);
  const Wide rising = 2 * n * x / l;
  const auto place = static_cast<std::int64_t>(std::min<Wide>({ruled, rising, Wide{rest_256}}));
  return line.format == BUSHD_FORMAT_FINE ? place : place / 256 * 256;
}

std::int64_t signed_256(const Line& line, std::int16_t out) {
  if (line.format == BUSHD_FORMAT_FINE) return out;
  return bushd_coarse_to_fine(static_cast<std::uint8_t>(out));
}

bool ramps_down(const Reference& reference, const Law& law, std::uint64_t ns,
                std::uint16_t shortest_delay) {
  const std::size_t made = reference.steps_at(ns);
  const std::size_t left = reference.steps() - made;
  const Wide speeding_up =
      std::max<Wide>({law.accel_at(made), Wide{law.cruise}, Wide{shortest_delay}});
  return law.decel_at(left - 1) > speeding_up;
}

TEST(LineOfAnAxis, EveryTickIsWhereTheLineIs) {
  test::holds("positions told, and the end", [] {
    const Line line = any_line();
    const Law law = line.law();
    const std::uint32_t run_steps = line.share.to - line.share.from;
    Reference run = Reference::move(law, run_steps, line.shortest_delay);
    Axis axis(line.own(), line.tick_ns, line.format);
    const Tick start = 100;
    const Tick begin = run_begin(line, start);
    axis.start_line(1000, line.share, start, line.shortest_delay);
    const Tick whole = axis.over_tick();
    RC_ASSERT(whole >= axis.end_tick());
    std::optional<Tick> at;
    if (between(0, 1) == 0 && whole > start + 1) {
      at = between<Tick>(start + 1, whole - 1);
      const auto ns = static_cast<std::uint64_t>(*at - begin) * line.tick_ns;
      axis.stop();
      const bool already = ramps_down(run, law, ns, line.shortest_delay);
      const std::size_t steps_before = run.steps();
      if (already) {
        run.leave_out_slow(ns);
      } else {
        run.ramp_down_at(ns, true);
      }
      const Tick end_before = axis.end_tick();
      const bool told = axis.change(*at);
      if (already && run.steps() == steps_before) RC_ASSERT(!told);
      if (*at >= end_before && !line.share.in_mcus) RC_ASSERT(!told);
    }
    const std::int64_t from = made_at(line.share, line.share.from);
    const std::int64_t rest =
        made_at(line.share, line.share.from + static_cast<std::uint32_t>(run.steps()));
    RC_ASSERT(axis.line_planned_end() == line.share.from + run.steps());
    RC_ASSERT(axis.planned_end_steps() == 1000 + line.share.direction * (rest - from));
    // Before the change nothing of the motor's rest is known.
    std::int64_t place = from * 256;
    Tick last_moved = start - 1;
    for (Tick tick = start - 2; tick < axis.over_tick() + 2;) {
      const auto count = static_cast<unsigned>(between(1, 9));
      std::vector<std::int16_t> out(count);
      const std::uint16_t delay = axis.render(tick, count, out.data(), 1);
      for (const std::int16_t one : out) {
        place += signed_256(line, one) * line.share.direction;
        if (one != 0) last_moved = tick;
        ++tick;
        const auto ns = static_cast<std::uint64_t>(std::max<Tick>(tick - begin, 0)) * line.tick_ns;
        const bool changed = !at || tick > *at;
        const Reference plain = Reference::move(law, run_steps, line.shortest_delay);
        const Reference& now = changed ? run : plain;
        const std::int64_t whole_rest = made_at(line.share, line.share.to);
        const std::int64_t position = now.position_at(ns);
        const std::int64_t ruled =
            tick <= start ? from * 256
                          : place_at(line, position, (changed ? rest : whole_rest) * 256);
        RC_ASSERT(place == ruled);
      }
      const bool over = tick >= axis.end_tick() && !(at && tick <= *at);
      if (over) RC_ASSERT(delay == 0);
      if (tick < axis.end_tick() && axis.end_tick() > start) RC_ASSERT(delay > 0);
    }
    RC_ASSERT(place == rest * 256);
    RC_ASSERT(last_moved < axis.end_tick());
    if (!at && axis.end_tick() > start) RC_ASSERT(last_moved == axis.end_tick() - 1);
    RC_ASSERT(axis.steps_at(axis.over_tick()) == axis.planned_end_steps());
  });
}

// A line that goes on stands between two steps of a motor. Of 390 steps of the run it has made 120;
// of 380 that the motor makes step 117 falls at s = 120.07 and step 118 at s = 121.09.
TEST(LineOfAnAxis, FirstStepAfterAPauseIsNotLate) {
  const TestTable table(test::ramp(), true);
  const std::vector<tables::LinePart> parts = {{table.view(), 390}, {table.view(), 380}};
  Axis axis(*table.view(), 2'500'000, BUSHD_FORMAT_FINE);
  axis.start_line(0,
                  {.table = std::make_shared<const tables::Envelope>(parts, 390),
                   .blocks = std::make_shared<RunBlocks>(),
                   .increment = 380,
                   .longest = 390,
                   .from = 120,
                   .to = 390},
                  10, 0);
  const auto interval_ns = test::first_interval_ns(axis);
  ASSERT_TRUE(interval_ns);
  // A tick's displacement is told to 1/256 step, of which each end may take that of the first code.
  const std::uint16_t* codes = table.view()->accel.code;
  EXPECT_GE(*interval_ns, codes[1] * 40'000.0 - codes[0] * 40'000.0 / 128);
}

// The delay that an MCU is told, from which it would ramp down by the motor's own table.
TEST(LineOfAnAxis, TellsNoDelayThatItsTableDoesNotAllow) {
  test::holds("not below the table's own cruise delay", [] {
    const Line line = any_line();
    RC_PRE(line.share.increment > 0);
    Axis axis(line.own(), line.tick_ns, line.format);
    axis.start_line(0, line.share, 0, line.shortest_delay);
    for (Tick tick = 0; tick < axis.end_tick();) {
      std::int16_t out = 0;
      const std::uint16_t delay = axis.render(tick++, 1, &out, 1);
      if (delay != 0) RC_ASSERT(delay >= line.own().cruise);
    }
  });
}

// A nearer end keeps the motor on the line.
TEST(LineOfAnAxis, TakesANearerEnd) {
  test::holds("it ends at the point of that step, if it can", [] {
    const Line line = any_line();
    Axis axis(line.own(), line.tick_ns, line.format);
    axis.start_line(0, line.share, 0, line.shortest_delay);
    RC_PRE(axis.over_tick() > 1);
    const Tick at = between<Tick>(1, axis.over_tick() - 1);
    const auto step = between<std::uint32_t>(line.share.from, line.share.to);
    axis.aim_on_line(step, line.shortest_delay);
    axis.change(at);
    RC_ASSERT(axis.line_target() == step);
    // It runs as far as its ramp needs otherwise.
    RC_ASSERT(axis.line_planned_end() >= std::min(step, axis.line_planned_end()));
    const std::int64_t from = made_at(line.share, line.share.from);
    RC_ASSERT(axis.planned_end_steps() ==
              line.share.direction * (made_at(line.share, axis.line_planned_end()) - from));
    std::int64_t place = from * 256;
    for (Tick tick = 0; tick <= axis.over_tick(); ++tick) {
      std::int16_t out = 0;
      axis.render(tick, 1, &out, 1);
      place += signed_256(line, out) * line.share.direction;
    }
    RC_ASSERT(place == made_at(line.share, axis.line_planned_end()) * 256);
    axis.executed(axis.over_tick() + 1);
    RC_ASSERT(axis.executed_steps() == axis.planned_end_steps());
    RC_ASSERT(axis.line_step() == axis.line_planned_end());
  });
}

}  // namespace
}  // namespace bushd::motion
