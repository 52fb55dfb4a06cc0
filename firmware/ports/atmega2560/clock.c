#include "firmware/ports/atmega2560/clock.h"

#include <board.h>

static uint32_t latest;  // in counts

void clock_init(void) {
  clock_start();
}

// The UART's interrupt reads the timer through the same register for its high byte. With interrupts
// off, slots that have waited for that interrupt would wait for this too: so what it has spoilt is
// read again.
static uint16_t count_now(void) {
  uint16_t before = 0;
  uint16_t count = 0;
  do {
    before = CLOCK_COUNT;
    count = CLOCK_COUNT;
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
