// EN, common to all drivers of the MCU.
#ifndef BUSHD_FIRMWARE_CORE_DRIVERS_H
#define BUSHD_FIRMWARE_CORE_DRIVERS_H

#include <stdbool.h>

typedef struct bushd_mcu bushd_mcu;

void bushd_mcu_set_enable(bushd_mcu* mcu, bool on);
// Tells the port whether EN is to be raised again after a watchdog reset.
void bushd_mcu_keep_enable(bushd_mcu* mcu);

#endif
