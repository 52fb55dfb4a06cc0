#include "engine/line_follower.h"

#include "engine/line.h"

void bushd_line_follower_start(bushd_line_follower* follower, uint32_t increment, uint32_t longest,
                               uint32_t from) {
  bushd_line line;
  bushd_line_start(&line, increment, longest);
  bushd_line_go_to(&line, from);
  // What is missing to the next step is missing / 2N steps of the run (line.c).
  const uint32_t missing = 2u * (longest - line.value) - ((longest - increment) & 1u);
  const uint64_t missing_parts = (uint64_t)missing * 128u;
  const uint64_t parts = (missing_parts + increment - 1u) / increment;
  follower->increment = increment;
  follower->lead = increment - 1u - (uint32_t)(parts * increment - missing_parts);
  follower->due_step = from + 1u + (uint32_t)((parts - 1u) >> 8);
  follower->due_part = (uint8_t)(parts - 1u);
  const uint64_t apart_parts = (uint64_t)longest * 256u;
  const uint64_t apart = (apart_parts + increment - 1u) / increment;
  follower->apart_late = (uint32_t)(apart * increment - apart_parts);
  follower->apart_steps = (uint32_t)(apart >> 8);
  follower->apart_parts = (uint8_t)apart;
}

#ifndef BUSHD_OWN_LINE_FOLLOWER
uint8_t bushd_line_follower_make(bushd_line_follower* follower, const bushd_run_spans* spans,
                                 uint16_t bit) {
  uint8_t made = 0;
  while (true) {
    const uint32_t index = follower->due_step - spans->step;
    if (index >= spans->count) return made;
    if (index == spans->count - 1u && follower->due_part >= spans->parts) return made;
    spans->masks[bushd_run_span_slot(spans, (uint8_t)index, follower->due_part)] |= bit;
    bushd_line_follower_step(follower);
    ++made;
  }
}
#endif

// Of a quotient below 512. On an 8-bit MCU a whole division would not fit into a tick.
static uint16_t small_quotient(uint64_t numerator, uint32_t divisor) {
  uint64_t part = (uint64_t)divisor << 8;
  uint16_t quotient = 0;
  for (uint16_t bit = 1u << 8; bit != 0; bit = (uint16_t)(bit >> 1)) {
    if (numerator >= part) {
      numerator -= part;
      quotient |= bit;
    }
    part >>= 1;
  }
  return quotient;
}

// With c the place in parts, and j the step that is due,
//
//     256 j - N (C(j) - c) / L ,     before the first step not more than    2 N c / L .
//
// What is missing is at most a step, before the first one a step and a half.
uint8_t bushd_line_follower_fraction(const bushd_line_follower* follower, uint32_t longest,
                                     uint32_t step, uint8_t parts) {
  const uint32_t increment = follower->increment;
  const uint64_t at = ((uint64_t)(step - 1u) << 8) + parts;
  const uint64_t due = ((uint64_t)(follower->due_step - 1u) << 8) + follower->due_part + 1u;
  const uint64_t missing = (due - at) * increment - (increment - 1u - follower->lead);
  const uint16_t to_step = small_quotient(missing + longest - 1u, longest);
  const uint16_t fraction = to_step < 256u ? (uint16_t)(256u - to_step) : (uint16_t)0;
  const uint64_t apart = ((uint64_t)follower->apart_steps << 8) + follower->apart_parts;
  if (at >= apart) return (uint8_t)fraction;
  const uint16_t risen = small_quotient(at * increment * 2u, longest);
  return (uint8_t)(risen < fraction ? risen : fraction);
}
