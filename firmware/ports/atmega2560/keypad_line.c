#include "firmware/ports/atmega2560/keypad_line.h"

#include <board.h>

#define DIVISOR (CYCLES_PER_US * 1000000UL / (16UL * BUSHD_KEYPAD_BAUD) - 1UL)
_Static_assert(DIVISOR < 4096, "the divisor has 12 bits");

#define ON (1 << RXEN2 | 1 << TXEN2)

void keypad_line_hear(bushd_mcu* mcu) {
  if (mcu->local.settings.keypad == 0) {
    UCSR2B = 0;
    return;
  }
  if ((UCSR2B & ON) != ON) {
    UBRR2 = DIVISOR;
    UCSR2B = ON;
  }
  // The status belongs to the byte that is read next.
  for (uint8_t status = UCSR2A; status & 1 << RXC2; status = UCSR2A) {
    const uint8_t byte = UDR2;
    if (status & (1 << FE2 | 1 << DOR2)) {
      bushd_mcu_keypad_break(mcu);
    } else {
      bushd_mcu_keypad_byte(mcu, byte);
    }
  }
}

void keypad_line_show(bushd_mcu* mcu) {
  if ((UCSR2A & 1 << UDRE2) == 0) return;
  const int16_t character = bushd_mcu_keypad_display(mcu);
  if (character >= 0) UDR2 = (uint8_t)character;
}
