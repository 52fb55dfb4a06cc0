// A general-purpose timer that interrupts when its time is over.
//
// The chip counts down to 0 and so takes a cycle more than it is loaded with; other timers of this
// kind, and simulators, do not. timer_excess is what this one takes more, measured at boot.
#ifndef BUSHD_FIRMWARE_PORTS_LM3S6965_TIMER_H
#define BUSHD_FIRMWARE_PORTS_LM3S6965_TIMER_H

#include "firmware/ports/lm3s6965/registers.h"

extern uint32_t timer_excess;
// Precondition: the clock runs.
void timer_measure_excess(void);

void timer_init(uint32_t timer);

static inline void timer_stop(uint32_t timer) {
  TIMER_CTL(timer) = 0;
  TIMER_ICR(timer) = 1;
}

// Stopped before. `mode` is TIMER_ONE_SHOT or TIMER_PERIODIC.
static inline void timer_start(uint32_t timer, uint32_t mode, uint32_t cycles) {
  TIMER_TAMR(timer) = mode;
  TIMER_TAILR(timer) = cycles - timer_excess;
  TIMER_CTL(timer) = 1;
}

#endif
