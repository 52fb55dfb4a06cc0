// A bus and its MCUs as configured.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "bus/address.h"
#include "bus/emission_setup.h"
#include "engine/message.h"
#include "engine/table.h"

namespace bushd::link {

using fieldbus::McuAddress;

struct TableRef {
  const bushd_table* table = nullptr;  // outlives the master
  std::uint32_t revision = 0;
};

// What an MCU may have no room for. Numbers: of outputs, with kInput of inputs, else 0.
enum class SetupKey {
  kAddress,
  kFormat,
  kTick,
  kOutput,
  kTable,
  kCurrents,
  kVelocity,
  kKeypad,
  kMotorInputs,
  kInput,
  kEmergencyStop,
  kEmergencyInput
};

struct McuSetup {
  McuAddress address;
  std::vector<TableRef> tables;  // by bank, at most BUSHD_TABLE_BANKS
  // Bank of its motor's table, by output; none: no motor there.
  std::array<std::optional<std::uint8_t>, BUSHD_MOTORS_PER_MCU> table_of_motor{};
  fieldbus::EmissionSetup emission{};
  bushd_set_outputs outputs{.step_low = 0, .direction_low = 0, .enabled = BUSHD_ENABLED_HIGH};
  Error outputs_at{};  // where one of them is said to be active low; without a message
  bushd_set_inputs inputs{};
  bool disabled_by_stop = false;  // by an emergency stop of its bus: BUSHD_STOP_DISABLE
  // Inputs of motors whose switches are not all at the input with the number of their output.
  std::vector<bushd_motor_inputs> motor_inputs{};
  // Currents of all motors that are driven by phases: those without current control have zeros.
  std::vector<bushd_currents> currents{};
  // Velocities of all motors that people move at it: those that move by their table have zeros.
  std::vector<bushd_set_velocity> velocities{};
  std::uint16_t used_inputs = 0;
  bool off_after_watchdog = false;  // then drivers stay off until control() enables them
  bushd_local local{};              // motors that people move at it
  // Where each of these stands in the configuration, for people; without messages.
  std::map<std::pair<SetupKey, unsigned>, Error> places{};
};

struct BusSetup {
  std::uint32_t baud = 0;
  std::uint32_t tick_ns = 0;
  bushd_format format = BUSHD_FORMAT_FINE;
  // Ticks of motors that run by their table are sent as states of the run where that is shorter;
  // otherwise each as its displacement.
  bool table_ticks = true;
  std::uint16_t master = 0;  // tells this master from another on the same line
  std::vector<McuSetup> mcus;
};

}  // namespace bushd::link
