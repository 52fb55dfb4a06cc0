// From reset to main: vectors, and memory as C wants it.
#include <stdint.h>

#include "firmware/ports/lm3s6965/interrupts.h"
#include "firmware/ports/lm3s6965/registers.h"

// lm3s6965.ld
extern uint32_t data_begin[];
extern uint32_t data_end[];
extern const uint32_t data_image[];
extern uint32_t bss_begin[];
extern uint32_t bss_end[];
extern uint32_t stack_end[];

#define VECTORS EXTERNAL(44u)
static const vector kVectors[VECTORS];

int main(void);
void reset(void);

// Aligned as the chip wants it.
__attribute__((aligned(256))) vector vectors[VECTORS];

void reset(void) {
  const uint32_t* from = data_image;
  for (uint32_t* to = data_begin; to < data_end; ++to) *to = *from++;
  for (uint32_t* to = bss_begin; to < bss_end; ++to) *to = 0;
  for (uint32_t i = 0; i < VECTORS; ++i) vectors[i] = kVectors[i];
  SCB_VTOR = (uint32_t)(uintptr_t)vectors;
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
    [EXTERNAL(IRQ_UART0)] = line_received,
    [EXTERNAL(IRQ_TIMER0A)] = emission_half_slot,
    [EXTERNAL(IRQ_TIMER1A)] = emission_tick_begins,
    [EXTERNAL(IRQ_TIMER2A)] = line_due};
