#include "firmware/ports/lm3s6965/emission.h"

#include <stddef.h>

#include "firmware/ports/lm3s6965/board.h"
#include "firmware/ports/lm3s6965/clock.h"
#include "firmware/ports/lm3s6965/compare_output.h"
#include "firmware/ports/lm3s6965/emission_slots.h"
#include "firmware/ports/lm3s6965/interrupts.h"
#include "firmware/ports/lm3s6965/timer.h"

#define SLOT_TIMER TIMER(0)
#define TICK_TIMER TIMER(1)
// What the beginning of a tick and its last half slot may be late by, together.
#define MARGIN_CYCLES 250u
// What a timer is set to at least.
#define SHORTEST_CYCLES 40
// The end of a tick without steps: from its only half slot, in which the next tick is taken.
#define TAKE_CYCLES 500u

typedef struct emission_tick {
  const uint16_t* mask;  // of its slots
  const uint16_t* end;
  uint32_t half_slot;  // cycles
  uint32_t cycles;
  bool turns;       // DIR is to be latched
  uint8_t outputs;  // bushd_outputs
  bool has_compare;
  compare_edges compare;
} emission_tick;

// What becomes of the slot_buffer that the core has prepared.
typedef enum plane_state { PLANE_NONE, PLANE_WAITS, PLANE_TAKEN } plane_state;

// Used by the interrupts.
_Static_assert(offsetof(emission_slot_state, end) == SLOT_END, "as in emission_slots.S");
_Static_assert(offsetof(emission_slot_state, rest) == SLOT_REST, "as in emission_slots.S");
emission_slot_state emission_slot = {
    .timer = &TIMER_ICR(SLOT_TIMER), .step_low = &STEP_LOW, .step_high = &STEP_HIGH};
static emission_tick present;
static emission_tick silent;  // goes on when no slot_buffer is ready
static uint16_t held;         // its levels
static uint32_t next_start;
static bool common_dir_rests_high;

// Between them and the main loop.
static emission_tick next;
static volatile plane_state state;
static volatile bool begun;
static uint32_t begun_at;

// Used by the main loop.
static const bushd_slot_buffer* slot_buffer;
static uint16_t directions;  // as latched last
static uint32_t core_start;  // of the core's present tick
static uint32_t tick_ns;
static int32_t adjust_ns;      // of the next tick
static int32_t carry_ns;       // adjustments that came when the tick they were for had been taken
static uint32_t rest_ns;       // of a cycle, not yet given
static int32_t next_extra_ns;  // of `next`
static uint32_t next_rest_ns;

// Pulses are over: DIR may change. The current is wanted when the tick after the next is prepared.
void emission_take_next(void) {
  timer_stop(SLOT_TIMER);
  board_begin_current();
  if (state == PLANE_WAITS) {
    present = next;
    state = PLANE_TAKEN;
    if (present.turns) board_latch_directions();
  } else {
    held = present.outputs == BUSHD_OUTPUTS_LEVELS ? present.end[-1] : 0;
    silent.outputs = present.outputs;
    present = silent;
  }
  const int32_t left = clock_since(next_start, clock_now());
  timer_start(TICK_TIMER, TIMER_ONE_SHOT,
              (uint32_t)(left > SHORTEST_CYCLES ? left : SHORTEST_CYCLES));
}

// STEP rests high where `rest` says so; of phases nothing does.
static void put_steps(uint32_t mask) {
  mask ^= emission_slot.rest;
  STEP_LOW = mask & 0xFFu;
  STEP_HIGH = mask >> 8;
}

// As emission_half_slot, with the common DIR.
static void half_slot_common_dir(void) {
  *emission_slot.timer = 1;
  const uintptr_t at = emission_slot.cursor++;
  if ((at & 1u) == 0) {
    put_steps(*(const uint16_t*)at);
    return;
  }
  put_steps(0);
  const bool last = at + 1 == emission_slot.end;
  const uintptr_t next_slot = (at + 1 - (uintptr_t)present.mask) / sizeof present.mask[0];
  COMMON_DIR = (!last && next_slot % 2 != 0) != common_dir_rests_high ? ALL_PINS : 0;
  if (last) emission_take_next();
}

// As emission_half_slot, with levels instead of pulses.
static void half_slot_levels(void) {
  *emission_slot.timer = 1;
  const uintptr_t at = emission_slot.cursor++;
  if ((at & 1u) == 0) {
    put_steps(*(const uint16_t*)at);
  } else if (at + 1 == emission_slot.end) {
    emission_take_next();
  }
}

void emission_tick_begins(void) {
  static const vector kHalfSlot[] = {[BUSHD_OUTPUTS_PULSES] = emission_half_slot,
                                     [BUSHD_OUTPUTS_COMMON_DIR] = half_slot_common_dir,
                                     [BUSHD_OUTPUTS_LEVELS] = half_slot_levels};
  put_steps(*present.mask);
  vectors[EXTERNAL(IRQ_TIMER0A)] = kHalfSlot[present.outputs];
  timer_start(SLOT_TIMER, TIMER_PERIODIC, present.half_slot);
  timer_stop(TICK_TIMER);
  emission_slot.cursor = (uintptr_t)present.mask + 1;
  emission_slot.end = (uintptr_t)present.end;
  const uint32_t start = next_start;
  next_start = start + present.cycles;
  if (present.has_compare) compare_emit(&present.compare);
  if (state == PLANE_TAKEN && !begun) {
    begun_at = start;
    begun = true;
  }
}

static uint32_t half_slot_of(uint32_t cycles) {
  return (cycles - MARGIN_CYCLES) / (2u * EMISSION_SLOTS);
}

static emission_tick tick_of(const bushd_slot_buffer* of, uint32_t cycles) {
  const emission_tick tick = {.mask = of->step,
                              .end = of->step + EMISSION_SLOTS,
                              .half_slot = half_slot_of(cycles),
                              .cycles = cycles};
  return tick;
}

// A tick of one slot, in which nothing happens: the time is left to the main loop.
static emission_tick empty_tick(const uint16_t* mask, uint32_t cycles) {
  const emission_tick tick = {
      .mask = mask, .end = mask + 1, .half_slot = cycles - TAKE_CYCLES, .cycles = cycles};
  return tick;
}

static compare_edges compare_of(uint32_t cycles) {
  const uint32_t slot = 2u * half_slot_of(cycles);
  compare_edges edges = {.rises = slot_buffer->compare_rise != 0,
                         .falls = slot_buffer->compare_fall != 0};
  if (edges.rises) edges.rise = (slot_buffer->compare_rise - 1u) * slot;
  if (edges.falls) edges.fall = (slot_buffer->compare_fall - 1u) * slot;
  return edges;
}

// `next` from the slot_buffer and what is known of its length, unless it has been taken.
static void give(void) {
  const int32_t extra_ns = adjust_ns + carry_ns;
  const uint32_t length_ns = tick_ns + rest_ns + (uint32_t)extra_ns;
  const uint32_t cycles = length_ns / CYCLE_NS;
  emission_tick tick = slot_buffer->active != 0 ? tick_of(slot_buffer, cycles)
                                                : empty_tick(slot_buffer->step, cycles);
  tick.outputs = slot_buffer->outputs;
  tick.turns = slot_buffer->direction != directions;
  tick.has_compare = (slot_buffer->compare_rise | slot_buffer->compare_fall) != 0;
  if (tick.has_compare) tick.compare = compare_of(cycles);
  interrupts_off();
  if (state != PLANE_TAKEN) {
    next = tick;
    state = PLANE_WAITS;
    next_extra_ns = extra_ns;
    next_rest_ns = length_ns % CYCLE_NS;
  }
  interrupts_on();
}

void emission_set_rest(uint16_t step, bool common_dir) {
  interrupts_off();
  if (emission_slot.rest != step) {
    emission_slot.rest = step;
    put_steps(0);
  }
  common_dir_rests_high = common_dir;
  COMMON_DIR = common_dir ? ALL_PINS : 0;
  interrupts_on();
}

void emission_start(void) {
  timer_init(SLOT_TIMER);
  timer_init(TICK_TIMER);
  next_start = clock_now() + MARGIN_CYCLES;
  core_start = next_start;
  NVIC_ISER0 = 1u << IRQ_TIMER0A | 1u << IRQ_TIMER1A;
  present = silent;
  timer_start(TICK_TIMER, TIMER_ONE_SHOT, MARGIN_CYCLES);
}

void emission_ready(const bushd_slot_buffer* prepared) {
  slot_buffer = prepared;
  if (slot_buffer->direction != directions) board_shift_directions(slot_buffer->direction);
  give();
}

bool emission_begun(uint32_t* start) {
  if (!begun) return false;
  *start = begun_at;  // does not change while `begun` is set
  return true;
}

void emission_swap(void) {
  core_start = begun_at;
  directions = slot_buffer->direction;
  rest_ns = next_rest_ns;
  carry_ns += adjust_ns - next_extra_ns;
  adjust_ns = 0;
  interrupts_off();
  state = PLANE_NONE;
  begun = false;
  interrupts_on();
}

uint32_t emission_time_in_tick_ns(uint32_t time) {
  return (uint32_t)clock_since(time, core_start) * CYCLE_NS;
}

void emission_set_tick(uint32_t ns) {
  tick_ns = ns;
  const emission_tick tick = empty_tick(&held, ns / CYCLE_NS);
  interrupts_off();
  silent = tick;
  interrupts_on();
  if (state == PLANE_WAITS) give();
}

void emission_adjust_tick(int32_t ns) {
  adjust_ns = ns;
  if (state == PLANE_WAITS) give();
}
