#include "firmware/ports/lm3s6965/timer.h"

#include "firmware/ports/lm3s6965/clock.h"

#define TRIAL_PERIODS 64u
#define TRIAL_CYCLES 200u

uint32_t timer_excess;

void timer_init(uint32_t timer) {
  TIMER_CTL(timer) = 0;
  TIMER_CFG(timer) = 0;
  TIMER_ICR(timer) = 1;
  TIMER_IMR(timer) = 1;
}

static void await(uint32_t timer) {
  while ((TIMER_RIS(timer) & 1u) == 0) {
  }
  TIMER_ICR(timer) = 1;
}

void timer_measure_excess(void) {
  const uint32_t timer = TIMER(0);
  TIMER_CTL(timer) = 0;
  TIMER_CFG(timer) = 0;
  TIMER_IMR(timer) = 0;
  TIMER_TAMR(timer) = TIMER_PERIODIC;
  TIMER_TAILR(timer) = TRIAL_CYCLES;
  TIMER_ICR(timer) = 1;
  TIMER_CTL(timer) = 1;
  await(timer);
  const uint32_t begin = clock_now();
  for (uint32_t i = 0; i < TRIAL_PERIODS; ++i) await(timer);
  const uint32_t cycles = (clock_now() - begin) & CLOCK_MASK;
  // The polls are some cycles long, no more than a fraction of what is looked for.
  timer_excess = (cycles + TRIAL_PERIODS / 2u) / TRIAL_PERIODS - TRIAL_CYCLES;
  TIMER_CTL(timer) = 0;
  TIMER_ICR(timer) = 1;
}
