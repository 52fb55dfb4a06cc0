// In steps of the motor, with g = 2 value + p, p = (L - N) mod 2:
//
//     r (s - 1/2) + 1/2  =  made + g / 2L ,     and after f / 256 of the next step of the run
//
//     256 (r (s + f/256 - 1/2) + 1/2)  =  256 made + (256 g + 2 N f) / 2L .
//
// All numerators are below 2^41.
#include "engine/line.h"

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
