#include "firmware/ports/atmega2560/inputs.h"

#include <board.h>
#include <util/atomic.h>

#include "firmware/ports/atmega2560/identity.h"

#define SETTLE_CYCLES (200UL * CYCLES_PER_US)

// PINx, DDRx and PORTx follow each other. Returns the pins that are high while they are driven low,
// for some cycles only: a short takes more than a pin may give for long.
static uint8_t shorted(volatile uint8_t* pin, uint8_t bits) {
  const uint8_t pull_ups = pin[2];
  pin[2] = (uint8_t)(pull_ups & ~bits);
  pin[1] = bits;
  __builtin_avr_delay_cycles(3);
  const uint8_t high = pin[0] & bits;
  pin[1] = 0;
  pin[2] = pull_ups;
  return high;
}

bool inputs_test(void) {
  const uint8_t high =
      shorted(&INPUT_LOW, 0xFF) | shorted(&INPUT_HIGH, 0xFF) | shorted(&INPUT_SYSTEM, SYSTEM_BITS);
  // Long lines take a while to be pulled up again.
  __builtin_avr_delay_cycles(SETTLE_CYCLES);
  return high == 0;
}

void inputs_init(void) {
  DIDR0 = 1 << ADC0D;
  ADMUX = 1 << REFS0;
  ADCSRB = 0;
  ADCSRA = 1 << ADEN | 1 << ADSC | 1 << ADATE | 1 << ADPS2 | 1 << ADPS1 | 1 << ADPS0;
}

// What the pin is to say although it has gone back; true: it is.
static bool has_switched_off(void) {
  return (EICRA & EMERGENCY_EDGES) != 0 && (EIMSK & 1 << EMERGENCY_INT) == 0;
}

bool inputs_unwatch(bool on) {
  bool off = false;
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    off = has_switched_off();
    EIMSK &= (uint8_t)~(1 << EMERGENCY_INT);
  }
  if (off && on) return false;
  EICRA &= (uint8_t)~EMERGENCY_EDGES;
  return true;
}

// Its interrupt puts itself off, and leaves in EICRA which edge it was.
void inputs_switch_off_at(bushd_edge edge) {
  if (edge == BUSHD_EDGE_NONE) return;
  // Closed to ground is active.
  const bool rising = edge == BUSHD_EDGE_RISING;
  EICRA = (uint8_t)(EICRA | (rising ? EMERGENCY_FALLING : EMERGENCY_EDGES));
  EIFR = 1 << EMERGENCY_FLAG;
  EIMSK |= 1 << EMERGENCY_INT;
  // It may have come before. What falls from here on is for the interrupt.
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    const bool closed = (INPUT_SYSTEM & 1 << EMERGENCY_BIT) == 0;
    if (closed == rising && (EIMSK & 1 << EMERGENCY_INT) != 0) {
      EIMSK &= (uint8_t)~(1 << EMERGENCY_INT);
      EN_PIN = 1 << EN_BIT;
    }
  }
  if (has_switched_off()) identity_keep_enable(0);
}

bushd_inputs inputs_read(void) {
  const uint8_t low = INPUT_LOW;
  const uint8_t high = INPUT_HIGH;
  const uint8_t system = (uint8_t)~INPUT_SYSTEM;
  bushd_inputs inputs = {(uint16_t)~((uint16_t)high << 8 | low), 0};
  bool emergency = (system & 1 << EMERGENCY_BIT) != 0;
  if (has_switched_off()) emergency = (EICRA & EMERGENCY_EDGES) == EMERGENCY_FALLING;
  if (emergency) inputs.system |= BUSHD_INPUT_EMERGENCY;
  if (system & 1 << FORWARD_BIT) inputs.system |= BUSHD_INPUT_FORWARD;
  if (system & 1 << REVERSE_BIT) inputs.system |= BUSHD_INPUT_REVERSE;
  if (system & 1 << TRIGGER_BIT) inputs.system |= BUSHD_INPUT_TRIGGER;
  return inputs;
}

uint16_t inputs_current(void) {
  return ADC;
}
