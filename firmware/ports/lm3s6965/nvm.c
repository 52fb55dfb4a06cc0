#include "firmware/ports/lm3s6965/nvm.h"

#include <string.h>

#include "engine/frame.h"
#include "firmware/ports/lm3s6965/flash.h"

#define PAGES 96u
#define MOST_PAGES 31u      // of a writing
#define COMPARED_BYTES 32u  // at a time

typedef struct nvm_head {
  uint32_t program;
  uint32_t number;
  uint32_t size;
  uint32_t crc;
  uint32_t check;
} nvm_head;
#define HEAD_WORDS (sizeof(nvm_head) / sizeof(uint32_t))
#define MOST_BYTES (MOST_PAGES * FLASH_PAGE_WORDS * sizeof(uint32_t) - sizeof(nvm_head))

static const volatile uint32_t* const kArea = (const volatile uint32_t*)0x00027800;  // lm3s6965.ld
extern const uint32_t image_seal;                                                    // startup.c

static nvm_head newest;         // all zero: there is none
static const uint8_t* content;  // of the newest, at boot
static uint32_t next;           // page, from which on it is blank up to:
static uint32_t room_end;

static enum { COMPARES, WRITES, ENDS } phase;
static bushd_mcu_nvm_scan scan;
static uint32_t planned;  // CRC of what is being written
static uint32_t planned_size;
static uint32_t head_words;  // written

static const volatile uint32_t* page_at(uint32_t page) {
  return kArea + page * FLASH_PAGE_WORDS;
}

static uint32_t pages_of(uint32_t content_size) {
  const uint32_t words = HEAD_WORDS + (content_size + 3u) / 4u;
  return (words + FLASH_PAGE_WORDS - 1u) / FLASH_PAGE_WORDS;
}

static bool is_blank(uint32_t page) {
  const volatile uint32_t* const at = page_at(page);
  uint32_t word = 0;
  while (word < FLASH_PAGE_WORDS && at[word] == FLASH_BLANK) ++word;
  return word == FLASH_PAGE_WORDS;
}

static uint32_t check_of(const nvm_head* head) {
  return ~(head->program ^ head->number ^ head->size ^ head->crc);
}

static nvm_head head_at(uint32_t page) {
  const volatile uint32_t* const at = page_at(page);
  const nvm_head head = {at[0], at[1], at[2], at[3], at[4]};
  return head;
}

static void make_room(uint32_t from) {
  next = from + MOST_PAGES <= PAGES ? from : 0;
  for (uint32_t page = next; page < next + MOST_PAGES; ++page) {
    if (!is_blank(page)) flash_erase(page_at(page));
  }
  room_end = next + MOST_PAGES;
  while (room_end < PAGES && is_blank(room_end)) ++room_end;
}

nvm_found nvm_find(void) {
  uint32_t found = 0;  // page
  for (uint32_t page = 0; page < PAGES; ++page) {
    const nvm_head head = head_at(page);
    if (head.check != check_of(&head) || head.size > MOST_BYTES) continue;
    if (newest.number != 0 && (int32_t)(head.number - newest.number) < 0) continue;
    newest = head;
    found = page;
  }
  bushd_mcu_nvm_begin_scan(&scan);
  make_room(newest.number != 0 ? found + pages_of(newest.size) : 0);
  if (newest.number == 0 || newest.program != image_seal) return NVM_NOTHING;
  content = (const uint8_t*)(uintptr_t)(page_at(found) + HEAD_WORDS);
  if (bushd_crc32(BUSHD_CRC32_START, content, newest.size) == newest.crc) return NVM_WHOLE;
  newest.size = 0;  // what is there will be written again
  return NVM_BROKEN;
}

bushd_set_outputs nvm_outputs(void) {
  bushd_set_outputs outputs;
  memcpy(&outputs, content, sizeof outputs);
  return outputs;
}

void nvm_load(bushd_mcu* mcu) {
  for (;;) {
    const uint32_t from = scan.size;
    const bushd_mcu_nvm_region bytes = bushd_mcu_nvm_scan_next(mcu, &scan, MOST_BYTES);
    if (bytes.at == NULL) break;
    memcpy(bytes.at, content + from, bytes.size);
  }
  bushd_mcu_nvm_begin_scan(&scan);
  bushd_mcu_nvm_restored(mcu);
}

// At the end of a scan that only compares.
static void compare_whole(bushd_mcu* mcu) {
  const bool same =
      newest.program == image_seal && newest.size == scan.size && newest.crc == scan.crc;
  const bool news = newest.number != 0 || mcu->tables.codes_used != 0;
  const bool quiet = bushd_mcu_nvm_is_quiet(mcu, &scan);
  const bool room = scan.size <= MOST_BYTES && next + pages_of(scan.size) <= room_end;
  bushd_mcu_nvm_compared(mcu, same || !news);
  if (!same && news && quiet && room) phase = WRITES;
  planned = scan.crc;
  planned_size = scan.size;
  bushd_mcu_nvm_begin_scan(&scan);
}

// It has changed meanwhile, or flash is worn.
static void give_up(void) {
  next += pages_of(planned_size);
  phase = COMPARES;
  bushd_mcu_nvm_begin_scan(&scan);
}

static void write_word(bushd_mcu* mcu) {
  const uint32_t at = scan.size / 4u;
  uint32_t word = FLASH_BLANK;
  uint8_t* const to = (uint8_t*)&word;
  uint32_t count = 0;
  for (; count < sizeof word; ++count) {
    const bushd_mcu_nvm_region byte = bushd_mcu_nvm_scan_next(mcu, &scan, 1);
    if (byte.at == NULL) break;
    to[count] = *(const uint8_t*)byte.at;
  }
  if (scan.size > planned_size) {
    give_up();
  } else if (count != 0) {
    if (!flash_write(page_at(next) + HEAD_WORDS + at, word)) give_up();
  } else if (scan.crc == planned && scan.size == planned_size) {
    phase = ENDS;
    head_words = 0;
  } else {
    give_up();
  }
}

static void write_head(void) {
  nvm_head head = {image_seal, newest.number + 1u, scan.size, scan.crc, 0};
  head.check = check_of(&head);
  const uint32_t words[HEAD_WORDS] = {head.program, head.number, head.size, head.crc, head.check};
  if (!flash_write(page_at(next) + head_words, words[head_words])) {
    give_up();
  } else if (++head_words == HEAD_WORDS) {
    newest = head;
    next += pages_of(scan.size);
    phase = COMPARES;
    bushd_mcu_nvm_begin_scan(&scan);
  }
}

void nvm_poll(bushd_mcu* mcu) {
  switch (phase) {
    case COMPARES:
      if (bushd_mcu_nvm_scan_next(mcu, &scan, COMPARED_BYTES).at == NULL) compare_whole(mcu);
      break;
    case WRITES:
      write_word(mcu);
      break;
    case ENDS:
      write_head();
      break;
  }
}
