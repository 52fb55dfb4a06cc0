#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "motion/motor.h"
#include "motion/report_words.h"
#include "words/remedy.h"

namespace bushd::motion {

bool MotorReach::forbidden(int direction) const {
  return motor_.forbidden(direction);
}

Result<void> MotorReach::may_be_used() const {
  if (motor_.is<Armed>()) {
    return fail("waits for the trigger; run " + words::remedy("disarm", motor_.name()) + " first");
  }
  if (motor_.is<Homing>()) return fail("it is being homed; wait for that result");
  if (motor_.is<Travelling>()) {
    return fail("it travels by itself, for a CAMAC module; run " +
                words::remedy("stop", motor_.name()) + " first");
  }
  if (motor_.is<InProgram>()) {
    return fail("a program of its MCU controls it; run " + words::remedy("stop", motor_.name()) +
                " first");
  }
  if (motor_.is<Local>() && !motor_.autonomous_) {
    return fail("MCU " + motor_.setup_.mcu +
                " moves it for another master; end that, and wait until it rests");
  }
  if (motor_.is<Local>()) {
    return fail("the local inputs of MCU " + motor_.setup_.mcu + " move it; release them first");
  }
  return {};
}

Result<void> MotorReach::may_move_to(std::int64_t target, bushd_delay shortest_delay) const {
  if (motor_.trust_.uncertain_reason()) {
    return fail(
        "its position is uncertain, because " + *motor_.trust_.uncertain_reason() + "; " +
        (motor_.setup_.has_home ? "run " + words::remedy("home", motor_.name()) + ", or " : "") +
        "find out where it stands and run " + words::set_remedy(motor_.name()) + ", or " +
        words::remedy("confirm", motor_.name()) + " if it stands where it is shown");
  }
  if (motor_.is<OnLine>()) {
    return fail("it moves on a line, or by a CAMAC program; run " +
                words::remedy("stop", motor_.name()) + " first, then move it by itself");
  }
  if (follows_trajectory(motor_)) {
    return fail("it follows a trajectory; run " + words::remedy("stop", motor_.name()) +
                " first, then move it by itself");
  }
  if (motor_.trust_.restored_reason() && motor_.setup_.restored_refused) {
    return fail("its position is only restored, because " + *motor_.trust_.restored_reason() +
                ", and restored = \"refuse\" keeps it there; run " +
                (motor_.setup_.has_home ? words::remedy("home", motor_.name()) + " or " : "") +
                words::set_remedy(motor_.name()) + ", or " +
                words::remedy("confirm", motor_.name()) + " if it is right");
  }
  const std::int64_t steps = target - motor_.position_;
  if (target > Motor::kMaxPosition || target < -Motor::kMaxPosition ||
      std::abs(steps) > Motor::kMaxPosition) {
    return fail("target " + std::to_string(target) + " is beyond +-" +
                std::to_string(Motor::kMaxPosition) + " steps");
  }
  if (auto within = motor_.scale().may_move_to(target, motor_.position_); !within) return within;
  if (motor_.moves() && motor_.moving()->limit != 0) {
    return fail(switch_at(motor_.moving()->limit) + " is stopping it; wait for that result");
  }
  const int direction = steps < 0 ? -1 : 1;
  if (steps != 0 && forbidden(direction)) {
    return fail(
        switch_at(direction) +
        " is active: motion in this direction is inhibited; move it in the other direction");
  }
  if (motor_.axis_.duration_ticks(steps, shortest_delay) > Axis::kMaxDurationTicks) {
    const double tick_days = motor_.axis_.tick_ns() * 1e-9 / 86400;
    return fail(fmt::format(
        "{} steps would take {:.1f} days at that speed; the longest move is {:.1f} days: move it "
        "faster, or in parts",
        steps, motor_.axis_.duration_ticks(steps, shortest_delay) * tick_days,
        Axis::kMaxDurationTicks * tick_days));
  }
  return {};
}

Result<void> MotorReach::may_be_moved_within(std::int64_t steps) const {
  if (std::abs(motor_.position_) + steps <= Motor::kMaxPosition) return {};
  return fail(fmt::format(
      "it stands at {}, and may make up to {} steps to either side, which would lead beyond +-{}, "
      "where no more are counted; run {}, then home it",
      motor_.position_, steps, Motor::kMaxPosition,
      words::remedy("set", motor_.name(), "--dial 0")));
}

Result<units::Steps> MotorReach::distance_from() const {
  const auto rounded = rounded_distance_from();
  if (!rounded) return fail(rounded.error());
  return motor_.asked_for_ && motor_.asked_for_->whole == *rounded ? *motor_.asked_for_
                                                                   : units::Steps{*rounded};
}

Result<std::int64_t> MotorReach::rounded_distance_from() const {
  constexpr const char* kRemedy = "wait until it stands, or move it to a position";
  if (!motor_.has_plan()) {
    if (auto may = may_be_used(); !may) return fail(may.error());
    return motor_.position_;
  }
  if (motor_.is_paused()) {
    return fail("it is paused on its way to " +
                motor_.scale().coordinates().text(motor_.target_steps()) +
                ", so a distance could count from there or from where it is; run " +
                words::remedy("stop", motor_.name()) + " first, or move it to a position");
  }
  if (motor_.stops()) {
    if (motor_.axis_.is_planned()) return motor_.axis_.end_steps();
    return fail(
        fmt::format("it is being stopped, and where it will stand is not known yet; {}", kRemedy));
  }
  if (motor_.jogs_)
    return fail(fmt::format("it jogs, and nobody has said where it is to stand; {}", kRemedy));
  if (follows_trajectory(motor_))
    return fail(fmt::format("it follows a trajectory, which may get more rows; {}", kRemedy));
  return motor_.target_steps();
}

std::int64_t MotorReach::farthest(int direction, bushd_delay shortest_delay) const {
  const std::int64_t limit = direction > 0 ? motor_.scale().highest() : motor_.scale().lowest();
  const std::int64_t steps = std::min((limit - motor_.position_) * direction, Motor::kMaxPosition);
  if (steps <= 0) return motor_.position_;
  if (motor_.axis_.duration_ticks(steps, shortest_delay) <= Axis::kMaxDurationTicks) {
    return motor_.position_ + direction * steps;
  }
  std::int64_t low = 0;
  std::int64_t high = steps;
  while (high - low > 1) {
    const std::int64_t middle = low + (high - low) / 2;
    (motor_.axis_.duration_ticks(middle, shortest_delay) <= Axis::kMaxDurationTicks ? low : high) =
        middle;
  }
  return motor_.position_ + direction * low;
}

Result<std::vector<Leg>> MotorReach::legs_to(std::int64_t target,
                                             bushd_delay shortest_delay) const {
  if (auto may = may_move_to(target, shortest_delay); !may) return fail(may.error());
  const auto backlash = motor_.scale().coordinates().steps_of_distance(motor_.setup_.backlash);
  const std::int64_t way = target - motor_.position_;
  if (!backlash || *backlash == 0 || (way == 0 && motor_.stands())) {
    return std::vector<Leg>{{target, shortest_delay}};
  }
  bushd_delay slow = shortest_delay;
  if (motor_.setup_.backlash_speed) {
    const auto approach = shortest_delay_at(words::Speed{.per_s = *motor_.setup_.backlash_speed});
    if (!approach) return fail("backlash_speed: " + approach.error().message);
    slow = std::max(shortest_delay, *approach);
  }
  // As the EPICS motor record does it: straight, if it is in the direction of the last approach and
  // as slow. One that moves may have to come back first, so that its direction says nothing.
  const bool from_that_side = motor_.stands() && (way < 0) == (*backlash < 0);
  if (from_that_side && (slow == shortest_delay || std::abs(way) <= std::abs(*backlash))) {
    return std::vector<Leg>{{target, slow}};
  }
  const std::int64_t start = target - *backlash;
  if (auto may = may_move_to(start, shortest_delay); !may) {
    return fail("the start of its last approach, for backlash: " + may.error().message);
  }
  return std::vector<Leg>{{start, shortest_delay}, {target, slow}};
}

Result<void> MotorReach::stands_within_soft_limits() const {
  return motor_.scale().stands_within_soft_limits(motor_.position_);
}

Result<bushd_delay> MotorReach::shortest_delay_at(const std::optional<words::Speed>& speed) const {
  return motor_.scale().shortest_delay_at(speed, motor_.axis_.time_unit_ns());
}

}  // namespace bushd::motion
