#include "motion/motor_scale.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <variant>

namespace bushd::motion {

// Nothing is rounded for a motor without a unit, so amounts in steps are whole.
Result<void> MotorScale::is_amount(const words::Amount& amount) const {
  const auto* user = std::get_if<words::UserUnits>(&amount);
  if (user == nullptr || coordinates_.has_unit()) return {};
  if (std::trunc(user->value) == user->value) return {};
  return fail(fmt::format("{} is no whole number of steps, and it has no unit", user->value));
}

Result<std::int64_t> MotorScale::steps_of_position(const words::Amount& position) const {
  if (auto good = is_amount(position); !good) return fail(good.error());
  if (const auto* steps = std::get_if<std::int64_t>(&position)) return *steps;
  return coordinates_.steps_of_user(std::get<words::UserUnits>(position).value);
}

Result<units::Steps> MotorScale::position_of(const words::Amount& position) const {
  if (auto good = is_amount(position); !good) return fail(good.error());
  if (const auto* steps = std::get_if<std::int64_t>(&position)) return units::Steps{*steps};
  return coordinates_.unrounded_of_user(std::get<words::UserUnits>(position).value);
}

Result<units::Steps> MotorScale::distance_of(const words::Amount& distance) const {
  if (auto good = is_amount(distance); !good) return fail(good.error());
  if (const auto* steps = std::get_if<std::int64_t>(&distance)) return units::Steps{*steps};
  return coordinates_.unrounded_of_distance(std::get<words::UserUnits>(distance).value);
}

Result<bushd_delay> MotorScale::shortest_delay_at(const std::optional<words::Speed>& speed,
                                                  std::uint32_t time_unit_ns) const {
  bushd_delay shortest_delay = 0;
  if (max_speed_) {
    const auto slowest = coordinates_.delay_at(*max_speed_, time_unit_ns);
    if (!slowest) return fail("max_speed: " + slowest.error().message);
    shortest_delay = *slowest;
  }
  if (!speed) return shortest_delay;
  const units::Coordinates in_steps;
  const auto delay =
      (speed->in_steps ? in_steps : coordinates_).delay_at(speed->per_s, time_unit_ns);
  if (!delay) return fail(delay.error());
  return std::max<bushd_delay>(shortest_delay, *delay);
}

std::int64_t MotorScale::lowest() const {
  return soft_limits_ ? coordinates_.first_step_from(soft_limits_->low) : -kMaxPosition;
}

std::int64_t MotorScale::highest() const {
  return soft_limits_ ? coordinates_.last_step_to(soft_limits_->high) : kMaxPosition;
}

std::string MotorScale::range_text() const {
  const bool falls = coordinates_.scale().negative;
  return fmt::format("{} to {}", coordinates_.text(falls ? highest() : lowest()),
                     coordinates_.text(falls ? lowest() : highest()));
}

Result<void> MotorScale::may_move_to(std::int64_t target, std::int64_t position) const {
  if (!soft_limits_) return {};
  const std::int64_t low = lowest();
  const std::int64_t high = highest();
  if (target >= std::min(low, position) && target <= std::max(high, position)) return {};
  return fail(fmt::format("target {} is beyond the soft limit at {}; allowed: {}",
                          coordinates_.text(target), coordinates_.text(target > high ? high : low),
                          range_text()));
}

Result<void> MotorScale::stands_within_soft_limits(std::int64_t position) const {
  if (!soft_limits_ || (position >= lowest() && position <= highest())) return {};
  return fail(
      fmt::format("it stands at {}, beyond its soft limits of {}; it may be moved towards them",
                  coordinates_.text(position), range_text()));
}

}  // namespace bushd::motion
