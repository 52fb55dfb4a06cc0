// From reset to main: vectors, and memory as C wants it. RAM has been tested before (ram_test.S).
#include <stdint.h>

#include "engine/frame.h"
#include "firmware/ports/lm3s6965/boot.h"
#include "firmware/ports/lm3s6965/interrupts.h"
#include "firmware/ports/lm3s6965/registers.h"

// lm3s6965.ld
extern uint32_t data_begin[];
extern uint32_t data_end[];
extern const uint32_t data_image[];
extern uint32_t bss_begin[];
extern uint32_t bss_end[];
extern uint32_t stack_end[];
extern const uint8_t image_begin[];
extern const uint8_t image_end[];

uint32_t boot_ram_faults;

// What makes the CRC of the image 0: seal_image.py puts it there.
__attribute__((section(".seal"), used)) const uint32_t image_seal;

bool boot_flash_is_sealed(void) {
  return bushd_crc32(BUSHD_CRC32_START, image_begin, (size_t)(image_end - image_begin)) == 0;
}

#define VECTORS EXTERNAL(44u)
static const vector kVectors[VECTORS];

int main(void);
void reset(void);                 // ram_test.S
void start(uint32_t ram_faults);  // by it

// Aligned as the chip wants it.
__attribute__((aligned(256))) vector vectors[VECTORS];

void start(uint32_t ram_faults) {
  const uint32_t* from = data_image;
  for (uint32_t* to = data_begin; to < data_end; ++to) *to = *from++;
  for (uint32_t* to = bss_begin; to < bss_end; ++to) *to = 0;
  for (uint32_t i = 0; i < VECTORS; ++i) vectors[i] = kVectors[i];
  SCB_VTOR = (uint32_t)(uintptr_t)vectors;
  boot_ram_faults = ram_faults;
  main();
}

// A fault of the CPU, or an interrupt that nobody asked for: pulses and drivers off, and a reset.
static void fail(void) {
  interrupts_off();
  SCB_AIRCR = 0x05FA0004;  // SYSRESETREQ
  for (;;) {
  }
}

__attribute__((section(".vectors"), used)) static const vector kVectors[VECTORS] = {
    [0] = (vector)(uintptr_t)stack_end,
    [1] = reset,
    [2] = fail,
    [3] = fail,
    [4] = fail,
    [5] = fail,
    [6] = fail,
    [EXTERNAL(IRQ_GPIO_A)] = input_edge,
    [EXTERNAL(IRQ_UART0)] = line_received,
    [EXTERNAL(IRQ_TIMER0A)] = emission_half_slot,
    [EXTERNAL(IRQ_TIMER1A)] = emission_tick_begins,
    [EXTERNAL(IRQ_TIMER2A)] = line_due,
    [EXTERNAL(IRQ_TIMER3A)] = compare_due};
