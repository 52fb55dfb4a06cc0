#include "motion/path.h"

#include <gtest/gtest.h>

#include <memory>
#include <ostream>
#include <vector>

#include "motion/path_judge.h"
#include "motion/path_run.h"
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
                Path::Corners corners, std::vector<bushd_delay> shortest_delays = {}) {
  Planned made;
  std::vector<Path::Motor> motors;
  for (const Law& law : laws) {
    made.tables.push_back(std::make_unique<TestTable>(law, true));
    motors.push_back({made.tables.back()->view()});
  }
  made.points = points;
  made.path = test::path_through(motors, points, corners, shortest_delays);
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

Planned any_path(Path::Corners corners, bool from_anywhere = false) {
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
  Planned made = planned(laws, std::move(points), corners);
  if (from_anywhere && made.path->segments() > 0) {
    const auto begin =
        between<std::uint32_t>(0, static_cast<std::uint32_t>(made.path->steps()) - 1);
    made.path = made.path->rest(begin);
    made.path->plan(SIZE_MAX);
  }
  return made;
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

std::vector<test::Ran> run_of(const PathTrack& track) {
  std::vector<test::Ran> run;
  const Path& path = track.path();
  if (track.from() == track.to()) return run;
  for (std::size_t i = path.segment_at(track.from()); i <= path.segment_at(track.to() - 1); ++i) {
    run.push_back({i, path.first_of(i) - path.start_of(i), *track.profile(i)});
  }
  return run;
}

// What a run has made, up to the end of step `running`, and then what another one makes.
std::vector<test::Ran> joined(const std::vector<test::Ran>& made, std::uint32_t running,
                              const PathTrack& track) {
  const Path& path = track.path();
  const std::size_t segment = path.segment_at(running);
  std::vector<test::Ran> run;
  for (const test::Ran& part : made) {
    if (part.segment < segment) run.push_back(part);
    if (part.segment != segment) continue;
    const std::uint32_t steps = running + 1 - path.start_of(segment) - part.first;
    run.push_back({segment, part.first, part_of(part.profile, 0, steps)});
    const Profile behind = part_of(*track.profile(segment), steps, UINT32_MAX);
    run.back().profile.insert(run.back().profile.end(), behind.begin(), behind.end());
  }
  for (const test::Ran& part : run_of(track)) {
    if (part.segment > segment) run.push_back(part);
  }
  return run;
}

std::uint64_t units_of_run(const std::vector<test::Ran>& run) {
  std::uint64_t units = 0;
  for (const auto& part : run) units += units_of(part.profile);
  return units;
}

// A run from rest anywhere is stopped anywhere, and once more while it ramps down.
TEST(Path, NoMotorIsFasterThanItsTableAllowsUnderStops) {
  EXPECT_TRUE(rc::check("stops", [] {
    const Planned made = any_path(Path::Corners::kContinuous, between(0, 1) == 0);
    const std::shared_ptr<const Path> path(made.path.get(), [](const Path*) {});
    const auto whole_steps = static_cast<std::uint32_t>(path->steps());
    if (whole_steps == 0) return;
    const std::uint32_t from = path->first_step();
    auto track = std::make_shared<const PathTrack>(path, whole_steps);
    std::uint32_t running = from;
    auto run = run_of(*track);
    for (int stops = 0; stops < 3; ++stops) {
      RC_ASSERT(units_of_run(run_of(*track)) == track->units());
      std::uint32_t length = 0;
      for (const auto& part : run) {
        for (const Delays& delays : part.profile) length += delays.steps;
      }
      RC_ASSERT(length == track->to() - from);
      auto bad = too_close(*path, run);
      if (bad.empty()) bad = bad_corner(*path, run);
      if (!bad.empty()) {
        std::ostringstream text;
        text << bad << "\nfrom " << from << ", stop " << stops << " at " << running << ", to "
             << track->to() << "\n"
             << text_of(made) << "\n";
        for (const auto& part : run) {
          text << " |";
          for (const Delays& delays : part.profile)
            text << ' ' << delays.steps << 'x' << delays.delay;
        }
        RC_FAIL(text.str());
      }
      if (running >= track->to()) break;
      running = between(running, track->to() - 1);
      const auto stopped = track->ending(track, running, 0);
      RC_ASSERT(stopped->to() > running);
      RC_ASSERT(stopped->to() <= track->to());
      // What the run has made stays what it was.
      const std::size_t segment = path->segment_at(running);
      const std::uint32_t local = running - path->first_of(segment);
      RC_ASSERT(part_of(*stopped->profile(segment), local, 1) ==
                part_of(*track->profile(segment), local, 1));
      run = joined(run, running, *stopped);
      track = stopped;
    }
  }));
}

}  // namespace
}  // namespace bushd::motion
