#include "firmware/ports/atmega2560/kept.h"

#include "engine/frame.h"
#include "firmware/ports/atmega2560/eeprom.h"

#define HEAD_WHOLE 0xA5u
#define HEAD_BEGUN 0x00u
#define CONTENT (EEPROM_KEPT + sizeof(kept_head))

typedef struct kept_head {
  uint8_t state;
  uint32_t program;
  uint16_t size;
  uint32_t crc;
} kept_head;

_Static_assert(sizeof(kept_head) == KEPT_HEAD_BYTES, "as laid down");

extern const __flash uint32_t image_seal;  // boot_tests.S

static enum { COMPARE, WRITE, WRITE_HEAD } phase;
static bushd_mcu_pass pass;
static uint32_t planned;  // CRC of what is being written
static uint8_t in_head;   // bytes of it that are written

static kept_head read_head(void) {
  kept_head head;
  eeprom_read_block(&head, (const void*)EEPROM_KEPT, sizeof head);
  return head;
}

kept_found kept_find(void) {
  bushd_mcu_begin_pass(&pass);
  const kept_head head = read_head();
  if (head.state == 0xFF) return KEPT_NOTHING;
  if (head.state != HEAD_WHOLE || head.size > KEPT_MOST_BYTES) return KEPT_BROKEN;
  if (head.program != image_seal) return KEPT_NOTHING;
  uint32_t sum = BUSHD_CRC32_START;
  for (uint16_t i = 0; i < head.size; ++i) {
    const uint8_t byte = eeprom_byte((uint16_t)(CONTENT + i));
    sum = bushd_crc32(sum, &byte, 1);
  }
  if (sum == head.crc) return KEPT_WHOLE;
  // All of it will be written again.
  eeprom_write_byte((uint8_t*)EEPROM_KEPT, HEAD_BEGUN);
  return KEPT_BROKEN;
}

void kept_load(bushd_mcu* mcu) {
  for (;;) {
    const uint16_t at = (uint16_t)(CONTENT + pass.size);
    const bushd_mcu_piece byte = bushd_mcu_next_kept(mcu, &pass, 1);
    if (byte.at == NULL) break;
    *(uint8_t*)byte.at = eeprom_byte(at);
  }
  bushd_mcu_begin_pass(&pass);
  bushd_mcu_restored(mcu);
}

// At the end of a pass that only compares.
static void compare_whole(const bushd_mcu* mcu) {
  const kept_head head = read_head();
  const bool same = head.state == HEAD_WHOLE && head.program == image_seal &&
                    head.size == pass.size && head.crc == pass.crc;
  const bool news = head.state != 0xFF || mcu->tables.codes_used != 0;
  const bool quiet = bushd_mcu_kept_is_quiet(mcu, &pass);
  if (!same && news && quiet) {
    phase = WRITE;
    planned = pass.crc;
    eeprom_write(EEPROM_KEPT, HEAD_BEGUN);
  }
  bushd_mcu_begin_pass(&pass);
}

static void write_head(void) {
  const kept_head head = {HEAD_WHOLE, image_seal, pass.size, pass.crc};
  ++in_head;
  if (in_head < sizeof head) {
    eeprom_write((uint16_t)(EEPROM_KEPT + in_head), ((const uint8_t*)&head)[in_head]);
    return;
  }
  eeprom_write(EEPROM_KEPT, HEAD_WHOLE);
  phase = COMPARE;
  bushd_mcu_begin_pass(&pass);
}

void kept_poll(bushd_mcu* mcu) {
  if (phase == WRITE_HEAD) {
    write_head();
    return;
  }
  const uint16_t at = (uint16_t)(CONTENT + pass.size);
  const bushd_mcu_piece byte = bushd_mcu_next_kept(mcu, &pass, 1);
  if (byte.at != NULL) {
    if (phase == WRITE) eeprom_write(at, *(const uint8_t*)byte.at);
  } else if (phase == COMPARE) {
    compare_whole(mcu);
  } else if (pass.crc == planned) {
    phase = WRITE_HEAD;
    in_head = 0;
  } else {
    phase = COMPARE;  // it has changed meanwhile
    bushd_mcu_begin_pass(&pass);
  }
}
