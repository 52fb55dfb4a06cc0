// bushd_slots_fill for 128 slots and 16 motors, in the same time however many steps there are. With
// T the crossing of a step, in 1/256 of a motor's distance d a slot, it is the step of slot
//
//     floor(T / 2d),   T = 256 (first + 256 i)
//
// T is counted down by 2d a slot, modulo 2^16, and borrows are steps.
#include "engine/slots.h"
#include "firmware/ports/atmega2560/emission.h"
#include "firmware/ports/atmega2560/run_parts.h"

typedef struct slots_phase {
  uint16_t phase;
  uint16_t step;
} slots_phase;

// slots_fill.S
void slots_fill_fine(uint8_t* masks, const slots_phase motor[8]);

static void fill_fine(uint8_t* masks, const bushd_slots* plans) {
  slots_phase motor[8];
  for (uint8_t m = 0; m < 8; ++m) {
    const bool moves = plans[m].distance != 0;
    motor[m].phase = moves ? (uint16_t)(plans[m].first << 8) : UINT16_MAX;
    motor[m].step = (uint16_t)(plans[m].distance << 1);
  }
  slots_fill_fine(masks, motor);
  uint8_t bit = 1;
  for (uint8_t m = 0; m < 8; ++m, bit = (uint8_t)(bit << 1)) {
    const bushd_slots* plan = &plans[m];
    if (plan->distance == 0) continue;
    // Modulo 2^16 the first T is that of one step earlier, which is not made.
    if (plan->first >= 256) {
      uint16_t slot = (uint16_t)(plan->first - 256u);
      if (slot != 0) slot = (uint16_t)(slot * 128u) / plan->distance;
      masks[2 * slot] &= (uint8_t)~bit;
    }
    // A crossing exactly at the end of the tick belongs to it: its last slot.
    if ((uint8_t)plan->distance == (uint8_t)plan->first) {
      masks[2 * (EMISSION_SLOTS - 1u)] |= bit;
    }
  }
}

static void clear(uint8_t* masks) {
  for (uint8_t slot = EMISSION_SLOTS; slot > 0; --slot, masks += 2) *masks = 0;
}

void bushd_slots_clear(uint16_t* masks, uint16_t slot_count) {
  (void)slot_count;
  for (uint8_t eights = EMISSION_SLOTS / 8; eights > 0; --eights, masks += 8) {
    masks[0] = masks[1] = masks[2] = masks[3] = 0;
    masks[4] = masks[5] = masks[6] = masks[7] = 0;
  }
}

void bushd_slots_fill(uint16_t* masks, uint16_t slot_count, const bushd_slots* plans,
                      uint8_t motors) {
  (void)slot_count;
  for (uint8_t half = 0; half < 2; ++half) {
    uint8_t* const bytes = (uint8_t*)masks + half;
    const bushd_slots* const eight = plans + 8 * half;
    const uint8_t its = motors > 8 * half ? 8 : 0;  // an MCU has 8 or 16
    bool moves = false;
    for (uint8_t m = 0; m < its; ++m) moves = moves || eight[m].distance != 0;
    if (moves) {
      fill_fine(bytes, eight);
    } else {
      clear(bytes);
    }
  }
}
