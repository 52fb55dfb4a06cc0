// Limit switches, the emergency input and the supply current, and what they stop.
#ifndef BUSHD_FIRMWARE_CORE_INPUTS_H
#define BUSHD_FIRMWARE_CORE_INPUTS_H

#include "engine/message.h"

typedef struct bushd_mcu bushd_mcu;

void bushd_mcu_watch_inputs(bushd_mcu* mcu);  // before every tick is prepared
void bushd_mcu_begin_inputs(bushd_mcu* mcu);  // after the settings were restored
// What the port has latched counts before EN is written anew.
void bushd_mcu_watch_emergency_input(bushd_mcu* mcu);
void bushd_mcu_report_inputs(const bushd_mcu* mcu, bushd_report* report);
// Clears those of these faults (0: of all) whose cause is gone.
void bushd_mcu_clear_faults(bushd_mcu* mcu, uint8_t faults);

#endif
