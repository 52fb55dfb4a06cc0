// Where a line leads, by which table, and how fast.
#include <fmt/format.h>

#include <cstdlib>
#include <utility>

#include "daemon/services/line_motors.h"
#include "daemon/services/lines.h"

namespace bushd::daemon {
Result<Line> Lines::line_of(const api::MoveLine& request, const tables::TablePtr& by) const {
  Line line{.motors = *installation_.find(request.motors), .course = {}, .target = 0};
  if (const auto may = interlocks_.may_move(); !may) return fail(may.error());
  if (const auto may = may_be_one_line(installation_, line.motors); !may) return fail(may.error());
  auto points = points_of(line.motors, request, by);
  if (!points) return fail(points.error());
  std::vector<std::int64_t> from;
  for (const MotorId motor : line.motors) from.push_back(installation_[motor].position_steps());
  Straight straight{.points = std::move(*points), .way = {}, .by = by};
  if (request.law == api::MoveLine::Law::kElementary) straight.law = motion::Way::Law::kElementary;
  if (request.feed) {
    auto feed = Feed::make(installation_, line.motors, *request.feed, straight.law);
    if (!feed) return fail(feed.error());
    straight.feed = std::move(*feed);
  }
  if (const auto may = may_be_laid(line.motors, straight, from); !may) return fail(may.error());
  straight.way = lay(line.motors, straight, from, straight.points.front());
  if (const auto may = is_possible(straight.way, straight.feed); !may) return fail(may.error());
  line.target = straight.way.longest();
  if (auto fits = fits_duration(line, straight.way, request.duration_s); !fits) {
    return fail(fits.error());
  }
  line.course = std::move(straight);
  return line;
}

// The line itself is straight. A motor that should make a last approach for its backlash makes it
// when all have arrived, and the others wait; one that is alone turns where it makes it from.
Result<std::vector<Straight::Point>> Lines::points_of(const std::vector<MotorId>& motors,
                                                      const api::MoveLine& request,
                                                      const tables::TablePtr& by) const {
  using Point = Straight::Point;
  Point to;
  Point back;
  Point again;
  bool approach = false;
  for (std::size_t i = 0; i < motors.size(); ++i) {
    const motion::Motor& motor = installation_[motors[i]];
    const auto shortest_delay = moves_.shortest_delay_of(motors[i], request.speed);
    if (!shortest_delay) return fail(shortest_delay.error());
    const auto target =
        moves_.target_of(motors[i], request.motors[i].amount, request.kind, *shortest_delay);
    if (!target) return fail(target.error());
    const auto legs = motor.reach().legs_to(target->whole, *shortest_delay);
    if (!legs) return fail(motor.name() + ": " + legs.error().message);
    const motion::Leg& last = legs->back();
    const bool straight = legs->size() == 1;
    const bushd_delay fast = shortest_delay_by(by, motors[i], *shortest_delay);
    const bushd_delay slow = shortest_delay_by(by, motors[i], last.shortest_delay);
    approach = approach || !straight;
    to.steps.push_back(target->whole);
    to.shortest_delays.push_back(straight ? slow : fast);
    back.steps.push_back(straight ? target->whole : legs->front().target);
    back.shortest_delays.push_back(fast);
    again.steps.push_back(target->whole);
    again.shortest_delays.push_back(slow);
    to.asked_for.push_back(*target);
    again.asked_for.push_back(*target);
  }
  if (!approach) return std::vector<Point>{std::move(to)};
  if (motors.size() == 1) return std::vector<Point>{std::move(back), std::move(again)};
  return std::vector<Point>{std::move(to), std::move(back), std::move(again)};
}

tables::TablePtr Lines::table_of(MotorId motor, const tables::TablePtr& by) const {
  return by ? by : installation_.table_of(motor);
}

// The shortest delay of the motor, converted from units of its own table to those of the table that
// it goes by.
bushd_delay Lines::shortest_delay_by(const tables::TablePtr& by, MotorId motor,
                                     bushd_delay shortest_delay) const {
  if (!by) return shortest_delay;
  const std::uint64_t unit_ns = by->view().time_unit_ns;
  const std::uint64_t own_ns = installation_.table_of(motor)->view().time_unit_ns;
  return (shortest_delay * own_ns + unit_ns - 1) / unit_ns;
}

Result<void> Lines::may_be_laid(const std::vector<MotorId>& motors, const Straight& straight,
                                const std::vector<std::int64_t>& from) const {
  if (straight.law == motion::Way::Law::kLeading) return {};
  if (auto may = may_be_elementary(installation_, motors); !may) return may;
  std::int64_t sum = 0;
  for (std::size_t i = 0; i < motors.size(); ++i) {
    sum += std::abs(straight.points.front().steps[i] - from[i]);
  }
  if (sum <= motion::Motor::kMaxPosition) return {};
  return fail(fmt::format(
      "the ways of all motors together are {} steps; by the elementary law a line has at most {}: "
      "make several lines of it",
      sum, motion::Motor::kMaxPosition));
}

Result<void> Lines::is_possible(const motion::Way& way, const std::optional<Feed>& feed) {
  if (!feed || way.longest() == 0) return {};
  return feed->is_possible(feed->step_ns(way));
}

motion::Way Lines::lay(const std::vector<MotorId>& motors, const Straight& straight,
                       const std::vector<std::int64_t>& from, const Straight::Point& to) const {
  std::vector<motion::Way::Motor> all;
  for (std::size_t i = 0; i < motors.size(); ++i) {
    all.push_back({.table = &table_of(motors[i], straight.by)->view(),
                   .from = from[i],
                   .to = to.steps[i],
                   .shortest_delay = to.shortest_delays[i],
                   .output = installation_[motors[i]].output().value});
  }
  motion::Way way(std::move(all), straight.law);
  if (straight.feed) way.slow_down_to(straight.feed->step_ns(way));
  return way;
}

Result<void> Lines::fits_duration(const Line& line, motion::Way& way,
                                  std::optional<double> duration_s) const {
  if (way.longest() == 0) return {};
  const double tick_ns = installation_[line.motors.front()].axis().tick_ns();
  const double longest_ns = tick_ns * motion::Axis::kMaxDurationTicks;
  if (way.duration_ns() > longest_ns) {
    return fail(fmt::format(
        "the line would take {:.1f} days, limited by {}; the longest move is {:.1f} days: move it "
        "faster, or in parts",
        way.duration_ns() / 86400e9, limiting(line, way), longest_ns / 86400e9));
  }
  if (!duration_s) return {};
  if (auto taken = way.take(*duration_s, longest_ns); !taken) {
    return fail(taken.error().message + "; it is limited by " + limiting(line, way));
  }
  return {};
}

}  // namespace bushd::daemon
