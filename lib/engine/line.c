// In steps of the motor, with g = 2 value + p, p = (L - N) mod 2:
//
//     r (s - 1/2) + 1/2  =  made + g / 2L ,     and after f / 256 of the next step of the run
//
//     256 (r (s + f/256 - 1/2) + 1/2)  =  256 made + (256 g + 2 N f) / 2L .
//
// All numerators are below 2^41.
#include "engine/line.h"

#include <stdbool.h>
#include <string.h>

#include "engine/elementary.h"

static inline uint32_t first_value(const bushd_line* line) {
  return (line->longest - line->increment) / 2u;
}

static inline uint64_t twice_value(const bushd_line* line) {
  return (uint64_t)line->value * 2u + ((line->longest - line->increment) & 1u);
}

void bushd_line_start(bushd_line* line, uint32_t increment, uint32_t longest) {
  line->increment = increment;
  line->longest = longest;
  // 2 value is L for a motor that does not move, and stays so.
  line->value = first_value(line);
  line->made = 0;
}

uint32_t bushd_line_follow(bushd_line* line, uint32_t run_steps) {
  const uint32_t increment = line->increment;
  const uint32_t longest = line->longest;
  uint32_t value = line->value;
  uint32_t steps = 0;
  for (; run_steps > 0; --run_steps) {
    value += increment;
    if (value >= longest) {
      value -= longest;
      ++steps;
    }
  }
  line->value = value;
  line->made += steps;
  return steps;
}

void bushd_line_go_to(bushd_line* line, uint32_t run_steps) {
  const uint64_t sum = (uint64_t)line->increment * run_steps + first_value(line);
  line->made = (uint32_t)(sum / line->longest);
  line->value = (uint32_t)(sum - (uint64_t)line->made * line->longest);
}

// The least s whose sum is `step` times L.
uint32_t bushd_line_run_step(const bushd_line* line, uint32_t step) {
  const uint64_t missing = (uint64_t)step * line->longest - first_value(line);
  return (uint32_t)((missing + line->increment - 1u) / line->increment);
}

uint64_t bushd_line_position(const bushd_line* line, uint8_t fraction) {
  const uint64_t twice_longest = (uint64_t)line->longest * 2u;
  uint64_t part = twice_value(line) * 256u + (uint64_t)line->increment * 2u * fraction;
  if (line->made == 0) {
    // The rule at s = 0 is 256 (L - N) / 2L, and the way from 0 is twice that from there.
    const uint64_t at_rest = (uint64_t)(line->longest - line->increment) * 256u;
    const uint64_t risen = (part - at_rest) * 2u;
    if (risen < part) part = risen;
  }
  return (uint64_t)line->made * 256u + part / twice_longest;
}

uint16_t bushd_line_crossing(const bushd_line* line) {
  const uint64_t missing = ((uint64_t)line->longest * 2u - twice_value(line)) * 256u;
  const uint64_t increment = (uint64_t)line->increment * 2u;
  const uint64_t fraction = (missing + increment - 1u) / increment;
  return fraction < 256u ? (uint16_t)fraction : (uint16_t)256u;
}

#if BUSHD_ELEMENTARY
// The elementary law. A coordinate with N against R, the sum of those behind it: in r steps of
// these N + R = T
//
//     its own steps:      floor( N (r - 1) / T ) + 1 for r > 0
//     its step j is at:   ceil( T (j - 1) / N ) + 1
//     those of the R:     what is left of r
//     their step j is at: floor( T (j - 1) / R ) + 2
//
// which is where F, begun at 0, is not, or is, below 0.

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
#endif
