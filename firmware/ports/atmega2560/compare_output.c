#include "firmware/ports/atmega2560/compare_output.h"

#include <avr/io.h>
#include <board.h>
#include <util/atomic.h>

#include "firmware/ports/atmega2560/clock.h"

#define COUNT_CYCLES 64u

// Which compares are to stay on when the other one has come: its bit in TIMSK4, or 0.
// edge_interrupts.S
volatile uint8_t compare_rises;
volatile uint8_t compare_falls;

// A compare comes when the count ends that it names.
static uint16_t compare_for(uint32_t time) {
  return (uint16_t)((time + COUNT_CYCLES / 2u) / COUNT_CYCLES - 1u);
}

// Too near to be set: it would come when the timer has gone round.
static bool is_due(uint32_t time) {
  return clock_before(time, clock_now() + 3u * COUNT_CYCLES);
}

void compare_rise(uint32_t time) {
  OCR4A = compare_for(time);
  TIFR4 = 1 << OCF4A;
  if (is_due(time)) {
    COMPARE_PORT |= 1 << COMPARE_BIT;
    return;
  }
  compare_rises = 1 << OCIE4A;
  // No slot is to wait for more than that.
  ATOMIC_BLOCK(ATOMIC_FORCEON) {
    TIMSK4 |= 1 << OCIE4A;
  }
}

void compare_fall(uint32_t time) {
  OCR4B = compare_for(time);
  TIFR4 = 1 << OCF4B;
  if (is_due(time)) {
    COMPARE_PORT &= (uint8_t)~(1 << COMPARE_BIT);
    return;
  }
  compare_falls = 1 << OCIE4B;
  ATOMIC_BLOCK(ATOMIC_FORCEON) {
    TIMSK4 |= 1 << OCIE4B;
  }
}
