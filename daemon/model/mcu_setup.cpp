#include "daemon/model/mcu_setup.h"

#include <algorithm>

#include "base/output_bits.h"

namespace bushd::daemon {
namespace {

constexpr std::int32_t kVelocityUnits = 64;  // of VELOCITY, in a step/s

bushd_set_inputs inputs_of(const config::Mcu& mcu) {
  bushd_set_inputs inputs{};
  inputs.debounce_ticks = mcu.debounce_ticks;
  inputs.emergency = mcu.emergency_input;
  inputs.overcurrent = mcu.overcurrent;
  inputs.enable_after_watchdog = mcu.enable_after_reset == config::EnableAfterReset::kAtOnce;
  if (mcu.emergency_active_open) inputs.system_inverted |= BUSHD_INPUT_EMERGENCY;
  return inputs;
}

void add_inputs(link::McuSetup& setup, const config::Motor& motor, bool one_input_open) {
  const std::uint16_t bit = bit_of(motor.output);
  const config::MotorInputs& its = motor.inputs;
  if (its.positive) setup.inputs.limit_positive |= bit;
  if (its.negative) setup.inputs.limit_negative |= bit;
  if (motor.limit_action == BUSHD_STOP_IMMEDIATE) setup.inputs.limit_immediate |= bit;
  for (const auto& input : {its.positive, its.negative, its.home, its.step, its.own}) {
    if (!input) continue;
    setup.used_inputs |= static_cast<std::uint16_t>(1u << input->number);
    if (motor.has_one_input ? one_input_open : input->active_open) {
      setup.inputs.inverted |= static_cast<std::uint16_t>(1u << input->number);
    }
  }
  const std::uint8_t own = motor.output.value;
  const auto number = [own](const std::optional<config::Input>& input) {
    return input ? input->number : own;
  };
  const bushd_motor_inputs numbers = {.motor = own,
                                      .positive = number(its.positive),
                                      .negative = number(its.negative),
                                      .home = number(its.home)};
  if (numbers.positive == own && numbers.negative == own && numbers.home == own) return;
  setup.motor_inputs.push_back(numbers);
}

// Where what the MCU may have no room for stands in the file.
void add_places(link::McuSetup& setup, const config::Bus& bus, const config::Mcu& mcu) {
  using enum link::SetupKey;
  setup.places[{kAddress, 0}] = mcu.places.at("address");
  setup.places[{kFormat, 0}] = bus.places.at("format");
  setup.places[{kTick, 0}] = bus.places.at("tick_us");
  setup.places[{kEmergencyStop, 0}] = bus.places.at("emergency_stop");
  setup.places[{kEmergencyInput, 0}] = mcu.places.at("emergency_input");
}

void add_places(link::McuSetup& setup, const config::Motor& motor) {
  using enum link::SetupKey;
  const unsigned output = motor.output.value;
  setup.places[{kOutput, output}] = motor.places.at("output");
  setup.places[{kTable, output}] = motor.places.at("group");
  setup.places[{kCurrents, output}] = motor.places.at("currents");
  setup.places[{kVelocity, output}] = motor.places.at("velocity");
  setup.places[{kKeypad, output}] = motor.places.at("keypad");
  const Error inputs = motor.places.at(motor.places.written("inputs") ? "inputs" : "output");
  setup.places[{kMotorInputs, output}] = inputs;
  const config::MotorInputs& its = motor.inputs;
  for (const auto& input : {its.positive, its.negative, its.home, its.step, its.own}) {
    if (input) setup.places.try_emplace({kInput, input->number}, inputs);
  }
}

// Rounded up: 0 would be no limit.
std::uint16_t keypad_ticks(const config::Config& config, const config::Mcu& mcu) {
  const std::uint32_t tick_us = config.bus_of(mcu).tick_us;
  return static_cast<std::uint16_t>((mcu.keypad_ms * 1000 + tick_us - 1) / tick_us);
}

// Motors with the same table share it.
void add_table(link::McuSetup& setup, Output output, const tables::Table& table) {
  const auto found =
      std::find_if(setup.tables.begin(), setup.tables.end(),
                   [&table](const link::TableRef& ref) { return ref.table == &table.view(); });
  setup.table_of_motor[output.value] = static_cast<std::uint8_t>(found - setup.tables.begin());
  if (found != setup.tables.end()) return;
  setup.tables.push_back({.table = &table.view(), .revision = table.revision()});
}

}  // namespace

link::McuSetup setup_of(const config::Config& config, McuId id, const TableOf& table_of,
                        const Drives& drives) {
  const config::Mcu& mcu = config[id];
  link::McuSetup setup{.address = mcu.address, .tables = {}};
  setup.emission = mcu.emission;
  setup.outputs = mcu.outputs;
  setup.outputs_at = mcu.outputs_at;
  setup.inputs = inputs_of(mcu);
  setup.disabled_by_stop = config.bus_of(mcu).emergency_stop == BUSHD_STOP_DISABLE;
  add_places(setup, config.bus_of(mcu), mcu);
  setup.off_after_watchdog = mcu.enable_after_reset == config::EnableAfterReset::kNo;
  std::vector<const config::Motor*> motors;
  for (const config::Motor& motor : config.motors) {
    if (motor.mcu == id) motors.push_back(&motor);
  }
  const auto id_of = [&config](const config::Motor* motor) {
    return MotorId{static_cast<std::size_t>(motor - config.motors.data())};
  };
  const auto drive_of = [&](const config::Motor* motor) -> const config::Drive& {
    return drives[id_of(motor)];
  };
  // Banks are given in the order of outputs.
  std::ranges::sort(motors, {}, [](const config::Motor* motor) { return motor->output; });
  for (const config::Motor* motor : motors) {
    add_places(setup, *motor);
    add_inputs(setup, *motor, drive_of(motor).input_open);
    if (drive_of(motor).local) setup.local.motors |= bit_of(motor->output);
    if (drive_of(motor).keypad) {
      setup.local.keypad |= bit_of(motor->output);
      setup.local.keypad_ticks = keypad_ticks(config, mcu);
    }
    if (setup.emission.settings.mode == BUSHD_EMISSION_PHASES) {
      setup.emission.settings.sequence = drive_of(motor).phase_sequence;
      const config::Currents its = drive_of(motor).currents.value_or(config::Currents{});
      setup.currents.push_back(
          {motor->output.value, its.fast_decay, its.ramp_ma, its.cruise_ma, its.hold_ma});
    }
    if (drive_of(motor).moved_by_people()) {
      const config::Velocity its = drive_of(motor).velocity.value_or(config::Velocity{});
      setup.velocities.push_back({.motor = motor->output.value,
                                  .least = its.min_steps_per_s * kVelocityUnits,
                                  .most = its.max_steps_per_s * kVelocityUnits,
                                  .acceleration = its.steps_per_s2});
    }
    add_table(setup, motor->output, *table_of(id_of(motor)));
  }
  return setup;
}

}  // namespace bushd::daemon
