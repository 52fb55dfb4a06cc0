#include "firmware/ports/atmega2560/trigger.h"

#include <avr/io.h>

#include "firmware/ports/atmega2560/board.h"
#include "firmware/ports/atmega2560/clock.h"
#include "firmware/ports/atmega2560/emission_slots.h"

volatile uint16_t trigger_count;  // of timer 5; edge_interrupts.S

void trigger_await(bushd_edge edge) {
  EIMSK &= (uint8_t) ~(1 << INT0);
  GPIOR0 &= (uint8_t) ~(1 << TRIGGER_CAME);
  if (edge == BUSHD_EDGE_NONE) return;
  // Closed to ground is active.
  EICRA = edge == BUSHD_EDGE_RISING ? 1 << ISC01 : 1 << ISC01 | 1 << ISC00;
  EIFR = 1 << INTF0;
  EIMSK |= 1 << INT0;
}

bool trigger_came(uint32_t* time) {
  if ((GPIOR0 & 1 << TRIGGER_CAME) == 0) return false;
  GPIOR0 &= (uint8_t) ~(1 << TRIGGER_CAME);
  *time = clock_at(trigger_count);  // the interrupt is off since
  return true;
}
