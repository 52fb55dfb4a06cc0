// The position compare output: a pulse when a motor arrives at a position.
#ifndef BUSHD_FIRMWARE_CORE_POSITION_COMPARE_H
#define BUSHD_FIRMWARE_CORE_POSITION_COMPARE_H

#include <stdbool.h>
#include <stdint.h>

#include "engine/message.h"
#include "firmware/core/slot_buffer.h"

typedef struct bushd_mcu bushd_mcu;

// A time in whole ticks and slots.
typedef struct bushd_mcu_slots {
  uint16_t ticks;
  uint16_t slots;
} bushd_mcu_slots;

// The position compare output (position_compare.c).
typedef struct bushd_mcu_position_compare {
  uint8_t motor : 4;
  uint8_t arrivals : 2;  // BUSHD_ARRIVES_*
  uint8_t pulse : 2;     // 0: none, or what comes next of it
  int32_t position_steps;
  bushd_mcu_slots delay;
  bushd_mcu_slots width;
  bushd_mcu_slots next;  // until then, from the beginning of the tick to be prepared
} bushd_mcu_position_compare;

// A pulse of a program, from the beginning of the tick that is prepared on. It takes the output: no
// motor's arrival makes one afterwards. False: another one is not over.
bool bushd_mcu_pulse_now(bushd_mcu* mcu, uint32_t width_us);
// Precondition: a pulse may begin or is under way. `slot_buffer` has its steps.
void bushd_mcu_emit_position_compare(bushd_mcu* mcu, bushd_slot_buffer* slot_buffer);

#endif
