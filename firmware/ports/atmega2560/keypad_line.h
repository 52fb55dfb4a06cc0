// The line of a keypad (firmware/core/keypad.h): UART 2 with 625 baud, RXD2 at PH0 and TXD2 at PH1.
// It has no interrupts: two bytes have room, which take 32 ms, and no tick lasts longer than 20 ms.
// It listens as long as LOCAL gives the keypad motors.
//
// RXD2 has a resistor to ground outside and no pull-up: a cable that is pulled is a low line, which
// is a framing error.
#ifndef BUSHD_FIRMWARE_PORTS_ATMEGA2560_KEYPAD_LINE_H
#define BUSHD_FIRMWARE_PORTS_ATMEGA2560_KEYPAD_LINE_H

#include "firmware/core/mcu_state.h"

// Once a tick: the bytes that have come. What came behind one that was lost counts as a broken
// line. O(1), short.
void keypad_line_hear(bushd_mcu* mcu);
// When nothing else is to be done: a character for the display, if there is room for it. Takes up
// to 60 us.
void keypad_line_show(bushd_mcu* mcu);

#endif
