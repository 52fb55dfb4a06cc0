// What was found before main.
#ifndef BUSHD_FIRMWARE_PORTS_LM3S6965_BOOT_H
#define BUSHD_FIRMWARE_PORTS_LM3S6965_BOOT_H

#include <stdbool.h>
#include <stdint.h>

// Bits that were wrong in any word of RAM.
extern uint32_t boot_ram_faults;

// Is the program in flash as it was built? Takes 5 ms.
bool boot_flash_is_sealed(void);

#endif
