// What the tests before `main` found (boot_tests.S): in I/O registers, whatever RAM is worth. To be
// read before interrupts are let in, which use the registers for something else.
#ifndef BUSHD_FIRMWARE_PORTS_ATMEGA2560_BOOT_TESTS_H
#define BUSHD_FIRMWARE_PORTS_ATMEGA2560_BOOT_TESTS_H

// What RAM holds that nothing has written to.
#define BOOT_PAINT 0xC5

#define BOOT_RAM_BAD 1
#define BOOT_FLASH_BAD_BIT 1
#define BOOT_FLASH_BAD 2
// No faults: `enable_kept` was the one or the other of these, as RAM still had it.
#define BOOT_ENABLE_HIGH_BIT 2
#define BOOT_ENABLE_LOW_BIT 3
#define BOOT_ENABLE_HIGH 0x5A69
#define BOOT_ENABLE_LOW 0xA569

#ifdef __ASSEMBLER__

#define BOOT_FAULTS _SFR_IO_ADDR(GPIOR0)
#define BOOT_CAUSE _SFR_IO_ADDR(GPIOR2)

#else

#include <avr/io.h>
#include <stdint.h>

#include "engine/message.h"

static inline uint8_t boot_faults(void) {
  return GPIOR0;
}

// BUSHD_ENABLED_* of drivers that were enabled when the watchdog came; 0: they were not.
static inline uint8_t boot_enable_kept(void) {
  if (GPIOR0 & 1 << BOOT_ENABLE_HIGH_BIT) return BUSHD_ENABLED_HIGH;
  return GPIOR0 & 1 << BOOT_ENABLE_LOW_BIT ? BUSHD_ENABLED_LOW : 0;
}

// MCUSR as it was after reset.
static inline uint8_t boot_cause(void) {
  return GPIOR2;
}

#endif
#endif
