// Who the MCU is, in the EEPROM. From address 0: unique id (8 bytes), address, CRC-32 of these nine
// (low byte first); at 16 the boot number, at 14 the one that counts where that cannot be written
// any more; at 19 a copy of the first 13 bytes, which counts if these are not whole: the power went
// while they were written.
#ifndef BUSHD_FIRMWARE_PORTS_ATMEGA2560_IDENTITY_H
#define BUSHD_FIRMWARE_PORTS_ATMEGA2560_IDENTITY_H

#include <stdbool.h>
#include <stdint.h>

#include "engine/message.h"

typedef struct identity {
  uint8_t unique_id[BUSHD_UNIQUE_ID_SIZE];
  uint8_t address;
  uint32_t crc;
} identity;

// Counts the boot. False if the EEPROM holds no identity: then the address is 1 and the id all
// zero; or if it cannot count: the next boot would have the same number.
bool identity_load(identity* kept, uint16_t* boot_number);

// Is written by identity_poll. False while another address is being written, or the first copy.
bool identity_store_address(uint8_t address);
// In RAM, which outlives a reset by the watchdog: a cell of the EEPROM would wear out where drivers
// are disabled at rest. BUSHD_ENABLED_* of drivers that are enabled, for boot_enable_kept(), or 0.
void identity_keep_enable(uint8_t enabled);

// Writes a byte of what has changed, if one is left. Precondition: the EEPROM writes nothing.
void identity_poll(void);

#endif
