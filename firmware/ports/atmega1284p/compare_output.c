// By compare B of timer 3, which is the clock: it goes round every 32 ms, less than the longest
// tick that is lengthened.
#include "firmware/ports/atmega2560/compare_output.h"

#include <avr/interrupt.h>
#include <board.h>
#include <stdbool.h>

#include "firmware/ports/atmega2560/clock.h"

volatile uint16_t line_sending;  // of the line; it has no register to spare

typedef struct event {
  bool due;
  uint8_t turns;  // of the timer that pass before
  uint16_t count;
} event;

static volatile event rise;
static volatile event fall;

static inline void await(volatile event* which) {
  OCR3B = which->count;
}

ISR(TIMER3_COMPB_vect) {
  if (rise.due) {
    if (rise.turns != 0) {
      --rise.turns;
      return;
    }
    COMPARE_PORT |= 1 << COMPARE_BIT;
    rise.due = false;
    if (fall.due) await(&fall);
  } else if (fall.due) {
    if (fall.turns != 0) {
      --fall.turns;
      return;
    }
    COMPARE_PORT &= (uint8_t)~(1 << COMPARE_BIT);
    fall.due = false;
  }
}

// False if it is too near to be set: it would come when the timer has gone round.
static bool set(volatile event* which, uint32_t time, uint32_t now) {
  if (clock_before(time, now + 8u * CLOCK_CYCLES)) return false;
  which->count = (uint16_t)(time / CLOCK_CYCLES);
  which->turns = (uint8_t)((time - now) / CLOCK_CYCLES >> 16);
  which->due = true;
  return true;
}

void compare_rise(uint32_t time) {
  const uint32_t now = clock_now();
  ATOMIC_BLOCK(ATOMIC_FORCEON) {
    if (set(&rise, time, now)) {
      await(&rise);
      TIFR3 = 1 << OCF3B;
    } else {
      COMPARE_PORT |= 1 << COMPARE_BIT;
    }
  }
}

void compare_fall(uint32_t time) {
  const uint32_t now = clock_now();
  ATOMIC_BLOCK(ATOMIC_FORCEON) {
    if (!set(&fall, time, now)) {
      COMPARE_PORT &= (uint8_t)~(1 << COMPARE_BIT);
    } else if (!rise.due) {
      await(&fall);
      TIFR3 = 1 << OCF3B;
    }
  }
}
