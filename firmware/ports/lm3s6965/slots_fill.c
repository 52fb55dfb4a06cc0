// bushd_slots_fill for 128 slots and 16 motors, in the same time however many steps there are. A
// motor of distance d makes the step of crossing x = first + 256 i in slot floor(128 x / d), so as
// many as floor(v / 2^15) grows by in a slot:
//
//     v = 128 first' + d (k + 1)   at the end of slot k, with first' = -first - 1/128
//
// v is kept in the upper 15 bits of a register: a step is the carry of adding d.
#include <string.h>

#include "engine/slots.h"
#include "firmware/ports/lm3s6965/emission.h"

#define AT_ONCE 4  // motors; their phases and distances fill the registers

_Static_assert(EMISSION_SLOTS == 128, "the shifts");
#define SCALE 17

typedef struct slots_phase {
  uint32_t phase;
  uint32_t step;
} slots_phase;

// Shifts four bits into each mask, that of motor[3] first.
static void fill_four(uint16_t* masks, const slots_phase motor[AT_ONCE]) {
  uint16_t* const end = masks + EMISSION_SLOTS;
  uint32_t phase_0 = motor[0].phase;
  uint32_t phase_1 = motor[1].phase;
  uint32_t phase_2 = motor[2].phase;
  uint32_t phase_3 = motor[3].phase;
  do {
#pragma GCC unroll 8
    for (int i = 0; i < 8; ++i) {
      uint32_t mask = masks[i];
      __asm volatile(
          "adds %[p3], %[s3]\n\t"
          "adc %[mask], %[mask]\n\t"
          "adds %[p2], %[s2]\n\t"
          "adc %[mask], %[mask]\n\t"
          "adds %[p1], %[s1]\n\t"
          "adc %[mask], %[mask]\n\t"
          "adds %[p0], %[s0]\n\t"
          "adc %[mask], %[mask]"
          : [p0] "+r"(phase_0), [p1] "+r"(phase_1), [p2] "+r"(phase_2), [p3] "+r"(phase_3),
            [mask] "+r"(mask)
          : [s0] "r"(motor[0].step), [s1] "r"(motor[1].step), [s2] "r"(motor[2].step),
            [s3] "r"(motor[3].step)
          : "cc");
      masks[i] = (uint16_t)mask;
    }
    masks += 8;
  } while (masks != end);
}

static slots_phase phase_of(const bushd_slots* plan) {
  const slots_phase rest = {0, 0};
  if (plan->distance == 0) return rest;
  const slots_phase moves = {(0u - 1u - ((uint32_t)plan->first << 7)) << SCALE,
                             (uint32_t)plan->distance << SCALE};
  return moves;
}

// What the carries of a motor's distance do not tell.
static void mend(uint16_t* masks, uint16_t bit, const bushd_slots* plan) {
  if (plan->distance == 0) return;
  // Modulo 2^15 the first crossing is that of one step earlier, which is not made.
  if (plan->first >= 256u) {
    masks[((uint32_t)plan->first - 256u) * EMISSION_SLOTS / plan->distance] &= (uint16_t)~bit;
  }
  // A crossing exactly at the end of the tick belongs to it: its last slot.
  if ((uint8_t)plan->distance == (uint8_t)plan->first) masks[EMISSION_SLOTS - 1u] |= bit;
}

void bushd_slots_fill(uint16_t* masks, uint16_t slot_count, const bushd_slots* plans,
                      uint8_t motors) {
  (void)slot_count;
  (void)motors;
  memset(masks, 0, EMISSION_SLOTS * sizeof masks[0]);
  uint32_t moves = 0;
  for (uint8_t m = 0; m < BUSHD_MOTORS_PER_MCU; ++m) moves |= plans[m].distance;
  if (moves == 0) return;
  for (int first = BUSHD_MOTORS_PER_MCU - AT_ONCE; first >= 0; first -= AT_ONCE) {
    slots_phase motor[AT_ONCE];
    for (int m = 0; m < AT_ONCE; ++m) motor[m] = phase_of(&plans[first + m]);
    fill_four(masks, motor);
  }
  for (uint8_t m = 0; m < BUSHD_MOTORS_PER_MCU; ++m) {
    mend(masks, (uint16_t)(1u << m), &plans[m]);
  }
}
