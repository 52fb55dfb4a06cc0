#include "firmware/ports/atmega1284p/chopper.h"

#include <avr/io.h>
#include <board.h>

#define COUNT_CYCLES 8u
#define PWM_COUNTS 256u
#define COMPARATOR_INTERRUPTS (1 << INT0 | 1 << INT1)

bushd_mcu_currents chopper_currents[1];

void chopper_init(void) {
  EICRA = BOARD_EDGES;
  // The reference: fast PWM of 62.5 kHz at OC2A.
  TCCR2A = 1 << COM2A1 | 1 << WGM21 | 1 << WGM20;
  TCCR2B = 1 << CS20;
  // The period.
  OCR0A = CHOPPER_PERIOD_US * CYCLES_PER_US / COUNT_CYCLES - 1u;
  TCCR0A = 1 << WGM01;
  TCCR0B = 1 << CS01;
}

// OC2A is high for OCR2A + 1 of 256 counts.
static uint8_t reference_of(uint16_t ma) {
  const uint16_t counts =
      (uint16_t)((PWM_COUNTS * (uint32_t)ma + BUSHD_MAX_CURRENT_MA / 2u) / BUSHD_MAX_CURRENT_MA);
  return (uint8_t)(counts == 0 ? 0u : counts - 1u);
}

void chopper_set(void* context, uint8_t motor, uint16_t ma, bool fast_decay) {
  (void)context;
  (void)motor;
  const bool controlled = ma != 0;
  OCR2A = reference_of(ma);
  if (fast_decay) {
    DECAY_PORT |= 1 << DECAY_BIT;
  } else {
    DECAY_PORT &= (uint8_t)~(1 << DECAY_BIT);
  }
  const bool on = (TIMSK0 & 1 << OCIE0A) != 0;
  if (on == controlled) return;
  if (controlled) {
    TIFR0 = 1 << OCF0A;
    TIMSK0 = 1 << OCIE0A;
    return;
  }
  // What is cut comes on with the next step.
  TIMSK0 = 0;
  EIMSK &= (uint8_t)~COMPARATOR_INTERRUPTS;
}
