#include "motion/trajectory_check.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <utility>

namespace bushd::motion {
namespace {

__extension__ using SignedWide = __int128;
using Position = Trajectory::Position;

// Speeds of rows are quotients of whole numbers, and steps fall where positions are rounded.
constexpr double kSlack = 1e-9;
constexpr double kSlackNs = 1;
constexpr std::size_t kPositionsAtOnce = 4000;

double unit_ns(const bushd_table& table) {
  return table.time_unit_ns;
}

// At which it may begin from rest, and come to rest.
double start_speed(const bushd_table& table) {
  return 1e9 / (std::max(table.accel.code[0], table.decel.code[0]) * unit_ns(table));
}

double least_delay_ns(const TrajectoryCheck::Motor& motor) {
  return static_cast<double>(
             std::max<bushd_delay>(bushd_table_fastest(motor.table), motor.shortest_delay)) *
         unit_ns(*motor.table);
}

// How many codes of a side are at least this delay, which comes first.
std::uint32_t codes_from(const bushd_ramp& ramp, double delay_ns, double unit_ns) {
  const std::span codes(ramp.code, ramp.count);
  const auto end = std::partition_point(codes.begin(), codes.end(), [&](std::uint16_t code) {
    return code * unit_ns >= delay_ns * (1 - kSlack) - kSlackNs;
  });
  return static_cast<std::uint32_t>(end - codes.begin());
}

// The delay that a side has one index beyond the place of this one, which may lie between two
// codes: there the squares of speeds are, as of steady acceleration. Slower ones are rest, beyond
// which is the index `first`.
double next_delay(const bushd_ramp& ramp, std::uint16_t cruise, double delay_ns, double unit_ns,
                  std::uint32_t first) {
  const auto code_ns = [&](std::uint32_t i) {
    return (i < ramp.count ? std::max(ramp.code[i], cruise) : cruise) * unit_ns;
  };
  const std::uint32_t passed = codes_from(ramp, delay_ns, unit_ns);
  const auto square = [](double ns) { return 1 / (ns * ns); };
  if (passed == 0) {
    const double share = first == 1 ? 1 : square(delay_ns) / square(code_ns(0));
    return 1 / std::sqrt(square(code_ns(0)) + share * (square(code_ns(1)) - square(code_ns(0))));
  }
  const double before = square(code_ns(passed - 1));
  const double after = square(code_ns(passed));
  if (after <= before) return code_ns(passed);
  const double share = std::clamp((square(delay_ns) - before) / (after - before), 0.0, 1.0);
  return 1 / std::sqrt(after + share * (square(code_ns(passed + 1)) - after));
}

bool is_short(double delay_ns, double allowed_ns) {
  return delay_ns * (1 + kSlack) + kSlackNs < allowed_ns;
}

// The least factor that makes a delay long enough, where what is allowed depends on it too.
template <class AllowedAt>
double stretch_for(double delay_ns, double at_least, double slowest_ns, AllowedAt allowed_at) {
  double low = at_least;
  double high = std::max(low, slowest_ns / delay_ns);
  for (int i = 0; i < 40; ++i) {
    const double middle = (low + high) / 2;
    (is_short(delay_ns * middle, allowed_at(middle)) ? low : high) = middle;
  }
  return high;
}

}  // namespace

std::int64_t nearest_step(Position position) {
  return static_cast<std::int64_t>((SignedWide{position} + Trajectory::kStep / 2) >> 32);
}

Position way_to_catch_up(const bushd_table& table, std::uint32_t tick_ns) {
  const SignedWide delay_ns = SignedWide{table.accel.code[0]} * table.time_unit_ns;
  return static_cast<Position>(std::min(SignedWide{tick_ns} * Trajectory::kStep / (2 * delay_ns),
                                        SignedWide{Trajectory::kStep}));
}

bool rests_at_end(const Trajectory& trajectory, std::size_t motor, const bushd_table& table) {
  if (trajectory.interpolation() == Trajectory::Interpolation::kCubic) return true;
  if (trajectory.rows() < 2) return true;
  const double speed = std::abs(trajectory.speed_after(trajectory.rows() - 2, motor));
  return speed <= start_speed(table) * (1 + kSlack);
}

TrajectoryCheck::TrajectoryCheck(const Trajectory& trajectory, std::vector<Motor> motors,
                                 std::uint32_t tick_ns)
    : trajectory_(trajectory), tick_ns_(tick_ns) {
  for (std::size_t m = 0; m < motors.size(); ++m) {
    watched_.push_back(
        {.motor = motors[m],
         .follower = Follower(trajectory, m, tick_ns, way_to_catch_up(*motors[m].table, tick_ns))});
  }
}

bool TrajectoryCheck::work(unsigned ticks) {
  look_at_rows();
  if (rows_seen_ < trajectory_.rows()) return true;
  // Beyond what no table allows there is nothing to go through.
  if (first_ && (first_->fault == Fault::kSpeed || first_->fault == Fault::kPosition)) return false;
  bool any = false;
  for (std::size_t m = 0; m < watched_.size(); ++m) {
    watched_[m].runs = true;
    for (unsigned i = 0; i < ticks && watched_[m].runs; ++i) follow(m);
    any = any || watched_[m].runs;
  }
  return any;
}

// Some of them: each takes some ten nanoseconds a motor.
void TrajectoryCheck::look_at_rows() {
  const std::size_t some = std::max<std::size_t>(kPositionsAtOnce / watched_.size(), 1);
  const std::size_t until = std::min(trajectory_.rows(), rows_seen_ + some);
  for (; rows_seen_ < until; ++rows_seen_) {
    for (std::size_t m = 0; m < watched_.size(); ++m) look_at_row(rows_seen_, m);
  }
}

void TrajectoryCheck::look_at_row(std::size_t row, std::size_t m) {
  const Motor& motor = watched_[m].motor;
  const std::int64_t steps = nearest_step(trajectory_.position(row, m));
  // One that stands beyond a limit may be moved towards it.
  const std::int64_t begin = nearest_step(trajectory_.position(0, m));
  if (steps < std::min(motor.lowest, begin) || steps > std::max(motor.highest, begin)) {
    find(row, m, Fault::kPosition, 0, 0, 0, steps);
  }
  if (row == 0) return;
  const double speed = trajectory_.speed_after(row - 1, m);
  const double most = 1e9 / least_delay_ns(motor);
  if (std::abs(speed) > most * (1 + kSlack)) {
    find(row, m, Fault::kSpeed, std::abs(speed), most, std::abs(speed) / most);
  }
  if (trajectory_.interpolation() == Trajectory::Interpolation::kCubic) return;
  const double before = row == 1 ? 0 : trajectory_.speed_after(row - 2, m);
  const double begins = start_speed(*motor.table);
  const double change = before * speed < 0 ? before * before + speed * speed
                                           : std::abs(speed * speed - before * before);
  if (change <= begins * begins * (1 + kSlack)) return;
  const double allowed =
      before * speed < 0 ? std::sqrt(std::max(0.0, begins * begins - before * before))
      : std::abs(speed) > std::abs(before)
          ? std::sqrt(before * before + begins * begins)
          : std::abs(before) - std::sqrt(std::max(0.0, before * before - begins * begins));
  find(row - 1, m, Fault::kCorner, std::abs(speed), allowed, std::sqrt(change) / begins);
}

void TrajectoryCheck::follow(std::size_t m) {
  Watched& watched = watched_[m];
  const Position before = watched.follower.told();
  const Position at_before = watched.follower.at();
  const std::int64_t made = watched.follower.made();
  const std::size_t row = watched.follower.row();
  const bool ends = rests_at_end(trajectory_, m, *watched.motor.table);
  if (watched.follower.rests() || !watched.follower.next(ends)) {
    watched.runs = false;
    return watched.follower.rests() ? rest(m, 0) : look_at_ramp_down(m);
  }
  const std::int64_t steps = nearest_step(watched.follower.at());
  const std::int64_t begin = nearest_step(trajectory_.position(0, m));
  if (steps < std::min(watched.motor.lowest, begin) ||
      steps > std::max(watched.motor.highest, begin)) {
    find(watched.follower.row() + 1, m, Fault::kPosition, 0, 0, 0, steps);
  }
  if (watched.follower.told() != before) follow_tick(m, before, at_before, made, row);
  if (watched.follower.last_way() > 0) judge_speed(m);
}

// A stop may come at any time: then the running step is made at the speed of this tick.
void TrajectoryCheck::judge_speed(std::size_t m) {
  const Watched& watched = watched_[m];
  const Follower& follower = watched.follower;
  const bushd_table& table = *watched.motor.table;
  const double unit = unit_ns(table);
  const double slowest = std::max(table.accel.code[0], table.decel.code[0]) * unit;
  const double delay_ns = tick_ns_ / std::ldexp(static_cast<double>(follower.last_way()), -32);
  const double since_ns = static_cast<double>(follower.ticks() - watched.last_tick) * tick_ns_;
  const bool rested = watched.direction != follower.direction() || since_ns >= slowest;
  const auto steps = rested ? 1 : static_cast<std::uint32_t>(watched.delays.size()) + 1;
  const double before = rested || watched.delays.empty() ? 1e18 : watched.delays.back();
  const auto allowed = [&](double factor) {
    return std::max({bushd_table_accel(&table, steps) * unit, least_delay_ns(watched.motor),
                     next_delay(table.accel, table.cruise, before * factor, unit, 1)});
  };
  if (!is_short(delay_ns, allowed(1))) return;
  find(follower.row() + 1, m, Fault::kSpeedUp, 1e9 / delay_ns, 1e9 / allowed(1),
       stretch_for(delay_ns, static_cast<double>(stretch_) / 1000, slowest, allowed));
}

// Steps fall where the way that its MCU is told crosses whole ones. In a tick with rows that way is
// bent at these, and it goes on evenly to the motor's rest, which it may reach before the tick's
// end. What it has to catch up at the beginning makes no step early.
void TrajectoryCheck::follow_tick(std::size_t m, Position before, Position at_before,
                                  std::int64_t made, std::size_t row) {
  const Follower& follower = watched_[m].follower;
  const Position after = follower.told();
  const int direction = after > before ? 1 : -1;
  const Position half = direction * (Trajectory::kStep / 2);
  const Position aim = follower.at() + half;
  const bool ends = follower.rests() || (trajectory_.closed() && after % Trajectory::kStep == 0 &&
                                         follower.row() + 1 == trajectory_.known_rows());
  const bool keeps_up = after == aim || (ends && (aim - after) * direction >= 0);
  const bool catches_up = (at_before + half - before) * direction > 0;
  const std::int64_t end_ns = follower.ticks() * tick_ns_;
  Point from{.ns = 0, .at = keeps_up && catches_up ? at_before + half : before};
  std::int64_t next = made + direction;
  const auto go_to = [&](Point to) {
    if ((to.at - from.at) * direction > 0) next = step_between(m, next, from, to, after);
    from = to;
  };
  for (++row; keeps_up && row < trajectory_.rows() && trajectory_.time_ns(row) < end_ns; ++row) {
    const Position at = trajectory_.position(row, m) + half;
    if ((at - from.at) * direction < 0) break;  // it turns round in this tick
    go_to({static_cast<double>(trajectory_.time_ns(row) - (end_ns - tick_ns_)), at});
  }
  go_to({static_cast<double>(tick_ns_), keeps_up ? aim : after});
  // What has not been made by now is made at the end of the tick.
  for (; (after - next * Trajectory::kStep) * direction >= 0; next += direction) {
    step(m, direction, tick_ns_);
  }
}

// The steps from `next` on as far as `last` allows. Returns the one after them.
std::int64_t TrajectoryCheck::step_between(std::size_t m, std::int64_t next, Point from, Point to,
                                           Position last) {
  const int direction = to.at > from.at ? 1 : -1;
  const Position until = direction > 0 ? std::min(to.at, last) : std::max(to.at, last);
  for (; (until - next * Trajectory::kStep) * direction >= 0; next += direction) {
    const double share = static_cast<double>(next * Trajectory::kStep - from.at) /
                         static_cast<double>(to.at - from.at);
    step(m, direction, from.ns + std::max(share, 0.0) * (to.ns - from.ns));
  }
  return next;
}

// Where the motor would come to rest if it ramped down from the last row that is known.
void TrajectoryCheck::look_at_ramp_down(std::size_t m) {
  const auto& [motor, follower, runs, direction, tick, ns, delays, peak] = watched_[m];
  if (follower.last_way() == 0) return;
  const SignedWide delay = SignedWide{tick_ns_} * Trajectory::kStep /
                           (SignedWide{follower.last_way()} * motor.table->time_unit_ns);
  const auto code = static_cast<std::uint16_t>(std::min<SignedWide>(delay, UINT16_MAX));
  const std::uint16_t fastest = bushd_table_fastest(motor.table);
  const std::int64_t ramp = bushd_table_steps_to_stop(motor.table, std::max(code, fastest));
  const std::int64_t rest = follower.made() + follower.direction() * (ramp + 1);
  if (rest >= motor.lowest && rest <= motor.highest) return;
  find(follower.row() + 1, m, Fault::kPosition, 0, 0, 0, rest);
}

void TrajectoryCheck::step(std::size_t m, int direction, double ns) {
  Watched& watched = watched_[m];
  const std::int64_t tick = watched.follower.ticks();
  if (direction != watched.direction) {
    rest(m, 0);
    watched.direction = direction;
  } else {
    judge(m, static_cast<double>(tick - watched.last_tick) * tick_ns_ + ns - watched.last_ns);
  }
  watched.last_tick = tick;
  watched.last_ns = ns;
}

void TrajectoryCheck::judge(std::size_t m, double delay_ns) {
  Watched& watched = watched_[m];
  const bushd_table& table = *watched.motor.table;
  const double unit = unit_ns(table);
  const std::size_t row = watched.follower.row() + 1;
  watched.peak = std::max(watched.peak, 1e9 / delay_ns);
  const double least = least_delay_ns(watched.motor);
  if (is_short(delay_ns, least)) {
    find(row, m, Fault::kSpeed, 1e9 / delay_ns, 1e9 / least, least / delay_ns);
  }
  const double slowest = std::max(table.accel.code[0], table.decel.code[0]) * unit;
  const auto before = watched.delays.empty() ? 1e18 : watched.delays.back();
  const auto steps = static_cast<std::uint32_t>(watched.delays.size()) + 1;
  const auto up = [&](double factor) {
    return std::max(bushd_table_accel(&table, steps) * unit,
                    next_delay(table.accel, table.cruise, before * factor, unit, 1));
  };
  const double at_least = static_cast<double>(stretch_) / 1000;
  if (is_short(delay_ns, up(1))) {
    find(row, m, Fault::kSpeedUp, 1e9 / delay_ns, 1e9 / up(1),
         stretch_for(delay_ns, at_least, slowest, up));
  }
  const auto down = [&](double factor) {
    return next_delay(table.decel, table.cruise, delay_ns * factor, unit, 0);
  };
  if (!watched.delays.empty() && is_short(before, down(1))) {
    find(row, m, Fault::kSlowDown, 1e9 / before, 1e9 / down(1),
         stretch_for(before, at_least, slowest, down));
  }
  if (delay_ns >= slowest) return rest(m, delay_ns < 2 * slowest ? 1 : 0);
  watched.delays.push_back(delay_ns);
}

// It has come to rest, or its last delay was as long as the first code: what led there, from this
// index of D on.
void TrajectoryCheck::rest(std::size_t m, std::size_t index) {
  Watched& watched = watched_[m];
  const bushd_table& table = *watched.motor.table;
  const std::size_t count = watched.delays.size();
  for (std::size_t i = 0; i < count && i + index < table.decel.count; ++i) {
    const double delay_ns = watched.delays[count - 1 - i];
    const double allowed = table.decel.code[i + index] * unit_ns(table);
    if (!is_short(delay_ns, allowed)) continue;
    find(watched.follower.row() + 1, m, Fault::kSlowDown, 1e9 / delay_ns, 1e9 / allowed,
         allowed / delay_ns);
  }
  watched.delays.clear();
}

void TrajectoryCheck::find(std::size_t row, std::size_t motor, Fault fault, double asked,
                           double allowed, double stretch, std::int64_t steps) {
  helps_ = helps_ && fault != Fault::kPosition;
  if (fault != Fault::kPosition) {
    const double thousandths = std::ceil(stretch * 1000 - 1e-6);
    stretch_ = std::max(stretch_, static_cast<std::int64_t>(std::min(thousandths, 1e12)));
  }
  if (first_ && std::pair(first_->row, first_->motor) <= std::pair(row, motor)) return;
  first_ = Finding{.row = row,
                   .motor = motor,
                   .fault = fault,
                   .asked_steps_per_s = asked,
                   .allowed_steps_per_s = allowed,
                   .steps = steps};
}

}  // namespace bushd::motion
