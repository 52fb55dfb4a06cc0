#include "daemon/services/feed.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdlib>

#include "base/bound_text.h"

namespace bushd::daemon {

Result<Feed> Feed::make(const Installation& installation, const std::vector<MotorId>& motors,
                        const api::Speed& feed, motion::Way::Law law) {
  if (!std::isfinite(feed.per_s) || feed.per_s <= 0) {
    return fail(fmt::format("a feed of {}; allowed: any above 0", feed.per_s));
  }
  Feed made;
  made.per_s_ = feed.per_s;
  made.unit_ = units::Coordinates::kSteps;
  if (feed.in_steps) {
    made.step_.assign(motors.size(), 1);
    return made;
  }
  const auto scale_of = [&](MotorId motor) -> const units::Scale& {
    return installation[motor].scale().coordinates().scale();
  };
  const std::string& name = installation[motors.front()].name();
  const units::Scale& first = scale_of(motors.front());
  made.unit_ = first.unit;
  for (const MotorId motor : motors) {
    const units::Scale& scale = scale_of(motor);
    if (scale.unit != first.unit) {
      return fail(fmt::format(
          "{} is in {} and {} in {}: a feed is along the way, so of motors with one unit; give a "
          "speed, which is of each motor in its own, or a feed in steps",
          name, first.unit, installation[motor].name(), scale.unit));
    }
    if (law == motion::Way::Law::kElementary && scale.steps_per_unit != first.steps_per_unit) {
      return fail(
          fmt::format("{} has {} steps per {} and {} has {}: by the elementary law a feed is h f, "
                      "with one step h for all; give a feed in steps, or ask for the leading law",
                      name, to_text(first.steps_per_unit), first.unit, installation[motor].name(),
                      to_text(scale.steps_per_unit)));
    }
    made.step_.push_back(static_cast<double>(scale.steps_per_unit.denominator) /
                         static_cast<double>(scale.steps_per_unit.numerator));
  }
  return made;
}

double Feed::way_ns(std::span<const std::int64_t> from, std::span<const std::int64_t> to) const {
  double squares = 0;
  for (std::size_t i = 0; i < step_.size(); ++i) {
    const double way = static_cast<double>(to[i] - from[i]) * step_[i];
    squares += way * way;
  }
  return std::sqrt(squares) / per_s_ * 1e9;
}

double Feed::step_ns(const motion::Way& way) const {
  if (way.is_elementary()) return step_.front() / per_s_ * 1e9;
  std::vector<std::int64_t> from;
  std::vector<std::int64_t> to;
  for (const motion::Way::Motor& motor : way.motors()) {
    from.push_back(motor.from);
    to.push_back(motor.to);
  }
  return way_ns(from, to) / way.longest();
}

Result<void> Feed::is_possible(double step_ns) const {
  if (step_ns <= static_cast<double>(BUSHD_LONGEST_DELAY_NS)) return {};
  const double least = per_s_ * step_ns / static_cast<double>(BUSHD_LONGEST_DELAY_NS);
  return fail(fmt::format(
      "a feed of {} would take {:.6g} s a step; allowed: up to an hour a step, which is "
      "{} {}/s",
      text(), step_ns * 1e-9, text_of_least(least), unit_));
}

std::string Feed::text() const {
  return fmt::format("{} {}/s", per_s_, unit_);
}

}  // namespace bushd::daemon
