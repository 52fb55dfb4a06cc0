#include "firmware/ports/atmega2560/clock.h"

#include <avr/interrupt.h>

volatile uint16_t clock_overflows;

ISR(TIMER5_OVF_vect) {
  ++clock_overflows;
}

void clock_init(void) {
  TCCR5A = 0;
  TCCR5B = 1 << CS50;
  TIMSK5 = 1 << TOIE5;
}
