// UART 0 and the RS-485 transceiver.
#ifndef BUSHD_FIRMWARE_PORTS_ATMEGA2560_LINE_H
#define BUSHD_FIRMWARE_PORTS_ATMEGA2560_LINE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "firmware/core/mcu.h"

void line_init(void);

// Where answers are made: at the end of the receiver's buffer, which has no need of it meanwhile.
// If a master sends before an answer's time, the answer is given up for the frame.
#define LINE_REPLY_AT (BUSHD_FRAME_MAX_RAW + 1u - BUSHD_MCU_MAX_REPLY)
uint8_t* line_reply(bushd_receiver* receiver);

// Some of the bytes that have come go to the receiver, up to one that ends a frame; that one waits:
// true, and when it came. Never much at a time: the main loop has a tick to prepare too.
bool line_collect(bushd_receiver* receiver, uint32_t* time);
// All that has come was collected.
bool line_is_idle(void);
// Whether it may be taken now: not while an answer is being sent, whose place the next one would
// take. One that waits is given up if this frame is a master's: who speaks before an answer's time
// waits for it no more.
bool line_may_take(const bushd_receiver* receiver);
// The byte that ends it, which the receiver is to get next. Precondition: it waits, and may be
// taken.
void line_take(bushd_receiver* receiver);

// Sends these bytes `delay_ns` after the delimiter taken last, or as soon as the line is ours. The
// buffer stays valid until they are sent.
void line_transmit(const uint8_t* wire, size_t size, uint32_t delay_ns);

#endif
