// How a simulated MCU, or the firmware core in a test, is made one with disabled capabilities. The
// core has a mask of 16 bits, and knows the others by what its port gives it: here all are one
// mask.
#pragma once

#include <cstdint>

#include "firmware/core/mcu.h"

namespace bushd::sim {

// `capabilities`: BUSHD_CAN_*. `config` is as of an MCU that has them all. The caller's port gives
// no set_trigger if BUSHD_CAN_TRIGGER is among them, and no set_current if current_motors is 0
// afterwards.
inline void disable_capabilities(std::uint32_t capabilities, bushd_mcu_config* config) {
  config->disabled_capabilities = static_cast<std::uint16_t>(capabilities & UINT16_MAX);
  if ((capabilities & BUSHD_CAN_CURRENTS) != 0) config->current_motors = 0;
  if ((capabilities & BUSHD_CAN_VELOCITY) != 0) config->velocity_motors = 0;
  if ((capabilities & BUSHD_CAN_KEYPAD) != 0) config->keypad = false;
  if ((capabilities & BUSHD_CAN_SCRATCH) != 0) config->scratch = nullptr;
  if ((capabilities & BUSHD_CAN_PROGRAM) != 0) config->program = nullptr;
  if ((capabilities & BUSHD_CAN_SLOW_RUNS) != 0) config->no_slow_runs = true;
  if ((capabilities & BUSHD_CAN_ELEMENTARY) != 0) config->no_elementary = true;
}

}  // namespace bushd::sim
