// A straight line by the evaluation function as V. M. Ivanov prints it (2023, formulas 2 to 6,
// figures 5 and 6): the second law of lines, beside that of engine/line.h. In each step of the run
// one motor makes one step; no motor leads.
//
// Two coordinates have the increments a_k and b_k. With a and b the steps made of them
//
//     F = a_k b - b_k a ,   0 at the beginning of each frame:
//     F >= 0: a step along alpha, F -= b_k;     F < 0: a step along beta, F += a_k
//
// until the coordinate with the larger increment is at its end; both are, then. That is after S =
// a_k + b_k elementary steps, so a table's delays, and a feed, are those of elementary steps along
// the way: v = h f.
//
// Ours, where the paper is silent: F = 0 is a step along alpha; where the increments are equal,
// beta ends the frame; a coordinate without a way makes no step. The paper has two coordinates. Of
// more, the first one is alpha, and all others together are its beta: a step of that beta is one of
// those, whose it is being found in the same way. So it is one step of one coordinate at a time, of
// any number of them. Coordinates are numbered as the motors of the MCU are.
//
// Between two of its own steps a motor's position rises evenly, as displacements in 1/256 step need
// it. The functions of both laws are in line.c.
#ifndef BUSHD_ENGINE_ELEMENTARY_H
#define BUSHD_ENGINE_ELEMENTARY_H

#include <stdint.h>

#include "engine/message_base.h"

#ifdef __cplusplus
extern "C" {
#endif

// Whether the MCU makes lines by this law. A small one has no memory for it.
#ifndef BUSHD_ELEMENTARY
#define BUSHD_ELEMENTARY 1
#endif

// Plain state, copyable.
typedef struct bushd_elementary {
  uint32_t sum;    // S, below 2^31
  uint32_t steps;  // elementary steps that are made
  struct {
    uint32_t increment;  // |N|, 0: makes no step
    int32_t value;       // F of this coordinate against all behind it; below 0 if it makes no step
    uint32_t made;       // steps of its own
    uint32_t last;       // the elementary step that was the last of these, counted from 1; 0: none
  } coordinate[BUSHD_MOTORS_PER_MCU];
} bushd_elementary;

// No coordinate has a way yet.
void bushd_elementary_clear(bushd_elementary* line);
// Precondition: this one had none; the sum of all is below 2^31.
void bushd_elementary_add(bushd_elementary* line, uint8_t coordinate, uint32_t increment);

// Makes the next elementary step; returns whose it is. Precondition: less than S are made.
// O(coordinates): a comparison and an addition each.
uint8_t bushd_elementary_step(bushd_elementary* line);
// The elementary step that is the next one of this coordinate. Precondition: it has not made all.
// A division for each coordinate up to this one.
uint32_t bushd_elementary_due(const bushd_elementary* line, uint8_t coordinate);
// Its position beyond its last step, 1/256 step, rounded down, when `parts` (0 .. 255) of the next
// elementary step are over. As bushd_elementary_due.
uint8_t bushd_elementary_fraction(const bushd_elementary* line, uint8_t coordinate, uint8_t parts);

// What follows reads S and increments only, at any place of the line. Some divisions for each
// coordinate up to this one.

// Its steps when `run_steps` (0 .. S) elementary steps are over.
uint32_t bushd_elementary_made(const bushd_elementary* line, uint8_t coordinate,
                               uint32_t run_steps);
// The elementary step, counted from 1, that is its step `step` (1 .. increment).
uint32_t bushd_elementary_run_step(const bushd_elementary* line, uint8_t coordinate, uint32_t step);
// Its position in 1/256 step, rounded down, when `fraction`/256 of the elementary step after
// `run_steps` are over.
uint64_t bushd_elementary_position(const bushd_elementary* line, uint8_t coordinate,
                                   uint32_t run_steps, uint8_t fraction);
// So many elementary steps at least lie from any step of its own to the next one. It may be the
// only coordinate: 1. Precondition: its increment is not 0.
uint32_t bushd_elementary_apart(const bushd_elementary* line, uint8_t coordinate);
// Any k elementary steps that follow each other have floor(k N / S) steps of its own, less this
// many, at least. Precondition: as above.
uint8_t bushd_elementary_late(const bushd_elementary* line, uint8_t coordinate);

#ifdef __cplusplus
}
#endif
#endif
