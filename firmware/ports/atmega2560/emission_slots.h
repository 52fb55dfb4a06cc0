// What the slot interrupts work by; for emission.c and the assembler files.
#ifndef BUSHD_FIRMWARE_PORTS_ATMEGA2560_EMISSION_SLOTS_H
#define BUSHD_FIRMWARE_PORTS_ATMEGA2560_EMISSION_SLOTS_H

// Registers that interrupts have to themselves: no C code of the image uses them
// (cmake/warnings.cmake), and no library function that is linked (tests/sim/avr/registers). None of
// these interrupts lets others in while it uses them.
#define SLOT_LOW r2  // where the masks of the next slot lie
#define SLOT_HIGH r3
#define SAVED_LOW r4  // a pointer register of the code that was interrupted
#define SAVED_HIGH r5
#define DATA_LOW r6
#define DATA_HIGH r7  // of the slots alone, for their second port
#define SLOT_MARK r8  // low byte of SLOT behind the first slot of a tick, later behind its last one
#define ZERO r9

// Offsets into emission_tick.
#define TICK_MASK 0
#define TICK_MARK 2
#define TICK_END 3
#define TICK_TOP 4
#define TICK_LAST_TOP 6
#define TICK_DIRECTION 8
#define TICK_CYCLES 10
#define TICK_BEGUN 14

// Bits of GPIOR0; the low ones hold what the tests before `main` found, until the first tick
// begins.
#define TICK_COMMON 3   // the common DIR changes behind every pulse
#define TICK_LEVELS 4   // masks are levels: they stay
#define TICK_SPECIAL 5  // one of these, or STEP of an output rests high
#define TICK_IS_NEXT 6  // the mark that comes is that of a tick's first slot
#define TICK_CHANGES 7  // from a tick's last slot into the next one's first

#ifndef __ASSEMBLER__

#include <stdint.h>

// A tick as it is emitted: slots of `top` + 1 cycles, the last one of `last_top` + 1.
typedef struct emission_tick {
  const uint16_t* mask;  // of its first slot
  uint8_t mark;          // low byte of the address behind that
  uint8_t end;           // and behind the last one
  uint16_t top;
  uint16_t last_top;
  uint16_t direction;
  uint32_t cycles;
  uint8_t begun;  // what GPIOR0 has from its first slot on
} emission_tick;

// In the last slot of a tick the next one is taken, and the silent one waits in its place. These
// are low bytes of addresses, so that a slot need not wait while one is written: all ticks lie
// within one multiple of 256 bytes (EMISSION_TICKS; tests/sim/avr/one_page).
extern volatile uint8_t emission_next;
extern volatile uint8_t emission_taken;
extern emission_tick emission_silent;
extern volatile uint16_t emission_last_top;  // of the present tick
// The taken tick has begun, at `begun_at`, and is not silent. `next_start` is of the tick after it.
extern volatile uint8_t emission_committed;
extern uint32_t emission_begun_at;
extern uint32_t emission_next_start;

// .data is where RAM begins, and short.
#define EMISSION_TICKS __attribute__((section(".data")))

// Gives the interrupts their registers. With interrupts off.
void emission_set_registers(const emission_tick* first);

#endif
#endif
