// ATmega2560 at 16 MHz: which pin is what. docs/firmware.md has the same as a table, with the
// wiring.
#ifndef BUSHD_FIRMWARE_PORTS_ATMEGA2560_BOARD_H
#define BUSHD_FIRMWARE_PORTS_ATMEGA2560_BOARD_H

#include <avr/io.h>

#define CYCLES_PER_US 16u

// Whole ports, so that the pulses of a slot begin together: motors 0..7 in _LOW, 8..15 in _HIGH.
// Those of STEP lie in the I/O space, where a write takes one cycle.
#define STEP_LOW PORTA
#define STEP_HIGH PORTC
#define DIR_LOW PORTL
#define DIR_HIGH PORTB
#define COMMON_DIR_PIN PINF
#define COMMON_DIR_BIT 2
// Inputs, with pull-ups; closed to ground: active.
#define INPUT_LOW PINK
#define INPUT_HIGH PINJ
// Those that are no motor's. The trigger's has an interrupt of its own, INT0.
#define INPUT_SYSTEM PIND
#define TRIGGER_BIT 0
#define EMERGENCY_BIT 1
#define FORWARD_BIT 2
#define REVERSE_BIT 3
#define SYSTEM_BITS (1 << TRIGGER_BIT | 1 << EMERGENCY_BIT | 1 << FORWARD_BIT | 1 << REVERSE_BIT)
// The current sensor is at ADC0.

// Output of the position compare pulse.
#define COMPARE_PORT PORTG
#define COMPARE_BIT 5
#define EN_PORT PORTH
#define EN_BIT 3
// Driver-enable of the RS-485 transceiver, and its /RE: it does not hear itself.
#define DE_PORT PORTE
#define DE_BIT 4

#ifndef __ASSEMBLER__
static inline void board_init(void) {
  // Outputs are low since reset.
  DDRA = DDRC = DDRL = DDRB = 0xFF;
  DDRH = 1 << EN_BIT;
  DDRE = 1 << DE_BIT;
  DDRG = 1 << COMPARE_BIT;
  DDRF = 1 << COMMON_DIR_BIT;
  // Pull-ups: the inputs, and the receiver's line while the transceiver does not drive it.
  PORTK = PORTJ = 0xFF;
  PORTD = SYSTEM_BITS;
  PORTE = 1 << 0;
}
#endif

#endif
