#include "firmware/ports/lm3s6965/journal.h"

#include <string.h>

#include "firmware/ports/lm3s6965/flash.h"

// Left for addresses that are given before the next boot.
#define RESERVED_WORDS 32u

enum { KIND_ADDRESS = 4, KIND_BOOT_NUMBER = 5, KINDS = 6 };

// What a page holds.
typedef struct page_content {
  uint16_t value[KINDS];
  uint8_t kinds;  // bit per kind: there is one
  uint16_t used;  // words
} page_content;

static const volatile uint32_t* const kPage[2] = {(const volatile uint32_t*)0x0003F800,
                                                  (const volatile uint32_t*)0x0003FC00};

static uint8_t present;  // page
static page_content content;

static uint32_t record_of(uint8_t kind, uint16_t value) {
  const uint8_t check = (uint8_t)~(value ^ value >> 8 ^ kind);
  return value | (uint32_t)kind << 16 | (uint32_t)check << 24;
}

static page_content read_page(uint8_t page) {
  page_content read;
  memset(&read, 0, sizeof read);
  for (; read.used < FLASH_PAGE_WORDS && kPage[page][read.used] != FLASH_BLANK; ++read.used) {
    const uint32_t record = kPage[page][read.used];
    const uint8_t kind = (uint8_t)(record >> 16);
    // One that was cut off by a power failure does not count.
    if (kind >= KINDS || record != record_of(kind, (uint16_t)record)) continue;
    read.value[kind] = (uint16_t)record;
    read.kinds |= (uint8_t)(1u << kind);
  }
  return read;
}

static bool has(const page_content* of, uint8_t kind) {
  return (of->kinds >> kind & 1u) != 0;
}

static bool has_identity(const page_content* of) {
  return (of->kinds & 0x1Fu) == 0x1Fu && (uint8_t)of->value[KIND_ADDRESS] != 0;
}

static bool append(uint8_t kind, uint16_t value) {
  if (content.used == FLASH_PAGE_WORDS) return false;
  if (!flash_write(kPage[present] + content.used++, record_of(kind, value))) return false;
  content.value[kind] = value;
  content.kinds |= (uint8_t)(1u << kind);
  return true;
}

// The boot number comes last: until it stands there the page before is the newer one.
static void turn_page(void) {
  const page_content old = content;
  present ^= 1u;
  flash_erase(kPage[present]);
  memset(&content, 0, sizeof content);
  for (uint8_t kind = 0; kind < KINDS; ++kind) {
    if (has(&old, kind)) append(kind, old.value[kind]);
  }
}

// Whether page 1 is newer than page 0.
static bool second_is_newer(const page_content* first, const page_content* second) {
  if (has_identity(first) != has_identity(second)) return has_identity(second);
  if (!has(first, KIND_BOOT_NUMBER) || !has(second, KIND_BOOT_NUMBER)) {
    return has(second, KIND_BOOT_NUMBER);
  }
  const uint16_t ahead =
      (uint16_t)(second->value[KIND_BOOT_NUMBER] - first->value[KIND_BOOT_NUMBER]);
  return ahead != 0 && ahead < 0x8000u;
}

bool journal_open(journal_state* state) {
  const page_content pages[2] = {read_page(0), read_page(1)};
  present = second_is_newer(&pages[0], &pages[1]) ? 1 : 0;
  content = pages[present];
  const uint16_t boot_number = (uint16_t)(content.value[KIND_BOOT_NUMBER] + 1u);
  if (content.used > FLASH_PAGE_WORDS - RESERVED_WORDS) turn_page();
  const bool counted = append(KIND_BOOT_NUMBER, boot_number);
  memset(state, 0, sizeof *state);
  state->boot_number = boot_number;
  state->address = 1;
  if (!has_identity(&content)) return false;
  state->address = (uint8_t)content.value[KIND_ADDRESS];
  for (uint8_t i = 0; i < BUSHD_UNIQUE_ID_SIZE; ++i) {
    state->unique_id[i] = (uint8_t)(content.value[i / 2] >> 8 * (i % 2));
  }
  return counted;
}

bool journal_store_address(uint8_t address) {
  return append(KIND_ADDRESS, address);
}
