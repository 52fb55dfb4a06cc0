// Time in CPU cycles since boot, modulo 2^32: a timer counts every eighth.
#ifndef BUSHD_FIRMWARE_PORTS_ATMEGA2560_CLOCK_H
#define BUSHD_FIRMWARE_PORTS_ATMEGA2560_CLOCK_H

#include <stdbool.h>
#include <stdint.h>

#define CLOCK_CYCLES 8u

void clock_init(void);

// Both for the main loop only, and one of them at least every 30 ms.
uint32_t clock_now(void);
// When the timer showed `count`, in the last 30 ms.
uint32_t clock_at(uint16_t count);

static inline bool clock_before(uint32_t time, uint32_t reference) {
  return (int32_t)(time - reference) < 0;
}

#endif
