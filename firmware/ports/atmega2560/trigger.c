#include "firmware/ports/atmega2560/trigger.h"

#include <avr/io.h>

#include "firmware/ports/atmega2560/board.h"
#include "firmware/ports/atmega2560/clock.h"

volatile uint16_t trigger_count;  // of timer 5; edge_interrupts.S
static bool awaited;

void trigger_await(bushd_edge edge) {
  EIMSK &= (uint8_t) ~(1 << INT0);
  awaited = edge != BUSHD_EDGE_NONE;
  if (!awaited) return;
  // Closed to ground is active.
  EICRA = edge == BUSHD_EDGE_RISING ? 1 << ISC01 : 1 << ISC01 | 1 << ISC00;
  EIFR = 1 << INTF0;
  EIMSK |= 1 << INT0;
}

bool trigger_came(uint32_t* time) {
  // Its interrupt puts itself off.
  if (!awaited || (EIMSK & 1 << INT0) != 0) return false;
  awaited = false;
  *time = clock_at(trigger_count);
  return true;
}
