// Where a line leads, by which table, and how fast.
#include <fmt/format.h>

#include <cstdlib>
#include <utility>

#include "daemon/services/lines.h"

namespace bushd::daemon {
namespace {

Result<void> few_enough(std::size_t motors) {
  if (motors <= api::MoveLine::kMostMotors) return {};
  return fail(fmt::format("{} motors are named; a line has at most {}", motors,
                          api::MoveLine::kMostMotors));
}

}  // namespace

Result<Lines::Line> Lines::line_of(const api::MoveLine& request) const {
  Line line{
      .motors = *installation_.find(request.motors), .points = {}, .way = {}, .by = request.by};
  if (const auto may = interlocks_.may_move(); !may) return fail(may.error());
  if (const auto may = may_be_one_line(line.motors); !may) return fail(may.error());
  auto points = points_of(line, request);
  if (!points) return fail(points.error());
  line.points = std::move(*points);
  std::vector<std::int64_t> from;
  for (const MotorId motor : line.motors) from.push_back(installation_[motor].position_steps());
  line.way = lay(line, from, line.points.front());
  line.target = line.way.longest();
  if (auto fits = fits_duration(line, request.duration_s); !fits) return fail(fits.error());
  return line;
}

// Motors of a line are on one bus that has ticks, or each at a serial port of its own, where ports
// keep pace with each other.
Result<void> Lines::may_be_one_line(const std::vector<MotorId>& motors) const {
  const auto keeps_pace = [this](MotorId motor) {
    return installation_.mcu_of(motor).keeps_pace();
  };
  const auto at_port = std::ranges::find_if(motors, keeps_pace);
  if (at_port == motors.end()) return on_one_bus(motors);
  if (auto few = few_enough(motors.size()); !few) return few;
  const auto not_at_port = std::ranges::find_if_not(motors, keeps_pace);
  if (not_at_port != motors.end()) {
    return fail(fmt::format(
        "{} is at a serial port that makes pulses, and {} is connected to {}: their steps have no "
        "common time. Move them without --line, or connect both to such ports or both to one bus",
        installation_[*at_port].name(), installation_[*not_at_port].name(),
        installation_.mcu_of(*not_at_port).name()));
  }
  for (const MotorId motor : motors) {
    const config::Bus& first = installation_.bus_of(installation_.mcu_of(motors.front())).config;
    const config::Bus& bus = installation_.bus_of(installation_.mcu_of(motor)).config;
    if (bus.tick_us == first.tick_us) continue;
    return fail(fmt::format(
        "bus {} has tick_us = {} and bus {} tick_us = {}: ports of a line go by the same ticks. "
        "Give both the same tick_us, or move them without --line",
        first.name, first.tick_us, bus.name, bus.tick_us));
  }
  return {};
}

Result<void> Lines::on_one_bus(const std::vector<MotorId>& motors) const {
  if (auto few = few_enough(motors.size()); !few) return few;
  const auto bus_name = [this](MotorId motor) {
    return installation_.bus_of(installation_.mcu_of(motor)).config.name;
  };
  for (const MotorId motor : motors) {
    if (installation_.mcu_of(motor).streams()) continue;
    const bool lines = installation_.mcu_of(motor).keeps_pace();
    return fail(fmt::format("{} is on bus {}, which makes runs of tables {}; move it {}",
                            installation_[motor].name(), bus_name(motor),
                            lines ? "and lines, but no paths" : "only, no lines or paths",
                            lines ? "from point to point, by 'move --line'" : "without --line"));
  }
  for (const MotorId motor : motors) {
    if (bus_name(motor) == bus_name(motors.front())) continue;
    return fail(fmt::format(
        "{} is on bus {} and {} on bus {}: ticks of two buses are not in step, so motors of a line "
        "must be on one. Move them without --line, or connect their MCUs to one bus",
        installation_[motors.front()].name(), bus_name(motors.front()), installation_[motor].name(),
        bus_name(motor)));
  }
  return {};
}

// The line itself is straight. A motor that should make a last approach for its backlash makes it
// when all have arrived, and the others wait; one that is alone turns where it makes it from.
Result<std::vector<Lines::Point>> Lines::points_of(const Line& line,
                                                   const api::MoveLine& request) const {
  const std::vector<MotorId>& motors = line.motors;
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
    const auto legs = motor.legs_to(target->whole, *shortest_delay);
    if (!legs) return fail(motor.name() + ": " + legs.error().message);
    const motion::Leg& last = legs->back();
    const bool straight = legs->size() == 1;
    const bushd_delay fast = shortest_delay_on(line, i, *shortest_delay);
    const bushd_delay slow = shortest_delay_on(line, i, last.shortest_delay);
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

tables::TablePtr Lines::table_of(const Line& line, std::size_t motor) const {
  return line.by ? line.by : installation_.table_of(line.motors[motor]);
}

// The shortest delay of the motor, converted from units of its own table to those of the table that
// it goes by.
bushd_delay Lines::shortest_delay_on(const Line& line, std::size_t motor,
                                     bushd_delay shortest_delay) const {
  if (!line.by) return shortest_delay;
  const std::uint64_t unit_ns = line.by->view().time_unit_ns;
  const std::uint64_t own_ns = installation_.table_of(line.motors[motor])->view().time_unit_ns;
  return (shortest_delay * own_ns + unit_ns - 1) / unit_ns;
}

motion::Way Lines::lay(const Line& line, const std::vector<std::int64_t>& from,
                       const Point& to) const {
  std::vector<motion::Way::Motor> all;
  for (std::size_t i = 0; i < line.motors.size(); ++i) {
    all.push_back({.table = &table_of(line, i)->view(),
                   .from = from[i],
                   .to = to.steps[i],
                   .shortest_delay = to.shortest_delays[i]});
  }
  return motion::Way(std::move(all));
}

Result<void> Lines::fits_duration(Line& line, std::optional<double> duration_s) const {
  if (line.way.longest() == 0) return {};
  const double tick_ns = installation_[line.motors.front()].axis().tick_ns();
  const double longest_ns = tick_ns * motion::Axis::kMaxDurationTicks;
  if (line.way.duration_ns() > longest_ns) {
    return fail(fmt::format(
        "the line would take {:.1f} days, limited by {}; the longest move is {:.1f} days: move it "
        "faster, or in parts",
        line.way.duration_ns() / 86400e9, limiting(line), longest_ns / 86400e9));
  }
  if (!duration_s) return {};
  if (auto taken = line.way.take(*duration_s, longest_ns); !taken) {
    return fail(taken.error().message + "; it is limited by " + limiting(line));
  }
  return {};
}

}  // namespace bushd::daemon
