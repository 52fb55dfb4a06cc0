// How a program is carried out, frame after frame.
#ifndef BUSHD_FIRMWARE_CORE_PROGRAM_RUN_H
#define BUSHD_FIRMWARE_CORE_PROGRAM_RUN_H

#include <stdint.h>

#include "firmware/core/program.h"

// Before every tick is prepared, while a program has motors. O(motors), and up to
// BUSHD_MCU_PROGRAM_BEGINS frames.
void bushd_mcu_go_on_with_program(bushd_mcu* mcu);
// All that it moves stops from `next` on, the first tick that is not prepared; a line as one.
void bushd_mcu_stop_program_motors(bushd_mcu* mcu, bushd_stop_mode mode, uint32_t next);
// Stops them as above; the program has ended as soon as they rest. Precondition: it has motors.
void bushd_mcu_end_program(bushd_mcu* mcu, bushd_program_reason why, bushd_stop_mode mode,
                           uint32_t next);
// So many ticks as the time has, rounded up.
uint32_t bushd_mcu_program_ticks(const bushd_mcu* mcu, uint32_t us);
// What the program says of one of its motors.
bushd_program_motor bushd_mcu_program_part_of(const bushd_mcu_program* p, uint8_t m);
// At the beginning of the tick that is prepared next, of a motor at rest.
int32_t bushd_mcu_position_at_rest(const bushd_mcu* mcu, uint8_t m);

#endif
