// Time in CPU cycles, modulo 2^24 (a third of a second): SysTick runs freely.
#ifndef BUSHD_FIRMWARE_PORTS_LM3S6965_CLOCK_H
#define BUSHD_FIRMWARE_PORTS_LM3S6965_CLOCK_H

#include "firmware/ports/lm3s6965/registers.h"

#define CLOCK_MASK 0xFFFFFFu

static inline void clock_init(void) {
  SYST_RVR = CLOCK_MASK;
  SYST_CVR = 0;
  SYST_CSR = 5;  // the CPU's clock, no interrupt
}

static inline uint32_t clock_now(void) {
  return CLOCK_MASK - SYST_CVR;
}

// From `reference` to `time`; they are less than a sixth of a second apart.
static inline int32_t clock_since(uint32_t time, uint32_t reference) {
  return (int32_t)((time - reference) << 8) >> 8;
}

#endif
