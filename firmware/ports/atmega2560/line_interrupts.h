// What the UART's interrupts work by; for line.c and line_interrupts.S.
#ifndef BUSHD_FIRMWARE_PORTS_ATMEGA2560_LINE_INTERRUPTS_H
#define BUSHD_FIRMWARE_PORTS_ATMEGA2560_LINE_INTERRUPTS_H

// Frames that may wait while a tick is prepared.
#define LINE_DELIMITERS 16

// Places in line_bytes: where the next byte goes, and the first that was not taken. They wrap.
// GPIOR2 holds the reset cause before that (boot_tests.h).
#define LINE_IN GPIOR1
#define LINE_OUT GPIOR2

#ifndef __ASSEMBLER__

#include <stdint.h>

extern uint8_t line_bytes[256];  // at a multiple of 256
// When delimiters came (clock_at), each at its number modulo LINE_DELIMITERS. `in` counts those
// among the bytes.
extern volatile uint16_t line_stamps[LINE_DELIMITERS];
extern volatile uint8_t line_stamps_in;
uint8_t line_decode(uint8_t** to, uint8_t* run, uint8_t out, uint8_t count);  // receive.S
extern volatile uint8_t line_sending_end;  // low byte of the address behind the last one

#endif
#endif
