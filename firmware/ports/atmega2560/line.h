// UART 0 and the RS-485 transceiver.
#ifndef BUSHD_FIRMWARE_PORTS_ATMEGA2560_LINE_H
#define BUSHD_FIRMWARE_PORTS_ATMEGA2560_LINE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

void line_init(void);

// When the oldest delimiter that has not been taken came; false if there is none.
bool line_delimiter_time(uint32_t* time);

// The next byte; *time is set if it is a delimiter. False if there is none.
bool line_take(uint8_t* byte, uint32_t* time);

// Sends these bytes `delay_ns` after the delimiter taken last, or as soon as the line is ours. The
// buffer stays valid until they are sent.
void line_transmit(const uint8_t* wire, size_t size, uint32_t delay_ns);

#endif
