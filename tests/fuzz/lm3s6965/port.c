// For MAP_FIXED_NOREPLACE.
#define _GNU_SOURCE
#include "fuzz/lm3s6965/port.h"

#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>

// The very file.
#include "firmware/ports/lm3s6965/nvm.c"

#define AREA 0x27800u
#define AREA_END 0x3F800u
#define MAPPED_FROM 0x27000u
#define MAPPED_UNTIL 0x40000u

const uint32_t image_seal = 0x5EA1ED01;

static uint32_t* word_at(const volatile uint32_t* at) {
  const uintptr_t address = (uintptr_t)at;
  if (address < AREA || address >= AREA_END || address % sizeof *at != 0) abort();
  return (uint32_t*)address;
}

bool flash_write(const volatile uint32_t* at, uint32_t word) {
  *word_at(at) &= word;
  return *at == word;
}

void flash_erase(const volatile uint32_t* page) {
  memset(word_at(page), 0xFF, FLASH_PAGE_WORDS * sizeof *page);
}

void host_reset(void) {
  memset(&newest, 0, sizeof newest);
  memset(&scan, 0, sizeof scan);
  content = NULL;
  next = room_end = planned = planned_size = head_words = 0;
  phase = COMPARES;
}

void host_blank_flash(void) {
  static bool mapped;
  if (!mapped) {
    void* const at =
        mmap((void*)(uintptr_t)MAPPED_FROM, MAPPED_UNTIL - MAPPED_FROM, PROT_READ | PROT_WRITE,
             MAP_PRIVATE | MAP_ANONYMOUS | MAP_FIXED_NOREPLACE, -1, 0);
    if ((uintptr_t)at != MAPPED_FROM) abort();
    mapped = true;
  }
  memset((void*)(uintptr_t)AREA, 0xFF, AREA_END - AREA);
}

uint32_t host_nvm_size(void) {
  return newest.size;
}

uint32_t host_nvm_crc(void) {
  return newest.crc;
}

bushd_mcu_nvm_scan host_walk(void) {
  return scan;
}
