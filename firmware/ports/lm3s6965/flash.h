// Words and pages of flash. While one is written or erased, the CPU gets nothing else from flash.
// What must go on meanwhile lies in RAM: the vectors, and the interrupt that collects bytes.
#ifndef BUSHD_FIRMWARE_PORTS_LM3S6965_FLASH_H
#define BUSHD_FIRMWARE_PORTS_LM3S6965_FLASH_H

#include <stdbool.h>
#include <stdint.h>

#define FLASH_PAGE_WORDS 256u
#define FLASH_BLANK 0xFFFFFFFFu
#define IN_RAM __attribute__((section(".ram_code"), noinline))

// Makes zeros of ones, in 20 us. False if it did not work.
bool flash_write(const volatile uint32_t* at, uint32_t word);

// All of the page is blank afterwards. Takes 20 ms: at boot only.
void flash_erase(const volatile uint32_t* page);

#endif
