// Stands for avr-libc's: the EEPROM is an array (port.c).
#ifndef BUSHD_FUZZ_ATMEGA2560_AVR_EEPROM_H
#define BUSHD_FUZZ_ATMEGA2560_AVR_EEPROM_H

#include <stddef.h>
#include <stdint.h>

#include "avr/io.h"

void eeprom_read_block(void* to, const void* from, size_t size);
uint8_t eeprom_read_byte(const uint8_t* at);
void eeprom_write_byte(uint8_t* at, uint8_t byte);

#endif
