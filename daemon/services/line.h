// The course of a line: straight ways, one after the other, or a path. As numbers only; Lines
// carries it out.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <variant>
#include <vector>

#include "base/ids.h"
#include "base/units/coordinates.h"
#include "bus/rs485/line_pace.h"
#include "daemon/services/feed.h"
#include "motion/path.h"
#include "motion/way.h"
#include "tables/table.h"

namespace bushd::daemon {

// A line that a trigger begins.
struct Triggered {
  struct Begin {
    MotorId motor;
    motion::Tick start;
    std::int64_t late_ns;
  };
  bool waits = true;            // some of its motors, or all while none has begun
  bool begun = false;           // by one of them at least
  std::vector<Begin> begins{};  // of those for which it has come
};

// The line that was asked for, and behind it the last approaches of those with backlash.
struct Straight {
  struct Point {
    std::vector<std::int64_t> steps{};
    std::vector<bushd_delay> shortest_delays{};  // of each motor's steps on the way to it
    std::vector<units::Steps> asked_for{};       // of the last point
  };
  std::vector<Point> points{};  // the one that the way leads to, and those to come
  motion::Way way{};
  tables::TablePtr by{};  // what its one motor goes by, in place of its own table
  motion::Way::Law law = motion::Way::Law::kLeading;
  std::optional<Feed> feed{};              // not to be exceeded on any of its ways
  std::shared_ptr<link::LinePace> pace{};  // of the run under way, where ports make it
  std::optional<Triggered> trigger{};

  motion::LineShare share(std::size_t motor, std::uint32_t from, std::uint32_t to) const;
};

// A path of many points, by one run.
struct AlongPath {
  // Planned in one slice; each takes some microseconds at each of three passes.
  static constexpr std::size_t kSegmentsPerSlice = 100;

  std::shared_ptr<motion::Path> path{};              // all of it
  std::shared_ptr<motion::Path> rest{};              // of which the run is that is made, or comes
  std::shared_ptr<const motion::PathTrack> track{};  // of the whole rest
  std::vector<tables::TablePtr> tables{};            // that it points to

  std::uint32_t longest() const { return static_cast<std::uint32_t>(path->steps()); }
  motion::LineShare share(std::size_t motor, std::uint32_t from, std::uint32_t to);
};

struct Line {
  std::vector<MotorId> motors{};  // in the request's order, as all that is by motor
  std::variant<Straight, AlongPath> course{};
  std::uint32_t target = 0;  // step at which its point, or the end of the path, is
  unsigned tries = 1;        // of the beginning of its run

  Straight* straight() { return std::get_if<Straight>(&course); }
  const Straight* straight() const { return std::get_if<Straight>(&course); }
  AlongPath* path() { return std::get_if<AlongPath>(&course); }
  const AlongPath* path() const { return std::get_if<AlongPath>(&course); }

  bool waits() const;      // for a trigger
  bool has_begun() const;  // or does not wait for one
  std::size_t legs() const;
  std::int64_t end_of(std::size_t motor) const;  // steps
  std::uint32_t longest() const;
  std::int64_t position_at(std::size_t motor, std::uint32_t step) const;
  double most_steps_per_s(std::size_t motor) const;
  // Whether a motor's share of a run before was of the same way, or path.
  bool is_of(const motion::LineShare& share) const;
  // A motor's share of a run between these steps.
  motion::LineShare share(std::size_t motor, std::uint32_t from, std::uint32_t to);
};

}  // namespace bushd::daemon
