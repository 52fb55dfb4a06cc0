// The position compare output. Timer 4 counts every 64th cycle, in step with timer 5 (clock.c).
#ifndef BUSHD_FIRMWARE_PORTS_ATMEGA2560_COMPARE_OUTPUT_H
#define BUSHD_FIRMWARE_PORTS_ATMEGA2560_COMPARE_OUTPUT_H

#include <stdint.h>

// The pin rises, or falls, at this time (clock.h), less than 260 ms from now. One of each may wait;
// they come by turns. For the main loop.
void compare_rise(uint32_t time);
void compare_fall(uint32_t time);

#endif
