#include "firmware/ports/atmega2560/nvm.h"

#include "engine/frame.h"
#include "firmware/ports/atmega2560/eeprom.h"

#define HEAD_WHOLE 0xA5u
#define HEAD_BEGUN 0x00u
#define CONTENT (EEPROM_NVM + sizeof(nvm_head))

typedef struct nvm_head {
  uint8_t state;
  uint32_t program;
  uint16_t size;
  uint32_t crc;
} nvm_head;

_Static_assert(sizeof(nvm_head) == NVM_HEAD_BYTES, "as laid down");

extern const __flash uint32_t image_seal;  // boot_tests.S

enum { COMPARE, WRITE, WRITE_HEAD };
static uint8_t phase;
static bushd_mcu_nvm_scan scan;
static uint32_t planned;  // CRC of what is being written
static uint8_t in_head;   // bytes of it that are written

static nvm_head read_head(void) {
  nvm_head head;
  eeprom_read_block(&head, (const void*)EEPROM_NVM, sizeof head);
  return head;
}

nvm_found nvm_find(void) {
  bushd_mcu_nvm_begin_scan(&scan);
  const nvm_head head = read_head();
  if (head.state == 0xFF) return NVM_NOTHING;
  if (head.state != HEAD_WHOLE || head.size > NVM_MOST_BYTES) return NVM_BROKEN;
  if (head.program != image_seal) return NVM_NOTHING;
  uint32_t sum = BUSHD_CRC32_START;
  for (uint16_t i = 0; i < head.size; ++i) {
    const uint8_t byte = eeprom_byte((uint16_t)(CONTENT + i));
    sum = bushd_crc32(sum, &byte, 1);
  }
  if (sum == head.crc) return NVM_WHOLE;
  // All of it will be written again.
  eeprom_write_byte((uint8_t*)EEPROM_NVM, HEAD_BEGUN);
  return NVM_BROKEN;
}

bushd_set_outputs nvm_outputs(void) {
  bushd_set_outputs outputs;
  eeprom_read_block(&outputs, (const void*)CONTENT, sizeof outputs);
  return outputs;
}

void nvm_load(bushd_mcu* mcu) {
  for (;;) {
    const uint16_t at = (uint16_t)(CONTENT + scan.size);
    const bushd_mcu_nvm_region byte = bushd_mcu_nvm_scan_next(mcu, &scan, 1);
    if (byte.at == NULL) break;
    *(uint8_t*)byte.at = eeprom_byte(at);
  }
  bushd_mcu_nvm_begin_scan(&scan);
  bushd_mcu_nvm_restored(mcu);
}

// At the end of a scan that only compares.
static void compare_whole(const bushd_mcu* mcu) {
  const nvm_head head = read_head();
  const bool same = head.state == HEAD_WHOLE && head.program == image_seal &&
                    head.size == scan.size && head.crc == scan.crc;
  // Nothing is kept of an MCU that has never been given anything to move by.
  const bool by_people = (mcu->local.settings.motors | mcu->local.settings.keypad) != 0;
  const bool news = head.state != 0xFF || mcu->tables.codes_used != 0 || by_people;
  const bool quiet = bushd_mcu_nvm_is_quiet(mcu, &scan);
  if (!same && news && quiet) {
    phase = WRITE;
    planned = scan.crc;
    eeprom_write(EEPROM_NVM, HEAD_BEGUN);
  }
  bushd_mcu_nvm_begin_scan(&scan);
}

static void write_head(void) {
  const nvm_head head = {HEAD_WHOLE, image_seal, scan.size, scan.crc};
  ++in_head;
  if (in_head < sizeof head) {
    eeprom_write((uint16_t)(EEPROM_NVM + in_head), ((const uint8_t*)&head)[in_head]);
    return;
  }
  eeprom_write(EEPROM_NVM, HEAD_WHOLE);
  phase = COMPARE;
  bushd_mcu_nvm_begin_scan(&scan);
}

void nvm_poll(bushd_mcu* mcu) {
  if (phase == WRITE_HEAD) {
    write_head();
    return;
  }
  const uint16_t at = (uint16_t)(CONTENT + scan.size);
  const bushd_mcu_nvm_region byte = bushd_mcu_nvm_scan_next(mcu, &scan, 1);
  if (byte.at != NULL) {
    if (phase == WRITE) eeprom_write(at, *(const uint8_t*)byte.at);
  } else if (phase == COMPARE) {
    compare_whole(mcu);
  } else if (scan.crc == planned) {
    phase = WRITE_HEAD;
    in_head = 0;
  } else {
    phase = COMPARE;  // it has changed meanwhile
    bushd_mcu_nvm_begin_scan(&scan);
  }
}
