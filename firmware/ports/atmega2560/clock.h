// Time in CPU cycles since boot, modulo 2^32: timer 5 runs freely, its overflows are counted.
#ifndef BUSHD_FIRMWARE_PORTS_ATMEGA2560_CLOCK_H
#define BUSHD_FIRMWARE_PORTS_ATMEGA2560_CLOCK_H

#include <avr/io.h>
#include <stdbool.h>
#include <stdint.h>
#include <util/atomic.h>

extern volatile uint16_t clock_overflows;

void clock_init(void);

// With interrupts off: an overflow may not have been counted yet.
static inline uint32_t clock_now_locked(void) {
  const uint16_t low = TCNT5;
  uint16_t high = clock_overflows;
  if ((TIFR5 & (1 << TOV5)) != 0 && low < 0x8000u) ++high;
  return (uint32_t)high << 16 | low;
}

static inline uint32_t clock_now(void) {
  uint32_t now = 0;
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    now = clock_now_locked();
  }
  return now;
}

static inline bool clock_before(uint32_t time, uint32_t reference) {
  return (int32_t)(time - reference) < 0;
}

#endif
