// What boards with an ATmega328P at 16 MHz have in common: windings at latches, the inputs of the
// motor whose number leads the multiplexers, and the line. Pins are in docs/firmware.md. For the
// one source file of an image, which says before it where the strobe is: STROBE_D.
#ifndef BUSHD_FIRMWARE_PORTS_COMMUTATOR_BOARD_H
#define BUSHD_FIRMWARE_PORTS_COMMUTATOR_BOARD_H

#include <avr/io.h>
#include <stdbool.h>

#include "firmware/commutator/commutator.h"

#define CYCLES_PER_S 16000000UL

// Eight samples a bit. The data sheet (8N1, double speed) recommends no more than 1.5 %.
#define DIVIDER ((CYCLES_PER_S / 8UL + BUSHD_COMMUTATOR_BAUD / 2UL) / BUSHD_COMMUTATOR_BAUD)
#define ACTUAL_BAUD (CYCLES_PER_S / 8UL / DIVIDER)
_Static_assert(ACTUAL_BAUD * 1000UL <= BUSHD_COMMUTATOR_BAUD * 1015UL &&
                   ACTUAL_BAUD * 1000UL >= BUSHD_COMMUTATOR_BAUD * 985UL,
               "16 MHz make no such baud rate");
_Static_assert(DIVIDER <= 4096, "the divisor has 12 bits");

// Windings at PC0 .. PC3; the latch of the motor takes them with the rising edge of the strobe.
#define WINDINGS_C 0x0Fu
#define OTHERS_C 0x30u
// Number of the motor at PD2 .. PD4.
#define FIRST_NUMBER 2u
#define NUMBER_D 0x1Cu
// Inputs, pulled up: active, present, connected and on are low.
#define SUPPLY_D 0x40u
#define RIGHT_LIMIT_B 1u
#define LEFT_LIMIT_B 2u
#define CONNECTED_B 4u

// The latches keep windings through a reset by the watchdog, so RAM keeps what they are.
typedef struct kept_phase {
  uint8_t phase;
  uint8_t inverted;
} kept_phase;
static kept_phase kept[BUSHD_COMMUTATOR_MOTORS] __attribute__((section(".noinit")));

static void address(uint8_t number) {
  PORTD = (uint8_t)((PORTD & ~NUMBER_D) | (uint8_t)(number << FIRST_NUMBER));
  // Multiplexer and synchroniser: 0.1 us, and two cycles.
  __builtin_avr_delay_cycles(4);
}

static uint8_t read_inputs(uint8_t motor) {
  address(motor);
  const uint8_t b = PINB;
  uint8_t inputs = 0;
  if ((b & RIGHT_LIMIT_B) == 0) inputs |= BUSHD_COMMUTATOR_RIGHT_LIMIT;
  if ((b & LEFT_LIMIT_B) == 0) inputs |= BUSHD_COMMUTATOR_LEFT_LIMIT;
  if ((b & CONNECTED_B) != 0) inputs |= BUSHD_COMMUTATOR_NOT_CONNECTED;
  if ((PIND & SUPPLY_D) != 0) inputs |= BUSHD_COMMUTATOR_SUPPLY_MISSING;
  return inputs;
}

static void switch_windings(const bushd_commutator* board, uint8_t motor) {
  const uint8_t phase = board->phase[motor];
  kept[motor] = (kept_phase){phase, (uint8_t)~phase};
  address(motor);
  PORTC = (uint8_t)(OTHERS_C | bushd_commutator_windings(board, motor));
  PORTD &= (uint8_t)~STROBE_D;
  PORTD |= STROBE_D;
}

// A motor of which RAM has lost the phase goes to phase 0, two steps away at most.
static void begin_windings(bushd_commutator* board, bool power_came) {
  for (uint8_t m = 0; m < BUSHD_COMMUTATOR_MOTORS; ++m) {
    const uint8_t phase = kept[m].phase;
    const bool is_kept = phase < BUSHD_COMMUTATOR_PHASES && (phase ^ kept[m].inverted) == 0xFF;
    board->phase[m] = is_kept && !power_came ? phase : 0;
    switch_windings(board, m);
  }
}

static void begin_line(void) {
  UCSR0A = 1 << U2X0;
  UBRR0 = DIVIDER - 1;
  UCSR0B = 1 << RXEN0 | 1 << TXEN0;
}

typedef enum heard { HEARD_NOTHING, HEARD_BYTE, HEARD_DAMAGED } heard;

// The status belongs to the byte that is read next.
static inline heard hear_byte(uint8_t* byte) {
  const uint8_t status = UCSR0A;
  if ((status & 1 << RXC0) == 0) return HEARD_NOTHING;
  *byte = UDR0;
  return (status & (1 << FE0 | 1 << DOR0)) != 0 ? HEARD_DAMAGED : HEARD_BYTE;
}

#endif
