// The crossing of the i-th step of a tick lies x_i = 256 i + (crossing - progress) past the tick's
// start position, so its slot is floor(x_i S / |d|): one quotient and remainder for the first, one
// for the distance between two, and additions from there (Bresenham's scheme).
#include "engine/slots.h"

int16_t bushd_slots_add(uint16_t* masks, uint16_t slot_count, uint16_t bit, int16_t displacement,
                        int16_t* remainder, int16_t crossing) {
  const int16_t direction = displacement < 0 ? -1 : 1;
  const uint32_t distance = (uint32_t)(displacement < 0 ? -(int32_t)displacement : displacement);
  const int32_t progress = (int32_t)*remainder * direction;  // in the direction of this tick
  const int32_t reach = progress + (int32_t)distance;
  int16_t steps = 0;
  // A crossing at x <= 0 cannot be: the step would have been made in the tick before.
  int32_t first = crossing - progress;
  if (distance != 0 && first <= (int32_t)distance) {
    if (first < 0) first = 0;
    uint32_t slot = (uint32_t)first * slot_count / distance;
    uint32_t rest = (uint32_t)first * slot_count % distance;
    const uint32_t step_slots = 256u * (uint32_t)slot_count / distance;
    const uint32_t step_rest = 256u * (uint32_t)slot_count % distance;
    for (int32_t x = first; x <= (int32_t)distance; x += 256) {
      // A crossing exactly at the end of the tick belongs to it: its last slot.
      masks[slot < slot_count ? slot : slot_count - 1u] |= bit;
      ++steps;
      slot += step_slots;
      rest += step_rest;
      if (rest >= distance) {
        rest -= distance;
        ++slot;
      }
    }
  }
  *remainder = (int16_t)((reach - 256 * (int32_t)steps) * direction);
  return (int16_t)(steps * direction);
}

int16_t bushd_coarse_to_fine(uint8_t coarse) {
  const int16_t size = (int16_t)((coarse & 0x7F) * 256);
  return (coarse & 0x80) ? size : (int16_t)-size;
}
