#include "firmware/ports/atmega2560/emission.h"

#include <avr/interrupt.h>
#include <stddef.h>

#include "firmware/ports/atmega2560/board.h"
#include "firmware/ports/atmega2560/clock.h"
#include "firmware/ports/atmega2560/emission_slots.h"

// From a slot's beginning to its compare B. Pulses are to last 2.5 us, 40 cycles: A's edge comes 23
// cycles after its compare and later if another interrupt is being served, B's 11 after its own.
#define PULSE_END_CYCLES 112u
// Until the first slot.
#define START_CYCLES 400u
// Of a tick without steps: the last slot, and how many of them there are at most.
#define SHORT_SLOT_CYCLES 256u
#define MAX_EMPTY_SLOTS 9u

_Static_assert(offsetof(emission_tick, direction) == 0, "as in emission_slots.S");
_Static_assert(offsetof(emission_tick, mask) == TICK_MASK, "as in emission_slots.S");
_Static_assert(offsetof(emission_tick, end) == TICK_END, "as in emission_slots.S");
_Static_assert(offsetof(emission_tick, top) == TICK_TOP, "as in emission_slots.S");
_Static_assert(offsetof(emission_tick, last_top) == TICK_LAST_TOP, "as in emission_slots.S");

emission_tick emission_present;
const emission_tick* volatile emission_next = &emission_silent;
const emission_tick* volatile emission_taken;
emission_tick emission_silent;  // goes on when no plane is ready

static const uint16_t kNoSteps[MAX_EMPTY_SLOTS];

// Between the interrupt and the main loop.
static volatile bool committed;  // the next tick has begun
static uint32_t next_start;      // of the tick that follows the one being emitted
static uint32_t begun_at;        // of the committed one

typedef struct tick_length {
  uint32_t cycles;
  uint16_t residue;  // 1/1000 cycles that it is too short
  int32_t extra_ns;  // longer than a plain tick
} tick_length;

// Of the main loop.
static emission_tick prepared[2];  // one of them waits or was taken last
static uint8_t spare;
static const bushd_plane* next_plane;
static tick_length next_length;
static tick_length plain;    // without adjustment, from residue 0
static uint32_t core_start;  // of the core's present tick
static int32_t adjust_ns;    // of the next tick
static int32_t carry_ns;     // adjustments that came when the tick they were for had begun
static uint16_t residue;

static emission_tick tick_of_plane(const bushd_plane* plane, uint32_t cycles) {
  const uint16_t slot = (uint16_t)(cycles / EMISSION_SLOTS);
  emission_tick tick;
  tick.direction = plane->direction;
  tick.mask = plane->step;
  tick.end = (uint8_t)(uintptr_t)(plane->step + EMISSION_SLOTS);
  tick.top = (uint16_t)(slot - 1u);
  tick.last_top = (uint16_t)(tick.top + (uint16_t)(cycles % EMISSION_SLOTS));
  tick.cycles = cycles;
  return tick;
}

// Of few slots, so that the time is left to the main loop. The last one is as short as may be: in
// it the next tick is taken.
static emission_tick empty_tick(uint16_t direction, uint32_t cycles) {
  const uint32_t body = cycles - SHORT_SLOT_CYCLES;
  const uint8_t shift = body <= UINT16_MAX ? 0 : 3;
  const uint8_t long_slots = (uint8_t)(1u << shift);
  emission_tick tick;
  tick.direction = direction;
  tick.mask = kNoSteps;
  tick.end = (uint8_t)(uintptr_t)(kNoSteps + long_slots + 1u);
  tick.top = (uint16_t)((body >> shift) - 1u);
  tick.last_top = (uint16_t)(SHORT_SLOT_CYCLES - 1u + (body & (long_slots - 1u)));
  tick.cycles = cycles;
  return tick;
}

// By TIMER1_COMPB, in the first slot of a tick.
void __vector_emission_begun(void) __attribute__((interrupt));
void __vector_emission_begun(void) {
  const emission_tick* const begun = emission_taken;
  const uint32_t start = next_start;
  next_start += begun->cycles;
  if (begun == &emission_silent) return;
  emission_silent.direction = begun->direction;
  begun_at = start;
  committed = true;
}

static tick_length length_of(uint32_t tick_ns) {
  const uint32_t parts = tick_ns * CYCLES_PER_US;
  const tick_length length = {parts / 1000u, (uint16_t)(parts % 1000u), 0};
  return length;
}

// Divides only what a tick differs by.
static tick_length length_of_next(void) {
  tick_length length = plain;
  length.extra_ns = adjust_ns + carry_ns;
  int32_t parts = length.extra_ns * (int32_t)CYCLES_PER_US + plain.residue + residue;
  if (parts < 0 || parts >= 2000) {
    int32_t cycles = parts / 1000;
    if (cycles * 1000 > parts) --cycles;
    length.cycles += (uint32_t)cycles;
    parts -= cycles * 1000;
  } else if (parts >= 1000) {
    ++length.cycles;
    parts -= 1000;
  }
  length.residue = (uint16_t)parts;
  return length;
}

// `again`: in place of the one that waits; not if it was taken.
static void give(tick_length length, bool again) {
  emission_tick* const tick = &prepared[spare];
  *tick = next_plane->active != 0 ? tick_of_plane(next_plane, length.cycles)
                                  : empty_tick(next_plane->direction, length.cycles);
  bool given = false;
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    given = !again || emission_next != &emission_silent;
    if (given) emission_next = tick;
  }
  if (!given) return;
  next_length = length;
  spare ^= 1u;
}

void emission_start(void) {
  emission_present = emission_silent;
  emission_taken = &emission_silent;
  GPIOR0 = EMISSION_BEGUN;
  OCR1A = START_CYCLES - 1u;
  OCR1B = PULSE_END_CYCLES;
  TCNT1 = 0;
  TCCR1A = 0;
  core_start = next_start = clock_now_locked() + START_CYCLES;
  TCCR1B = 1 << WGM12 | 1 << CS10;
  while (TCNT1 <= PULSE_END_CYCLES) {
  }
  TIFR1 = 1 << OCF1A | 1 << OCF1B;
  TIMSK1 = 1 << OCIE1A | 1 << OCIE1B;
}

void emission_ready(const bushd_plane* plane) {
  next_plane = plane;
  give(length_of_next(), false);
}

bool emission_begun(uint32_t* start) {
  if (!committed) return false;
  *start = begun_at;  // does not change while `committed` is set
  return true;
}

void emission_swap(void) {
  core_start = begun_at;
  residue = next_length.residue;
  carry_ns += adjust_ns - next_length.extra_ns;
  adjust_ns = 0;
  committed = false;
}

uint32_t emission_time_in_tick_ns(uint32_t time) {
  return (time - core_start) * 125u / 2u;
}

static void change_length(void) {
  if (next_plane != NULL) give(length_of_next(), true);
}

void emission_set_tick(uint32_t ns) {
  plain = length_of(ns);
  const emission_tick silent = empty_tick(emission_silent.direction, plain.cycles);
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    emission_silent = silent;
  }
  change_length();
}

void emission_adjust_tick(int32_t ns) {
  adjust_ns = ns;
  change_length();
}
