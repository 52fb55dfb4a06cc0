// What is emitted during one tick.
#ifndef BUSHD_FIRMWARE_CORE_SLOT_BUFFER_H
#define BUSHD_FIRMWARE_CORE_SLOT_BUFFER_H

#include <stdint.h>

#include "engine/message.h"
#include "engine/slots.h"

// What the masks of a slot_buffer are.
typedef enum bushd_outputs {
  BUSHD_OUTPUTS_PULSES = 0,
  // Pulses, and the common DIR is at rest in even slots and at its other level in odd ones. It
  // changes when the pulses of a slot are over; after the last one, and in slot_buffers without
  // steps, it is at rest: low, unless bushd_set_outputs.direction_low says otherwise.
  BUSHD_OUTPUTS_COMMON_DIR = 1,
  // Levels, from the slot's beginning until others follow; also in slot_buffers without steps.
  BUSHD_OUTPUTS_LEVELS = 2
} bushd_outputs;

// What is emitted during one tick.
typedef struct bushd_slot_buffer {
  uint16_t direction;                   // DIR levels, bit per motor, constant within the tick
  uint16_t step[BUSHD_MAX_SLOTS];       // STEP pulses of each slot, bit per motor; 1: active
  uint8_t outputs;                      // bushd_outputs
  int16_t steps[BUSHD_MOTORS_PER_MCU];  // signed steps of the tick, for the position counters
  uint16_t active;                      // motors with a step in this tick
  // Slots of this tick, counted from 1, at whose beginning the position compare output rises and
  // falls; 0: it does not. If both, it rises first.
  uint16_t compare_rise;
  uint16_t compare_fall;
} bushd_slot_buffer;

#endif
