// UART 0 and the RS-485 transceiver. All of this is for the main loop.
#ifndef BUSHD_FIRMWARE_PORTS_LM3S6965_LINE_H
#define BUSHD_FIRMWARE_PORTS_LM3S6965_LINE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

void line_init(void);

// Is there a delimiter that came before `time` (clock.h) and was not taken yet?
bool line_has_frame_before(uint32_t time);
// The next byte; `time` is set if it is a delimiter. False if none is there.
bool line_take(uint8_t* byte, uint32_t* time);

// Sends these bytes `delay_ns` after the delimiter taken last, or as soon as the line is ours. The
// buffer stays valid until they are sent.
void line_transmit(const uint8_t* wire, size_t size, uint32_t delay_ns);

#endif
