#include "motion/path.h"

#include <gtest/gtest.h>

#include <memory>
#include <ostream>
#include <vector>

#include "motion/path_judge.h"
#include "motion/ramp.h"

namespace bushd::motion {
namespace {

using test::any_law;
using test::bad_corner;
using test::between;
using test::Law;
using test::TestTable;
using test::too_close;
using test::whole;

struct Planned {
  std::vector<std::unique_ptr<TestTable>> tables;
  std::vector<std::int64_t> points;
  std::unique_ptr<Path> path;
};

Planned planned(const std::vector<Law>& laws, std::vector<std::int64_t> points,
                Path::Corners corners, std::vector<std::uint16_t> floors = {}) {
  Planned made;
  std::vector<Path::Motor> motors;
  for (const Law& law : laws) {
    made.tables.push_back(std::make_unique<TestTable>(law, true));
    motors.push_back({made.tables.back()->view()});
  }
  made.points = points;
  made.path = std::make_unique<Path>(motors, std::move(points), corners, std::move(floors));
  while (!made.path->plan(7)) {
  }
  return made;
}

std::vector<std::uint32_t> delays(const Path& path) {
  std::vector<std::uint32_t> all;
  for (std::size_t i = 0; i < path.segments(); ++i) {
    for (const Delays& one : path.profile(i)) all.insert(all.end(), one.steps, one.delay);
  }
  return all;
}

std::string text_of(const Planned& made) {
  std::ostringstream text;
  text << "points";
  for (const std::int64_t at : made.points) text << ' ' << at;
  for (const auto& table : made.tables) {
    text << "\naccel";
    for (const auto code : table->law().accel) text << ' ' << code;
    text << " decel";
    for (const auto code : table->law().decel) text << ' ' << code;
    text << " cruise " << table->law().cruise << " unit " << table->law().unit_ns;
  }
  text << "\n";
  for (const auto delay : delays(*made.path)) text << ' ' << delay;
  return text.str();
}

// Tables that accelerate, as far as their sides go, not too far from each other.
Law any_motor(std::uint32_t unit_ns) {
  Law law = any_law();
  law.unit_ns = unit_ns;
  return law;
}

Planned any_path(Path::Corners corners) {
  const auto width = between<std::size_t>(1, 4);
  const auto rows = between<std::size_t>(2, 12);
  const std::int64_t far = *rc::gen::element<std::int64_t>(2, 6, 40, 200);
  std::vector<Law> laws;
  const std::uint32_t unit_ns = *rc::gen::element<std::uint32_t>(100, 999);
  for (std::size_t m = 0; m < width; ++m)
    laws.push_back(any_motor(m % 2 == 0 ? unit_ns : 2 * unit_ns));
  std::vector<std::int64_t> points(width, 0);
  std::vector<std::int64_t> way(width, 0);
  for (std::size_t row = 1; row < rows; ++row) {
    const int kind = between(0, 3);
    for (std::size_t m = 0; m < width; ++m) {
      if (kind == 0) {
        way[m] = between<std::int64_t>(-far, far);
      } else if (kind == 1) {
        way[m] += between<std::int64_t>(-1, 1);
      } else if (kind == 2) {
        way[m] = between<std::int64_t>(0, far);
      }
      points.push_back(points[points.size() - width] + way[m]);
    }
  }
  return planned(laws, std::move(points), corners);
}

TEST(Path, OfOneSegmentAndOneMotorIsTheMotorsOwnMove) {
  for (const std::int64_t steps : {1, 5, 30, 37, 400}) {
    const Planned made = planned({test::ramp()}, {7, 7 - steps}, Path::Corners::kContinuous);
    const std::vector<std::uint32_t> all = delays(*made.path);
    ASSERT_EQ(all.size(), static_cast<std::size_t>(steps));
    for (std::uint32_t j = 1; j <= steps; ++j) {
      EXPECT_EQ(all[j - 1],
                bushd_table_delay(made.tables[0]->view(), j, static_cast<std::uint32_t>(steps)))
          << j;
    }
  }
}

TEST(Path, PointsOnAStraightWayChangeNothing) {
  const Planned whole = planned({test::ramp()}, {0, 400}, Path::Corners::kContinuous);
  std::vector<std::int64_t> points;
  for (std::int64_t at = 0; at <= 400; at += 1 + at % 3) points.push_back(at);
  points.push_back(400);
  const Planned cut = planned({test::ramp()}, points, Path::Corners::kContinuous);
  EXPECT_EQ(delays(*cut.path), delays(*whole.path));
}

TEST(Path, NoMotorIsFasterThanItsTableAllows) {
  EXPECT_TRUE(rc::check("intervals and corners", [] {
    for (const auto corners : {Path::Corners::kContinuous, Path::Corners::kExact}) {
      const Planned made = any_path(corners);
      if (made.path->segments() == 0) continue;
      const auto close = too_close(*made.path, whole(*made.path), corners == Path::Corners::kExact);
      if (!close.empty()) RC_FAIL(close + "\n" + text_of(made));
      if (corners == Path::Corners::kExact) continue;
      const auto bad = bad_corner(*made.path, whole(*made.path));
      if (!bad.empty()) RC_FAIL(bad + "\n" + text_of(made));
    }
  }));
}

}  // namespace
}  // namespace bushd::motion
