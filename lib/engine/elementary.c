// A coordinate with N against R, the sum of those behind it: in r steps of these N + R = T
//
//     its own:    floor( N (r - 1) / T ) + 1     for r > 0,      its step j is at    ceil( T (j -
//     1) / N ) + 1 of the R:   what is left of r,             the step j of those at floor( T (j -
//     1) / R ) + 2
//
// which is where F, begun at 0, is not, or is, below 0.
#include "engine/elementary.h"

#include <stdbool.h>
#include <string.h>

// The coordinates before the one that is asked for: each leaves to those behind it what it does not
// make itself.
typedef struct level {
  uint32_t increment;  // N, not 0
  uint32_t total;      // T
} level;

void bushd_elementary_clear(bushd_elementary* line) {
  memset(line, 0, sizeof *line);
  for (uint8_t i = 0; i < BUSHD_MOTORS_PER_MCU; ++i) line->coordinate[i].value = -1;
}

void bushd_elementary_add(bushd_elementary* line, uint8_t coordinate, uint32_t increment) {
  line->sum += increment;
  line->coordinate[coordinate].increment = increment;
  line->coordinate[coordinate].value = increment == 0 ? -1 : 0;
}

static uint32_t own_steps(level at, uint32_t steps) {
  if (steps == 0) return 0;
  return (uint32_t)((uint64_t)at.increment * (steps - 1u) / at.total) + 1u;
}

static uint32_t step_of_own(level at, uint32_t step) {
  return (uint32_t)(((uint64_t)at.total * (step - 1u) + at.increment - 1u) / at.increment) + 1u;
}

static uint32_t step_of_others(level at, uint32_t step) {
  return (uint32_t)((uint64_t)at.total * (step - 1u) / (at.total - at.increment)) + 2u;
}

uint8_t bushd_elementary_step(bushd_elementary* line) {
  uint32_t rest = line->sum;
  for (uint8_t i = 0; i < BUSHD_MOTORS_PER_MCU; ++i) {
    int32_t* value = &line->coordinate[i].value;
    rest -= line->coordinate[i].increment;
    if (*value >= 0) {
      *value -= (int32_t)rest;
      ++line->coordinate[i].made;
      line->coordinate[i].last = ++line->steps;
      return i;
    }
    *value += (int32_t)line->coordinate[i].increment;
  }
  return BUSHD_MOTORS_PER_MCU - 1u;  // not reached: F of the last one with a way stays 0
}

// The levels before the coordinate, and its own, the last one. Returns how many.
static uint8_t levels_of(const bushd_elementary* line, uint8_t coordinate,
                         level levels[BUSHD_MOTORS_PER_MCU]) {
  uint8_t count = 0;
  uint32_t total = line->sum;
  for (uint8_t i = 0; i <= coordinate; ++i) {
    const uint32_t increment = line->coordinate[i].increment;
    if (increment == 0) continue;
    levels[count].increment = increment;
    levels[count].total = total;
    ++count;
    total -= increment;
  }
  return count;
}

uint32_t bushd_elementary_made(const bushd_elementary* line, uint8_t coordinate,
                               uint32_t run_steps) {
  if (line->coordinate[coordinate].increment == 0) return 0;
  level levels[BUSHD_MOTORS_PER_MCU];
  const uint8_t last = (uint8_t)(levels_of(line, coordinate, levels) - 1u);
  for (uint8_t i = 0; i < last; ++i) run_steps -= own_steps(levels[i], run_steps);
  return own_steps(levels[last], run_steps);
}

uint32_t bushd_elementary_run_step(const bushd_elementary* line, uint8_t coordinate,
                                   uint32_t step) {
  level levels[BUSHD_MOTORS_PER_MCU];
  uint8_t i = (uint8_t)(levels_of(line, coordinate, levels) - 1u);
  step = step_of_own(levels[i], step);
  while (i > 0) step = step_of_others(levels[--i], step);
  return step;
}

uint32_t bushd_elementary_due(const bushd_elementary* line, uint8_t coordinate) {
  return bushd_elementary_run_step(line, coordinate, line->coordinate[coordinate].made + 1u);
}

// Evenly from the step `before` to the step `after`.
static uint64_t part_of(uint32_t before, uint32_t after, uint32_t steps, uint8_t fraction) {
  return ((uint64_t)(steps - before) * 256u + fraction) / (after - before);
}

uint8_t bushd_elementary_fraction(const bushd_elementary* line, uint8_t coordinate, uint8_t parts) {
  const uint32_t due = bushd_elementary_due(line, coordinate);
  return (uint8_t)part_of(line->coordinate[coordinate].last, due, line->steps, parts);
}

uint64_t bushd_elementary_position(const bushd_elementary* line, uint8_t coordinate,
                                   uint32_t run_steps, uint8_t fraction) {
  const uint32_t made = bushd_elementary_made(line, coordinate, run_steps);
  if (made == line->coordinate[coordinate].increment) return (uint64_t)made * 256u;
  const uint32_t before = made == 0 ? 0 : bushd_elementary_run_step(line, coordinate, made);
  const uint32_t after = bushd_elementary_run_step(line, coordinate, made + 1u);
  return (uint64_t)made * 256u + part_of(before, after, run_steps, fraction);
}

uint32_t bushd_elementary_apart(const bushd_elementary* line, uint8_t coordinate) {
  level levels[BUSHD_MOTORS_PER_MCU];
  uint8_t i = (uint8_t)(levels_of(line, coordinate, levels) - 1u);
  uint64_t apart = levels[i].total / levels[i].increment;
  while (i > 0) {
    const level* before = &levels[--i];
    apart = apart * before->total / (before->total - before->increment);
  }
  return (uint32_t)apart;
}

// Each level rounds down, but the last one if nothing is behind it: less than a step is lost at
// each, and the first of them is the rounding of floor(k N / S) itself.
uint8_t bushd_elementary_late(const bushd_elementary* line, uint8_t coordinate) {
  level levels[BUSHD_MOTORS_PER_MCU];
  const uint8_t count = levels_of(line, coordinate, levels);
  const level* own = &levels[count - 1u];
  const bool is_last = own->increment == own->total;
  return (uint8_t)(count - (is_last && count > 1 ? 2u : 1u));
}
