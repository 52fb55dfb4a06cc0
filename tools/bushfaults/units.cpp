#include "units.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

#include "sim/random.h"

namespace bushfaults {
namespace {

constexpr std::uint32_t kStream = 406;  // of randomness
constexpr std::int64_t kMicro = 1'000'000;
// 400, 1000/3, 12.5, 80, 2000/7 and 0.4 steps to a unit.
constexpr std::array<std::int64_t, 6> kMicroPerStep = {2'500,  3'000, 80'000,
                                                       12'500, 3'500, 2'500'000};

// Ties away from zero.
std::int64_t nearest(std::int64_t value, std::int64_t divisor) {
  const std::int64_t steps = (2 * std::abs(value) + divisor) / (2 * divisor);
  return value < 0 ? -steps : steps;
}

std::int64_t micro_of(double number) {
  return std::llround(number * static_cast<double>(kMicro));
}

std::int64_t floor_div(std::int64_t value, std::int64_t divisor) {
  return value / divisor - (value % divisor < 0 ? 1 : 0);
}

}  // namespace

void add_units(bushd::config::Config& config, std::uint64_t seed) {
  bushd::sim::Random random(seed, kStream);
  for (bushd::config::Motor& motor : config.motors) {
    const std::int64_t micro_per_step = random.pick(kMicroPerStep);
    const bool negative = random.one_in(2);
    const std::int64_t offset = random.between(-50 * kMicro, 50 * kMicro);
    const std::int64_t low = -random.between(500, 12'000) * micro_per_step - random.between(0, 999);
    const std::int64_t high = random.between(500, 12'000) * micro_per_step + random.between(0, 999);
    const bool limited = random.one_in(2);
    if (random.one_in(4)) continue;
    const auto scale = bushd::units::parse_ratio(fmt::format("{}/{}", kMicro, micro_per_step));
    motor.coordinates =
        bushd::units::Coordinates::make({.unit = "mm",
                                         .steps_per_unit = scale.value(),
                                         .negative = negative,
                                         .offset = static_cast<double>(offset) / kMicro})
            .value();
    if (!limited) continue;
    motor.soft_limits = bushd::units::SoftLimits{.low = static_cast<double>(low) / kMicro,
                                                 .high = static_cast<double>(high) / kMicro};
  }
}

Units::Units(const bushd::config::Config& config) : config_(config) {
  for (const bushd::config::Motor& of : config.motors) {
    Motor motor;
    motor.unit = of.coordinates.has_unit();
    const bushd::units::Scale& scale = of.coordinates.scale();
    if (motor.unit) {
      motor.micro_per_step =
          kMicro * scale.steps_per_unit.denominator / scale.steps_per_unit.numerator;
      motor.sign = scale.negative ? -1 : 1;
      motor.offset_in_file = micro_of(scale.offset);
      motor.offset = motor.offset_in_file;
    }
    motor.offsets = {motor.offset_in_file};
    if (of.soft_limits) {
      motor.limits = Limits{-floor_div(-micro_of(of.soft_limits->low), motor.micro_per_step),
                            floor_div(micro_of(of.soft_limits->high), motor.micro_per_step)};
    }
    motors_.push_back(std::move(motor));
  }
}

void Units::daemon_started(bool kept) {
  for (Motor& motor : motors_) {
    if (!kept) motor.offsets = {motor.offset_in_file};
    motor.offset.reset();
    if (motor.offsets.size() == 1) motor.offset = motor.offsets.front();
  }
}

void Units::was_set(std::size_t index, std::int64_t user_micro,
                    std::optional<std::int64_t> stands) {
  Motor& motor = motors_[index];
  motor.offset.reset();
  if (!stands) {
    motor.offsets.clear();
    return;
  }
  motor.offset = user_micro - motor.sign * *stands * motor.micro_per_step;
  // Nothing says which of them a daemon that starts now would find.
  if (!motor.offsets.empty()) motor.offsets.push_back(*motor.offset);
}

std::optional<std::int64_t> Units::steps_of_position(std::size_t index,
                                                     std::int64_t user_micro) const {
  const Motor& motor = motors_[index];
  if (!motor.offset) return std::nullopt;
  return nearest(motor.sign * (user_micro - *motor.offset), motor.micro_per_step);
}

std::optional<std::int64_t> Units::user_of(std::size_t index, std::int64_t steps) const {
  const Motor& motor = motors_[index];
  if (!motor.offset) return std::nullopt;
  return *motor.offset + motor.sign * steps * motor.micro_per_step;
}

std::int64_t Units::steps_of_dial(std::size_t index, std::int64_t dial_micro) const {
  return nearest(dial_micro, motors_[index].micro_per_step);
}

std::int64_t Units::steps_of_distance(std::size_t index, std::int64_t user_micro) const {
  return motors_[index].sign * nearest(user_micro, motors_[index].micro_per_step);
}

std::int64_t Units::micro_of_distance(std::size_t index, std::int64_t steps) const {
  return motors_[index].sign * steps * motors_[index].micro_per_step;
}

std::int64_t Units::floor_ns(std::size_t index, const Request& request) const {
  if (request.speed_micro == 0) return 0;
  const auto unit_ns =
      static_cast<std::int64_t>(config_.table_of(config_.motors[index]).view().time_unit_ns);
  const std::int64_t micro_per_step =
      request.speed_in_steps ? kMicro : motors_[index].micro_per_step;
  const std::int64_t step_ns = 1'000'000'000 * micro_per_step / request.speed_micro;
  return step_ns / unit_ns * unit_ns;  // not above what it is: a bound
}

std::optional<std::string> Units::check(std::size_t index, const bushd::api::MotorState& state) {
  if (state.trust == bushd::api::Trust::kUnknown) return std::nullopt;
  Motor& motor = motors_[index];
  const std::int64_t dial = state.position_steps * motor.micro_per_step;
  if (micro_of(state.dial) != dial) {
    return fmt::format("{} is said to be at {} on its dial, at {} steps", state.name, state.dial,
                       state.position_steps);
  }
  const std::int64_t offset = micro_of(state.user) - motor.sign * dial;
  if (!motor.offset) {
    const bool possible =
        motor.offsets.empty() || std::ranges::find(motor.offsets, offset) != motor.offsets.end();
    if (!possible) return fmt::format("{} has an offset of {} millionths", state.name, offset);
    motor.offset = offset;
    motor.offsets = {offset};
  }
  if (*motor.offset == offset) return std::nullopt;
  return fmt::format("{} is said to be at {} for users, at {} steps: offset {} in place of {}",
                     state.name, state.user, state.position_steps, offset, *motor.offset);
}

}  // namespace bushfaults
