#include "firmware/ports/atmega2560/eeprom.h"

#include <avr/interrupt.h>
#include <util/atomic.h>

volatile bool eeprom_writes;

void eeprom_write(uint16_t address, uint8_t byte) {
  if (eeprom_byte(address) == byte) return;
  eeprom_writes = true;
  EEAR = address;
  EEDR = byte;
  // Within four cycles of each other.
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    EECR |= 1 << EEMPE;
    EECR |= 1 << EEPE;
  }
  EECR |= 1 << EERIE;
}

ISR(EE_READY_vect) {
  EECR &= (uint8_t)~(1 << EERIE);
  eeprom_writes = false;
}
