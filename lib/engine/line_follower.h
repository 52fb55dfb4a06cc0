// A motor that follows the run of a line (engine/line.h) where the run's own steps are made exact
// to a slot (engine/run_slots.h): between which of them, and where, the motor makes its own.
//
// In 1/256 of the run's steps, its step j falls at
//
//     C(j) = ceil( 128 (2j - 1) L / N ) + 128 ,
//
// which is where the position of engine/line.h reaches j. From one to the next that is an addition
// and a comparison: no division per step.
#ifndef BUSHD_ENGINE_LINE_FOLLOWER_H
#define BUSHD_ENGINE_LINE_FOLLOWER_H

#include <stdbool.h>
#include <stdint.h>

#include "engine/run_slots.h"

#ifdef __cplusplus
extern "C" {
#endif

// Plain state. Parts are 1/256 of a step of the run.
typedef struct bushd_line_follower {
  uint32_t increment;    // |N|
  uint32_t due_step;     // of the run, counted from the line's beginning from 1: in it the motor's
                         // next one falls
  uint32_t lead;         // rounded up, that is (N - 1 - lead) / N parts late; < N
  uint32_t apart_steps;  // from one step of the motor to the next, in steps and parts
  uint32_t apart_late;   // rounded up, by apart_late / N parts
  uint8_t due_part;      // of due_step, counted from 0, at whose end it falls
  uint8_t apart_parts;
} bushd_line_follower;

// The motor's place on its line when `from` steps of the run are over. Precondition: 1 <= increment
// <= longest < 2^31, from <= longest. Two divisions of 32 bits, and one of 64 unless `from` is 0.
void bushd_line_follower_start(bushd_line_follower* follower, uint32_t increment, uint32_t longest,
                               uint32_t from);

// N / L x 2^16, rounded down; for L / L what is just below. Precondition: as above.
uint16_t bushd_line_share(uint32_t increment, uint32_t longest);

// The step that is due has been made: the next one is. O(1), no division.
static inline void bushd_line_follower_step(bushd_line_follower* follower) {
  const uint16_t part = (uint16_t)(follower->due_part + follower->apart_parts);
  follower->due_step += follower->apart_steps + (part >> 8);
  follower->due_part = (uint8_t)part;
  const bool earlier = follower->lead < follower->apart_late;
  follower->lead -= follower->apart_late;
  if (!earlier) return;
  follower->lead += follower->increment;
  if (follower->due_part-- == 0) --follower->due_step;
}

// Whether the step that is due lies in the first `parts` (0 .. 256) of this step of the run.
static inline bool bushd_line_follower_due(const bushd_line_follower* follower, uint32_t step,
                                           uint16_t parts) {
  return follower->due_step == step && follower->due_part < parts;
}

// Makes the motor's steps in these steps of the run, whose numbers are those of due_step: sets
// `bit` in the masks of their slots. Returns how many. Precondition: what was due before is made.
// O(steps made). A small MCU may link one of its own (BUSHD_OWN_LINE_FOLLOWER), for its number of
// slots only.
uint8_t bushd_line_follower_make(bushd_line_follower* follower, const bushd_run_spans* spans,
                                 uint16_t bit);

// The motor's position beyond its last step, 1/256 step rounded down, when `parts` (0 .. 255) of
// the step `step` are over: that of bushd_line_position. Precondition: what was due is made; L is
// that of the start. No division.
uint8_t bushd_line_follower_fraction(const bushd_line_follower* follower, uint32_t longest,
                                     uint32_t step, uint8_t parts);

#ifdef __cplusplus
}
#endif
#endif
