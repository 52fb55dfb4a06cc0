// How motors stop: on request, by an emergency, at a fault, and when nobody is heard. Homing,
// travel and programs end what they do by themselves (homing.c, travel.c, program_run.c).
#ifndef BUSHD_FIRMWARE_CORE_STOP_H
#define BUSHD_FIRMWARE_CORE_STOP_H

#include <stdint.h>

#include "engine/message.h"

typedef struct bushd_mcu bushd_mcu;

void bushd_mcu_watch_comm_timeout(bushd_mcu* mcu);  // before every tick is prepared
// All motors stop from `next` on, the first tick that is not prepared. With BUSHD_STOP_DISABLE EN
// falls first; who says so latches a fault that keeps it off.
void bushd_mcu_stop_all(bushd_mcu* mcu, bushd_stop_mode mode, uint32_t next);

#endif
