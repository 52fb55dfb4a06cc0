// How steps get to the pins.
#ifndef BUSHD_FIRMWARE_CORE_EMISSION_H
#define BUSHD_FIRMWARE_CORE_EMISSION_H

#include <stdbool.h>
#include <stdint.h>

#include "engine/emission.h"
#include "engine/message.h"
#include "firmware/core/settle.h"
#include "firmware/core/slot_buffer.h"

typedef struct bushd_mcu bushd_mcu;

// The windings of up to four motors driven by phases. Rotors stay where they are while settings
// change, so the phases do, until another sequence or staggered emission comes.
typedef struct bushd_mcu_windings {
  uint8_t sequence;  // that of the phases
  uint8_t phase[BUSHD_MOTORS_PER_MCU / BUSHD_PHASE_OUTPUTS];
  uint8_t on_ticks[BUSHD_MOTORS_PER_MCU / BUSHD_PHASE_OUTPUTS];  // they stay on, after a move
} bushd_mcu_windings;

// How steps get to the pins (emission.c).
typedef struct bushd_mcu_emission {
  bushd_emission settings;
  bushd_emission_grid grid;
  union {
    bushd_mcu_settle settle;      // of staggered
    bushd_mcu_windings windings;  // of all others
  } of;
} bushd_mcu_emission;

void bushd_mcu_default_emission(bushd_mcu* mcu);
void bushd_mcu_restore_emission(bushd_mcu* mcu);
// The slot_buffer is complete but for what the emission makes of it.
void bushd_mcu_shape(bushd_mcu* mcu, bushd_slot_buffer* slot_buffer);

#endif
