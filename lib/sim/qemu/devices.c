/* What the image uses beside UART and pins, as far as QEMU does not model it: flash that can be
 * written, an ADC, the watchdog, the cause of a reset; and RAM that is broken. */
#include <string.h>
#include <unistd.h>

#include "sim/qemu/machine.h"

#define PAGE 0x1000u /* of registers */
#define FLASH_CONTROL 0x400FD000u
#define FLASH_PAGE 1024u
#define FLASH_KEY 0xA442u
#define ADC_AT 0x40038000u
#define WATCHDOG_AT 0x40000000u
#define RESET_CAUSE_AT 0x400FE05Cu
#define ADC_SAMPLE_NS INT64_C(1000)

/* Flash that the image writes to. Writing only makes zeros of ones. */
#define WRITTEN 0x27800u
#define WRITTEN_SIZE (98 * FLASH_PAGE)
static struct {
  uint32_t address;
  uint32_t data;
  uint32_t words[WRITTEN_SIZE / 4];
  uint32_t command;
  int64_t busy_until_ns;
  bool worn;
} flash;

static struct {
  uint32_t result;
  uint32_t averaging; /* of 2 to the power of it samples */
  int64_t ready_ns;
} adc;

static uint32_t reset_cause;

static struct {
  QEMUTimer timer;
  uint32_t load;
  uint32_t control;
  bool interrupt;
} watchdog;

void flash_set(uint32_t address, uint32_t word) {
  if (address < WRITTEN || address >= WRITTEN + WRITTEN_SIZE) {
    store_violation(address);
  }
  flash.words[(address - WRITTEN) / 4] = word;
  address_space_write_rom(&address_space_memory, address, NO_ATTRIBUTES, &word, sizeof word);
}

void flash_wear(void) {
  flash.worn = true;
}

void reset_cause_set(uint32_t flags) {
  reset_cause = flags;
}

/* A word of RAM with a bit that is always 1. */
static uint32_t stuck;

static uint32_t stuck_read(uint32_t address) {
  (void)address;
  return stuck | 1u;
}

static void stuck_write(uint32_t address, uint32_t data) {
  (void)address;
  stuck = data;
}

void ram_stick(uint32_t address) {
  static device word = {.read = stuck_read, .write = stuck_write};
  cover(&word, address, 4);
}

static uint32_t adc_read(uint32_t address) {
  if (address == 0xACu) return now() < adc.ready_ns ? 1u << 8 : 0;
  if (address != 0xA8u) return 0;
  adc.ready_ns = INT64_MAX;
  return adc.result;
}

static void adc_convert(void) {
  lockstep_message answer;
  tell(LOCKSTEP_CONVERTS, 0, 0);
  flush();
  get_all(&answer, sizeof answer);
  if (answer.kind != LOCKSTEP_CURRENT) give_up();
  adc.result = answer.value;
  adc.ready_ns = now() + (ADC_SAMPLE_NS << adc.averaging);
}

static void adc_write(uint32_t address, uint32_t data) {
  if (address == 0x30u) adc.averaging = data & 7u;
  if (address == 0x28u && (data & 8u) != 0) adc_convert();
}

static uint32_t cause_read(uint32_t address) {
  (void)address;
  return reset_cause;
}

static void cause_write(uint32_t address, uint32_t data) {
  (void)address;
  reset_cause = data;
}

static void watchdog_reload(void) {
  if ((watchdog.control & 1u) == 0) return;
  timer_mod(&watchdog.timer, now() + (int64_t)watchdog.load * CYCLE_NS);
}

static void on_watchdog(void* opaque) {
  (void)opaque;
  if (watchdog.interrupt && (watchdog.control & 2u) != 0) {
    uint32_t kept = 0;
    cpu_physical_memory_rw(RAM, &kept, sizeof kept, false);
    tell(LOCKSTEP_WATCHDOG, kept, 0);
    flush();
    _exit(0);
  }
  watchdog.interrupt = true;
  watchdog_reload();
}

static uint32_t watchdog_read(uint32_t address) {
  return address == 0x8u ? watchdog.control : 0;
}

static void watchdog_write(uint32_t address, uint32_t data) {
  if (address == 0x0u) watchdog.load = data;
  if (address == 0x8u) watchdog.control |= data;
  if (address == 0xCu) watchdog.interrupt = false;
  watchdog_reload();
}

static uint32_t flash_read(uint32_t address) {
  const bool busy = now() < flash.busy_until_ns;
  return address == 0x8u && busy ? flash.command : 0;
}

static void flash_takes(uint32_t command, int64_t ns) {
  flash.command = command;
  flash.busy_until_ns = now() + ns;
}

static void flash_store(uint32_t address, uint32_t word) {
  flash_set(address, word);
  tell(LOCKSTEP_STORED, word, address);
}

static void flash_write(uint32_t address, uint32_t data) {
  if (address == 0x0u) flash.address = data;
  if (address == 0x4u) flash.data = data;
  if (address != 0x8u || data >> 16 != FLASH_KEY) return;
  if (data & 1u) {
    const uint32_t word = (flash.address - WRITTEN) / 4 % (WRITTEN_SIZE / 4);
    if (!flash.worn) flash_store(flash.address, flash.words[word] & flash.data);
    flash_takes(1u, 20000);
  }
  if (data & 2u) {
    const uint32_t page = flash.address & ~(FLASH_PAGE - 1u);
    for (uint32_t word = 0; word < FLASH_PAGE; word += 4) flash_store(page + word, UINT32_MAX);
    flash_takes(2u, 20000000);
  }
}

void devices_init(void) {
  static device control = {.read = flash_read, .write = flash_write};
  static device dog = {.read = watchdog_read, .write = watchdog_write};
  static device cause = {.read = cause_read, .write = cause_write};
  static device converter = {.read = adc_read, .write = adc_write};
  cover(&converter, ADC_AT, PAGE);
  cover(&control, FLASH_CONTROL, PAGE);
  cover(&dog, WATCHDOG_AT, PAGE);
  cover(&cause, RESET_CAUSE_AT, 4);
  begin_timer(&watchdog.timer, on_watchdog);
  memset(flash.words, 0xFF, sizeof flash.words);
  address_space_write_rom(&address_space_memory, WRITTEN, NO_ATTRIBUTES, flash.words,
                          sizeof flash.words);
}
