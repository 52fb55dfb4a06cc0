// What the interrupt of every half slot works by; for emission.c and emission_slots.S.
#ifndef BUSHD_FIRMWARE_PORTS_LM3S6965_EMISSION_SLOTS_H
#define BUSHD_FIRMWARE_PORTS_LM3S6965_EMISSION_SLOTS_H

// Offsets into emission_slot_state.
#define SLOT_END 16
#define SLOT_REST 20

#ifndef __ASSEMBLER__

#include <stdint.h>

typedef struct emission_slot_state {
  uintptr_t cursor;          // the next mask; plus 1 while its pulses last
  volatile uint32_t* timer;  // clears the interrupt
  volatile uint32_t* step_low;
  volatile uint32_t* step_high;
  uintptr_t end;  // of the masks
  uint32_t rest;  // levels of STEP without pulses
} emission_slot_state;

extern emission_slot_state emission_slot;

// When the pulses of the last slot of a tick have ended.
void emission_take_next(void);

#endif
#endif
