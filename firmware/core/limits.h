// A motor's switches, and the directions in which its limits inhibit motion.
#ifndef BUSHD_FIRMWARE_CORE_LIMITS_H
#define BUSHD_FIRMWARE_CORE_LIMITS_H

#include <stdbool.h>
#include <stdint.h>

#include "engine/message.h"

typedef struct bushd_mcu bushd_mcu;

// Inputs of the MCU, by number (bushd_motor_inputs).
typedef struct bushd_mcu_switches {
  uint8_t positive : 4;
  uint8_t negative : 4;
  uint8_t home : 4;
} bushd_mcu_switches;

typedef struct bushd_mcu_limits {
  uint16_t watched;      // inputs that are a limit of some motor
  uint16_t active;       // of them, as debounced
  uint16_t unsettled;    // inputs that differ from that
  uint16_t bounces[4];   // for how many ticks: bit by bit
  uint16_t both_ends;    // motors with one switch for both ends
  uint16_t at_positive;  // motors whose switch at this end is active
  uint16_t at_negative;
  uint16_t hit_positive;  // motors that a limit has stopped, until they have left it
  uint16_t hit_negative;
} bushd_mcu_limits;

// Motor m has input m, for whatever it may need.
void bushd_mcu_default_switches(bushd_mcu* mcu);
// Settings of inputs have changed; what is active now counts at once.
void bushd_mcu_begin_limits(bushd_mcu* mcu, uint16_t active_inputs);

// Motors that may not move in this direction (+1, -1).
uint16_t bushd_mcu_forbidden(const bushd_mcu* mcu, int8_t direction);
// Whether the motor's limit in this direction is its home switch too.
bool bushd_mcu_homes_at_limit(const bushd_mcu* mcu, uint8_t m, int8_t direction);
// These ticks are starts, and all their first steps are in such directions. Of other starts those
// that are inhibited are given up where they begin.
bool bushd_mcu_starts_into_limit(const bushd_mcu* mcu, const bushd_ticks* ticks);
// Once a tick: the watched inputs as they are now. Returns motors of which a switch has become
// active, or inactive.
uint16_t bushd_mcu_debounce_limits(bushd_mcu* mcu, uint16_t pins);
// Whether its switch stops a motor that goes in this direction. One that goes away from it has left
// it. `homes`: a limit that is the switch it looks for is not looked at.
bool bushd_mcu_limit_stops(bushd_mcu* mcu, uint8_t m, int8_t heading, bool now_active, bool homes);
// Motors with an active limit switch.
uint16_t bushd_mcu_at_limits(const bushd_mcu* mcu);
// A switch of a motor at rest has changed. If its last step led away from a switch, and that is
// inactive, it no longer inhibits. One switch for both ends goes on to: if it closed again at rest,
// nothing would tell at which end.
void bushd_mcu_stands_off_limit(bushd_mcu* mcu, uint8_t m, int8_t last_direction);
// A motor that homes has come to its switch: if that is a limit, it inhibits the way on. It has
// left it.
void bushd_mcu_stands_at_switch(bushd_mcu* mcu, uint8_t m, int8_t direction);
void bushd_mcu_has_left_switch(bushd_mcu* mcu, uint8_t m, int8_t direction);

#endif
