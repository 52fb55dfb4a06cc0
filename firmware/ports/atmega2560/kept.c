#include "firmware/ports/atmega2560/kept.h"

#include "engine/frame.h"
#include "firmware/ports/atmega2560/eeprom.h"

#define HEAD_WHOLE 0xA5u
#define HEAD_BEGUN 0x00u
#define QUIET_TICKS 512u
#define CONTENT (EEPROM_KEPT + sizeof(kept_head))

typedef struct kept_head {
  uint8_t state;
  uint32_t program;
  uint16_t size;
  uint32_t crc;
} kept_head;

extern const __flash uint32_t image_seal;  // boot_tests.S

static enum { COMPARE, WRITE, WRITE_HEAD } phase;
// How far it goes through the pieces.
static uint8_t piece_index;
static uint16_t offset;  // in the piece
static uint16_t size;    // of all bytes so far
static uint32_t crc;
static uint32_t planned;         // CRC of the pass before
static uint16_t planned_uptime;  // since when it is the same

static void begin_pass(void) {
  piece_index = 0;
  offset = 0;
  size = 0;
  crc = BUSHD_CRC32_START;
}

// Null at the end of all pieces.
static uint8_t* next_byte(bushd_mcu* mcu) {
  for (;;) {
    const bushd_mcu_piece piece = bushd_mcu_kept(mcu, piece_index);
    if (offset < piece.size) return (uint8_t*)piece.at + offset++;
    if (piece.at == NULL) return NULL;
    ++piece_index;
    offset = 0;
  }
}

static kept_head read_head(void) {
  kept_head head;
  eeprom_read_block(&head, (const void*)EEPROM_KEPT, sizeof head);
  return head;
}

kept_found kept_find(void) {
  begin_pass();
  const kept_head head = read_head();
  if (head.state == 0xFF) return KEPT_NOTHING;
  if (head.state != HEAD_WHOLE || head.size > E2END + 1u - CONTENT) return KEPT_BROKEN;
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
  uint8_t* byte;
  while ((byte = next_byte(mcu)) != NULL) *byte = eeprom_byte((uint16_t)(CONTENT + size++));
  begin_pass();
  bushd_mcu_restored(mcu);
}

// At the end of a pass that only compares.
static void compare_whole(const bushd_mcu* mcu) {
  const kept_head head = read_head();
  const bool same = head.state == HEAD_WHOLE && head.program == image_seal && head.size == size &&
                    head.crc == crc;
  const bool news = head.state != 0xFF || mcu->codes_used != 0;
  // A master that begins changes one thing after the other.
  if (crc != planned) planned_uptime = (uint16_t)mcu->uptime;
  const bool quiet = (uint16_t)((uint16_t)mcu->uptime - planned_uptime) >= QUIET_TICKS;
  if (!same && news && quiet && size <= E2END + 1u - CONTENT) {
    phase = WRITE;
    eeprom_write(EEPROM_KEPT, HEAD_BEGUN);
  }
  planned = crc;
  begin_pass();
}

static void write_head(void) {
  const kept_head head = {HEAD_WHOLE, image_seal, size, crc};
  ++offset;
  if (offset < sizeof head) {
    eeprom_write((uint16_t)(EEPROM_KEPT + offset), ((const uint8_t*)&head)[offset]);
    return;
  }
  eeprom_write(EEPROM_KEPT, HEAD_WHOLE);
  phase = COMPARE;
  begin_pass();
}

void kept_poll(bushd_mcu* mcu) {
  if (phase == WRITE_HEAD) {
    write_head();
    return;
  }
  const uint8_t* byte = next_byte(mcu);
  if (byte != NULL) {
    crc = bushd_crc32(crc, byte, 1);
    if (phase == WRITE) eeprom_write((uint16_t)(CONTENT + size), *byte);
    ++size;
  } else if (phase == COMPARE) {
    compare_whole(mcu);
  } else if (crc == planned) {
    phase = WRITE_HEAD;
    offset = 0;
  } else {
    phase = COMPARE;  // it has changed meanwhile
    begin_pass();
  }
}
