// A straight line of several motors: one run, which counts the steps of the longest motor, and an
// evaluation function per motor that says which of them it makes too. On the host
// motion/axis_line.cpp goes by it, in the MCU line_follower.h, for firmware/core/line_run.c.
//
// Motors have increments N(i) of any sign, L = max |N(i)| and r(i) = |N(i)| / L. After s steps of
// the run motor i has made
//
//     floor( r(i) (s - 1/2) + 1/2 )   steps in its direction,                        s = 0 .. L
//
// so its step j falls at s = (j - 1/2) / r(i) + 1/2, that of the longest motor at s = j, and all
// are within half a step of the line's point at s - 1/2. The reversed line makes the same steps in
// the opposite order. A step takes no product and no division.
//
// The idea is that of V. M. Ivanov's evaluation function (2023), the rule is another one. His
// begins each frame at F = 0, makes a step of one coordinate in each interrupt, and has no leading
// coordinate, so that its speed is that of single steps along the way and its path lies on one side
// of the line. Begun at the difference of the increments, it would give this order of steps, ties
// aside. As printed it is the second law of lines: engine/elementary.h.
//
// Between two steps of the run the same rule holds for a broken s, as displacements in 1/256 step
// need it. Before its first step a motor's position rises twice as fast from 0 as the rule says
// until both agree; it crosses no whole number in that.
#ifndef BUSHD_ENGINE_LINE_H
#define BUSHD_ENGINE_LINE_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

// Plain state, copyable. 2 value + (L - N) mod 2 is 2 N s - N + L modulo 2 L: so all sums stay
// below 2^32.
typedef struct bushd_line {
  uint32_t increment;  // |N|
  uint32_t longest;    // L
  uint32_t value;      // of the evaluation function, below L
  uint32_t made;       // steps of the motor
} bushd_line;

// The motor's place at the beginning of its line. Precondition: increment <= longest, 1 <= longest
// < 2^31. O(1).
void bushd_line_start(bushd_line* line, uint32_t increment, uint32_t longest);

// Takes the next `run_steps` steps of the run; returns how many of them the motor makes.
// O(run_steps): an addition and a comparison each, and a subtraction where it makes one.
// Precondition: not beyond s = L.
uint32_t bushd_line_follow(bushd_line* line, uint32_t run_steps);

// Goes to s = `run_steps`, from wherever it is. One division.
void bushd_line_go_to(bushd_line* line, uint32_t run_steps);

// The step of the run, counted from 1, with or before which the motor makes its step `step` (1 ..
// increment). One division.
uint32_t bushd_line_run_step(const bushd_line* line, uint32_t step);

// The motor's position in 1/256 step, rounded down, when `fraction`/256 of the step of the run
// after s are over. It may be above `made` + 1: a step may fall between two of the run. One
// division.
uint64_t bushd_line_position(const bushd_line* line, uint8_t fraction);

// The least fraction at which the position above is `made` + 1 or more; 256: that is not before the
// run's next step. Precondition: made < increment. One division.
uint16_t bushd_line_crossing(const bushd_line* line);

#ifdef __cplusplus
}
#endif
#endif
