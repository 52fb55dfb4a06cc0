#include "firmware/ports/atmega2560/identity.h"

#include <avr/eeprom.h>
#include <avr/interrupt.h>
#include <stddef.h>
#include <string.h>
#include <util/atomic.h>

#include "engine/frame.h"

#define BOOT_NUMBER ((uint16_t*)16)
#define ENABLE_KEPT 18u

static identity image;
static volatile uint8_t written;  // bytes of the image given to the EEPROM

static uint32_t image_crc(void) {
  return ~bushd_crc32(BUSHD_CRC32_START, (const uint8_t*)&image, offsetof(identity, crc));
}

bool identity_load(identity* kept, uint16_t* boot_number) {
  *boot_number = (uint16_t)(eeprom_read_word(BOOT_NUMBER) + 1u);
  eeprom_update_word(BOOT_NUMBER, *boot_number);
  eeprom_read_block(&image, (const void*)0, sizeof image);
  written = sizeof image;
  const bool good = image.crc == image_crc() && image.address != BUSHD_ADDRESS_BROADCAST;
  if (!good) {
    memset(&image, 0, sizeof image);
    image.address = 1;
  }
  *kept = image;
  return good;
}

// The two writes to EECR must follow each other within four cycles: interrupts are off.
static void write_next(void) {
  EEAR = written;
  EEDR = ((const uint8_t*)&image)[written];
  ++written;
  EECR |= 1 << EEMPE;
  EECR |= 1 << EEPE;
}

ISR(EE_READY_vect) {
  if (written == sizeof image) {
    EECR &= (uint8_t) ~(1 << EERIE);
  } else {
    write_next();
  }
}

bool identity_store_address(uint8_t address) {
  if (written != sizeof image) return false;
  image.address = address;
  image.crc = image_crc();
  eeprom_busy_wait();
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    written = 0;
    write_next();
    EECR |= 1 << EERIE;
  }
  return true;
}

bool identity_enable_kept(void) {
  return eeprom_read_byte((const uint8_t*)ENABLE_KEPT) == 1;
}

void identity_keep_enable(bool on) {
  if (written != sizeof image || !eeprom_is_ready()) return;
  if (identity_enable_kept() == on) return;
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    EEAR = ENABLE_KEPT;
    EEDR = on ? 1 : 0;
    EECR |= 1 << EEMPE;
    EECR |= 1 << EEPE;
  }
}
