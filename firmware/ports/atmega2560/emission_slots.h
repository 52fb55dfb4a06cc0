// What the slot interrupts work by; for emission.c and emission_slots.S.
#ifndef BUSHD_FIRMWARE_PORTS_ATMEGA2560_EMISSION_SLOTS_H
#define BUSHD_FIRMWARE_PORTS_ATMEGA2560_EMISSION_SLOTS_H

// Offsets into emission_tick.
#define TICK_MASK 2
#define TICK_END 4
#define TICK_TOP 5
#define TICK_LAST_TOP 7

// In GPIOR0: what compare B has to do besides. Bit 7: something.
#define EMISSION_CHANGE 0x81
#define EMISSION_BEGUN 0x82

#ifndef __ASSEMBLER__

#include <stdint.h>

// A tick as it is emitted: slots of `top` + 1 cycles, the last one of `last_top` + 1.
typedef struct emission_tick {
  uint16_t direction;
  const uint16_t* mask;  // of its first slot; of the present tick, the next one
  uint8_t end;           // low byte of the address behind the last one
  uint16_t top;
  uint16_t last_top;
  uint32_t cycles;
} emission_tick;

// A copy; of it all but direction and cycles.
extern emission_tick emission_present;
// In the last slot of a tick the next one is taken, and the silent one waits in its place.
extern const emission_tick* volatile emission_next;
extern const emission_tick* volatile emission_taken;
extern emission_tick emission_silent;

#endif
#endif
