#include "engine/line_follower.h"

#include "engine/line.h"

// *rest x 2^bits / divisor, rounded down; *rest becomes what remains. On an 8-bit MCU a division of
// more than 32 bits takes longer than all that the start of a line needs by this. Precondition:
// *rest < divisor < 2^31.
static uint32_t divide_on(uint32_t* rest, uint32_t divisor, uint8_t bits) {
  uint32_t quotient = 0;
  for (; bits > 0; --bits) {
    *rest <<= 1;
    quotient <<= 1;
    if (*rest >= divisor) {
      *rest -= divisor;
      quotient |= 1u;
    }
  }
  return quotient;
}

uint16_t bushd_line_share(uint32_t increment, uint32_t longest) {
  return increment == longest ? UINT16_MAX : (uint16_t)divide_on(&increment, longest, 16);
}

void bushd_line_follower_start(bushd_line_follower* follower, uint32_t increment, uint32_t longest,
                               uint32_t from) {
  bushd_line line;
  bushd_line_start(&line, increment, longest);
  if (from != 0) bushd_line_go_to(&line, from);
  follower->increment = increment;
  // What is missing to the next step is missing / 2N steps of the run (line.c), that is 128 times
  // as many parts. Rounded up and less 1 it is rounded down, but where nothing was to be rounded.
  const uint32_t missing = 2u * (longest - line.value) - ((longest - increment) & 1u);
  uint32_t rest = missing % increment;
  const uint32_t halves = missing / increment;
  follower->due_step = from + 1u + (halves >> 1);
  follower->due_part = (uint8_t)(halves << 7 | divide_on(&rest, increment, 7));
  follower->lead = increment - 1u;
  if (rest != 0) {
    follower->lead -= increment - rest;
  } else if (follower->due_part-- == 0) {
    --follower->due_step;
  }
  rest = longest % increment;
  follower->apart_steps = longest / increment;
  follower->apart_parts = (uint8_t)divide_on(&rest, increment, 8);
  follower->apart_late = 0;
  if (rest != 0) {
    follower->apart_late = increment - rest;
    if (++follower->apart_parts == 0) ++follower->apart_steps;
  }
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

// A quotient below 512, bit by bit. On an 8-bit MCU a whole division would not fit into a tick.
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
