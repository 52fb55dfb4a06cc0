#include "bus/rs485/mcu_fit.h"

#include <algorithm>
#include <bit>
#include <string>

#include "bus/bus_times.h"
#include "bus/rs485/request.h"
#include "engine/velocity.h"

namespace bushd::link {
namespace {

constexpr unsigned kMinQueueTicks =
    2 * fieldbus::kMaxTicksPerFrame;           // one runs while the next arrives
constexpr std::int64_t kMinQueueUs = 150'000;  // two lost answers and a frame

// " (bushd.toml:31:1: motor[3].currents)"; nothing where nobody says.
std::string at(const McuSetup& setup, SetupKey key, unsigned number = 0) {
  const auto found = setup.places.find({key, number});
  if (found == setup.places.end() || found->second.file.empty()) return "";
  constexpr std::size_t kColon = 2;  // before the message that there is none of
  const std::string place = found->second.text();
  return " (" + place.substr(0, place.size() - kColon) + ")";
}

// No motor's table makes more steps in a tick than the emission has room for.
Result<void> check_time(const McuSetup& setup, const bushd_identity& identity,
                        std::uint32_t tick_ns) {
  const auto room = fieldbus::max_steps_per_tick(setup.emission, identity, tick_ns);
  if (!room) return fail(room.error());
  for (std::size_t output = 0; output < setup.table_of_motor.size(); ++output) {
    const auto bank = setup.table_of_motor[output];
    if (!bank) continue;
    const bushd_table* table = setup.tables[*bank].table;
    const std::uint32_t steps = bushd_table_max_steps_per_tick(table, tick_ns);
    if (steps <= *room) continue;
    return fail("has room for " + std::to_string(*room) +
                " steps of a motor in a tick, with its emission in " +
                std::to_string(identity.slots) + " slots, but the table of output " +
                std::to_string(output) + " makes up to " + std::to_string(steps) +
                ": use a slower table, or less step_us or dir_setup_us" +
                at(setup, SetupKey::kTable, static_cast<unsigned>(output)));
  }
  for (const bushd_set_velocity& one : setup.velocities) {
    if (one.most == 0) continue;
    const std::uint32_t period_ns =
        bushd_velocity_period(one.most, one.least) * BUSHD_VELOCITY_INTERVAL_NS;
    const std::uint32_t steps = tick_ns / period_ns + 1;
    if (steps <= *room) continue;
    return fail("has room for " + std::to_string(*room) +
                " steps of a motor in a tick, but motor " + std::to_string(one.motor) +
                " makes up to " + std::to_string(steps) +
                " by its `velocity`: use a lower max_steps_per_s, or a shorter tick_us" +
                at(setup, SetupKey::kVelocity, one.motor));
  }
  return {};
}

// Even emission needs a long first delay: steps that wait for DIR would be followed by others too
// soon.
Result<void> check_dir_setup(const McuSetup& setup) {
  const bushd_emission& settings = setup.emission.settings;
  if (settings.mode != BUSHD_EMISSION_EVEN) return {};
  const auto refusal = [&settings](std::size_t motor, const char* what, std::uint32_t longest_us) {
    return fail("has dir_setup_us = " + std::to_string(settings.dir_setup_us) + ", but motor " +
                std::to_string(motor) + what +
                ", so steps that wait for DIR would come too close together: use dir_setup_us = " +
                std::to_string(longest_us) + " or less, or let it begin more slowly");
  };
  for (std::size_t output = 0; output < setup.table_of_motor.size(); ++output) {
    const auto bank = setup.table_of_motor[output];
    if (!bank) continue;
    const std::uint32_t longest_us = fieldbus::longest_dir_setup_us(*setup.tables[*bank].table);
    if (settings.dir_setup_us > longest_us) {
      return refusal(output, " begins by its table sooner than that allows", longest_us);
    }
  }
  for (const bushd_set_velocity& one : setup.velocities) {
    if (one.most == 0) continue;
    const std::uint32_t longest_us = fieldbus::longest_dir_setup_us(one.least);
    if (settings.dir_setup_us > longest_us) {
      return refusal(one.motor, " turns by its `velocity` sooner than that allows", longest_us);
    }
  }
  return {};
}

Result<void> check_currents(const McuSetup& setup, const bushd_identity& identity) {
  if ((identity.capabilities & BUSHD_CAN_CURRENTS) != 0) return {};
  for (const bushd_currents& one : setup.currents) {
    if (one.ramp_ma == 0) continue;
    return fail("controls no currents of windings, but motor " + std::to_string(one.motor) +
                " has `currents`: leave them out, or connect it to an MCU with a chopper" +
                at(setup, SetupKey::kCurrents, one.motor));
  }
  return {};
}

Result<void> check_velocities(const McuSetup& setup, const bushd_identity& identity) {
  if ((identity.capabilities & BUSHD_CAN_VELOCITY) != 0) return {};
  for (const bushd_set_velocity& one : setup.velocities) {
    if (one.most == 0) continue;
    return fail("moves no motor by the velocity loop, but motor " + std::to_string(one.motor) +
                " has `velocity`: leave it out, so that local inputs move it by its table, or "
                "connect it to an MCU that has the loop" +
                at(setup, SetupKey::kVelocity, one.motor));
  }
  return {};
}

Result<void> check_outputs(const McuSetup& setup, const bushd_identity& identity) {
  const bushd_set_outputs& outputs = setup.outputs;
  const bool all_high =
      outputs.enabled == BUSHD_ENABLED_HIGH && (outputs.step_low | outputs.direction_low) == 0;
  if (all_high || (identity.capabilities & BUSHD_CAN_OUTPUTS) != 0) return {};
  Error error = setup.outputs_at;
  error.message =
      "is \"low\", but outputs of this MCU are active high: update its firmware, or put inverters "
      "before the drivers and remove the key";
  return fail(error.text());
}

Result<void> check_keypad(const McuSetup& setup, const bushd_identity& identity) {
  if (setup.local.keypad == 0 || (identity.capabilities & BUSHD_CAN_KEYPAD) != 0) return {};
  const auto motor = static_cast<unsigned>(std::countr_zero(setup.local.keypad));
  return fail("has no line for a keypad, but motor " + std::to_string(motor) +
              " has `keypad`: leave it out, or connect the keypad to the PC as a [[keypad]]" +
              at(setup, SetupKey::kKeypad, motor));
}

// One that does not know the mode would ignore the stop.
Result<void> check_disabling(const McuSetup& setup, const bushd_identity& identity) {
  const bool by_input = setup.inputs.emergency == BUSHD_EMERGENCY_INPUT_DISABLE;
  if (!by_input && !setup.disabled_by_stop) return {};
  if ((identity.capabilities & BUSHD_CAN_DISABLE) != 0) return {};
  return fail(std::string("does not disable its drivers in an emergency, but ") +
              (by_input ? "its emergency_input" : "emergency_stop of its bus") +
              " is \"disable\": update its firmware, or use \"immediate\"" +
              at(setup, by_input ? SetupKey::kEmergencyInput : SetupKey::kEmergencyStop));
}

// An MCU has as many inputs as motors.
Result<void> check_inputs(const McuSetup& setup, const bushd_identity& identity) {
  for (unsigned n = identity.motors; n < BUSHD_MOTORS_PER_MCU; ++n) {
    if ((setup.used_inputs >> n & 1u) == 0) continue;
    return fail("has only " + std::to_string(identity.motors) + " inputs, but input " +
                std::to_string(n) + " is configured: use inputs 0 to " +
                std::to_string(identity.motors - 1) + at(setup, SetupKey::kInput, n));
  }
  if (setup.motor_inputs.empty() || (identity.capabilities & BUSHD_CAN_MOTOR_INPUTS) != 0) {
    return {};
  }
  return fail("knows one input a motor, but motor " + std::to_string(setup.motor_inputs[0].motor) +
              " has others: leave out `inputs` of its motors, or update its firmware" +
              at(setup, SetupKey::kMotorInputs, setup.motor_inputs[0].motor));
}

const char* remedy_if_too_much(std::uint8_t type) {
  switch (type) {
    case BUSHD_MSG_CONFIGURE:
      return "use a longer tick_us on its bus";
    case BUSHD_MSG_TABLE_BEGIN:
    case BUSHD_MSG_TABLE_DATA:
    case BUSHD_MSG_TABLE_END:
    case BUSHD_MSG_ASSIGN:
      return "use shorter or slower tables, or fewer on this MCU";
    case BUSHD_MSG_VELOCITY:
      return "use a lower max_steps_per_s in `velocity`";
    default:
      return nullptr;
  }
}

}  // namespace

std::size_t codes_of(const bushd_table& table) {
  const bool symmetric = table.decel.code == table.accel.code;
  return std::size_t{table.accel.count} + (symmetric ? 0 : table.decel.count);
}

Result<void> check_room(const McuSetup& setup, const bushd_identity& identity,
                        std::uint32_t tick_ns) {
  if (auto outputs = check_outputs(setup, identity); !outputs) return outputs;
  if (auto currents = check_currents(setup, identity); !currents) return currents;
  if (auto velocities = check_velocities(setup, identity); !velocities) return velocities;
  if (auto keypad = check_keypad(setup, identity); !keypad) return keypad;
  if (auto dir_setup = check_dir_setup(setup); !dir_setup) return dir_setup;
  std::size_t codes = 0;
  for (const TableRef& ref : setup.tables) codes += codes_of(*ref.table);
  if (codes <= identity.table_codes) return check_time(setup, identity, tick_ns);
  return fail("has memory for " + std::to_string(identity.table_codes) +
              " table codes, but its motors' tables need " + std::to_string(codes) +
              ": use shorter tables or fewer on this MCU" + at(setup, SetupKey::kAddress));
}

Result<void> check_fit(const BusSetup& bus, const McuSetup& setup, const bushd_identity& identity) {
  if (identity.protocol_version != BUSHD_PROTOCOL_VERSION) {
    return fail("speaks protocol version " + std::to_string(identity.protocol_version) +
                ", this program version " + std::to_string(BUSHD_PROTOCOL_VERSION) +
                ": update the older of the two");
  }
  const bool fine = bus.format == BUSHD_FORMAT_FINE;
  if ((identity.capabilities & (fine ? BUSHD_CAN_FINE : BUSHD_CAN_COARSE)) == 0) {
    return fail(std::string("does not know the ") + (fine ? "fine" : "coarse") +
                " format: choose the other one for this bus" + at(setup, SetupKey::kFormat));
  }
  for (unsigned m = identity.motors; m < BUSHD_MOTORS_PER_MCU; ++m) {
    if (setup.table_of_motor[m]) {
      return fail("has only " + std::to_string(identity.motors) + " outputs, but output " +
                  std::to_string(m) + " is configured: connect the motor to another one" +
                  at(setup, SetupKey::kOutput, m));
    }
  }
  if (auto inputs = check_inputs(setup, identity); !inputs) return inputs;
  if (auto disabling = check_disabling(setup, identity); !disabling) return disabling;
  if (auto room = check_room(setup, identity, bus.tick_ns); !room) return room;
  const std::int64_t queue_us =
      static_cast<std::int64_t>(identity.queue_ticks) * bus.tick_ns / 1000;
  if (identity.queue_ticks < kMinQueueTicks || queue_us < kMinQueueUs) {
    return fail("has a queue of " + std::to_string(identity.queue_ticks) + " ticks, " +
                std::to_string(queue_us / 1000) + " ms; needed are " +
                std::to_string(kMinQueueTicks) + " ticks and " +
                std::to_string(kMinQueueUs / 1000) + " ms: use a longer tick" +
                at(setup, SetupKey::kTick));
  }
  return {};
}

std::string refusal_text(const BusSetup& bus, const McuSetup& setup, const bushd_identity& identity,
                         std::uint8_t type, unsigned status) {
  if (type == BUSHD_MSG_EMISSION) {
    return fieldbus::emission_refusal(setup.emission, status, identity.slots, bus.tick_ns);
  }
  if (type == BUSHD_MSG_VELOCITY && status == BUSHD_E_FORMAT) {
    return "VELOCITY: only its first motors have the velocity loop; leave out `velocity` of the "
           "others, or connect them to the first outputs";
  }
  const std::string name = type_name(type);
  const char* const if_too_much = remedy_if_too_much(type);
  const bool too_much = status == BUSHD_E_CAPACITY && if_too_much != nullptr;
  return (name.empty() ? name : name + ": ") + bushd_status_text(status) + "; " +
         (too_much ? if_too_much : fieldbus::remedy_of(status));
}

}  // namespace bushd::link
