// Lines that are paths: from points to a plan, and what differs then.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "daemon/services/lines.h"

namespace bushd::daemon {
namespace {

// Segments that are planned in one slice; each takes some microseconds at each of three passes.
constexpr std::size_t kSegmentsPerSlice = 100;
constexpr std::size_t kMostComing = 4;

// Of a single motor's way: the first point that is not on the way to the last one; 0: all are.
std::size_t first_turn(const std::vector<std::int64_t>& points) {
  const bool falls = points.back() < points.front();
  for (std::size_t i = 1; i < points.size(); ++i) {
    if (falls ? points[i] > points[i - 1] : points[i] < points[i - 1]) return i;
  }
  return 0;
}

}  // namespace

std::uint32_t Lines::Line::longest() const {
  return path ? static_cast<std::uint32_t>(path->steps()) : way.longest();
}

std::int64_t Lines::Line::position_at(std::size_t motor, std::uint32_t step) const {
  return path ? path->position_at(motor, step) : way.position_at(motor, step);
}

double Lines::Line::most_steps_per_s(std::size_t motor) const {
  return path ? path->most_steps_per_s(motor) : way.most_steps_per_s(motor);
}

motion::LineShare Lines::Line::share(std::size_t motor, std::uint32_t from, std::uint32_t to) {
  if (!path) return way.share(motor, from, to);
  motion::LineShare share{.way = path->number(),
                          .track = {},
                          .motor = motor,
                          .increment = 1,
                          .longest = longest(),
                          .from = from,
                          .to = to};
  if (rest->first_step() == from && to == rest->steps()) {
    if (!track) track = std::make_shared<const motion::PathTrack>(rest, to);
    share.track = track;
    return share;
  }
  // One that has stopped earlier than others goes after them: some segments.
  std::shared_ptr<motion::Path> part = path->rest(from, path->segment_at(to - 1));
  part->plan(SIZE_MAX);
  share.track = std::make_shared<const motion::PathTrack>(part, to);
  return share;
}

void Lines::request(std::int64_t, const api::Asker& asker, const api::MovePath& request) {
  const auto motors = installation_.find(request.motors);
  if (!motors) return asker.answer(api::Refused{motors.error().text()});
  auto whole = path_points_.take(asker, request);
  if (!whole) return asker.answer(api::Refused{whole.error().text()});
  if (!*whole) {
    return asker.answer(api::Completed{.outcome = api::Outcome::kDone,
                                       .reason = "these points are taken; more are to come",
                                       .detail = {}});
  }
  if (coming_.size() >= kMostComing) {
    return asker.answer(api::Refused{
        fmt::format("{} paths are being planned; try again in a moment", coming_.size())});
  }
  auto line = path_of(**whole);
  if (!line) return asker.answer(api::Refused{line.error().text()});
  if (auto may = may_begin(*line); !may) return asker.answer(api::Refused{may.error().text()});
  coming_.push_back({asker, (*whole)->dry_run, std::move(*line)});
}

Result<Lines::Line> Lines::path_of(const api::MovePath& request) const {
  Line line{.motors = *installation_.find(request.motors), .points = {}, .way = {}};
  if (const auto may = interlocks_.may_move(); !may) return fail(may.error());
  if (const auto one = on_one_bus(line.motors); !one) return fail(one.error());
  std::vector<motion::Path::Motor> motors;
  Point to;
  for (const MotorId id : line.motors) {
    const auto floor = moves_.floor_of(id, request.speed);
    if (!floor) return fail(floor.error());
    line.tables.push_back(installation_.table_of(id));
    motors.push_back({&line.tables.back()->view(), *floor});
    to.floors.push_back(*floor);
  }
  auto points = points_of(line.motors, request, to.floors);
  if (!points) return fail(points.error());
  auto floors = floors_of(line.motors.front(), request, *points, to.floors.front());
  if (!floors) return fail(floors.error());
  to.steps.assign(points->end() - static_cast<std::ptrdiff_t>(motors.size()), points->end());
  const auto corners = request.corners == api::MovePath::Corners::kExact
                           ? motion::Path::Corners::kExact
                           : motion::Path::Corners::kContinuous;
  line.path = std::make_shared<motion::Path>(std::move(motors), std::move(*points), corners,
                                             std::move(*floors));
  if (line.path->steps() > std::uint64_t{motion::Motor::kMaxPosition}) {
    return fail(fmt::format("the path has {} steps; at most {}: make several paths of it",
                            line.path->steps(), motion::Motor::kMaxPosition));
  }
  line.rest = line.path;
  line.target = static_cast<std::uint32_t>(line.path->steps());
  line.points.push_back(std::move(to));
  return line;
}

// In steps, behind where the motors stand. What is asked of a motor are the ends of its way.
Result<std::vector<std::int64_t>> Lines::points_of(const std::vector<MotorId>& motors,
                                                   const api::MovePath& request,
                                                   const std::vector<std::uint16_t>& floors) const {
  const std::size_t width = motors.size();
  std::vector<std::int64_t> points;
  points.reserve(request.positions.size() + width);
  for (const MotorId id : motors) points.push_back(installation_[id].position_steps());
  std::vector<std::size_t> low(width, 0);
  std::vector<std::size_t> high(width, 0);
  const auto wrong = [&](std::size_t at, const std::string& why) {
    return fail(
        fmt::format("point {}, {}: {}", at / width, installation_[motors[at % width]].name(), why));
  };
  for (const double position : request.positions) {
    const std::size_t at = points.size();
    const std::size_t m = at % width;
    const auto steps = installation_[motors[m]].steps_of_position(api::UserUnits{position});
    if (!steps) return wrong(at, steps.error().message);
    points.push_back(*steps);
    if (*steps < points[low[m] * width + m]) low[m] = at / width;
    if (*steps > points[high[m] * width + m]) high[m] = at / width;
  }
  for (std::size_t m = 0; m < width; ++m) {
    const motion::Motor& motor = installation_[motors[m]];
    if (auto may = interlocks_.may_move(motors[m]); !may) {
      return fail(motor.name() + ": " + may.error().text());
    }
    for (const std::size_t row : {std::min(low[m], high[m]), std::max(low[m], high[m])}) {
      const auto may = motor.may_move_to(points[row * width + m], floors[m]);
      if (!may) return wrong(row * width + m, may.error().text());
    }
  }
  return points;
}

// Of each segment of a single motor, if it has speeds.
Result<std::vector<std::uint16_t>> Lines::floors_of(MotorId motor, const api::MovePath& request,
                                                    const std::vector<std::int64_t>& points,
                                                    std::uint16_t floor) const {
  std::vector<std::uint16_t> floors;
  // It would go to the zone's beginning first.
  if (const std::size_t turn = first_turn(points); !request.speeds.empty() && turn != 0) {
    return fail(
        fmt::format("point {}, {}: it does not lie on the way from the point before it to "
                    "the last one; give points of speeds in their order",
                    turn, installation_[motor].name()));
  }
  for (std::size_t i = 0; i < request.speeds.size(); ++i) {
    floors.push_back(floor);
    if (request.speeds[i] == 0) continue;
    const auto slower = moves_.floor_of(motor, api::Speed{.per_s = request.speeds[i]});
    if (!slower) return fail(fmt::format("point {}, {}", i + 1, slower.error().text()));
    floors.back() = std::max(floor, *slower);
  }
  return floors;
}

// All stand where the path begins, and nothing keeps them there.
Result<void> Lines::may_begin(const Line& line) const {
  if (const auto may = interlocks_.may_move(); !may) return fail(may.error());
  for (std::size_t i = 0; i < line.motors.size(); ++i) {
    const motion::Motor& motor = installation_[line.motors[i]];
    const std::string name = motor.name() + ": ";
    if (motor.has_plan()) {
      return fail(name + "it moves; a path begins at rest, so stop it or wait for its result");
    }
    if (auto may = interlocks_.may_move(line.motors[i]); !may) {
      return fail(name + may.error().text());
    }
    if (motor.position_steps() != line.path->point(0, i) ||
        &installation_.table_of(line.motors[i])->view() != line.path->motors()[i].table) {
      return fail(name +
                  "it was moved, or its table changed, while the path was planned; send it "
                  "again");
    }
  }
  return {};
}

bool Lines::plans() const {
  return !coming_.empty() || std::ranges::any_of(lines_, [](const auto& line) {
    return line.second.path && !line.second.rest->is_planned();
  });
}

// What is under way comes first.
void Lines::work() {
  for (auto& [number, line] : lines_) {
    if (line.path && !line.rest->is_planned()) {
      line.rest->plan(kSegmentsPerSlice);
      return;
    }
  }
  if (!coming_.empty()) coming_.front().line.path->plan(kSegmentsPerSlice);
}

void Lines::begin_path(std::int64_t now_us, Coming coming) {
  auto& [asker, dry_run, line] = coming;
  const auto refuse = [&](const Error& why) { asker.answer(api::Refused{why.text()}); };
  // A table that a path uses may have been replaced, so that this comes first.
  if (const auto may = may_begin(line); !may) return refuse(may.error());
  const motion::Path& path = *line.path;
  const double tick_ns = installation_[line.motors.front()].axis().tick_ns();
  const double longest_ns = tick_ns * motion::Axis::kMaxDurationTicks;
  const double duration_ns = static_cast<double>(path.units()) * path.unit_ns();
  if (duration_ns > longest_ns) {
    return refuse(
        Error{fmt::format("the path would take {:.0f} days; the longest move is {:.0f} "
                          "days: make several paths of it",
                          duration_ns / 86400e9, longest_ns / 86400e9)});
  }
  if (!dry_run) return start(now_us, asker, std::move(line));
  std::vector<DryRun::Part> parts;
  for (std::size_t i = 0; i < line.motors.size(); ++i) {
    const std::int64_t from = path.point(0, i);
    DryRun::Part part{line.motors[i], path.point(path.segments(), i) - from, 0, from};
    if (line.longest() != 0) part.line = line.share(i, 0, line.longest());
    parts.push_back(std::move(part));
  }
  dry_runs_.request(now_us, asker, parts);
}

}  // namespace bushd::daemon
