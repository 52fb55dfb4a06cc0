// How motors stop.
#ifndef BUSHD_FIRMWARE_CORE_STOP_H
#define BUSHD_FIRMWARE_CORE_STOP_H

#include <stdint.h>

#include "engine/message.h"

typedef struct bushd_mcu bushd_mcu;

void bushd_mcu_watch_comm_timeout(bushd_mcu* mcu);  // before every tick is prepared
bushd_status bushd_mcu_emergency(bushd_mcu* mcu, const bushd_emergency* message);
// Ramps a motor in a stream down; `delay` is that of the running step, 0: it rests at once.
void bushd_mcu_ramp_down_stream(bushd_mcu* mcu, uint8_t m, uint16_t delay);
// Stops it from `next` on, the first tick that is not prepared.
void bushd_mcu_stop_motor(bushd_mcu* mcu, uint8_t m, bushd_stop_mode mode, uint32_t next);
void bushd_mcu_stop_all(bushd_mcu* mcu, bushd_stop_mode mode, uint32_t next);
// Where it goes in that tick: +1, -1; 0: at rest.
int8_t bushd_mcu_heading(const bushd_mcu* mcu, uint8_t m, uint32_t next);
int8_t bushd_mcu_last_direction(const bushd_mcu* mcu, uint8_t m);

#endif
