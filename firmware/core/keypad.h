// LOCAL by a keypad on a serial line of the MCU's own, with a host or without. Its bytes:
//
//     0x00 forward   0xFF reverse   0xFE slower, by one amount; beyond the slowest, the first speed
//     0xFD stop      anything else: nothing
//
// A direction counts until the next one, or, where LOCAL says so, for some ticks after it was heard
// last. Back goes the delay of a step in units of 10 us (or of 0.1 ms, below), four decimal digits
// and a line feed, or "----" while the key counts for nothing: a fault or a limit forbids it,
// people use the inputs, a host has the motors.
#ifndef BUSHD_FIRMWARE_CORE_KEYPAD_H
#define BUSHD_FIRMWARE_CORE_KEYPAD_H

#include <stdbool.h>
#include <stdint.h>

#include "engine/table.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct bushd_mcu bushd_mcu;

// The figures of the source document: the first delay, by how much "slower" changes it, and the
// last one before the first again, in units of the display. keypad.c may be compiled for the other
// keypad, whose key for the speed makes it faster: 250 ms to 50 ms.
#ifdef BUSHD_KEYPAD_SWITCH
#define BUSHD_KEYPAD_UNIT_NS UINT32_C(100000)
#define BUSHD_KEYPAD_FIRST 2500
#define BUSHD_KEYPAD_CHANGE (-500)
#define BUSHD_KEYPAD_LAST 500
#else
#define BUSHD_KEYPAD_UNIT_NS UINT32_C(10000)
#define BUSHD_KEYPAD_FIRST 300
#define BUSHD_KEYPAD_CHANGE 30
#define BUSHD_KEYPAD_LAST 3000
#endif
#define BUSHD_KEYPAD_BAUD 625u
// A key that is held is repeated more often than that.
#define BUSHD_KEYPAD_RELEASE_NS UINT32_C(500000000)

typedef struct bushd_mcu_keypad {
  int8_t direction;            // of the key that counts, +1 or -1; 0: none does
  uint8_t slower : 7;          // so many changes
  bool waits_for_release : 1;  // a key may be held that was pressed for what was set before
  uint16_t heard;    // when a tick was prepared first with the direction, in low bits of uptime
  uint8_t left : 3;  // characters of the display still to be sent
  bool fresh : 1;    // no tick was prepared yet with the direction
  bool due : 1;      // the display is to be sent anew
  bool slowed : 1;   // the speed is another one, and those that move do not know
  bool refused : 1;  // the key counts for nothing
  bool dashes : 1;   // what is being sent
} bushd_mcu_keypad;

// For a port that has such a line (bushd_mcu_config.keypad); between the other calls of the core.
// O(1), short. Nothing happens as long as LOCAL gives it no motors.
void bushd_mcu_keypad_byte(bushd_mcu* mcu, uint8_t byte);
// The line is broken, or carries no byte: a framing error. What counts ends.
void bushd_mcu_keypad_break(bushd_mcu* mcu);
// The next character for its display, in the order of sending; -1: none is due. Four divisions.
int16_t bushd_mcu_keypad_display(bushd_mcu* mcu);

// For local.c. The direction in the tick that is prepared.
int8_t bushd_mcu_keypad_direction(bushd_mcu* mcu);
// What counts ends, and the display says so: it has to be received again.
void bushd_mcu_keypad_refuse(bushd_mcu* mcu);
// Another motor is its own: what is held must be released first.
void bushd_mcu_keypad_wait_for_release(bushd_mcu* mcu);
// Its delay in time units of this table, rounded up, or the longest that a run may have. A
// division.
uint16_t bushd_mcu_keypad_shortest_delay(const bushd_mcu* mcu, const bushd_table* table);
// Its speed in 1/64 step/s, rounded down. A division.
int32_t bushd_mcu_keypad_speed(const bushd_mcu* mcu);

#ifdef __cplusplus
}
#endif
#endif
