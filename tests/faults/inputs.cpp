#include "inputs.h"

#include <fmt/core.h>

#include <algorithm>

#include "made_config.h"
#include "programs.h"
#include "shutter_model.h"
#include "times.h"

namespace bushfaults {
namespace {

using bushd::sim::TimeNs;

}  // namespace

Inputs::Inputs(const bushd::config::Config& config, bushd::sim::Bus& bus, bushd::sim::Plant& plant,
               Witness& witness, std::uint64_t seed)
    : config_(config),
      bus_(bus),
      plant_(plant),
      witness_(witness),
      limit_until_ns_(config.motors.size(), 0),
      emergency_until_ns_(config.mcus.size(), 0),
      trigger_(config.mcus.size(), false) {
  for (std::size_t i = 0; i < config.motors.size(); ++i) {
    const bushd::config::Motor& motor = config.motors[i];
    switches_.push_back(limit_switches(config, i, seed));
    if (ShutterPlace::motor(config) == bushd::MotorId{i}) add_shutter_switches(i);
    const auto home = home_switch(config, i, seed);
    if (!home) continue;
    switches_.back().push_back(*home);
    witness_.positions().has_switch(i, home->at_steps);
    for (const bushd::sim::SwitchOptions& one : switches_.back()) {
      bus_.mcu(motor.mcu.value).attach_switch(motor.output.value, one);
    }
  }
}

// Limits at both ends of its way, and a sensor that sees every second step.
void Inputs::add_shutter_switches(std::size_t index) {
  const bushd::config::Motor& motor = config_.motors[index];
  const bushd::config::MotorInputs& its = motor.inputs;
  const bushd::sim::SwitchOptions right{
      .at_steps = ShutterPlace::kRightSteps, .positive_end = true, .input = its.positive->number};
  const bushd::sim::SwitchOptions left{.at_steps = ShutterPlace::kLeftSteps,
                                       .input = its.negative->number};
  const bushd::sim::SwitchOptions sensor{.period_steps = ShutterPlace::kSensorPeriod,
                                         .input = its.step->number};
  switches_.back() = {right, left};
  for (const auto& one : {right, left, sensor}) {
    bus_.mcu(motor.mcu.value).attach_switch(motor.output.value, one);
  }
}

void Inputs::set(std::size_t mcu) {
  unsigned motors = 0;
  for (std::size_t i = 0; i < config_.motors.size(); ++i) {
    if (config_.motors[i].mcu.value != mcu || limit_until_ns_[i] == 0) continue;
    motors |= 1u << config_.motors[i].output.value;
  }
  unsigned system = 0;
  if (emergency_until_ns_[mcu] != 0) system |= BUSHD_INPUT_EMERGENCY;
  if (trigger_[mcu]) system |= BUSHD_INPUT_TRIGGER;
  bus_.mcu(mcu).set_inputs({static_cast<std::uint16_t>(motors), static_cast<std::uint8_t>(system)});
}

std::string Inputs::press_limit(TimeNs now_ns, bushd::sim::Random& random) {
  auto motor = static_cast<std::size_t>(random.below(config_.motors.size()));
  if (is_of_shutter(config_, motor)) motor = 0;  // its switches are the plant's
  const TimeNs length_ns = random.magnitude(5 * kMs, 2000 * kMs);
  limit_until_ns_[motor] = now_ns + length_ns;
  witness_.pressed(now_ns, motor);
  set(config_.motors[motor].mcu.value);
  return fmt::format("of {} for {} ms", config_.motors[motor].name, length_ns / kMs);
}

std::string Inputs::press_emergency(TimeNs now_ns, bushd::sim::Random& random) {
  const auto mcu = static_cast<std::size_t>(random.below(config_.mcus.size()));
  const TimeNs length_ns = random.magnitude(5 * kMs, 2000 * kMs);
  emergency_until_ns_[mcu] = now_ns + length_ns;
  set(mcu);
  // It looks within a tick, and what it has prepared by then is made: the same two ticks as for an
  // EMERGENCY. One that a host has not told yet what this input is for does not look at all.
  const bushd::sim::VirtualMcu& of = bus_.mcu(mcu);
  if (of.running() && of.core().inputs.emergency != BUSHD_EMERGENCY_INPUT_IGNORED) {
    plant_.halt(mcu, now_ns, of.core().inputs.emergency != BUSHD_EMERGENCY_INPUT_RAMP);
  }
  return fmt::format("of {} for {} ms", config_.mcus[mcu].id, length_ns / kMs);
}

std::string Inputs::trigger(TimeNs now_ns, bushd::sim::Random& random) {
  const auto one = static_cast<std::size_t>(random.below(config_.mcus.size()));
  const bool all = random.one_in(2);
  for (std::size_t mcu = 0; mcu < config_.mcus.size(); ++mcu) {
    if (!all && mcu != one) continue;
    trigger_[mcu] = !trigger_[mcu];
    witness_.trigger(now_ns, mcu, trigger_[mcu]);
    set(mcu);
  }
  return all ? "at all MCUs" : "at " + config_.mcus[one].id;
}

void Inputs::run(TimeNs now_ns) {
  for (std::size_t i = 0; i < limit_until_ns_.size(); ++i) {
    if (limit_until_ns_[i] == 0) continue;
    witness_.pressed(now_ns, i);
    if (limit_until_ns_[i] > now_ns) continue;
    limit_until_ns_[i] = 0;
    set(config_.motors[i].mcu.value);
  }
  for (std::size_t mcu = 0; mcu < emergency_until_ns_.size(); ++mcu) {
    if (emergency_until_ns_[mcu] == 0 || emergency_until_ns_[mcu] > now_ns) continue;
    emergency_until_ns_[mcu] = 0;
    set(mcu);
  }
  watch_switches(now_ns);
}

// A motor that is beyond its switch, or so near that the contact may still be closed, presses it.
void Inputs::watch_switches(TimeNs now_ns) {
  for (std::size_t i = 0; i < switches_.size(); ++i) {
    for (const bushd::sim::SwitchOptions& one : switches_[i]) {
      const std::int64_t towards = one.positive_end ? 1 : -1;
      const std::int64_t beyond = (witness_.positions().plant_steps(i) - one.at_steps) * towards;
      if (beyond >= -one.hysteresis_steps) witness_.pressed(now_ns, i);
    }
  }
}

TimeNs Inputs::released_ns() const {
  return std::max(*std::max_element(limit_until_ns_.begin(), limit_until_ns_.end()),
                  *std::max_element(emergency_until_ns_.begin(), emergency_until_ns_.end()));
}

}  // namespace bushfaults
