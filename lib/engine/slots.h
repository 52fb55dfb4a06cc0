// From a displacement to the slots in which its steps fall.
//
// A tick is cut into S slots. A motor's exact position moves linearly through the tick; a step is
// made in the slot in which it crosses the next whole number. Coarse displacements are the same
// thing with the crossing half a step earlier, which spaces c steps evenly: step i at slot
// (2i+1)S/2c.
#ifndef BUSHD_ENGINE_SLOTS_H
#define BUSHD_ENGINE_SLOTS_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define BUSHD_MIN_SLOTS 128u
// A build for a small MCU may have fewer: slot buffers are made for as many.
#ifndef BUSHD_MAX_SLOTS
#define BUSHD_MAX_SLOTS 256u
#endif

// Where in a step the crossing lies, in 1/256 step from the last whole position.
#define BUSHD_CROSSING_FINE 256
#define BUSHD_CROSSING_COARSE 128

// Sets `bit` in the masks of the slots in which the motor steps during one tick.
//   masks         slot_count entries (BUSHD_MIN_SLOTS..BUSHD_MAX_SLOTS)
//   displacement  steps x 256, |displacement| < 256 x slot_count (then no two steps share a slot)
//   remainder     exact position minus steps made, 1/256 step, kept by the caller from tick to tick
//   crossing      BUSHD_CROSSING_FINE or BUSHD_CROSSING_COARSE
// Returns the signed number of steps. O(steps), two divisions, no division per step.
int16_t bushd_slots_add(uint16_t* masks, uint16_t slot_count, uint16_t bit, int16_t displacement,
                        int16_t* remainder, int16_t crossing);

// The same in two parts, for all motors of a tick at once.
//
// The steps of one motor: where its position crosses x = first + 256 i, in 1/256 step from the
// tick's start, up to `distance`; none if that is 0.
typedef struct bushd_slots {
  uint16_t distance;
  uint16_t first;  // below 512
} bushd_slots;

// Returns the signed number of steps; `remainder` is then that of the tick's end. O(1), no
// division.
int16_t bushd_slots_plan(int16_t displacement, int16_t* remainder, int16_t crossing,
                         bushd_slots* plan);

// Makes the masks of all slots anew; plans[m] is bit m. O(slots + steps). A small MCU may link one
// of its own (BUSHD_OWN_SLOTS_FILL), for its number of slots only.
void bushd_slots_fill(uint16_t* masks, uint16_t slot_count, const bushd_slots* plans,
                      uint8_t motors);

// The same for ticks of whole steps from whole positions (BUSHD_CROSSING_COARSE, remainder 0):
// motor m makes |steps[m]| of them, evenly spaced. BUSHD_OWN_SLOTS_FILL_EVENLY.
void bushd_slots_fill_evenly(uint16_t* masks, uint16_t slot_count, const int16_t* steps,
                             uint8_t motors);

// No step in any slot. BUSHD_OWN_SLOTS_CLEAR.
void bushd_slots_clear(uint16_t* masks, uint16_t slot_count);

// The coarse byte as a fine displacement: steps x 256, signed by bit 7.
static inline int16_t bushd_coarse_to_fine(uint8_t coarse) {
  const uint8_t steps = coarse & 0x7F;
  const uint8_t high = (coarse & 0x80) ? steps : (uint8_t)-steps;
  return (int16_t)(uint16_t)(high << 8);
}

#ifdef __cplusplus
}
#endif
#endif
