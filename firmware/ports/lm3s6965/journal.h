// What survives without power: unique id, address, and how often it has booted. Two pages of flash
// take records of a word by turns; the newest of a kind counts. The chip is given its id by writing
// the first page (docs/firmware.md has a line for it).
//
//     bits 0..15 value, 16..23 kind, 24..31 check: ~(low byte ^ high byte ^ kind)
//     kinds 0..3: unique id, two bytes each, low byte first; 4: address; 5: boot number
//
// A page that is nearly full is copied to the other one at boot, where nobody minds that an erasure
// stops the CPU for 20 ms. A record takes 20 us.
#ifndef BUSHD_FIRMWARE_PORTS_LM3S6965_JOURNAL_H
#define BUSHD_FIRMWARE_PORTS_LM3S6965_JOURNAL_H

#include <stdbool.h>
#include <stdint.h>

#include "engine/message.h"

typedef struct journal_state {
  uint8_t unique_id[BUSHD_UNIQUE_ID_SIZE];
  uint8_t address;
  uint16_t boot_number;  // of this boot
} journal_state;

// Once, at boot; counts it. False if there is no identity (then the address is 1 and the id all
// zero), or if the number of this boot cannot be kept: the next one would have the same.
bool journal_open(journal_state* state);

// False if it cannot be kept: no room until the next boot, or worn flash.
bool journal_store_address(uint8_t address);

#endif
