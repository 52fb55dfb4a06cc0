#include "firmware/ports/atmega2560/clock.h"

#include <avr/io.h>

static uint32_t latest;  // in counts

void clock_init(void) {
  // Timer 4, of the position compare output, begins in the same cycle, from the same prescaler.
  GTCCR = 1 << TSM | 1 << PSRSYNC;
  TCCR5B = 1 << CS51;
  TCCR4B = 1 << CS41 | 1 << CS40;
  GTCCR = 0;
}

// The UART's interrupt reads the timer through the same register for its high byte. With interrupts
// off, slots that have waited for that interrupt would wait for this too: so what it has spoilt is
// read again.
static uint16_t count_now(void) {
  uint16_t before = 0;
  uint16_t count = 0;
  do {
    before = TCNT5;
    count = TCNT5;
  } while ((uint16_t)(count - before) > UINT8_MAX / 2u);
  return count;
}

uint32_t clock_now(void) {
  latest += (uint16_t)(count_now() - (uint16_t)latest);
  return latest * CLOCK_CYCLES;
}

uint32_t clock_at(uint16_t count) {
  const uint32_t now = clock_now();
  return now - (uint16_t)((uint16_t)latest - count) * (uint32_t)CLOCK_CYCLES;
}
