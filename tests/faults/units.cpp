#include "units.h"

#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

#include "request.h"
#include "sim/random.h"

namespace bushfaults {
namespace {

constexpr std::uint32_t kUnitsStream = 406;  // of randomness
constexpr std::uint32_t kBacklashStream = 408;
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

std::int64_t micro_per_step_of(const bushd::config::Motor& motor) {
  const bushd::units::Scale& scale = motor.coordinates.scale();
  return kMicro * scale.steps_per_unit.denominator / scale.steps_per_unit.numerator;
}

}  // namespace

void add_units(bushd::config::Config& config, std::uint64_t seed) {
  bushd::sim::Random random(seed, kUnitsStream);
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

void add_backlash(bushd::config::Config& config, std::uint64_t seed) {
  bushd::sim::Random random(seed, kBacklashStream);
  for (bushd::config::Motor& motor : config.motors) {
    const bool has = random.one_in(2);
    const std::int64_t steps = random.magnitude(2, 400) * (random.one_in(2) ? 1 : -1);
    const std::int64_t steps_per_s = random.magnitude(150, 2'000);
    const bool slower = random.one_in(2);
    const std::int64_t settle_ms = random.magnitude(5, 1'500);
    if (random.one_in(3)) motor.settle_ms = settle_ms;
    if (!has) continue;
    const double micro_per_step = static_cast<double>(micro_per_step_of(motor));
    motor.backlash = static_cast<double>(steps) * micro_per_step / static_cast<double>(kMicro);
    if (!slower) continue;
    motor.backlash_speed =
        static_cast<double>(steps_per_s) * micro_per_step / static_cast<double>(kMicro);
  }
}

Units::Units(const bushd::config::Config& config) : config_(config) {
  for (const bushd::config::Motor& of : config.motors) {
    Motor motor;
    motor.unit = of.coordinates.has_unit();
    motor.micro_per_step = micro_per_step_of(of);
    motor.in_file.sign = of.coordinates.scale().negative ? -1 : 1;
    motor.in_file.offset = micro_of(of.coordinates.scale().offset);
    if (of.soft_limits) {
      motor.in_file.low = micro_of(of.soft_limits->low);
      motor.in_file.high = micro_of(of.soft_limits->high);
    }
    motor.backlash_micro = micro_of(of.backlash);
    motor.approach_micro = micro_of(of.backlash_speed.value_or(0));
    motor.now = motor.in_file;
    motor.kept = {motor.in_file};
    motors_.push_back(std::move(motor));
  }
}

void Units::daemon_started(bool kept) {
  for (Motor& motor : motors_) {
    if (!kept) motor.kept = {motor.in_file};
    motor.now = motor.kept.back();
    motor.decided = motor.kept.size() == 1;
  }
}

void Units::change(Motor& motor, Settings settings) {
  settings.change = ++changes_;
  motor.now = settings;
  // Nothing says which of them a daemon that starts now would find.
  motor.kept.push_back(settings);
}

void Units::was_set(std::size_t index, std::int64_t user_micro,
                    std::optional<std::int64_t> stands) {
  Motor& motor = motors_[index];
  Settings settings = motor.now;
  settings.offset.reset();
  if (stands) settings.offset = user_micro - settings.sign * *stands * motor.micro_per_step;
  change(motor, settings);
}

std::uint64_t Units::configured(std::size_t index, const Setting& setting) {
  Motor& motor = motors_[index];
  Settings settings = motor.now;
  switch (setting.key) {
    case Setting::Key::kOffset:
      settings.offset = setting.low;
      break;
    case Setting::Key::kDirection:
      settings.sign = setting.low < 0 ? -1 : 1;
      break;
    case Setting::Key::kSoftLimits:
      settings.low.reset();
      settings.high.reset();
      if (setting.none) break;
      settings.low = setting.low;
      settings.high = setting.high;
      break;
  }
  change(motor, settings);
  return changes_;
}

void Units::is_on_disk(std::size_t index, std::uint64_t change) {
  std::erase_if(motors_[index].kept, [change](const Settings& s) { return s.change < change; });
}

std::optional<Units::Limits> Units::limits(std::size_t index) const {
  const Motor& motor = motors_[index];
  if (!motor.decided || !motor.now.low) return std::nullopt;
  return Limits{-floor_div(-*motor.now.low, motor.micro_per_step),
                floor_div(*motor.now.high, motor.micro_per_step)};
}

std::optional<std::int64_t> Units::steps_of_position(std::size_t index,
                                                     std::int64_t user_micro) const {
  const Motor& motor = motors_[index];
  if (!motor.decided || !motor.now.offset) return std::nullopt;
  return nearest(motor.now.sign * (user_micro - *motor.now.offset), motor.micro_per_step);
}

std::optional<std::int64_t> Units::user_of(std::size_t index, std::int64_t steps) const {
  const Motor& motor = motors_[index];
  if (!motor.decided || !motor.now.offset) return std::nullopt;
  return *motor.now.offset + motor.now.sign * steps * motor.micro_per_step;
}

std::int64_t Units::steps_of_dial(std::size_t index, std::int64_t dial_micro) const {
  return nearest(dial_micro, motors_[index].micro_per_step);
}

std::int64_t Units::steps_of_distance(std::size_t index, std::int64_t user_micro) const {
  return motors_[index].now.sign * nearest(user_micro, motors_[index].micro_per_step);
}

std::int64_t Units::micro_of_distance(std::size_t index, std::int64_t steps) const {
  return motors_[index].now.sign * steps * motors_[index].micro_per_step;
}

std::int64_t Units::backlash_steps(std::size_t index) const {
  const Motor& motor = motors_[index];
  return motor.now.sign * nearest(motor.backlash_micro, motor.micro_per_step);
}

std::int64_t Units::unit_ns(std::size_t index) const {
  return config_.table_of(config_.motors[index]).view().time_unit_ns;
}

std::int64_t Units::delay(std::size_t index, std::int64_t speed_micro,
                          std::int64_t micro_per_step) const {
  if (speed_micro == 0) return 0;
  const std::int64_t per_unit = std::abs(speed_micro) * unit_ns(index);
  return (1'000'000'000 * micro_per_step + per_unit - 1) / per_unit;
}

std::int64_t Units::delay(std::size_t index, const Request& request) const {
  return delay(index, request.speed_micro,
               request.speed_in_steps ? kMicro : motors_[index].micro_per_step);
}

std::int64_t Units::shortest_delay_ns(std::size_t index, const Request& request) const {
  return delay(index, request) * unit_ns(index);
}

bool Units::approach_is_slower(std::size_t index, const Request& request) const {
  const Motor& motor = motors_[index];
  return delay(index, motor.approach_micro, motor.micro_per_step) > delay(index, request);
}

std::int64_t Units::approach_shortest_delay_ns(std::size_t index, const Request& request) const {
  const Motor& motor = motors_[index];
  return std::max(delay(index, motor.approach_micro, motor.micro_per_step), delay(index, request)) *
         unit_ns(index);
}

std::optional<std::string> Units::check(std::size_t index, const bushd::api::MotorState& state) {
  if (state.trust == bushd::api::Trust::kUnknown) return std::nullopt;
  Motor& motor = motors_[index];
  const std::int64_t dial = state.position_steps * motor.micro_per_step;
  if (micro_of(state.dial) != dial) {
    return fmt::format("{} is said to be at {} on its dial, at {} steps", state.name, state.dial,
                       state.position_steps);
  }
  const std::int64_t offset = micro_of(state.user) - motor.now.sign * dial;
  if (motor.decided && motor.now.offset == offset) return std::nullopt;
  return fmt::format("{} is said to be at {} for users, at {} steps: offset {} in place of {}",
                     state.name, state.user, state.position_steps, offset,
                     motor.now.offset.value_or(0));
}

std::optional<std::string> Units::check(std::size_t index,
                                        const bushd::api::MotorDescription& said) {
  Motor& motor = motors_[index];
  Settings settings{.offset = micro_of(said.scale.offset), .sign = said.scale.negative ? -1 : 1};
  if (said.soft_limits) {
    settings.low = micro_of(said.soft_limits->low);
    settings.high = micro_of(said.soft_limits->high);
  }
  const bool good =
      motor.decided
          ? motor.now.is(settings)
          : std::ranges::any_of(motor.kept, [&](const Settings& one) { return one.is(settings); });
  if (!good) {
    return fmt::format(
        "{} is said to have offset {}, sign {}, soft limits {} to {}, in place of "
        "{}, {}, {} to {}",
        said.name, *settings.offset, settings.sign, settings.low.value_or(0),
        settings.high.value_or(0), motor.now.offset.value_or(0), motor.now.sign,
        motor.now.low.value_or(0), motor.now.high.value_or(0));
  }
  if (motor.decided && motor.now.offset) return std::nullopt;
  // An offset that nobody knew is known now; and of what was kept this daemon has found one.
  settings.change = motor.decided ? motor.now.change : 0;
  motor.now = settings;
  if (!motor.decided) motor.kept.clear();
  if (!motor.kept.empty()) motor.kept.pop_back();
  motor.kept.push_back(settings);
  motor.decided = true;
  return std::nullopt;
}

}  // namespace bushfaults
