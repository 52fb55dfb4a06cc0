// The EEPROM, a byte at a time without waiting for it. Who has which part of it:
//   0 .. 31   identity.h
//   32 ..     nvm.h
#ifndef BUSHD_FIRMWARE_PORTS_ATMEGA2560_EEPROM_H
#define BUSHD_FIRMWARE_PORTS_ATMEGA2560_EEPROM_H

#include <avr/eeprom.h>
#include <stdbool.h>
#include <stdint.h>

#define EEPROM_NVM 32u

static inline uint8_t eeprom_byte(uint16_t address) {
  return eeprom_read_byte((const uint8_t*)address);
}

// A byte is being written, for 3.4 ms; until then nothing may be read or written.
extern volatile bool eeprom_writes;

// Precondition: none is. A byte that is the same already is not written.
void eeprom_write(uint16_t address, uint8_t byte);

#endif
