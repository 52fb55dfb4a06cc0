// A motor on a trajectory against the function through its rows, in exact arithmetic, and against
// its table: every step edge as its MCU makes it of the ticks that it is told.
#include "motion/trajectory.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <numeric>
#include <vector>

#include "engine/slots.h"
#include "engine/tables.h"
#include "motion/axis.h"
#include "motion/trajectory_check.h"

namespace bushd::motion {
namespace {

using test::any_law;
using test::between;
using test::holds;
using test::Law;
using test::TestTable;

constexpr std::uint16_t kSlots = 256;

struct Edge {
  double ns;  // at the beginning of its slot
  int direction;
};

// The edges of displacements in 1/256 step, as an MCU makes them.
std::vector<Edge> edges_of(const std::vector<std::int16_t>& ticks, std::uint32_t tick_ns) {
  std::vector<Edge> edges;
  std::int16_t remainder = 0;
  for (std::size_t i = 0; i < ticks.size(); ++i) {
    std::uint16_t masks[kSlots] = {};
    bushd_slots_add(masks, kSlots, 1, ticks[i], &remainder, BUSHD_CROSSING_FINE);
    for (int slot = 0; slot < kSlots; ++slot) {
      if (masks[slot] == 0) continue;
      edges.push_back(
          {(static_cast<double>(i) + slot / double{kSlots}) * tick_ns, ticks[i] > 0 ? 1 : -1});
    }
  }
  EXPECT_EQ(remainder, 0) << "it rests on a whole step";
  return edges;
}

// Written anew from the definition, in long double: 64 bits of mantissa.
class Exact {
 public:
  explicit Exact(const Trajectory& rows) : rows_(rows) {}

  long double at(double ns) const {
    std::size_t k = 0;
    while (k + 2 < rows_.rows() && static_cast<double>(rows_.time_ns(k + 1)) <= ns) ++k;
    const long double h = time(k + 1) - time(k);
    const long double t = std::min<long double>(ns, time(rows_.rows() - 1)) - time(k);
    const long double d = position(k + 1) - position(k);
    if (rows_.interpolation() == Trajectory::Interpolation::kLinear) return position(k) + d * t / h;
    const long double u = t / h;
    const long double m0 = h * speed(k);
    const long double m1 = h * speed(k + 1);
    return position(k) + m0 * u * (1 - u) * (1 - u) + d * u * u * (3 - 2 * u) -
           m1 * u * u * (1 - u);
  }
  // The greatest less the least speed in a stretch of time. Of 32 parts: of a speed that changes
  // evenly, half a part is missed at each end.
  long double swing(double from_ns, double to_ns) const {
    long double most = -1e9L;
    long double least = 1e9L;
    constexpr int kParts = 32;
    for (int i = 0; i < kParts; ++i) {
      const double a = from_ns + (to_ns - from_ns) * i / kParts;
      const double b = from_ns + (to_ns - from_ns) * (i + 1) / kParts;
      const long double v = (at(b) - at(a)) / (b - a);
      most = std::max(most, v);
      least = std::min(least, v);
    }
    return (most - least) * kParts / (kParts - 1);
  }

 private:
  long double time(std::size_t k) const { return static_cast<long double>(rows_.time_ns(k)); }
  long double position(std::size_t k) const {
    return static_cast<long double>(rows_.position(k, 0)) / Trajectory::kStep;
  }
  long double speed(std::size_t k) const {
    if (k == 0 || k + 1 == rows_.rows()) return 0;
    const long double before = time(k) - time(k - 1);
    const long double after = time(k + 1) - time(k);
    return ((position(k) - position(k - 1)) / before * after +
            (position(k + 1) - position(k)) / after * before) /
           (before + after);
  }
  const Trajectory& rows_;
};

struct Case {
  std::unique_ptr<TestTable> table;
  std::uint32_t tick_ns = 0;
  std::unique_ptr<Trajectory> rows;

  const bushd_table& view() const { return *table->view(); }
};

bool follows(const Case& c, std::int64_t& factor) {
  TrajectoryCheck check(*c.rows, {{&c.view(), 0, -1'000'000, 1'000'000}}, c.tick_ns);
  while (check.work(1000)) {
  }
  factor = check.stretch_thousandths();
  return !check.first();
}

// Made slow enough for the table, as bushd tells its users to.
Case any_case() {
  Case c;
  const Law law = any_law();
  c.table = std::make_unique<TestTable>(law, true);
  c.tick_ns = test::any_tick_ns(law);
  const auto kind =
      between(0, 1) == 0 ? Trajectory::Interpolation::kLinear : Trajectory::Interpolation::kCubic;
  Trajectory rows(1, kind);
  const double slow_ns = static_cast<double>(law.accel.front()) * law.unit_ns;
  std::int64_t time_ns = 0;
  Trajectory::Position at = between<std::int64_t>(-20, 20) * Trajectory::kStep;
  const int count = between(2, 9);
  for (int i = 0; i < count; ++i) {
    rows.append(time_ns, {{at}});
    const std::int64_t parts = between<std::int64_t>(0, 6 * 256);
    at += between<std::int64_t>(-parts, parts) * (Trajectory::kStep / 256);
    const auto longest = std::min<std::int64_t>(static_cast<std::int64_t>(6 * slow_ns),
                                                std::int64_t{150} * c.tick_ns);
    time_ns += between<std::int64_t>(1 + c.tick_ns / 3, longest + c.tick_ns);
  }
  rows.close();
  c.rows = std::make_unique<Trajectory>(std::move(rows));
  for (int tries = 0; tries < 12; ++tries) {
    std::int64_t factor = 1000;
    if (follows(c, factor)) break;
    RC_PRE(factor > 0 && c.rows->known_ns() / c.tick_ns * factor < 3'000'000);
    c.rows = std::make_unique<Trajectory>(c.rows->stretched(factor));
  }
  std::int64_t unused = 0;
  RC_PRE(follows(c, unused));
  RC_PRE(c.rows->known_ns() / c.tick_ns < 3'000);
  return c;
}

// Precondition of all: it may follow the rows.
void keeps_to_its_table(const std::vector<Edge>& edges, const bushd_table& table,
                        std::uint32_t tick_ns,
                        const std::function<bool(const Edge&)>& rests_after = nullptr) {
  const double unit = table.time_unit_ns;
  // A ramp-down waits for no step that is more than half a second away.
  std::uint32_t left_out = 0;
  while (left_out < table.decel.count && table.decel.code[left_out] * unit > 500e6) ++left_out;
  // What ticks and slots may add: each edge is within half a tick of its time, but for first ones.
  std::size_t from = 0;
  for (std::size_t j = 1; j <= edges.size(); ++j) {
    const bool last = j == edges.size();
    if (!last && edges[j].direction == edges[from].direction) continue;
    const std::size_t n = j - from;
    for (std::size_t i = 1; i < n; ++i) {
      const double delay = edges[from + i].ns - edges[from + i - 1].ns;
      const double slack = tick_ns + delay / 64 + 2;
      RC_ASSERT(delay + slack >= table.cruise * unit);
      // Slower than the first code is rest: what comes then is as from there.
      bool rested = false;
      for (std::size_t k = 1; k < n; ++k) {
        rested = rested || edges[from + k].ns - edges[from + k - 1].ns + slack >=
                               std::max(table.accel.code[0], table.decel.code[0]) * unit;
      }
      if (rested) continue;
      RC_ASSERT(delay + slack >= bushd_table_accel(&table, static_cast<std::uint32_t>(i)) * unit);
      if (rests_after && rests_after(edges[from + n - 1])) continue;
      // The first step after it has turned round is late by half a step at most, which is made up
      // at twice the speed: what a stop in the next one ends with has half the interval at least.
      const double made_up = from > 0 && i == 1 ? 0.5 : 1;
      RC_ASSERT(delay + slack >=
                bushd_table_decel(&table, static_cast<std::uint32_t>(n - 1 - i) + left_out) * unit *
                    made_up);
    }
    from = j;
  }
}

std::vector<std::int16_t> ticks_of(Axis& axis) {
  std::vector<std::int16_t> ticks;
  while (axis.end_tick() > static_cast<Tick>(ticks.size())) {
    const Tick first = static_cast<Tick>(ticks.size());
    const auto count = between<unsigned>(1, 30);
    ticks.resize(ticks.size() + count);
    axis.render(first, count, &ticks[static_cast<std::size_t>(first)], 1);
    if (between(0, 3) == 0) axis.executed(first);
  }
  return ticks;
}

TEST(Trajectory, EveryStepIsWhereTheRowsPutIt) {
  holds("edges against the function", [] {
    const Case c = any_case();
    Axis axis(c.view(), c.tick_ns, BUSHD_FORMAT_FINE);
    axis.start_trajectory({.trajectory = std::make_shared<Trajectory>(*c.rows)}, 0);
    const std::int64_t from = axis.from_steps();
    const std::vector<Edge> edges = edges_of(ticks_of(axis), c.tick_ns);
    const bool rests = rests_at_end(*c.rows, 0, c.view());
    const Exact exact(*c.rows);
    std::int64_t count = from;
    for (const Edge& edge : edges) {
      const double ns = edge.ns + c.tick_ns / (2.0 * kSlots);
      count += edge.direction;
      if (ns > static_cast<double>(c.rows->known_ns())) continue;  // the ramp-down
      const double tick = std::floor(edge.ns / c.tick_ns) * c.tick_ns;
      const double before = std::max(0.0, tick - c.tick_ns);
      const long double at = exact.at(ns);
      const long double late = (at - (count - edge.direction * 0.5L)) * edge.direction;
      const long double v = std::abs(exact.at(tick + c.tick_ns) - exact.at(before));
      // The last part: times are whole nanoseconds.
      const long double bound = exact.swing(before, tick + 2.0 * c.tick_ns) * c.tick_ns / 2 +
                                v / kSlots * 2 + 3.0L / 256 + v / c.tick_ns;
      // It may be late on the first half step after it has turned round.
      const long double lag = 0.5L + v;
      RC_ASSERT(late >= -bound);
      RC_ASSERT(late <= bound + lag);
    }
    if (rests) RC_ASSERT(count == nearest_step(c.rows->position(c.rows->rows() - 1, 0)));
    keeps_to_its_table(edges, c.view(), c.tick_ns);
  });
}

TEST(Trajectory, AStopRampsDownByTheTable) {
  holds("a stop at any tick", [] {
    const Case c = any_case();
    Axis axis(c.view(), c.tick_ns, BUSHD_FORMAT_FINE);
    axis.start_trajectory({.trajectory = std::make_shared<Trajectory>(*c.rows)}, 0);
    const Tick end = axis.end_tick();
    const auto at = between<Tick>(0, end);
    axis.stop();
    RC_ASSERT(axis.change(at) == (at < end));
    const std::vector<Edge> edges = edges_of(ticks_of(axis), c.tick_ns);
    std::int64_t count = axis.from_steps();
    for (const Edge& edge : edges) count += edge.direction;
    RC_ASSERT(count == axis.planned_end_steps());
    // Slower than the first code is rest: the rows have brought it there where they slow it down so
    // far before the stop, within a step.
    const Exact exact(*c.rows);
    const double longest = std::max(c.view().accel.code[0], c.view().decel.code[0]);
    const long double least = c.tick_ns / (longest * c.view().time_unit_ns);
    const auto rests_after = [&](const Edge& edge) {
      for (auto tick = static_cast<Tick>(edge.ns / c.tick_ns); tick < std::min(at, end); ++tick) {
        const auto ns = static_cast<double>(tick) * c.tick_ns;
        const long double way = exact.at(ns + c.tick_ns) - exact.at(ns);
        if (way * edge.direction < least) return true;
      }
      return false;
    };
    keeps_to_its_table(edges, c.view(), c.tick_ns, rests_after);
  });
}

// Motors that slow down, or stand, within a step when the stop comes: the interval of that step.
TEST(Trajectory, AStopWithinAStepOfManySpeedsTakesTheLongestDelay) {
  struct Stop {
    Law law;
    std::uint32_t tick_ns;
    std::vector<std::pair<std::int64_t, double>> rows;
    Tick at;
  };
  std::vector<std::uint16_t> steep(40, 1);
  steep.front() = 3;
  const Stop stops[] = {
      {{.accel = steep, .decel = {1135, 1}, .cruise = 1, .unit_ns = 123'457},
       8'725'090,
       {{0, -20},
        {23'436'475, -24.1055},
        {62'294'119, -24.1055},
        {122'989'920, -26.3516},
        {196'700'928, -26.3516},
        {227'690'753, -25.8672},
        {306'121'111, -27.4414}},
       15},
      {{.accel = {36, 16, 16}, .decel = {46'926}, .cruise = 11, .unit_ns = 7},
       1'895,
       {{0, -20},
        {183'302, -20.7695},
        {399'590, -21.168},
        {544'989, -22.4648},
        {809'270, -22.9219},
        {1'025'170, -24.3984}},
       299},
  };
  for (const Stop& stop : stops) {
    const TestTable table(stop.law, true);
    auto rows = std::make_shared<Trajectory>(1, Trajectory::Interpolation::kLinear);
    for (const auto& [ns, steps] : stop.rows) {
      const auto at = static_cast<Trajectory::Position>(steps * Trajectory::kStep);
      rows->append(ns, {&at, 1});
    }
    rows->close();
    Axis axis(*table.view(), stop.tick_ns, BUSHD_FORMAT_FINE);
    axis.start_trajectory({.trajectory = rows}, 0);
    axis.stop();
    ASSERT_TRUE(axis.change(stop.at));
    std::vector<std::int16_t> ticks(static_cast<std::size_t>(axis.end_tick()));
    axis.render(0, static_cast<unsigned>(ticks.size()), ticks.data(), 1);
    const std::vector<Edge> edges = edges_of(ticks, stop.tick_ns);
    ASSERT_GE(edges.size(), 2u);
    const double last_ns = edges.back().ns - edges[edges.size() - 2].ns;
    const double slack = stop.tick_ns + last_ns / 64 + 2;
    EXPECT_GE(last_ns + slack, 1.0 * stop.law.decel.front() * stop.law.unit_ns);
  }
}

TEST(Trajectory, RowsThatComeLaterChangeNothingBefore) {
  holds("appended in two parts", [] {
    const Case c = any_case();
    auto grows = std::make_shared<Trajectory>(1, c.rows->interpolation());
    const auto append = [&](std::size_t row) {
      const Trajectory::Position position = c.rows->position(row, 0);
      grows->append(c.rows->time_ns(row), {&position, 1});
    };
    const std::size_t first = between<std::size_t>(2, c.rows->rows());
    for (std::size_t row = 0; row < first; ++row) append(row);
    Axis axis(c.view(), c.tick_ns, BUSHD_FORMAT_FINE);
    axis.start_trajectory({.trajectory = grows}, 0);
    Axis whole(c.view(), c.tick_ns, BUSHD_FORMAT_FINE);
    whole.start_trajectory({.trajectory = std::make_shared<Trajectory>(*c.rows)}, 0);
    const Tick known = grows->known_ns() / c.tick_ns;
    RC_ASSERT(!axis.runs_out_before(known));
    std::vector<std::int16_t> ticks(static_cast<std::size_t>(known) + 1);
    if (known > 0) axis.render(0, static_cast<unsigned>(known), ticks.data(), 1);
    for (std::size_t row = first; row < c.rows->rows(); ++row) append(row);
    grows->close();
    axis.trajectory_grew();
    RC_ASSERT(axis.end_tick() == whole.end_tick());
    std::vector<std::int16_t> all(static_cast<std::size_t>(whole.end_tick()));
    std::vector<std::int16_t> again(all.size());
    whole.render(0, static_cast<unsigned>(all.size()), all.data(), 1);
    axis.render(0, static_cast<unsigned>(again.size()), again.data(), 1);
    RC_ASSERT(all == again);
  });
}

TEST(Trajectory, WhatEndsInMotionOrWithoutItsLastRowRampsDown) {
  const TestTable table(
      {.accel = {1000, 500, 300}, .decel = {1000, 500, 300}, .cruise = 250, .unit_ns = 1000}, true);
  for (const bool closed : {false, true}) {
    auto rows = std::make_shared<Trajectory>(1, Trajectory::Interpolation::kLinear);
    for (const auto& [ms, steps] : {std::pair{0, 0}, {10, 10}, {16, 20}, {22, 40}}) {
      const Trajectory::Position at = steps * Trajectory::kStep;
      rows->append(ms * 1'000'000, {&at, 1});
    }
    if (closed) rows->close();
    Axis axis(*table.view(), 100'000, BUSHD_FORMAT_FINE);
    axis.start_trajectory({.trajectory = rows}, 0);
    EXPECT_FALSE(axis.ran_out());
    EXPECT_TRUE(axis.runs_out_before(221));
    EXPECT_FALSE(axis.runs_out_before(220));
    std::vector<std::int16_t> ticks(static_cast<std::size_t>(axis.end_tick()));
    axis.render(0, static_cast<unsigned>(ticks.size()), ticks.data(), 1);
    EXPECT_EQ(edges_of(ticks, 100'000).size(), 43u);  // 300 us a step: two more, 500 and 1000
    EXPECT_EQ(axis.planned_end_steps(), 43);
    axis.executed(axis.end_tick());
    EXPECT_TRUE(axis.ran_out());
    EXPECT_EQ(axis.executed_steps(), 43);
  }
}

TEST(TrajectoryCheck, NamesTheFirstRowThatCannotBeFollowed) {
  const TestTable table(
      {.accel = {1000, 500, 300}, .decel = {1000, 500, 300}, .cruise = 250, .unit_ns = 1000}, true);
  const auto check = [&](std::initializer_list<std::pair<int, int>> all,
                         std::int64_t highest = 999) {
    Trajectory rows(1, Trajectory::Interpolation::kLinear);
    for (const auto& [ms, steps] : all) {
      const Trajectory::Position at = steps * Trajectory::kStep;
      rows.append(ms * 1'000'000, {&at, 1});
    }
    rows.close();
    TrajectoryCheck of(rows, {{table.view(), 0, -999, highest}}, 100'000);
    while (of.work(1000)) {
    }
    return std::pair(of.first(), of.stretch_thousandths());
  };
  EXPECT_FALSE(check({{0, 0}, {10, 10}}).first);
  // From rest at most 1000 steps/s at once.
  const auto [corner, by] = check({{0, 0}, {10, 12}});
  ASSERT_TRUE(corner);
  EXPECT_EQ(corner->row, 0u);
  EXPECT_EQ(corner->fault, TrajectoryCheck::Fault::kCorner);
  EXPECT_DOUBLE_EQ(corner->asked_steps_per_s, 1200);
  EXPECT_DOUBLE_EQ(corner->allowed_steps_per_s, 1000);
  EXPECT_EQ(by, 1200);
  // Not faster than 4000 steps/s.
  const auto [fast, slower] = check({{0, 0}, {10, 10}, {20, 60}});
  ASSERT_TRUE(fast);
  EXPECT_EQ(fast->row, 1u);
  EXPECT_EQ(fast->fault, TrajectoryCheck::Fault::kCorner);
  EXPECT_GT(slower, 1250);
  const auto [beyond, none] = check({{0, 0}, {10, 10}, {20, 20}}, 15);
  ASSERT_TRUE(beyond);
  EXPECT_EQ(beyond->row, 2u);
  EXPECT_EQ(beyond->fault, TrajectoryCheck::Fault::kPosition);
  EXPECT_EQ(none, 0);
}

}  // namespace
}  // namespace bushd::motion
