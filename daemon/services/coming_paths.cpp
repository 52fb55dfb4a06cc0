// From points to a plan.
#include "daemon/services/coming_paths.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "daemon/services/line_motors.h"

namespace bushd::daemon {
namespace {

constexpr std::size_t kMostComing = 4;

}  // namespace

// Points are looked at as they come: a million of them at once would keep others waiting.
void ComingPaths::request(const api::Asker& asker, const api::MovePath& request) {
  const auto refuse = [&](const Error& why) { asker.answer(api::Refused{why.text()}); };
  const std::string client = asker.session ? asker.session->client_id() : std::string();
  const auto motors = installation_.find(request.motors);
  if (!motors) return refuse(motors.error());
  const auto last = path_points_.take(client, request);
  if (request.first_row == 0) {
    incoming_.erase(client);
    ended_.erase(client);
  }
  if (!last) return refuse(last.error());
  const auto is_dropped = [&](const auto& one) {
    return one.first != client && !path_points_.has(one.first);
  };
  std::erase_if(incoming_, is_dropped);
  std::erase_if(ended_, is_dropped);
  auto incoming = incoming_.find(client);
  if (incoming != incoming_.end()) {
    Incoming& path = incoming->second;
    path.after_stops = std::min(path.after_stops, asker.after_stops);
  }
  if (const auto by = overtaken(client, asker, request)) {
    incoming_.erase(client);
    ended_.erase(client);
    if (!*last) ended_.emplace(client, *by);
    return open_.not_begun(asker, *by);
  }
  Result<void> good;
  if (incoming == incoming_.end()) {
    auto begun = begin_points(asker, request);
    if (begun) {
      incoming = incoming_.emplace(client, std::move(*begun)).first;
    } else {
      good = fail(begun.error());
    }
  }
  if (good) good = same_scales(incoming->second);
  if (good) good = add_points(incoming->second, request);
  if (good && *last) good = may_follow(incoming->second);
  if (good && *last && coming_.size() >= kMostComing) {
    good = fail(fmt::format("{} paths are being planned; try again in a moment", coming_.size()));
  }
  if (!good) {
    path_points_.drop(client);
    incoming_.erase(client);
    return refuse(good.error());
  }
  if (!*last) {
    asker.answer(api::Accepted{});
    return asker.answer(api::done("these points are taken; more are to come"));
  }
  incoming->second.along.rest = incoming->second.along.path;
  coming_.push_back({asker, request.dry_run, std::move(incoming->second)});
  incoming_.erase(incoming);
}

std::optional<Precedence::Overtaken> ComingPaths::overtaken(const Incoming& path) const {
  return open_.precedence().overtaken(path.after_stops, path.motors);
}

// A stop since its first points has ended all of it: those that come still, too.
std::optional<Precedence::Overtaken> ComingPaths::overtaken(const std::string& client,
                                                            const api::Asker& asker,
                                                            const api::MovePath& part) const {
  if (part.dry_run) return std::nullopt;
  if (const auto ended = ended_.find(client); ended != ended_.end()) return ended->second;
  if (const auto path = incoming_.find(client); path != incoming_.end()) {
    return overtaken(path->second);
  }
  return open_.precedence().overtaken(asker.after_stops, *installation_.find(part.motors));
}

void ComingPaths::end_overtaken() {
  std::erase_if(coming_, [this](const Coming& coming) {
    const auto by = coming.dry_run ? std::nullopt : overtaken(coming.path);
    if (by) open_.not_begun(coming.asker, *by);
    return by.has_value();
  });
}

Result<ComingPaths::Incoming> ComingPaths::begin_points(const api::Asker& asker,
                                                        const api::MovePath& request) const {
  Incoming incoming;
  incoming.after_stops = asker.after_stops;
  AlongPath& along = incoming.along;
  incoming.motors = *installation_.find(request.motors);
  if (const auto may = interlocks_.may_move(); !may) return fail(may.error());
  if (const auto one = on_one_bus(installation_, incoming.motors); !one) return fail(one.error());
  std::vector<motion::Path::Motor> motors;
  std::vector<std::int64_t> begin;
  for (const MotorId id : incoming.motors) {
    const auto shortest_delay = moves_.shortest_delay_of(id, request.speed);
    if (!shortest_delay) return fail(shortest_delay.error());
    along.tables.push_back(installation_.table_of(id));
    motors.push_back({&along.tables.back()->view(), *shortest_delay});
    incoming.shortest_delays.push_back(*shortest_delay);
    begin.push_back(installation_[id].position_steps());
    incoming.scales.push_back(installation_[id].scale().coordinates().scale());
    incoming.low.push_back({0, begin.back()});
    incoming.high.push_back({0, begin.back()});
  }
  if (request.feed) {
    auto feed =
        Feed::make(installation_, incoming.motors, *request.feed, motion::Way::Law::kLeading);
    if (!feed) return fail(feed.error());
    incoming.feed = std::move(*feed);
  }
  const auto corners = request.corners == api::MovePath::Corners::kExact
                           ? motion::Path::Corners::kExact
                           : motion::Path::Corners::kContinuous;
  along.path = std::make_shared<motion::Path>(std::move(motors), begin, corners,
                                              static_cast<std::size_t>(request.rows));
  if (auto may = may_begin(incoming); !may) return fail(may.error());
  return incoming;
}

// Points become steps as they are taken: by another offset or direction later ones would lie
// elsewhere.
Result<void> ComingPaths::same_scales(const Incoming& incoming) const {
  for (std::size_t m = 0; m < incoming.scales.size(); ++m) {
    const motion::Motor& motor = installation_[incoming.motors[m]];
    if (motor.scale().coordinates().scale() == incoming.scales[m]) continue;
    return fail(
        motor.name() +
        ": its offset or direction has changed since the path's first points were received; send "
        "the path again from its beginning");
  }
  return {};
}

Result<void> ComingPaths::add_points(Incoming& incoming, const api::MovePath& request) const {
  motion::Path& path = *incoming.along.path;
  const std::size_t width = incoming.motors.size();
  std::vector<std::int64_t> point(width);
  std::vector<bushd_delay> shortest_delays;
  for (std::size_t at = 0; at < request.positions.size(); at += width) {
    const std::int32_t row = ++incoming.rows;
    for (std::size_t m = 0; m < width; ++m) {
      const motion::Motor& motor = installation_[incoming.motors[m]];
      const auto wrong = [&](const std::string& why) {
        return fail(fmt::format("point {}, {}: {}", row, motor.name(), why));
      };
      const auto steps = motor.scale().steps_of_position(api::UserUnits{request.positions[at + m]});
      if (!steps) return wrong(steps.error().message);
      if (*steps < -motion::Motor::kMaxPosition || *steps > motion::Motor::kMaxPosition)
        return wrong(fmt::format("it is beyond +-{} steps", motion::Motor::kMaxPosition));
      point[m] = *steps;
      if (*steps < incoming.low[m].steps) incoming.low[m] = {row, *steps};
      if (*steps > incoming.high[m].steps) incoming.high[m] = {row, *steps};
    }
    shortest_delays.clear();
    if (!request.speeds.empty()) {
      auto shortest_delay = shortest_delay_to(incoming, point.front(), request.speeds[at]);
      if (!shortest_delay)
        return fail(fmt::format("point {}, {}", row, shortest_delay.error().text()));
      shortest_delays.assign(1, *shortest_delay);
    }
    if (auto may = add_feed(incoming, point, shortest_delays); !may) {
      return fail(fmt::format("point {}, {}", row, may.error().text()));
    }
    path.add(point, shortest_delays);
  }
  if (path.steps() <= static_cast<std::uint64_t>(motion::Motor::kMaxPosition)) return {};
  return fail(fmt::format("the path has more than {} steps; make several paths of it",
                          motion::Motor::kMaxPosition));
}

Result<void> ComingPaths::add_feed(const Incoming& incoming, std::span<const std::int64_t> point,
                                   std::vector<bushd_delay>& shortest_delays) const {
  if (!incoming.feed) return {};
  const motion::Path& path = *incoming.along.path;
  std::vector<std::int64_t> before;
  for (std::size_t m = 0; m < point.size(); ++m) {
    before.push_back(path.point(path.segments(), m));
  }
  const double way_ns = incoming.feed->way_ns(before, point);
  if (shortest_delays.empty()) shortest_delays = incoming.shortest_delays;
  for (std::size_t m = 0; m < point.size(); ++m) {
    const auto steps = static_cast<double>(std::abs(point[m] - before[m]));
    if (steps == 0) continue;
    const double step_ns = way_ns / steps;
    if (auto may = incoming.feed->is_possible(step_ns); !may) return may;
    const auto units = motion::Way::units_of(step_ns, path.motors()[m].table->time_unit_ns);
    shortest_delays[m] = std::max(shortest_delays[m], units);
  }
  return {};
}

// The shortest delay on the way to a point of a motor with speeds.
Result<bushd_delay> ComingPaths::shortest_delay_to(Incoming& incoming, std::int64_t point,
                                                   double speed) const {
  const MotorId id = incoming.motors.front();
  const motion::Path& path = *incoming.along.path;
  const std::int64_t way = point - path.point(path.segments(), 0);
  const int direction = way > 0 ? 1 : way < 0 ? -1 : 0;
  // It would go to the beginning of a speed first, and back.
  if (direction * incoming.direction < 0) {
    return fail(installation_[id].name() +
                ": it lies behind the point before it, or the motor; "
                "give speeds in the order of their positions");
  }
  if (direction != 0) incoming.direction = direction;
  if (speed == 0) return incoming.shortest_delays.front();
  const auto shortest_delay = moves_.shortest_delay_of(id, api::Speed{.per_s = speed});
  if (!shortest_delay) return fail(shortest_delay.error());
  return std::max(*shortest_delay, incoming.shortest_delays.front());
}

// All stand at its beginning, points are still the steps that they were, and each motor may go to
// the ends of its way.
Result<void> ComingPaths::may_follow(const Incoming& incoming) const {
  if (auto may = may_begin(incoming); !may) return may;
  if (auto same = same_scales(incoming); !same) return same;
  for (std::size_t m = 0; m < incoming.motors.size(); ++m) {
    const motion::Motor& motor = installation_[incoming.motors[m]];
    for (const auto& [row, steps] : {incoming.low[m], incoming.high[m]}) {
      const auto may = motor.reach().may_move_to(steps, incoming.shortest_delays[m]);
      if (may) continue;
      const std::string where = row == 0 ? "" : fmt::format("point {}, ", row);
      return fail(fmt::format("{}{}: {}", where, motor.name(), may.error().text()));
    }
  }
  return {};
}

// All stand where the path begins, and nothing keeps them there.
Result<void> ComingPaths::may_begin(const Incoming& incoming) const {
  const motion::Path& path = *incoming.along.path;
  if (const auto may = interlocks_.may_move(); !may) return fail(may.error());
  for (std::size_t i = 0; i < incoming.motors.size(); ++i) {
    const motion::Motor& motor = installation_[incoming.motors[i]];
    const std::string name = motor.name() + ": ";
    if (auto may = interlocks_.may_move(incoming.motors[i]); !may) {
      return fail(name + may.error().text());
    }
    if (motor.has_plan()) {
      return fail(name + "it moves; a path begins at rest, so stop it or wait for its result");
    }
    if (motor.position_steps() != path.point(0, i) ||
        &installation_.table_of(incoming.motors[i])->view() != path.motors()[i].table) {
      return fail(name +
                  "it was moved, or its table changed, while the path was planned; send it "
                  "again");
    }
  }
  return {};
}

Result<void> ComingPaths::is_short_enough(const Incoming& incoming) const {
  const motion::Path& path = *incoming.along.path;
  const double tick_ns = installation_[incoming.motors.front()].axis().tick_ns();
  const double longest_ns = tick_ns * motion::Axis::kMaxDurationTicks;
  const double duration_ns = static_cast<double>(path.units()) * path.unit_ns();
  if (duration_ns <= longest_ns) return {};
  return fail(fmt::format(
      "the path would take {:.1f} days; the longest move is {:.1f} days: make several paths of it",
      duration_ns / 86400e9, longest_ns / 86400e9));
}

void ComingPaths::work() {
  if (!coming_.empty()) coming_.front().path.along.path->plan(AlongPath::kSegmentsPerSlice);
}

std::optional<ComingPaths::Planned> ComingPaths::take_planned() {
  if (coming_.empty() || !coming_.front().path.along.path->is_planned()) return std::nullopt;
  Coming planned = std::move(coming_.front());
  coming_.pop_front();
  // This comes first: the path points to tables, which may have been replaced while it was planned.
  auto may = may_follow(planned.path);
  if (may) may = is_short_enough(planned.path);
  if (!may) {
    planned.asker.answer(api::Refused{may.error().text()});
    return std::nullopt;
  }
  Line line{.motors = std::move(planned.path.motors),
            .course = std::move(planned.path.along),
            .target = 0};
  line.target = line.longest();
  return Planned{std::move(planned.asker), planned.dry_run, std::move(line)};
}

}  // namespace bushd::daemon
