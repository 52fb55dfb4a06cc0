#include "firmware/ports/lm3s6965/flash.h"

#include "firmware/ports/lm3s6965/registers.h"

#define FMC_KEY 0xA4420000u
#define FMC_WRITE (1u << 0)
#define FMC_ERASE (1u << 1)

IN_RAM static void command(uint32_t what) {
  FLASH_FMC = FMC_KEY | what;
  while ((FLASH_FMC & what) != 0) {
  }
}

bool flash_write(const volatile uint32_t* at, uint32_t word) {
  FLASH_FMA = (uint32_t)(uintptr_t)at;
  FLASH_FMD = word;
  command(FMC_WRITE);
  return *at == word;
}

void flash_erase(const volatile uint32_t* page) {
  FLASH_FMA = (uint32_t)(uintptr_t)page;
  command(FMC_ERASE);
}
