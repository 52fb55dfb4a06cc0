#include "jog_amounts.h"

#include <algorithm>
#include <cmath>

namespace bushctl {
namespace {

using bushd::tables::TableContent;
using bushd::units::Coordinates;

constexpr double kStepsOfAStep = 10;
constexpr double kSlowestPerS = 1.0001 / 3600;  // a step an hour is what the daemon takes

// The next of ..., 0.1, 0.2, 0.5, 1, 2, 5, ...
double round_up(double value) {
  const double power = std::pow(10, std::floor(std::log10(value)));
  constexpr double kAlmost = 1 + 1e-9;  // 10 steps of 0.01 are 0.1, and not 0.2
  for (const double digit : {1.0, 2.0, 5.0}) {
    if (value <= digit * power * kAlmost) return digit * power;
  }
  return 10 * power;
}

}  // namespace

JogAmounts jog_amounts(const TableContent* table, const bushd::units::Scale& scale, bool in_steps) {
  const auto& [numerator, denominator] = scale.steps_per_unit;
  const bool steps = in_steps || scale.unit == Coordinates::kSteps;
  const double units_per_step =
      steps ? 1 : static_cast<double>(denominator) / static_cast<double>(numerator);
  JogAmounts amounts{.unit = steps ? Coordinates::kSteps : scale.unit,
                     .step = round_up(kStepsOfAStep * units_per_step),
                     .least_step = units_per_step};
  if (table == nullptr) return amounts;
  const double per_s = 1e9 / table->time_unit_ns * units_per_step;  // of a step a time unit
  amounts.speed = per_s / table->accel.front();
  amounts.least_speed = kSlowestPerS * units_per_step;
  amounts.most_speed = per_s / table->cruise.value_or(table->accel.back());
  return amounts;
}

void JogAmounts::change_speed(int doublings) {
  speed = std::clamp(std::ldexp(speed, doublings), least_speed, std::max(speed, most_speed));
}

void JogAmounts::change_step(int doublings) {
  step = std::max(std::ldexp(step, doublings), least_step);
  if (unit == Coordinates::kSteps) step = std::floor(step);
}

}  // namespace bushctl
