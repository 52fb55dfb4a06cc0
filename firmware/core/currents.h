// Phase currents: which of its three a motor's windings have in the next tick, if the port controls
// their current (bushd_port.set_current). A motor whose speed has changed has that of the ramp for
// BUSHD_CURRENT_TICKS more; then, moving on, that of cruise, and at rest that of hold.
#ifndef BUSHD_FIRMWARE_CORE_CURRENTS_H
#define BUSHD_FIRMWARE_CORE_CURRENTS_H

#include <stdint.h>

#include "engine/message.h"

typedef struct bushd_mcu bushd_mcu;

#define BUSHD_CURRENT_TICKS 16u
#define BUSHD_MAX_CURRENT_MOTORS (BUSHD_MOTORS_PER_MCU / BUSHD_PHASE_OUTPUTS)

// The current control of a motor; memory of the port.
typedef struct bushd_mcu_currents {
  bushd_currents settings;  // not set: all zero, and no current is controlled
  uint16_t speed;           // when it changed last: a delay of its run, or a displacement
  uint16_t now_ma;          // what the port was told
  uint8_t steady_ticks;     // since; saturates
} bushd_mcu_currents;

// Chooses the currents for the slot buffer that is complete, before its tick. O(motors with current
// control).
void bushd_mcu_choose_currents(bushd_mcu* mcu);

#endif
