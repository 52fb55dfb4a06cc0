// A motor on a path, tick by tick, as its MCU makes steps of it, against the polyline and the run.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

#include "engine/slots.h"
#include "engine/tables.h"
#include "motion/axis.h"
#include "motion/first_interval.h"
#include "motion/path_judge.h"

namespace bushd::motion {
namespace {

using test::any_law;
using test::between;
using test::Law;
using test::TestTable;

struct OnPath {
  std::vector<std::unique_ptr<TestTable>> tables;
  std::shared_ptr<Path> path;
  std::vector<Axis> axes;
  std::uint32_t tick_ns = 0;
  bushd_format format = BUSHD_FORMAT_FINE;
};

OnPath any_axes() {
  OnPath made;
  const auto width = between<std::size_t>(1, 3);
  std::vector<Path::Motor> motors;
  made.tick_ns = UINT32_MAX;
  for (std::size_t m = 0; m < width; ++m) {
    Law law = any_law();
    law.unit_ns = 1000;
    made.tables.push_back(std::make_unique<TestTable>(law, true));
    motors.push_back({made.tables.back()->view()});
    made.tick_ns = std::min(made.tick_ns, test::any_tick_ns(law));
  }
  const auto rows = between<std::size_t>(2, 9);
  const std::int64_t far = *rc::gen::element<std::int64_t>(2, 9, 60);
  std::vector<std::int64_t> points(width, 0);
  for (std::size_t i = width; i < rows * width; ++i) {
    points.push_back(points[i - width] + between<std::int64_t>(-far, far));
  }
  made.path = test::path_through(
      motors, points, between(0, 1) == 0 ? Path::Corners::kContinuous : Path::Corners::kExact);
  made.path->plan(SIZE_MAX);
  if (between(0, 2) == 0 && made.path->segments() > 0) {
    made.path = made.path->rest(
        between<std::uint32_t>(0, static_cast<std::uint32_t>(made.path->steps()) - 1));
    made.path->plan(SIZE_MAX);
  }
  made.format = between(0, 1) == 0 ? BUSHD_FORMAT_FINE : BUSHD_FORMAT_COARSE;
  return made;
}

void start(OnPath& on_path, const std::shared_ptr<const PathTrack>& track, Tick at) {
  for (std::size_t m = 0; m < on_path.path->motors().size(); ++m) {
    Axis axis(*on_path.path->motors()[m].table, on_path.tick_ns, on_path.format);
    const LineShare share{.track = track,
                          .motor = m,
                          .increment = 1,
                          .longest = static_cast<std::uint32_t>(on_path.path->steps()),
                          .from = track->from(),
                          .to = track->to()};
    axis.start_line(on_path.path->position_at(m, track->from()), share, at, 0);
    on_path.axes.push_back(axis);
  }
}

struct Mcu {
  std::int64_t position = 0;
  std::int64_t steps = 0;  // to and fro
  std::int16_t remainder = 0;

  void tick(std::int16_t told, bushd_format format) {
    const bool fine = format == BUSHD_FORMAT_FINE;
    const std::int16_t moved = fine ? told : bushd_coarse_to_fine(static_cast<std::uint8_t>(told));
    bushd_slots plan;
    const std::int16_t made = bushd_slots_plan(
        moved, &remainder, fine ? BUSHD_CROSSING_FINE : BUSHD_CROSSING_COARSE, &plan);
    position += made;
    steps += std::abs(made);
  }
};

// Steps of a motor on all of its way. None if two of them, around a turn, may be in one tick
// (sim/pace.h: they are A(0) / 2 apart at least).
std::optional<std::int64_t> steps_of_way(const OnPath& on_path, std::size_t motor) {
  const bushd_table& table = *on_path.path->motors()[motor].table;
  const std::uint32_t slowest = std::max(table.accel.code[0], table.cruise);
  if (std::uint64_t{slowest} * table.time_unit_ns < 2 * std::uint64_t{on_path.tick_ns}) return {};
  std::int64_t steps = 0;
  for (std::size_t i = 0; i < on_path.path->segments(); ++i) {
    steps += std::abs(on_path.path->point(i + 1, motor) - on_path.path->point(i, motor));
  }
  return steps;
}

// The axis and its MCU count alike at every tick, stand at the same tick, and there is no step
// later; where a motor turns round it makes the step that leads there, and the one back. If it is
// stopped on the way all stand at one point of the path.
TEST(AxisOnAPath, LeadsItsMotorAlongIt) {
  EXPECT_TRUE(rc::check("ticks", [] {
    OnPath on_path = any_axes();
    if (on_path.path->segments() == 0) return;
    const auto whole = static_cast<std::uint32_t>(on_path.path->steps());
    const double ticks =
        static_cast<double>(on_path.path->units()) * on_path.path->unit_ns() / on_path.tick_ns;
    if (ticks > 3000) return;
    start(on_path, std::make_shared<const PathTrack>(on_path.path, whole), 10);
    std::vector<Mcu> mcus(on_path.axes.size());
    for (std::size_t m = 0; m < mcus.size(); ++m) {
      mcus[m].position = on_path.path->position_at(m, on_path.path->first_step());
    }
    const Tick over = on_path.axes.front().over_tick();
    const std::optional<Tick> stop = between(0, 1) == 0
                                         ? std::nullopt
                                         : std::optional<Tick>(between<std::int64_t>(8, 10 + over));
    if (stop) {
      for (Axis& axis : on_path.axes) {
        axis.stop();
        axis.change(*stop);
      }
    }
    for (Tick tick = 8; tick < 14 + over * 2; ++tick) {
      for (std::size_t m = 0; m < mcus.size(); ++m) {
        Axis& axis = on_path.axes[m];
        std::int16_t told = 0;
        const std::uint16_t delay = axis.render(tick, 1, &told, 1);
        const std::int64_t before = mcus[m].position;
        mcus[m].tick(told, on_path.format);
        if (tick >= axis.end_tick()) RC_ASSERT(mcus[m].position == before);
        if (tick >= axis.end_tick()) RC_ASSERT(told == 0);
        if (tick < axis.end_tick() && tick >= 10)
          RC_ASSERT(delay != 0 || tick + 1 == axis.end_tick());
        axis.executed(tick + 1);
        RC_ASSERT(axis.executed_steps() == mcus[m].position);
      }
    }
    const std::uint32_t end = on_path.axes.front().line_planned_end();
    for (std::size_t m = 0; m < mcus.size(); ++m) {
      RC_ASSERT(on_path.axes[m].line_planned_end() == end);
      RC_ASSERT(mcus[m].position == on_path.path->position_at(m, end));
      RC_ASSERT(mcus[m].position == on_path.axes[m].planned_end_steps());
      const auto steps = steps_of_way(on_path, m);
      if (steps && !stop && on_path.path->first_step() == 0) RC_ASSERT(mcus[m].steps == *steps);
    }
  }));
}

// A run that is resumed stands between two steps of a motor. Of 390 steps of the run it has made
// 120; of 380 that the motor makes step 117 falls at s = 120.07 and step 118 at s = 121.09.
TEST(AxisOnAPath, FirstStepAfterAPauseIsNotLate) {
  OnPath on_path;
  on_path.tick_ns = 2'500'000;
  std::vector<Path::Motor> motors;
  for (int m = 0; m < 2; ++m) {
    on_path.tables.push_back(std::make_unique<TestTable>(test::ramp(), true));
    motors.push_back({on_path.tables.back()->view()});
  }
  const std::vector<std::int64_t> points = {0, 0, 390, 380};
  const auto whole = test::path_through(motors, points, Path::Corners::kContinuous);
  whole->plan(SIZE_MAX);
  on_path.path = whole->rest(120);
  on_path.path->plan(SIZE_MAX);
  start(on_path, std::make_shared<const PathTrack>(on_path.path, 390), 10);
  Axis& axis = on_path.axes[1];
  const auto interval_ns = test::first_interval_ns(axis);
  ASSERT_TRUE(interval_ns);
  const auto& codes = on_path.tables[1]->view()->accel;
  // A tick's displacement is told to 1/256 step, of which each end may take that of the first code.
  EXPECT_GE(*interval_ns, codes.code[1] * 40'000.0 - codes.code[0] * 40'000.0 / 128);
}

}  // namespace
}  // namespace bushd::motion
