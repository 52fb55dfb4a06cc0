// What the MCU as a whole is doing.
#ifndef BUSHD_FIRMWARE_CORE_STATE_H
#define BUSHD_FIRMWARE_CORE_STATE_H

#include <stdint.h>

#include "engine/message.h"

typedef struct bushd_mcu bushd_mcu;

// Motors that move, or have ticks to come.
uint16_t bushd_mcu_moving(const bushd_mcu* mcu);
// These, motors that wait for the trigger, and those of a program: what a resting motor may be
// asked must wait too.
uint16_t bushd_mcu_engaged(const bushd_mcu* mcu);
// The state that it reports, from faults, flags and motion.
void bushd_mcu_update_state(bushd_mcu* mcu);
// A frame was refused: the report says so.
void bushd_mcu_reject(bushd_mcu* mcu, bushd_status status);
// A motor had to be ramped down.
void bushd_mcu_count_ramp_down(bushd_mcu* mcu);

#endif
