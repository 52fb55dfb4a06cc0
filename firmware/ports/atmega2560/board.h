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
#define INPUT_LOW PINK  // closed to ground: active
#define INPUT_HIGH PINJ

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
  // Pull-ups: the inputs, and the receiver's line while the transceiver does not drive it.
  PORTK = PORTJ = 0xFF;
  PORTE = 1 << 0;
}
#endif

#endif
