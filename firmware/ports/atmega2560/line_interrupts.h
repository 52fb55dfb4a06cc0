// What the UART's interrupts work by; for line.c and line_interrupts.S.
#ifndef BUSHD_FIRMWARE_PORTS_ATMEGA2560_LINE_INTERRUPTS_H
#define BUSHD_FIRMWARE_PORTS_ATMEGA2560_LINE_INTERRUPTS_H

// Frames that may wait while a tick is prepared; beyond, a delimiter becomes a wrong byte.
#define LINE_DELIMITERS 16

#ifndef __ASSEMBLER__

#include <stdint.h>

// When a delimiter came.
typedef struct line_stamp {
  uint16_t low;       // timer 5
  uint8_t overflows;  // of it, 7 bits; bit 7: one was not counted yet
} line_stamp;

extern uint8_t line_bytes[256];
extern volatile uint8_t line_in;
extern volatile uint8_t line_out;
extern volatile line_stamp line_stamps[LINE_DELIMITERS];
extern volatile uint8_t line_stamps_in;
extern volatile uint8_t line_stamps_out;
extern const uint8_t* volatile line_sending;
extern volatile uint8_t line_sending_end;

#endif
#endif
