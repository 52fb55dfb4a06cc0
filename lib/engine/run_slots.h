// A run's steps exact to a slot, where no displacements stand between the table and the outputs.
#ifndef BUSHD_ENGINE_RUN_SLOTS_H
#define BUSHD_ENGINE_RUN_SLOTS_H

#include <stdbool.h>
#include <stdint.h>

#include "engine/run.h"
#include "engine/slots.h"

#ifdef __cplusplus
extern "C" {
#endif

// A tick in the terms of a table. Made once for many ticks: it takes divisions.
typedef struct bushd_run_tick {
  uint32_t tick_ns;
  uint32_t unit_ns;
  uint32_t units;
  uint32_t rest_ns;
  uint16_t slot_count;
  uint16_t reciprocal;  // of tick_ns, x 2^32
  // Slots in a unit, rounded up, and in a ns, rounded down, x 2^32. `has_places`: they tell the
  // slot of every step exactly.
  uint64_t per_unit;
  uint64_t per_ns;
  uint64_t per_cruise;  // in a delay of `cruise`
  uint16_t cruise;
  bool has_places;
  bool is_short;  // that, and a whole number of units
} bushd_run_tick;
//   slot_count  BUSHD_MIN_SLOTS..BUSHD_MAX_SLOTS
// Precondition: tick_ns is at most BUSHD_MAX_TICK_NS.
bushd_run_tick bushd_run_tick_of(uint32_t tick_ns, const bushd_table* table, uint16_t slot_count);
// Whether it is that of this table and length. O(1).
static inline bool bushd_run_tick_fits(const bushd_run_tick* tick, uint32_t tick_ns,
                                       const bushd_table* table) {
  return tick->unit_ns == table->time_unit_ns && tick->cruise == table->cruise &&
         tick->tick_ns == tick_ns;
}

// Makes the next tick of a run: sets `bit` in the masks of the slots floor(t x slot_count /
// tick_ns) for the steps at the times t from the tick's start; one at exactly its end falls into
// its last slot. Returns the signed number of steps, 0 when the run is done. The run stands at the
// tick's end afterwards, as bushd_run_expand_coarse would leave it: ticks of both kinds may be
// mixed.
//   masks  slot_count entries
// Precondition: as for bushd_run_expand_*; then no two steps share a slot. `tick` is of the
// run's table. It does not brake (bushd_run_retarget). O(slots + steps), no division.
int16_t bushd_run_slots(bushd_run* run, const bushd_run_tick* tick, uint16_t bit, uint16_t* masks);

// Steps of a tick that follow each other on one part of a run. A small MCU may link the four
// functions of its own, and bushd_run_take_span (BUSHD_OWN_RUN_PARTS).
typedef struct bushd_run_part {
  uint64_t place;        // of the step that is due, in slots from the tick's start x 2^32
  const uint64_t* rate;  // places in a unit; read even for a single step
  const uint16_t* code;  // its delay; a side's only
  uint16_t* masks;
  uint16_t bit;
  uint16_t last_slot;
  uint16_t since;  // units from the step before it to the tick's end
  uint16_t delay;  // <= since
  uint8_t left;    // steps of the part, at least this one
} bushd_run_part;
// *place += times x *rate, modulo 2^40 at least.
void bushd_run_move_place(uint64_t* place, const uint64_t* rate, uint16_t times);
// Makes the step that is due and those that follow it within the tick and the part. Along a side of
// the table, towards its fast end or `down` from there, or with the same delay, of which `rate`
// then is the whole.
void bushd_run_make_on_side(bushd_run_part* part, bool down);
void bushd_run_make_evenly(bushd_run_part* part);
// 256 numerator / divisor with the bits of `low` behind the numerator's, rounded down.
// Precondition: numerator < divisor.
uint8_t bushd_run_share(uint16_t numerator, uint8_t low, uint16_t divisor);

// A tick of a run step by step, for what follows it (engine/line_follower.h). Places are slots from
// the tick's start: x 2^32, as in bushd_run_part, or x 2^BUSHD_SPAN_SHIFT in 32 bits; modulo 2^40
// at least, and modulo 2^32.
#if BUSHD_MAX_SLOTS <= 128
#define BUSHD_SPAN_SHIFT 24
#else
#define BUSHD_SPAN_SHIFT 23
#endif
// A step of the run.
typedef struct bushd_run_span {
  uint32_t first;  // when the first of its 256 parts is over
  uint32_t part;   // and for each one more
} bushd_run_span;
// Some that follow each other, and where what follows them goes.
#define BUSHD_RUN_SPANS 12u
typedef struct bushd_run_spans {
  uint32_t step;   // number of the first one, in the caller's count
  uint16_t parts;  // of the last one that are over at the tick's end; 256: it ends in this tick
  uint16_t* masks;
  uint16_t slot_count;  // of them
  uint8_t count;
  bushd_run_span span[BUSHD_RUN_SPANS];
} bushd_run_spans;
typedef struct bushd_run_walk {
  const bushd_run_tick* tick;
  uint64_t place;  // where the step that is next begins
  uint32_t since;  // units from there to the tick's end
  uint32_t since_ns;
  bool over;  // no step that is next begins within the tick
} bushd_run_walk;
// At the beginning of the next tick, before any step. As bushd_run_slots; the run is not done, and
// its delays are codes (engine/table.h). The step that runs, or is next, has the number `step`.
void bushd_run_walk_begin(bushd_run_walk* walk, const bushd_run* run, const bushd_run_tick* tick,
                          bushd_run_spans* spans, uint32_t step, uint16_t* masks);
// The steps that run in the tick, as many as there is room for: true as long as there are some.
// Then the run stands at the tick's end, and `step` is that of the step that runs there. O(spans),
// no division.
bool bushd_run_walk_next(bushd_run_walk* walk, bushd_run* run, bushd_run_spans* spans);
// What begins at *place and lasts `times` x *rate; *place moves to its end, as by
// bushd_run_move_place.
void bushd_run_take_span(bushd_run_span* span, uint64_t* place, const uint64_t* rate,
                         uint16_t times);
// The slot of what falls at the end of part `part` of a step, of those that are over: that in which
// this time lies, to within a thousandth of a slot; the last one at the tick's end. As
// bushd_run_slots has it for the run's own steps.
static inline uint16_t bushd_run_span_slot(const bushd_run_spans* spans, uint8_t index,
                                           uint8_t part) {
  const bushd_run_span* span = &spans->span[index];
  const uint16_t slot = (uint16_t)((span->first + span->part * part) >> BUSHD_SPAN_SHIFT);
  return slot < spans->slot_count ? slot : (uint16_t)(spans->slot_count - 1u);
}

// Makes the run's fraction what bushd_run_expand_fine would have left, so that ticks of that kind
// may follow. Precondition: it stands at the end of a tick made by bushd_run_slots. No division.
void bushd_run_note_fraction(bushd_run* run);

#ifdef __cplusplus
}
#endif
#endif
