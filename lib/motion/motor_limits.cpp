// What a motor may do: where to, how fast, and by which legs.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "motion/motor.h"
#include "motion/report_words.h"
#include "words/remedy.h"

namespace bushd::motion {

Result<void> Motor::may_be_used() const {
  if (is<Armed>()) {
    return fail("waits for the trigger; run " + words::remedy("disarm", name()) + " first");
  }
  if (is<Homing>()) return fail("it is being homed; wait for that result");
  if (is<Travelling>()) {
    return fail("it travels by itself, for a CAMAC module; run " + words::remedy("stop", name()) +
                " first");
  }
  if (is<Local>() && !autonomous_) {
    return fail("MCU " + setup_.mcu +
                " moves it for another master; end that, and wait until it rests");
  }
  if (is<Local>()) {
    return fail("the local inputs of MCU " + setup_.mcu + " move it; release them first");
  }
  return {};
}

Result<void> Motor::may_move_to(std::int64_t target, bushd_delay shortest_delay) const {
  if (uncertain_reason_) {
    return fail("its position is uncertain, because " + *uncertain_reason_ + "; " +
                (setup_.has_home ? "run " + words::remedy("home", name()) + ", or " : "") +
                "find out where it stands and run " + words::set_remedy(name()) + ", or " +
                words::remedy("confirm", name()) + " if it stands where it is shown");
  }
  if (is<OnLine>()) {
    return fail("it moves on a line, or by a CAMAC program; run " + words::remedy("stop", name()) +
                " first, then move it by itself");
  }
  if (follows()) {
    return fail("it follows a trajectory; run " + words::remedy("stop", name()) +
                " first, then move it by itself");
  }
  if (restored_reason_ && setup_.restored_refused) {
    return fail("its position is only restored, because " + *restored_reason_ +
                ", and restored = \"refuse\" keeps it there; run " +
                (setup_.has_home ? words::remedy("home", name()) + " or " : "") +
                words::set_remedy(name()) + ", or " + words::remedy("confirm", name()) +
                " if it is right");
  }
  const std::int64_t steps = target - position_;
  if (target > kMaxPosition || target < -kMaxPosition || std::abs(steps) > kMaxPosition) {
    return fail("target " + std::to_string(target) + " is beyond +-" +
                std::to_string(kMaxPosition) + " steps");
  }
  if (auto within = within_soft_limits(target); !within) return within;
  if (moves() && moving()->limit != 0) {
    return fail(switch_at(moving()->limit) + " is stopping it; wait for that result");
  }
  const int direction = steps < 0 ? -1 : 1;
  if (steps != 0 && forbidden(direction)) {
    return fail(
        switch_at(direction) +
        " is active: motion in this direction is inhibited; move it in the other direction");
  }
  if (axis_.duration_ticks(steps, shortest_delay) > Axis::kMaxDurationTicks) {
    const double tick_days = axis_.tick_ns() * 1e-9 / 86400;
    return fail(fmt::format(
        "{} steps would take {:.1f} days at that speed; the longest move is {:.1f} days: move it "
        "faster, or in parts",
        steps, axis_.duration_ticks(steps, shortest_delay) * tick_days,
        Axis::kMaxDurationTicks * tick_days));
  }
  return {};
}

Result<void> Motor::may_be_moved_within(std::int64_t steps) const {
  if (std::abs(position_) + steps <= kMaxPosition) return {};
  return fail(fmt::format(
      "it stands at {}, and may make up to {} steps to either side, which would lead beyond +-{}, "
      "where no more are counted; run {}, then home it",
      position_, steps, kMaxPosition, words::remedy("set", name(), "--dial 0")));
}

Result<units::Steps> Motor::distance_from() const {
  const auto rounded = rounded_distance_from();
  if (!rounded) return fail(rounded.error());
  return asked_for_ && asked_for_->whole == *rounded ? *asked_for_ : units::Steps{*rounded};
}

Result<std::int64_t> Motor::rounded_distance_from() const {
  constexpr const char* kRemedy = "wait until it stands, or move it to a position";
  if (!has_plan()) {
    if (auto may = may_be_used(); !may) return fail(may.error());
    return position_;
  }
  if (is_paused()) {
    return fail("it is paused on its way to " + coordinates().text(target_steps()) +
                ", so a distance could count from there or from where it is; run " +
                words::remedy("stop", name()) + " first, or move it to a position");
  }
  if (axis_.stopping()) {
    if (axis_.is_planned()) return axis_.end_steps();
    return fail(
        fmt::format("it is being stopped, and where it will stand is not known yet; {}", kRemedy));
  }
  if (jogs_)
    return fail(fmt::format("it jogs, and nobody has said where it is to stand; {}", kRemedy));
  if (follows())
    return fail(fmt::format("it follows a trajectory, which may get more rows; {}", kRemedy));
  return target_steps();
}

Result<bushd_delay> Motor::shortest_delay_at(const std::optional<words::Speed>& speed) const {
  bushd_delay shortest_delay = 0;
  if (setup_.max_speed) {
    const auto slowest = setup_.coordinates.delay_at(*setup_.max_speed, axis_.time_unit_ns());
    if (!slowest) return fail("max_speed: " + slowest.error().message);
    shortest_delay = *slowest;
  }
  if (!speed) return shortest_delay;
  const units::Coordinates in_steps;
  const auto delay = (speed->in_steps ? in_steps : setup_.coordinates)
                         .delay_at(speed->per_s, axis_.time_unit_ns());
  if (!delay) return fail(delay.error());
  return std::max<bushd_delay>(shortest_delay, *delay);
}

std::int64_t Motor::farthest(int direction, bushd_delay shortest_delay) const {
  Range range{.low = -kMaxPosition, .high = kMaxPosition};
  if (setup_.soft_limits) range = allowed_steps();
  const std::int64_t limit = direction > 0 ? range.high : range.low;
  const std::int64_t steps = std::min((limit - position_) * direction, kMaxPosition);
  if (steps <= 0) return position_;
  if (axis_.duration_ticks(steps, shortest_delay) <= Axis::kMaxDurationTicks) {
    return position_ + direction * steps;
  }
  std::int64_t low = 0;
  std::int64_t high = steps;
  while (high - low > 1) {
    const std::int64_t middle = low + (high - low) / 2;
    (axis_.duration_ticks(middle, shortest_delay) <= Axis::kMaxDurationTicks ? low : high) = middle;
  }
  return position_ + direction * low;
}

Result<std::vector<Leg>> Motor::legs_to(std::int64_t target, bushd_delay shortest_delay) const {
  if (auto may = may_move_to(target, shortest_delay); !may) return fail(may.error());
  const auto backlash = setup_.coordinates.steps_of_distance(setup_.backlash);
  const std::int64_t way = target - position_;
  if (!backlash || *backlash == 0 || (way == 0 && stands())) {
    return std::vector<Leg>{{target, shortest_delay}};
  }
  bushd_delay slow = shortest_delay;
  if (setup_.backlash_speed) {
    const auto approach = shortest_delay_at(words::Speed{.per_s = *setup_.backlash_speed});
    if (!approach) return fail("backlash_speed: " + approach.error().message);
    slow = std::max(shortest_delay, *approach);
  }
  // As the EPICS motor record does it: straight, if it is in the direction of the last approach and
  // as slow. One that moves may have to come back first, so that its direction says nothing.
  const bool from_that_side = stands() && (way < 0) == (*backlash < 0);
  if (from_that_side && (slow == shortest_delay || std::abs(way) <= std::abs(*backlash))) {
    return std::vector<Leg>{{target, slow}};
  }
  const std::int64_t start = target - *backlash;
  if (auto may = may_move_to(start, shortest_delay); !may) {
    return fail("the start of its last approach, for backlash: " + may.error().message);
  }
  return std::vector<Leg>{{start, shortest_delay}, {target, slow}};
}

Motor::Range Motor::allowed_steps() const {
  return {.low = setup_.coordinates.first_step_from(setup_.soft_limits->low),
          .high = setup_.coordinates.last_step_to(setup_.soft_limits->high)};
}

std::int64_t Motor::lowest() const {
  return setup_.soft_limits ? allowed_steps().low : -kMaxPosition;
}

std::int64_t Motor::highest() const {
  return setup_.soft_limits ? allowed_steps().high : kMaxPosition;
}

std::string Motor::text_of(const Range& range) const {
  const units::Coordinates& coordinates = setup_.coordinates;
  const bool falls = coordinates.scale().negative;
  return fmt::format("{} to {}", coordinates.text(falls ? range.high : range.low),
                     coordinates.text(falls ? range.low : range.high));
}

// One that stands beyond a limit may be moved towards it.
Result<void> Motor::within_soft_limits(std::int64_t target) const {
  if (!setup_.soft_limits) return {};
  const Range range = allowed_steps();
  if (target >= std::min(range.low, position_) && target <= std::max(range.high, position_)) {
    return {};
  }
  const std::int64_t limit = target > range.high ? range.high : range.low;
  return fail(fmt::format("target {} is beyond the soft limit at {}; allowed: {}",
                          setup_.coordinates.text(target), setup_.coordinates.text(limit),
                          text_of(range)));
}

Result<void> Motor::stands_within_soft_limits() const {
  if (!setup_.soft_limits) return {};
  const Range range = allowed_steps();
  if (position_ >= range.low && position_ <= range.high) return {};
  return fail(
      fmt::format("it stands at {}, beyond its soft limits of {}; it may be moved towards them",
                  setup_.coordinates.text(position_), text_of(range)));
}

// Nothing is rounded for a motor without a unit, so amounts in steps are whole.
Result<void> Motor::is_amount(const words::Amount& amount) const {
  const auto* user = std::get_if<words::UserUnits>(&amount);
  if (user == nullptr || setup_.coordinates.has_unit()) return {};
  if (std::trunc(user->value) == user->value) return {};
  return fail(fmt::format("{} is no whole number of steps, and it has no unit", user->value));
}

Result<std::int64_t> Motor::steps_of_position(const words::Amount& position) const {
  if (auto good = is_amount(position); !good) return fail(good.error());
  if (const auto* steps = std::get_if<std::int64_t>(&position)) return *steps;
  return setup_.coordinates.steps_of_user(std::get<words::UserUnits>(position).value);
}

Result<units::Steps> Motor::position_of(const words::Amount& position) const {
  if (auto good = is_amount(position); !good) return fail(good.error());
  if (const auto* steps = std::get_if<std::int64_t>(&position)) return units::Steps{*steps};
  return setup_.coordinates.unrounded_of_user(std::get<words::UserUnits>(position).value);
}

Result<units::Steps> Motor::distance_of(const words::Amount& distance) const {
  if (auto good = is_amount(distance); !good) return fail(good.error());
  if (const auto* steps = std::get_if<std::int64_t>(&distance)) return units::Steps{*steps};
  return setup_.coordinates.unrounded_of_distance(std::get<words::UserUnits>(distance).value);
}

}  // namespace bushd::motion
