// Switches and the current sensor.
#ifndef BUSHD_FIRMWARE_PORTS_ATMEGA2560_INPUTS_H
#define BUSHD_FIRMWARE_PORTS_ATMEGA2560_INPUTS_H

#include "firmware/core/port.h"

// After board_init. False if a pin stays high while it is pulled low for a moment: it is shorted to
// the supply, and its switch would never be seen.
bool inputs_test(void);

// Conversions of the current go on by themselves from now on, some 10000 a second.
void inputs_init(void);

bushd_inputs inputs_read(void);
uint16_t inputs_current(void);

#endif
