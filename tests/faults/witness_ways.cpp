// The part of the witness that is about motors on one way: lines, and paths through points.
#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "witness.h"

namespace bushfaults {
namespace {

// How far the motors are from the nearest point of the polyline.
double off_polyline(const std::vector<std::int64_t>& rows, const std::vector<std::int64_t>& stand) {
  const std::size_t width = stand.size();
  double least = INFINITY;
  for (std::size_t row = width; row < rows.size(); row += width) {
    double along = 0;
    double length = 0;
    for (std::size_t i = 0; i < width; ++i) {
      const auto from = static_cast<double>(rows[row - width + i]);
      const double way = static_cast<double>(rows[row + i]) - from;
      along += way * (static_cast<double>(stand[i]) - from);
      length += way * way;
    }
    const double share = length > 0 ? std::clamp(along / length, 0.0, 1.0) : 0;
    double square = 0;
    for (std::size_t i = 0; i < width; ++i) {
      const auto from = static_cast<double>(rows[row - width + i]);
      const double at = from + share * (static_cast<double>(rows[row + i]) - from);
      square += (static_cast<double>(stand[i]) - at) * (static_cast<double>(stand[i]) - at);
    }
    least = std::min(least, std::sqrt(square));
  }
  return least;
}

// An MCU that did not hear of a change in time takes it later than the others: in as many ticks it
// leaves them. Added up over the changes of one motor, each of which is the same one as that of
// another motor which is nearest to it. A motor without changes has come to the end of its run.
std::int64_t ticks_apart(const std::vector<std::vector<std::int64_t>>& changed_at) {
  std::int64_t most = 0;
  for (const std::vector<std::int64_t>& own : changed_at) {
    std::int64_t sum = 0;
    for (const std::int64_t tick : own) {
      std::int64_t farthest = 0;
      for (const std::vector<std::int64_t>& others : changed_at) {
        std::int64_t nearest = others.empty() ? 0 : INT64_MAX;
        for (const std::int64_t other : others) {
          nearest = std::min(nearest, std::abs(other - tick));
        }
        farthest = std::max(farthest, nearest);
      }
      sum += farthest;
    }
    most = std::max(most, sum);
  }
  return most;
}

}  // namespace

// Where all of it is known, and all motors rest.
void Witness::begin_way(Asked& asked) {
  const Request& request = asked.request;
  if (request.trajectory != 0) return;
  // Edges at several MCUs may be apart, and a short line over before that is known.
  const bool several = std::ranges::any_of(request.motors, [&](const std::string& name) {
    return find(name)->mcu != find(request.motors.front())->mcu;
  });
  if (request.ask == Ask::kArm && several) return;
  const std::size_t width = request.motors.size();
  for (std::size_t i = 0; i < width; ++i) {
    if (!asked.from[i] || !asked.target[i] || !offset(*find(request.motors[i]))) return;
  }
  std::vector<std::int64_t> rows;
  for (const auto& from : asked.from) rows.push_back(*from);
  for (std::size_t value = 0; value < request.points.size(); ++value) {
    const Motor& motor = *find(request.motors[value % width]);
    const auto steps = units_.steps_of_position(index_of(motor), request.points[value]);
    if (!steps) return;
    rows.push_back(*offset(motor) + *steps);
  }
  if (request.points.empty()) {
    for (const auto& target : asked.target) rows.push_back(*target);
  }
  asked.polyline = std::move(rows);
}

void Witness::watch_ways() {
  for (auto& [key, asked] : asked_) {
    if (asked.finished || asked.polyline.empty()) continue;
    // All have come to its end then, and some may be settling.
    for (const std::string& name : asked.request.motors) {
      asked.way_is_over = asked.way_is_over || find(name)->move != key;
    }
    if (asked.way_is_over) continue;
    std::vector<std::int64_t> stand;
    for (const std::string& name : asked.request.motors) stand.push_back(plant_steps(*find(name)));
    asked.off_way = std::max(asked.off_way, off_polyline(asked.polyline, stand));
  }
}

// All of its motors begin a run at once where they stand at one place. Others only catch up.
void Witness::run_of_way_begins(TimeNs now_ns, Asked& asked) {
  if (now_ns != asked.runs_begun_ns) asked.runs_begun = 0;
  asked.runs_begun_ns = now_ns;
  if (++asked.runs_begun < asked.request.motors.size()) return;
  asked.most_ticks_apart = std::max(asked.most_ticks_apart, ticks_apart(asked.changed_at));
  asked.changed_at.clear();
}

void Witness::run_changed(const Motor& motor, std::int64_t tick) {
  if (!motor.move) return;
  Asked& asked = asked_.at(*motor.move);
  if (asked.polyline.empty()) return;
  asked.changed_at.resize(asked.request.motors.size());
  asked.changed_at[asked.index_of(motor.name)].push_back(tick);
}

// Each motor is within half a step of its place, by the run of all; a step of a streamed tick, and
// an MCU that has only just been brought into step, is off by up to a tick (sim/pace.h), in which a
// motor makes so many steps, and one more; in the ticks between two MCUs' changes as many each.
// (One that speeds up meanwhile ramps down from a greater speed, too. That the way is left by one
// side of the motors only, and the bound counts all, makes up for it.) The nearest point is no
// farther than that of the same time. A motor that was not ramped down with the others ends
// otherwise than by reaching its end.
void Witness::check_way(TimeNs now_ns, const Asked& asked, const bushd::api::Completed& result) {
  if (asked.polyline.empty() || result.outcome != bushd::api::Outcome::kReached) return;
  ++ways_;
  const std::int64_t apart = std::max(asked.most_ticks_apart, ticks_apart(asked.changed_at));
  most_ticks_apart_ = std::max(most_ticks_apart_, apart);
  ways_apart_ += apart != 0 ? 1u : 0u;
  const TimeNs late_ns = (apart + 1) * config_.buses.front().tick_ns();
  double square = 0;
  for (const std::string& name : asked.request.motors) {
    const bushd_table& table = config_.table_of(config_.motors[index_of(*find(name))]).view();
    const double step_ns = static_cast<double>(table.cruise) * table.time_unit_ns;
    const double most = 1.5 + static_cast<double>(late_ns) / step_ns;
    square += most * most;
  }
  if (apart == 0) worst_off_way_ = std::max(worst_off_way_, asked.off_way);
  if (asked.off_way * asked.off_way <= square) return;
  violated(now_ns, fmt::format("{:.1f} steps off the way, and {:.1f} are possible, its MCUs having "
                               "changed {} ticks apart: {}",
                               asked.off_way, std::sqrt(square), apart, text_of(asked.request)));
}

}  // namespace bushfaults
