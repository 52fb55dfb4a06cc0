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

// EN changes by itself no more: it may be written, but not to be `on` (false) where it has changed
// since the last call with `on` false.
bool inputs_unwatch(bool on);

// After that: from now on EN changes by itself at this edge of the emergency input, once, and at
// once if the input is as after it already; inputs_read says so until inputs_unwatch.
// BUSHD_EDGE_NONE: it does not. Nobody else writes to the port of EN meanwhile.
void inputs_switch_off_at(bushd_edge edge);

#endif
