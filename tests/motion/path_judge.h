// Judges the run of a path by what its motors do, in exact fractions and without code of the
// planner.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <memory>
#include <span>
#include <sstream>
#include <string>
#include <vector>

#include "engine/tables.h"
#include "motion/path.h"

namespace bushd::test {

// Rows of points of all motors, the first one where they stand, and the shortest delays of the ways
// to the others.
inline std::unique_ptr<motion::Path> path_through(
    const std::vector<motion::Path::Motor>& motors, const std::vector<std::int64_t>& points,
    motion::Path::Corners corners, const std::vector<bushd_delay>& shortest_delays = {}) {
  const std::size_t width = motors.size();
  const std::span all(points);
  auto path = std::make_unique<motion::Path>(motors, all.first(width), corners);
  for (std::size_t at = width; at < all.size(); at += width) {
    const std::span slower(shortest_delays);
    path->add(all.subspan(at, width), slower.empty() ? slower : slower.subspan(at - width, width));
  }
  return path;
}

// A run in segments: step `first` .. of each, by their delays.
struct Ran {
  std::size_t segment;
  std::uint32_t first;
  motion::Profile profile;
};

inline std::vector<Ran> whole(const motion::Path& path) {
  std::vector<Ran> run;
  for (std::size_t i = 0; i < path.segments(); ++i)
    run.push_back({i, path.first_of(i) - path.start_of(i), path.profile(i)});
  return run;
}

// When a motor makes its steps: `units` and a part of one more, and how it came to it.
struct OwnStep {
  std::uint64_t units;
  std::uint64_t part;   // over 2 N
  std::uint64_t twice;  // 2 N
  int direction;
  bool begins;  // it has stood or turned since the step before
};

inline std::vector<OwnStep> steps_of(const motion::Path& path, const std::vector<Ran>& run,
                                     std::size_t motor, bool rests) {
  std::vector<OwnStep> steps;
  std::uint64_t before = 0;
  int direction = 0;
  for (const auto& [segment, first, profile] : run) {
    const std::int64_t way = path.point(segment + 1, motor) - path.point(segment, motor);
    const int now = way > 0 ? 1 : way < 0 ? -1 : 0;
    const std::uint64_t n = static_cast<std::uint64_t>(std::abs(way));
    const std::uint64_t longest = path.length_of(segment);
    std::uint32_t s = first;
    bool begins = now != direction || rests;
    for (const auto& [count, delay] : profile) {
      for (std::uint32_t i = 0; i < count; ++i, ++s) {
        // Its steps j at (2j - 1) L + N <= 2N (s + 1), of which those after s are made in this one.
        const std::uint64_t made_after =
            n == 0 ? 0 : (2 * n * (s + 1) + longest - n) / (2 * longest);
        const std::uint64_t made_before = n == 0 ? 0 : (2 * n * s + longest - n) / (2 * longest);
        for (std::uint64_t j = made_before + 1; j <= made_after; ++j) {
          const std::uint64_t rest = (2 * j - 1) * longest + n - 2 * n * s;
          steps.push_back({before, rest * delay, 2 * n, now, begins});
          begins = false;
        }
        before += delay;
      }
    }
    direction = now;
  }
  return steps;
}

inline Law law_of(const bushd_table& table) {
  return {.accel = {table.accel.code, table.accel.code + table.accel.count},
          .decel = {table.decel.code, table.decel.code + table.decel.count},
          .cruise = table.cruise,
          .unit_ns = table.time_unit_ns};
}

// No interval of a motor between two of its steps is shorter than its table allows after so many
// steps since it stood or turned, and with so many to go; over a rest not shorter than from it.
inline std::string too_close(const motion::Path& path, const std::vector<Ran>& run,
                             bool rests = false) {
  __extension__ using Signed = __int128;
  for (std::size_t m = 0; m < path.motors().size(); ++m) {
    const bushd_table& table = *path.motors()[m].table;
    const std::vector<OwnStep> steps = steps_of(path, run, m, rests);
    std::vector<std::uint32_t> to_go(steps.size(), 0);
    for (std::size_t i = steps.size(); i-- > 1;) {
      to_go[i - 1] = steps[i].begins ? 0 : to_go[i] + 1;
    }
    std::uint32_t made = 0;
    for (std::size_t i = 1; i < steps.size(); ++i) {
      const OwnStep& a = steps[i - 1];
      const OwnStep& b = steps[i];
      made = b.begins ? 0 : made + 1;
      auto least = static_cast<std::uint32_t>(
          std::max<bushd_delay>(table.cruise, path.motors()[m].shortest_delay));
      if (b.begins) {
        if (rests) least = std::max<std::uint32_t>(least, table.accel.code[0]);
      } else {
        least = std::max<std::uint32_t>(
            {least, bushd_table_accel(&table, made), bushd_table_decel(&table, to_go[i])});
      }
      // (b - a) 2N 2N' >= least
      const Signed whole = Signed{b.units} - Signed{a.units};
      const Signed have =
          whole * a.twice * b.twice + Signed{b.part} * a.twice - Signed{a.part} * b.twice;
      const Signed want = Signed{least} * table.time_unit_ns * a.twice * b.twice;
      if (have * path.unit_ns() >= want) continue;
      std::ostringstream text;
      text << "motor " << m << " makes its step " << i + 1 << " after "
           << static_cast<double>(have) / static_cast<double>(a.twice) /
                  static_cast<double>(b.twice)
           << " units, allowed are "
           << least * (static_cast<double>(table.time_unit_ns) / path.unit_ns());
      return text.str();
    }
  }
  return {};
}

// What is asked of corners that are passed.
inline std::string bad_corner(const motion::Path& path, const std::vector<Ran>& run) {
  for (std::size_t i = 1; i < run.size(); ++i) {
    const std::size_t segment = run[i].segment;
    const long double e = run[i - 1].profile.back().delay;
    const long double d = run[i].profile.front().delay;
    for (std::size_t m = 0; m < path.motors().size(); ++m) {
      const bushd_table& table = *path.motors()[m].table;
      const std::int64_t before = path.point(segment, m) - path.point(segment - 1, m);
      const std::int64_t behind = path.point(segment + 1, m) - path.point(segment, m);
      const long double v1 = std::abs(before) / (path.length_of(segment - 1) * e);
      const long double v2 = std::abs(behind) / (path.length_of(segment) * d);
      const long double slow =
          static_cast<long double>(std::max(table.accel.code[0], table.cruise)) *
          table.time_unit_ns / path.unit_ns();
      const bool turns = before * behind < 0;
      // It is no corner to this motor, which goes on by its table.
      if (before * path.length_of(segment) == behind * path.length_of(segment - 1)) continue;
      const long double squares = turns ? v1 * v1 + v2 * v2 : std::abs(v2 * v2 - v1 * v1);
      if (squares * slow * slow <= 1 + 1e-9L) continue;
      std::ostringstream text;
      text << "corner before segment " << segment << ": motor " << m << " from "
           << (double)(v1 * slow) << " to " << (double)(v2 * slow) << " F"
           << (turns ? ", turning" : "");
      return text.str();
    }
  }
  return {};
}

}  // namespace bushd::test
