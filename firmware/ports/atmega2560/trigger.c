#include "firmware/ports/atmega2560/trigger.h"

#include <avr/io.h>
#include <board.h>

#include "firmware/ports/atmega2560/clock.h"

volatile uint16_t trigger_count;  // of the clock's timer; edge_interrupts.S
static bool awaited;

void trigger_await(bushd_edge edge) {
  EIMSK &= (uint8_t)~(1 << TRIGGER_INT);
  awaited = edge != BUSHD_EDGE_NONE;
  if (!awaited) return;
  // Closed to ground is active.
  EICRA = (uint8_t)(BOARD_EDGES | (edge == BUSHD_EDGE_RISING ? TRIGGER_FALLING : TRIGGER_RISING));
  EIFR = 1 << TRIGGER_FLAG;
  EIMSK |= 1 << TRIGGER_INT;
}

bool trigger_came(uint32_t* time) {
  // Its interrupt puts itself off.
  if (!awaited || (EIMSK & 1 << TRIGGER_INT) != 0) return false;
  awaited = false;
  *time = clock_at(trigger_count);
  return true;
}
