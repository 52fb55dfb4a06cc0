// Times are counted in whole units and a rest of ns, as everywhere in a run; only what lies within
// the tick is turned into slots. With T units and -since_ns ns from the tick's start to a step, its
// place is
//
//     T x per_unit - since_ns x per_ns    in slots x 2^32
//
// per_unit is rounded up and per_ns down, so a place is never before the step, and after it by less
// than T + since_ns. The slots to a step are a multiple of 1 / q, where q is tick_ns / S without
// its common factors of two. So if 2^32 is more than q times that, no border of a slot lies
// between step and place: it tells the slot exactly (has_places). Otherwise, with t the time of a
// step in ns from the tick's start,
//
//     t x slot_count  =  slot x tick_ns + rest,   0 <= rest < tick_ns
//
// is carried from step to step by additions, and the slot is estimated by the tick's reciprocal: on
// an 8-bit MCU divisions would not fit into a tick.
#include "engine/run_slots.h"

#include "engine/run_parts.h"
#include "engine/slots.h"

#if BUSHD_MAX_SLOTS <= 128
typedef uint32_t scaled_ns;    // 20 ms x 128 slots
typedef uint16_t scaled_high;  // without the low 16 bits
#else
typedef uint64_t scaled_ns;
typedef uint32_t scaled_high;
#endif

// Counts steps that lie in one part of the run.
static void make_steps(bushd_run* run, uint8_t steps) {
  bushd_run_count(run, steps);
  if (run->lead_delay != 0) {
    run->lead_delay = 0;
  } else if (run->accel_at < run->accel_end) {
    run->accel_at = (uint16_t)(run->accel_at + steps);
  } else if (run->cruise_left != 0) {
    run->cruise_left -= steps;
  } else {
    bushd_run_set_decel(run, (uint16_t)(run->decel_left - steps));
  }
}

// What is cut off makes the estimate too small: by at most two, unless the reciprocal is clipped.
static inline uint16_t whole_slots(scaled_ns* rest, const bushd_run_tick* tick) {
  const uint32_t high = (scaled_high)(*rest >> 16);
  uint16_t slots = (uint16_t)(high * tick->reciprocal >> 16);
  *rest -= (scaled_ns)tick->tick_ns * slots;
  for (; *rest >= tick->tick_ns; *rest -= tick->tick_ns) ++slots;
  return slots;
}

// 256 numerator / divisor with the bits of `low` behind the numerator's, rounded down.
// Precondition: numerator < divisor.
static uint8_t share(uint32_t numerator, uint8_t low, uint32_t divisor) {
  uint8_t quotient = 0;
  for (uint8_t bit = 0x80; bit != 0; bit = (uint8_t)(bit >> 1)) {
    const bool carry = numerator >> 31 != 0;
    numerator = numerator << 1 | ((low & bit) != 0);
    if (carry || numerator >= divisor) {
      numerator -= divisor;
      quotient |= bit;
    }
  }
  return quotient;
}

bushd_run_tick bushd_run_tick_of(uint32_t tick_ns, const bushd_table* table, uint16_t slot_count) {
  const uint32_t unit_ns = table->time_unit_ns;
  const uint32_t reciprocal = UINT32_MAX / tick_ns;
  const uint64_t unit_slots = (uint64_t)unit_ns * slot_count;
  bushd_run_tick tick;
  tick.tick_ns = tick_ns;
  tick.unit_ns = unit_ns;
  tick.units = tick_ns / unit_ns;
  tick.rest_ns = tick_ns % unit_ns;
  tick.slot_count = slot_count;
  tick.cruise = table->cruise;
  tick.reciprocal = reciprocal < UINT16_MAX ? (uint16_t)reciprocal : UINT16_MAX;
  uint32_t q = tick_ns;
  for (uint16_t s = slot_count; ((q | s) & 1u) == 0; s = (uint16_t)(s >> 1)) q >>= 1;
  // The first step lies up to a unit beyond units - 1.
  tick.has_places = tick.units < UINT16_MAX && unit_ns < UINT32_MAX - UINT16_MAX &&
                    unit_slots >> 32 == 0 && tick.units + 1u + unit_ns < UINT32_MAX / q;
  tick.is_short = tick.has_places && tick.rest_ns == 0;
  tick.per_unit = tick.per_ns = tick.per_cruise = 0;
  if (tick.has_places) {
    tick.per_unit = ((unit_slots << 32) + tick_ns - 1u) / tick_ns;
    tick.per_ns = ((uint64_t)slot_count << 32) / tick_ns;
    tick.per_cruise = tick.per_unit * table->cruise;
  }
  return tick;
}

#ifndef BUSHD_OWN_RUN_PARTS
void bushd_run_move_place(uint64_t* place, const uint64_t* rate, uint16_t times) {
  *place += *rate * times;
}

// What is rounded is rounded up: no place lies before the tick.
void bushd_run_take_span(bushd_run_span* span, uint64_t* place, const uint64_t* rate,
                         uint16_t times) {
  const uint64_t length = *rate * times;
  const uint64_t most_rest = (UINT64_C(1) << (32 - BUSHD_SPAN_SHIFT)) - 1u;
  span->part = (uint32_t)(length >> (40 - BUSHD_SPAN_SHIFT)) + 1u;
  span->first = (uint32_t)((*place + most_rest) >> (32 - BUSHD_SPAN_SHIFT)) + span->part;
  *place += length;
}

uint8_t bushd_run_share(uint16_t numerator, uint8_t low, uint16_t divisor) {
  uint8_t quotient = 0;
  for (uint8_t bit = 0x80; bit != 0; bit = (uint8_t)(bit >> 1)) {
    const bool carry = numerator >> 15 != 0;
    numerator = (uint16_t)(numerator << 1 | ((low & bit) != 0));
    if (carry || numerator >= divisor) {
      numerator = (uint16_t)(numerator - divisor);
      quotient |= bit;
    }
  }
  return quotient;
}

static inline void make_due(bushd_run_part* part) {
  const uint16_t slot = (uint16_t)(part->place >> 32);
  part->masks[slot < part->last_slot ? slot : part->last_slot] |= part->bit;
  part->since = (uint16_t)(part->since - part->delay);
  --part->left;
}

// As those of a small MCU do, these read the rate before they know whether a step follows.
// Volatile, so that a sanitizer sees it.
static inline uint64_t rate_of(const bushd_run_part* part) {
  return *(const volatile uint64_t*)part->rate;
}

void bushd_run_make_on_side(bushd_run_part* part, bool down) {
  const uint64_t rate = rate_of(part);
  while (true) {
    make_due(part);
    if (part->left == 0) return;
    part->delay = down ? *--part->code : *++part->code;
    if (part->since < part->delay) return;
    part->place += rate * part->delay;
  }
}

void bushd_run_make_evenly(bushd_run_part* part) {
  const uint64_t rate = rate_of(part);
  while (true) {
    make_due(part);
    if (part->left == 0 || part->since < part->delay) return;
    part->place += rate;
  }
}
#endif

static inline uint8_t at_most(uint32_t steps) {
  return steps < UINT8_MAX ? (uint8_t)steps : UINT8_MAX;
}

// Makes the steps of the part that the step which is due belongs to. Returns how many were made; a
// tick has fewer than a byte holds.
static uint8_t make_part(bushd_run* run, const bushd_run_tick* tick, bushd_run_part* part) {
  const bushd_table* table = run->table;
  uint8_t made = 1;
  if (run->lead_delay != 0) {
    part->left = 1;
    part->rate = &tick->per_unit;  // read, though no step follows
    bushd_run_make_evenly(part);
    run->lead_delay = 0;
  } else if (run->accel_at < run->accel_end) {
    const uint8_t left = part->left = at_most((uint32_t)(run->accel_end - run->accel_at));
    part->code = &table->accel.code[run->accel_at];
    part->rate = &tick->per_unit;
    bushd_run_make_on_side(part, false);
    made = (uint8_t)(left - part->left);
    run->accel_at = (uint16_t)(run->accel_at + made);
  } else if (run->cruise_left != 0) {
    const uint8_t left = part->left = at_most(run->cruise_left);
    uint64_t rate = 0;
    part->rate = &tick->per_cruise;
    if (run->cruise != tick->cruise) {
      bushd_run_move_place(&rate, &tick->per_unit, (uint16_t)run->cruise);
      part->rate = &rate;
    }
    bushd_run_make_evenly(part);
    made = (uint8_t)(left - part->left);
    run->cruise_left -= made;
  } else {
    const uint8_t left = part->left =
        at_most((uint32_t)(run->decel_left - bushd_run_decel_end(run)));
    part->code = &table->decel.code[run->decel_left - 1u];
    part->rate = &tick->per_unit;
    bushd_run_make_on_side(part, true);
    made = (uint8_t)(left - part->left);
    bushd_run_set_decel(run, (uint16_t)(run->decel_left - made));
  }
  bushd_run_count(run, made);
  return made;
}

// Preconditions: the first step is due, of `delay`; at the tick's end `since` units have passed.
// Not inlined, as the next one: in one function they would cost each other their registers.
__attribute__((noinline)) static int16_t make_by_places(bushd_run* run, const bushd_run_tick* tick,
                                                        uint16_t since, uint16_t delay,
                                                        uint16_t bit, uint16_t* masks) {
  bushd_run_part part;
  part.place = 0;
  if (run->since_ns != 0) {
    uint64_t high = 0;
    bushd_run_move_place(&part.place, &tick->per_ns, (uint16_t)run->since_ns);
    bushd_run_move_place(&high, &tick->per_ns, (uint16_t)(run->since_ns >> 16));
    part.place = 0 - (part.place + (high << 16));
  }
  bushd_run_move_place(&part.place, &tick->per_unit, (uint16_t)(delay - run->since));
  part.masks = masks;
  part.bit = bit;
  part.last_slot = (uint16_t)(tick->slot_count - 1u);
  part.since = since;
  part.delay = delay;
  int16_t steps = 0;
  while (true) {
    steps = (int16_t)(steps + make_part(run, tick, &part));
    if (part.left != 0) break;
    const bushd_delay next = bushd_run_delay(run);
    if (next == 0 || part.since < next) break;
    part.delay = (uint16_t)next;
    bushd_run_move_place(&part.place, &tick->per_unit, part.delay);
  }
  run->since = part.since;
  return steps;
}

// As above, where `since` may be beyond 16 bits.
__attribute__((noinline)) static int16_t make_by_rests(bushd_run* run, const bushd_run_tick* tick,
                                                       bushd_since since, bushd_delay delay,
                                                       uint16_t bit, uint16_t* masks) {
  const uint16_t slot_count = tick->slot_count;
  const scaled_ns unit_slots = (scaled_ns)tick->unit_ns * slot_count;
  scaled_ns rest = (scaled_ns)((delay - run->since) * tick->unit_ns - run->since_ns) * slot_count;
  int16_t steps = 0;
  uint16_t slot = 0;
  while (true) {
    slot = (uint16_t)(slot + whole_slots(&rest, tick));
    masks[slot < slot_count ? slot : slot_count - 1u] |= bit;
    ++steps;
    make_steps(run, 1);
    since -= delay;
    delay = bushd_run_delay(run);
    if (delay == 0 || since < delay) break;
    rest += (scaled_ns)delay * unit_slots;
  }
  run->since = since;
  return steps;
}

// A tick's rest that does not make whole units. Returns those that it makes with what has passed.
static uint8_t carry_rest(const bushd_run* run, const bushd_run_tick* tick, uint32_t* since_ns) {
  *since_ns = run->since_ns + tick->rest_ns;
  if (*since_ns >= tick->rest_ns && *since_ns < tick->unit_ns) return 0;
  *since_ns -= tick->unit_ns;
  return 1;
}

__attribute__((noinline)) static int16_t make_any(bushd_run* run, const bushd_run_tick* tick,
                                                  bushd_delay delay, uint16_t bit,
                                                  uint16_t* masks) {
  bushd_since since = run->since + tick->units;
  uint32_t since_ns = run->since_ns;
  if (tick->rest_ns != 0) since += carry_rest(run, tick, &since_ns);
  int16_t steps = 0;
  if (since < delay) {
    run->since = since;
  } else if (tick->has_places && since <= UINT16_MAX) {
    steps = make_by_places(run, tick, (uint16_t)since, (uint16_t)delay, bit, masks);
  } else {
    steps = make_by_rests(run, tick, since, delay, bit, masks);
  }
  run->since_ns = since_ns;
  return steps;
}

int16_t bushd_run_slots(bushd_run* run, const bushd_run_tick* tick, uint16_t bit, uint16_t* masks) {
  const bushd_delay delay = bushd_run_delay(run);
  if (delay == 0) return 0;
  // Mostly 16 bits will do.
  const uint16_t before = (uint16_t)run->since;
  const uint16_t since = (uint16_t)(before + (uint16_t)tick->units);
  int16_t steps = 0;
  if (!tick->is_short || run->since >> 16 != 0 || since < before) {
    steps = make_any(run, tick, delay, bit, masks);
  } else if (since < delay) {
    run->since = since;
  } else {
    steps = make_by_places(run, tick, since, (uint16_t)delay, bit, masks);
  }
  return run->direction < 0 ? (int16_t)-steps : steps;
}

void bushd_run_walk_begin(bushd_run_walk* walk, const bushd_run* run, const bushd_run_tick* tick,
                          bushd_run_spans* spans, uint32_t step, uint16_t* masks) {
  spans->step = step;
  spans->count = 0;
  spans->parts = 256;
  spans->masks = masks;
  spans->slot_count = tick->slot_count;
  walk->tick = tick;
  walk->since = (uint32_t)run->since + tick->units;
  walk->since_ns = run->since_ns;
  if (tick->rest_ns != 0) walk->since += carry_rest(run, tick, &walk->since_ns);
  walk->over = false;
  walk->place = 0;
  if (!tick->has_places) return;
  const bool later = bushd_run_begins_later(run);
  const uint16_t units = (uint16_t)(later ? 0u - (uint32_t)run->since : (uint32_t)run->since);
  bushd_run_move_place(&walk->place, &tick->per_unit, units);
  if (!later) walk->place = 0 - walk->place;
  if (run->since_ns == 0) return;
  uint64_t low = 0;
  uint64_t high = 0;
  bushd_run_move_place(&low, &tick->per_ns, (uint16_t)run->since_ns);
  bushd_run_move_place(&high, &tick->per_ns, (uint16_t)(run->since_ns >> 16));
  walk->place -= low + (high << 16);
}

static uint32_t place_of(uint64_t ns, const bushd_run_tick* tick, uint32_t parts) {
  const uint64_t length = (uint64_t)tick->tick_ns * parts;
  const uint64_t slots = ns * tick->slot_count;
  const uint64_t rest = (slots % length << BUSHD_SPAN_SHIFT) + length - 1u;
  return (uint32_t)(slots / length << BUSHD_SPAN_SHIFT) + (uint32_t)(rest / length);
}

// By divisions. At the tick's end the step has run for `since` units and walk->since_ns.
__attribute__((noinline)) static void divide_span(const bushd_run_walk* walk, uint32_t since,
                                                  uint16_t delay, bushd_run_span* span) {
  const bushd_run_tick* tick = walk->tick;
  const int64_t ns = (int64_t)tick->tick_ns - (int64_t)since * tick->unit_ns - walk->since_ns;
  const uint32_t begin =
      ns < 0 ? 0u - place_of((uint64_t)-ns, tick, 1) + 1u : place_of((uint64_t)ns, tick, 1);
  span->part = place_of((uint64_t)delay * tick->unit_ns, tick, 256);
  span->first = begin + span->part;
}

// Up to `most` (>= 1) steps of one part of the run, whose delays are every `stride`th code. Returns
// how many of them are over at the tick's end.
static uint8_t take_spans(bushd_run_walk* walk, const uint16_t* code, int8_t stride, uint8_t most,
                          bushd_run_span* span) {
  const bushd_run_tick* tick = walk->tick;
  uint32_t since = walk->since;
  uint8_t made = 0;
  do {
    const uint16_t delay = *code;
    if (tick->has_places) {
      bushd_run_take_span(span, &walk->place, &tick->per_unit, delay);
    } else {
      divide_span(walk, since, delay, span);
    }
    if (since < delay) {
      walk->over = true;
      break;
    }
    since -= delay;
    code += stride;
    ++span;
  } while (++made != most);
  walk->since = since;
  return made;
}

// The part of the run that is next: `left` steps, 0 if the run is done, whose delays are every
// `stride`th code, or all `same` if there is none.
typedef struct part_codes {
  const uint16_t* code;
  uint32_t left;
  uint16_t same;
  int8_t stride;
} part_codes;

static part_codes codes_of(const bushd_run* run) {
  const uint16_t* const accel = run->table->accel.code;
  const uint16_t* const decel = run->table->decel.code;
  if (run->lead_delay != 0) return (part_codes){NULL, 1, (uint16_t)run->lead_delay, 0};
  if (run->accel_at < run->accel_end) {
    return (part_codes){accel + run->accel_at, (uint32_t)(run->accel_end - run->accel_at), 0, 1};
  }
  if (run->cruise_left != 0) return (part_codes){NULL, run->cruise_left, (uint16_t)run->cruise, 0};
  if (run->decel_left != 0) {
    const uint16_t left = (uint16_t)(run->decel_left - bushd_run_decel_end(run));
    return (part_codes){decel + run->decel_left - 1, left, 0, -1};
  }
  return (part_codes){decel, 0, 0, 0};
}

static void walk_part(bushd_run_walk* walk, bushd_run* run, bushd_run_spans* spans) {
  const part_codes codes = codes_of(run);
  const uint8_t room = (uint8_t)(BUSHD_RUN_SPANS - spans->count);
  const uint8_t most = codes.left < room ? (uint8_t)codes.left : room;
  if (most == 0) {
    walk->over = true;
    return;
  }
  const uint16_t* const code = codes.code != NULL ? codes.code : &codes.same;
  const uint8_t made = take_spans(walk, code, codes.stride, most, &spans->span[spans->count]);
  if (made != 0) make_steps(run, made);
  spans->count = (uint8_t)(spans->count + made + (walk->over ? 1 : 0));
}

bool bushd_run_walk_next(bushd_run_walk* walk, bushd_run* run, bushd_run_spans* spans) {
  // Past the steps of the last call.
  spans->step += spans->count;
  if (spans->parts != 256u) --spans->step;
  spans->count = 0;
  spans->parts = 256;
  if (walk->over) return false;
  while (!walk->over && spans->count < BUSHD_RUN_SPANS) walk_part(walk, run, spans);
  if (walk->over) {
    run->since = walk->since;
    run->since_ns = walk->since_ns;
    bushd_run_note_fraction(run);
    if (!bushd_run_done(run)) spans->parts = run->fraction;
  }
  return spans->count != 0;
}

void bushd_run_note_fraction(bushd_run* run) {
  const bushd_delay delay = bushd_run_delay(run);
#if BUSHD_SLOW_RUNS
  if (!bushd_delay_is_code(delay)) {
    const uint32_t unit_ns = run->table->time_unit_ns;
    const uint64_t rest = (uint64_t)run->since_ns * 256u / unit_ns;
    run->fraction = (uint8_t)((run->since * 256u + rest) / delay);
    return;
  }
#endif
  uint8_t low = 0;
  if (run->since_ns != 0) low = share(run->since_ns, 0, run->table->time_unit_ns);
  // Less than the delay, since the step that runs is not over.
  run->fraction =
      delay == 0 ? (uint8_t)0 : bushd_run_share((uint16_t)run->since, low, (uint16_t)delay);
}
