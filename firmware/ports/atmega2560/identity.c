#include "firmware/ports/atmega2560/identity.h"

#include <stddef.h>
#include <string.h>

#include "engine/frame.h"
#include "firmware/ports/atmega2560/boot_tests.h"
#include "firmware/ports/atmega2560/eeprom.h"

#define BOOT_NUMBER ((uint16_t*)16)
#define SPARE_BOOT_NUMBER ((uint16_t*)14)
#define COPY 19u
#define ALL_WRITTEN (2u * sizeof(identity))

static identity image;
// Bytes of it that are in the EEPROM: first those of the copy, so that one of both is always whole.
static uint8_t written;
uint16_t enable_kept;  // boot_tests.S

static uint32_t image_crc(void) {
  return ~bushd_crc32(BUSHD_CRC32_START, (const uint8_t*)&image, offsetof(identity, crc));
}

// In the one or the other place, with its CRC.
static bool read_from(uint8_t place) {
  eeprom_read_block(&image, (const void*)(uint16_t)place, sizeof image);
  return image.crc == image_crc() && image.address != BUSHD_ADDRESS_BROADCAST;
}

// False if its cells are worn out.
static bool count_boot(uint16_t* place, uint16_t* boot_number) {
  *boot_number = (uint16_t)(eeprom_read_word(place) + 1u);
  eeprom_update_word(place, *boot_number);
  return eeprom_read_word(place) == *boot_number;
}

bool identity_load(identity* kept, uint16_t* boot_number) {
  const bool counted =
      count_boot(BOOT_NUMBER, boot_number) || count_boot(SPARE_BOOT_NUMBER, boot_number);
  const bool good = read_from(0) || read_from(COPY);
  if (!good) {
    memset(&image, 0, sizeof image);
    image.address = 1;
    written = ALL_WRITTEN;
  }
  *kept = image;
  return good && counted;
}

bool identity_store_address(uint8_t address) {
  if (written != ALL_WRITTEN) return false;
  image.address = address;
  image.crc = image_crc();
  written = 0;
  return true;
}

void identity_keep_enable(uint8_t enabled) {
  enable_kept = 0;
  if (enabled == BUSHD_ENABLED_HIGH) enable_kept = BOOT_ENABLE_HIGH;
  if (enabled == BUSHD_ENABLED_LOW) enable_kept = BOOT_ENABLE_LOW;
}

void identity_poll(void) {
  if (written == ALL_WRITTEN) return;
  const bool copied = written >= sizeof image;
  const uint8_t at = (uint8_t)(copied ? written - sizeof image : written);
  eeprom_write(copied ? at : COPY + at, ((const uint8_t*)&image)[at]);
  ++written;
}
