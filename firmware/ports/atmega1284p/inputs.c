#include "firmware/ports/atmega2560/inputs.h"

#include <board.h>
#include <util/atomic.h>

#include "firmware/ports/atmega2560/identity.h"

#define SETTLE_CYCLES (200UL * CYCLES_PER_US)

// PINx, DDRx and PORTx follow each other. Returns the pins that are high while they are driven low,
// for some cycles only: a short takes more than a pin may give for long.
static uint8_t shorted(volatile uint8_t* pin, uint8_t bits) {
  const uint8_t outputs = pin[1];
  const uint8_t pull_ups = pin[2];
  pin[2] = (uint8_t)(pull_ups & ~bits);
  pin[1] = outputs | bits;
  __builtin_avr_delay_cycles(3);
  const uint8_t high = pin[0] & bits;
  pin[1] = outputs;
  pin[2] = pull_ups;
  return high;
}

bool inputs_test(void) {
  const uint8_t high = shorted(&INPUT_LOW, INPUT_LOW_BITS) | shorted(&INPUT_SYSTEM, SYSTEM_BITS);
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

static bool awaited_closed;

static bool emergency_closed(void) {
  return (INPUT_SYSTEM & 1 << EMERGENCY_BIT) == 0;
}

static bool has_switched_off(void) {
  return PCMSK1 != 0 && PCICR == 0;
}

bool inputs_unwatch(bool on) {
  bool off = false;
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    off = has_switched_off();
    PCICR = 0;
  }
  if (off && on) return false;
  PCMSK1 = 0;
  return true;
}

// Its interrupt puts itself off.
void inputs_switch_off_at(bushd_edge edge) {
  if (edge == BUSHD_EDGE_NONE) return;
  awaited_closed = edge == BUSHD_EDGE_RISING;
  PCMSK1 = EMERGENCY_CHANGE;
  PCIFR = 1 << PCIF1;
  PCICR = 1 << PCIE1;
  // It may have come before. What changes from here on is for the interrupt.
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    if (emergency_closed() == awaited_closed && PCICR != 0) {
      PCICR = 0;
      EN_PIN = 1 << EN_BIT;
    }
  }
  if (has_switched_off()) identity_keep_enable(0);
}

bushd_inputs inputs_read(void) {
  const uint8_t low = (uint8_t)~INPUT_LOW;
  const uint8_t system = (uint8_t)~INPUT_SYSTEM;
  bushd_inputs inputs = {(uint16_t)((low & INPUT_LOW_BITS) | (system & 1 << INPUT_0_BIT)), 0};
  if (has_switched_off() ? awaited_closed : emergency_closed())
    inputs.system |= BUSHD_INPUT_EMERGENCY;
  if (system & 1 << FORWARD_BIT) inputs.system |= BUSHD_INPUT_FORWARD;
  if (system & 1 << REVERSE_BIT) inputs.system |= BUSHD_INPUT_REVERSE;
  if (system & 1 << TRIGGER_BIT) inputs.system |= BUSHD_INPUT_TRIGGER;
  return inputs;
}

uint16_t inputs_current(void) {
  return ADC;
}
