// Limit switches: in which directions motion is inhibited.
#ifndef BUSHD_FIRMWARE_CORE_LIMITS_H
#define BUSHD_FIRMWARE_CORE_LIMITS_H

#include <stdbool.h>
#include <stdint.h>

#include "engine/message.h"

typedef struct bushd_mcu bushd_mcu;

typedef struct bushd_mcu_limits {
  uint16_t active;        // of motors, as debounced
  uint16_t unsettled;     // inputs that differ from that
  uint16_t bounces[4];    // for how many ticks: bit by bit
  uint16_t hit_positive;  // motors that a limit has stopped, until they have left it
  uint16_t hit_negative;
} bushd_mcu_limits;

// Motors that may not move in this direction (+1, -1).
uint16_t bushd_mcu_forbidden(const bushd_mcu* mcu, int8_t direction);
// These ticks are starts, and all their first steps are in such directions. Of other starts those
// that are inhibited are given up where they begin.
bool bushd_mcu_starts_into_limit(const bushd_mcu* mcu, const bushd_ticks* ticks);
// Once a tick: the switches as they are now. Returns those that have become active.
uint16_t bushd_mcu_debounce_limits(bushd_mcu* mcu, uint16_t pins);
// Of a motor that goes in this direction: true if its switch stops it. One that goes away from it
// has left it.
bool bushd_mcu_limit_stops(bushd_mcu* mcu, uint8_t m, int8_t heading, bool now_active);
// A motor that homes has come to its switch: if that is a limit, it inhibits the way on. It has
// left it.
void bushd_mcu_stands_at_switch(bushd_mcu* mcu, uint8_t m, int8_t direction);
void bushd_mcu_has_left_switch(bushd_mcu* mcu, uint8_t m, int8_t direction);

#endif
