// EN, common to all drivers of the MCU, and the levels at which drivers do what they are to do.
#ifndef BUSHD_FIRMWARE_CORE_DRIVERS_H
#define BUSHD_FIRMWARE_CORE_DRIVERS_H

#include <stdbool.h>

#include "engine/message.h"

typedef struct bushd_mcu bushd_mcu;

void bushd_mcu_set_enable(bushd_mcu* mcu, bool on);
// Tells the port what is so, and whether EN is to be raised again after a watchdog reset.
void bushd_mcu_drive_enable(bushd_mcu* mcu);
// EN falls by no edge any more, until that is called again.
void bushd_mcu_unwatch_emergency_input(bushd_mcu* mcu);
bushd_status bushd_mcu_set_outputs(bushd_mcu* mcu, const bushd_set_outputs* message);

#endif
