// The crossing of the i-th step of a tick lies x_i = 256 i + (crossing - progress) past the tick's
// start position, so its slot is floor(x_i S / |d|): one quotient and remainder for the first, one
// for the distance between two, and additions from there (Bresenham's scheme).
#include "engine/slots.h"

#include <stdbool.h>
#include <string.h>

// In 16 bits, and without a product: it is done for every motor in every tick of a small MCU.
int16_t bushd_slots_plan(int16_t displacement, int16_t* remainder, int16_t crossing,
                         bushd_slots* plan) {
  const bool back = displacement < 0;
  const uint16_t distance = back ? (uint16_t)-displacement : (uint16_t)displacement;
  const int16_t progress = back ? (int16_t)-*remainder : *remainder;  // in this tick's direction
  // A crossing at x <= 0 cannot be: the step would have been made in the tick before.
  const uint16_t first = crossing > progress ? (uint16_t)(crossing - progress) : 0;
  if (distance == 0 || first > distance) {
    plan->distance = 0;
    *remainder = (int16_t)(*remainder + displacement);
    return 0;
  }
  plan->distance = distance;
  plan->first = first;
  const int16_t steps = (int16_t)((uint16_t)(distance - first) / 256u + 1u);
  // |remainder| stays below 512, so what wraps on the way does no harm.
  const int16_t left = (int16_t)((uint16_t)progress + distance - (uint16_t)steps * 256u);
  *remainder = back ? (int16_t)-left : left;
  return back ? (int16_t)-steps : steps;
}

static void fill(uint16_t* masks, uint16_t slot_count, uint16_t bit, const bushd_slots* plan) {
  const uint32_t distance = plan->distance;
  if (distance == 0) return;
  uint32_t slot = (uint32_t)plan->first * slot_count / distance;
  uint32_t rest = (uint32_t)plan->first * slot_count % distance;
  const uint32_t step_slots = 256u * (uint32_t)slot_count / distance;
  const uint32_t step_rest = 256u * (uint32_t)slot_count % distance;
  for (uint32_t x = plan->first; x <= distance; x += 256) {
    // A crossing exactly at the end of the tick belongs to it: its last slot.
    masks[slot < slot_count ? slot : slot_count - 1u] |= bit;
    slot += step_slots;
    rest += step_rest;
    if (rest >= distance) {
      rest -= distance;
      ++slot;
    }
  }
}

#ifndef BUSHD_OWN_SLOTS_CLEAR
void bushd_slots_clear(uint16_t* masks, uint16_t slot_count) {
  memset(masks, 0, slot_count * sizeof masks[0]);
}
#endif

#ifndef BUSHD_OWN_SLOTS_FILL
void bushd_slots_fill(uint16_t* masks, uint16_t slot_count, const bushd_slots* plans,
                      uint8_t motors) {
  memset(masks, 0, slot_count * sizeof masks[0]);
  for (uint8_t m = 0; m < motors; ++m) fill(masks, slot_count, (uint16_t)(1u << m), &plans[m]);
}
#endif

#ifndef BUSHD_OWN_SLOTS_FILL_EVENLY
void bushd_slots_fill_evenly(uint16_t* masks, uint16_t slot_count, const int16_t* steps,
                             uint8_t motors) {
  bushd_slots plans[16];  // a mask has as many bits
  for (uint8_t m = 0; m < motors; ++m) {
    const uint16_t count = (uint16_t)(steps[m] < 0 ? -steps[m] : steps[m]);
    plans[m].distance = (uint16_t)(count << 8);
    plans[m].first = BUSHD_CROSSING_COARSE;
  }
  bushd_slots_fill(masks, slot_count, plans, motors);
}
#endif

int16_t bushd_slots_add(uint16_t* masks, uint16_t slot_count, uint16_t bit, int16_t displacement,
                        int16_t* remainder, int16_t crossing) {
  bushd_slots plan;
  const int16_t steps = bushd_slots_plan(displacement, remainder, crossing, &plan);
  fill(masks, slot_count, bit, &plan);
  return steps;
}
