#include "firmware/ports/atmega2560/identity.h"

#include <stddef.h>
#include <string.h>

#include "engine/frame.h"
#include "firmware/ports/atmega2560/eeprom.h"

#define BOOT_NUMBER ((uint16_t*)16)
#define ENABLE_KEPT 18u

static identity image;
static uint8_t written;  // bytes of it that are in the EEPROM
static bool enable;

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

bool identity_enable_kept(void) {
  return eeprom_byte(ENABLE_KEPT) == 1;
}

bool identity_store_address(uint8_t address) {
  if (written != sizeof image) return false;
  image.address = address;
  image.crc = image_crc();
  written = 0;
  return true;
}

void identity_keep_enable(bool on) {
  enable = on;
}

void identity_poll(void) {
  if (written == sizeof image) {
    eeprom_write(ENABLE_KEPT, enable);
    return;
  }
  eeprom_write(written, ((const uint8_t*)&image)[written]);
  ++written;
}
