#include "firmware/ports/atmega2560/emission.h"

#include <avr/interrupt.h>
#include <board.h>
#include <stddef.h>
#include <util/atomic.h>

#include "firmware/ports/atmega2560/clock.h"
#include "firmware/ports/atmega2560/emission_slots.h"

// From a slot's beginning to its compare B. Pulses are to last 2.5 us, 40 cycles: A's edge comes 11
// cycles after its compare, and up to 35 later if another interrupt is being served; B's 4 after
// its own.
#define PULSE_END_CYCLES 82u
// To compare C, where timer 1 has one: B has been served.
#define CHANGE_CYCLES 92u
// Until the first slot.
#define START_CYCLES 400u
// From a tick's start until emission_begun says so, at most: 92 to compare C, 60 of its interrupt,
// 59 with interrupts off, and what other interrupts take meanwhile, 78 for two slots and 60 for a
// byte each way. The chopper takes 17 %.
#define BEGINNING_CYCLES 512u
// A tick without steps: its last slot, and how many of them there are at most. The longest tick
// is one of BUSHD_MAX_TICK_NS that is nearly doubled to come into step with the bus.
#define SHORT_SLOT_CYCLES 256u
#define MAX_EMPTY_SLOTS 11u
#define MOST_CYCLES (2ul * BUSHD_MAX_TICK_NS / 1000ul * CYCLES_PER_US)
_Static_assert(MOST_CYCLES / (MAX_EMPTY_SLOTS - 1u) < UINT16_MAX, "a slot is counted in 16 bits");

_Static_assert(offsetof(emission_tick, mask) == TICK_MASK, "as in emission_slots.S");
_Static_assert(offsetof(emission_tick, mark) == TICK_MARK, "as in emission_slots.S");
_Static_assert(offsetof(emission_tick, end) == TICK_END, "as in emission_slots.S");
_Static_assert(offsetof(emission_tick, top) == TICK_TOP, "as in emission_slots.S");
_Static_assert(offsetof(emission_tick, last_top) == TICK_LAST_TOP, "as in emission_slots.S");
_Static_assert(offsetof(emission_tick, direction) == TICK_DIRECTION, "as in emission_slots.S");
_Static_assert(offsetof(emission_tick, cycles) == TICK_CYCLES, "as in emission_slots.S");
_Static_assert(offsetof(emission_tick, begun) == TICK_BEGUN, "as in emission_slots.S");

volatile uint8_t emission_next;
volatile uint8_t emission_taken;
EMISSION_TICKS emission_tick emission_silent;  // goes on when no slot_buffer is ready
volatile uint16_t emission_last_top;
volatile uint8_t emission_committed;
uint32_t emission_begun_at;
uint32_t emission_next_start;

// The masks of ticks of few slots: where STEP rests, or the levels that the slot_buffer before has
// left.
static uint16_t idle_masks[MAX_EMPTY_SLOTS];

// A tick, and what its length is made of.
typedef struct prepared_tick {
  emission_tick tick;
  uint16_t residue;  // 1/1000 cycles that it is too short
  int32_t extra_ns;  // longer than a plain tick
} prepared_tick;

// Used by the main loop.
EMISSION_TICKS static prepared_tick prepared[2];
static prepared_tick* given = prepared;      // waits or was taken last
static const bushd_slot_buffer* next_plane;  // NULL: the core's present tick has the last one
// The length of a tick without adjustment, from residue 0.
static uint32_t plain_cycles;
static uint16_t plain_residue;
static uint32_t core_start;  // of the core's present tick
static int32_t adjust_ns;    // of the next tick
static int32_t carry_ns;     // adjustments that came when the tick they were for had begun
static uint16_t residue;
static uint32_t given_start;  // of next_plane's tick

static void set_masks(emission_tick* tick, const uint16_t* masks, uint8_t slots) {
  tick->mask = masks;
  tick->mark = (uint8_t)(uintptr_t)(masks + 1);
  tick->end = (uint8_t)(uintptr_t)(masks + slots);
}

static uint8_t begun_flags(uint8_t outputs) {
  const uint8_t flags = 1 << TICK_CHANGES;
  if (outputs == BUSHD_OUTPUTS_LEVELS) return flags | 1 << TICK_SPECIAL | 1 << TICK_LEVELS;
  if (outputs == BUSHD_OUTPUTS_COMMON_DIR) return flags | 1 << TICK_SPECIAL | 1 << TICK_COMMON;
  return board_rest() != 0 ? flags | 1 << TICK_SPECIAL : flags;
}

static void set_plane(emission_tick* tick, const bushd_slot_buffer* slot_buffer, uint32_t cycles) {
  // By 128; shifting bit by bit takes longer.
  const uint16_t slot = (uint16_t)((cycles << 1) >> 8);
  set_masks(tick, slot_buffer->step, EMISSION_SLOTS);
  tick->direction = slot_buffer->direction;
  tick->top = (uint16_t)(slot - 1u);
  tick->last_top = (uint16_t)(tick->top + (uint16_t)(cycles % EMISSION_SLOTS));
  tick->cycles = cycles;
  tick->begun = begun_flags(slot_buffer->outputs);
}

// Gives a tick few slots, so that the time is left to the main loop. The last one is as short as
// may be: in it the next tick is taken.
static void set_empty(emission_tick* tick, uint16_t direction, uint8_t begun, uint32_t cycles) {
  const uint32_t body = cycles - SHORT_SLOT_CYCLES;
  // Not divided but where ticks are so long that it does not matter.
  uint8_t long_slots = 1;
  uint32_t slot = body;
  if (body > 8 * (uint32_t)UINT16_MAX) {
    long_slots = MAX_EMPTY_SLOTS - 1u;
    slot = body / long_slots;
  } else if (body > UINT16_MAX) {
    long_slots = 8;
    slot = body >> 3;
  }
  set_masks(tick, idle_masks, (uint8_t)(long_slots + 1u));
  tick->direction = direction;
  tick->top = (uint16_t)(slot - 1u);
  tick->last_top = (uint16_t)(SHORT_SLOT_CYCLES - 1u + (uint16_t)(body - slot * long_slots));
  tick->cycles = cycles;
  tick->begun = begun;
}

// The cycles that the tick is longer or shorter than a plain one; `parts`, in 1/1000, is what is
// left.
__attribute__((noinline)) static int32_t split(int32_t* parts) {
  int32_t cycles = *parts / 1000;
  if (cycles * 1000 > *parts) --cycles;
  *parts -= cycles * 1000;
  return cycles;
}

// Returns the tick's cycles.
static uint32_t set_length(prepared_tick* next) {
  uint32_t cycles = plain_cycles;
  const int32_t extra_ns = adjust_ns + carry_ns;
  next->extra_ns = extra_ns;
  uint16_t parts = plain_residue + residue;
  if (extra_ns != 0) {
    int32_t all = extra_ns * (int32_t)CYCLES_PER_US + parts;
    cycles += (uint32_t)split(&all);
    parts = (uint16_t)all;
  } else if (parts >= 1000) {
    ++cycles;
    parts -= 1000;
  }
  next->residue = parts;
  return cycles;
}

static inline uint8_t name_of(const emission_tick* tick) {
  return (uint8_t)(uintptr_t)tick;
}

// `again`: in place of the one that waits; not if it was taken. Asked for at rest only.
static void give(bool again) {
  prepared_tick* const next = given == prepared ? prepared + 1 : prepared;
  const uint32_t cycles = set_length(next);
  // Levels are written anew in every slot.
  if (next_plane->active != 0 || next_plane->outputs == BUSHD_OUTPUTS_LEVELS) {
    set_plane(&next->tick, next_plane, cycles);
  } else {
    set_empty(&next->tick, next_plane->direction, begun_flags(BUSHD_OUTPUTS_PULSES), cycles);
  }
  const uint8_t name = name_of(&next->tick);
  if (again) {
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
      if (emission_next == name_of(&emission_silent)) return;
      emission_next = name;
    }
  } else {
    emission_next = name;
  }
  given = next;
}

void emission_start(void) {
  emission_taken = name_of(&emission_silent);
  emission_set_registers(&emission_silent);
  GPIOR0 = 1 << TICK_IS_NEXT | begun_flags(BUSHD_OUTPUTS_PULSES);
  OCR1A = START_CYCLES - 1u;
  OCR1B = PULSE_END_CYCLES;
#ifdef OCR1C
  OCR1C = CHANGE_CYCLES;
#endif
  TCNT1 = 0;
  TCCR1A = 0;
  core_start = emission_next_start = clock_now() + START_CYCLES;
  TCCR1B = 1 << WGM12 | 1 << CS10;
  while (TCNT1 <= CHANGE_CYCLES) {
  }
  TIFR1 = BOARD_SLOT_FLAGS;
  TIMSK1 = BOARD_SLOT_INTERRUPTS;
}

// Where nothing moves: no pulse begins or ends meanwhile, and no tick that is prepared has other
// masks than idle ones.
void emission_set_rest(uint16_t step) {
  if (step == board_rest()) return;
  const uint8_t special = 1 << TICK_SPECIAL;
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    board_set_rest(step);
    for (uint8_t i = 0; i < MAX_EMPTY_SLOTS; ++i) idle_masks[i] = step;
    GPIOR0 |= special;
    prepared[0].tick.begun |= special;
    prepared[1].tick.begun |= special;
    emission_silent.begun |= special;
  }
}

static void turn_round(uint16_t* mask, uint16_t rest) {
  for (const uint16_t* const end = mask + EMISSION_SLOTS; mask != end; ++mask) *mask ^= rest;
}

void emission_ready(bushd_slot_buffer* slot_buffer) {
  const uint16_t rest = board_rest();
  if (rest != 0 && slot_buffer->active != 0 && slot_buffer->outputs != BUSHD_OUTPUTS_LEVELS) {
    turn_round(slot_buffer->step, rest);
  }
  next_plane = slot_buffer;
  given_start = core_start + given->tick.cycles;
  give(false);
}

bool emission_begun(void) {
  return emission_committed;
}

bool emission_begins_soon(void) {
  // Later it has begun, or was not taken when it should have been and begins a tick later.
  const uint32_t end = given_start + BEGINNING_CYCLES;
  return end - clock_now() < EMISSION_FRAME_CYCLES + BEGINNING_CYCLES;
}

// If no slot_buffer is ready after this one, its last levels stay.
static void hold_levels(void) {
  const bool levels = next_plane->outputs == BUSHD_OUTPUTS_LEVELS;
  const uint16_t last = levels ? next_plane->step[EMISSION_SLOTS - 1u] : board_rest();
  emission_silent.begun = begun_flags(levels ? BUSHD_OUTPUTS_LEVELS : BUSHD_OUTPUTS_PULSES);
  if (idle_masks[0] == last) return;
  for (uint8_t i = 0; i < MAX_EMPTY_SLOTS; ++i) idle_masks[i] = last;
}

void emission_swap(void) {
  hold_levels();
  next_plane = NULL;
  core_start = emission_begun_at;
  residue = given->residue;
  carry_ns += adjust_ns - given->extra_ns;
  adjust_ns = 0;
  emission_committed = 0;
}

int32_t emission_time_in_tick_ns(uint32_t time) {
  return (int32_t)(time - core_start) * 125 / 2;
}

uint32_t emission_slot_time(uint16_t slot) {
  return given_start + slot * (given->tick.cycles / EMISSION_SLOTS);
}

static void change_length(void) {
  if (next_plane != NULL) give(true);
}

void emission_set_tick(uint32_t ns) {
  const uint32_t parts = ns * CYCLES_PER_US;
  plain_cycles = parts / 1000u;
  plain_residue = (uint16_t)(parts % 1000u);
  emission_tick silent;
  set_empty(&silent, emission_silent.direction, emission_silent.begun | 1 << TICK_CHANGES,
            plain_cycles);
  // Not while the interrupts read it.
  bool set = false;
  do {
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
      set = (GPIOR0 & 1 << TICK_CHANGES) == 0;
      if (set) emission_silent = silent;
    }
  } while (!set);
  change_length();
}

void emission_adjust_tick(int32_t ns) {
  adjust_ns = ns;
  change_length();
}
