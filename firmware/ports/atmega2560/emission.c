#include "firmware/ports/atmega2560/emission.h"

#include <avr/interrupt.h>
#include <util/delay_basic.h>

#include "firmware/ports/atmega2560/board.h"
#include "firmware/ports/atmega2560/clock.h"

// Pulses are to last 2.5 us; this many turns of three cycles besides the work of the slot
// interrupt.
#define PULSE_TURNS 8
// Until the first slot.
#define START_CYCLES 400u

typedef struct tick_length {
  uint32_t cycles;
  uint16_t slot_cycles;
  uint16_t last_slot_cycles;
  uint16_t joined_slot_cycles;  // all but the last; 0: more than the timer counts
  uint16_t residue;             // 1/1000 cycles that it is too short
  int32_t extra_ns;             // longer than a plain tick
} tick_length;

// Of the slot interrupt.
static struct {
  const uint16_t* mask;  // of the next slot
  uint16_t slot_cycles;
  uint16_t last_slot_cycles;
  uint8_t slots_left;
  bool silent;
  bool first;  // the next one is the first of its tick
} slot;

// Between the change of planes and the main loop.
static volatile bool ready;      // next_plane and next_length are good
static volatile bool committed;  // the next tick goes by them
static const bushd_plane* next_plane;
static tick_length next_length;
static tick_length present_length;
static uint32_t next_start;  // of the tick that follows the one being emitted

// Of the main loop.
static uint32_t core_start;  // of the core's present tick
static uint32_t begun_at;    // of the committed one
static uint32_t tick_ns;
static int32_t adjust_ns;  // of the next tick
static int32_t carry_ns;   // adjustments that came when the tick they were for was committed
static uint16_t residue;

static inline void set_slot_length(uint16_t cycles) {
  const uint16_t top = (uint16_t)(cycles - 1u);
  if (OCR1A != top) OCR1A = top;
}

// In the last slot of a tick, its pulses over: what is emitted from the next one on.
static inline void change_planes(void) {
  slot.silent = !ready || committed;
  bool empty = true;
  if (!slot.silent) {
    DIR_LOW = (uint8_t)next_plane->direction;
    DIR_HIGH = (uint8_t)(next_plane->direction >> 8);
    slot.mask = next_plane->step;
    empty = next_plane->active == 0;
    present_length = next_length;
    begun_at = next_start;
    committed = true;
    ready = false;
  }
  // Without steps all slots but the last are one: at rest the time is left to the main loop.
  const bool joined = empty && present_length.joined_slot_cycles != 0;
  slot.slots_left = joined ? 2 : EMISSION_SLOTS;
  slot.slot_cycles = joined ? present_length.joined_slot_cycles : present_length.slot_cycles;
  slot.last_slot_cycles = present_length.last_slot_cycles;
  slot.first = true;
  next_start += present_length.cycles;
}

ISR(TIMER1_COMPA_vect) {
  const uint16_t mask = slot.silent ? 0 : *slot.mask;
  STEP_LOW = (uint8_t)mask;
  STEP_HIGH = (uint8_t)(mask >> 8);
  ++slot.mask;
  if (slot.first) {
    slot.first = false;
    set_slot_length(slot.slot_cycles);
  }
  if (--slot.slots_left == 0) set_slot_length(slot.last_slot_cycles);
  if (mask != 0) _delay_loop_1(PULSE_TURNS);
  STEP_LOW = 0;
  STEP_HIGH = 0;
  if (slot.slots_left == 0) change_planes();
}

static tick_length length_of_next(void) {
  tick_length length;
  length.extra_ns = adjust_ns + carry_ns;
  const uint32_t parts = (tick_ns + (uint32_t)length.extra_ns) * CYCLES_PER_US + residue;
  length.cycles = parts / 1000u;
  length.residue = (uint16_t)(parts % 1000u);
  length.slot_cycles = (uint16_t)(length.cycles / EMISSION_SLOTS);
  length.last_slot_cycles = (uint16_t)(length.slot_cycles + length.cycles % EMISSION_SLOTS);
  const uint32_t joined = length.cycles - length.last_slot_cycles;
  length.joined_slot_cycles = joined <= UINT16_MAX ? (uint16_t)joined : 0;
  return length;
}

void emission_start(void) {
  present_length = length_of_next();
  slot.slot_cycles = present_length.slot_cycles;
  slot.last_slot_cycles = present_length.last_slot_cycles;
  slot.slots_left = EMISSION_SLOTS;
  slot.silent = true;
  slot.first = true;
  OCR1A = START_CYCLES - 1u;
  TCNT1 = 0;
  TIFR1 = 1 << OCF1A;
  TIMSK1 = 1 << OCIE1A;
  TCCR1A = 0;
  core_start = clock_now_locked() + START_CYCLES;
  TCCR1B = 1 << WGM12 | 1 << CS10;
  next_start = core_start + present_length.cycles;
}

void emission_ready(const bushd_plane* plane) {
  const tick_length length = length_of_next();
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    next_plane = plane;
    next_length = length;
    ready = true;
  }
}

bool emission_begun(uint32_t* start) {
  if (!committed) return false;
  *start = begun_at;  // does not change while `committed` is set
  return !clock_before(clock_now(), begun_at);
}

void emission_swap(void) {
  core_start = begun_at;
  residue = present_length.residue;
  carry_ns += adjust_ns - present_length.extra_ns;
  adjust_ns = 0;
  committed = false;
}

uint32_t emission_time_in_tick_ns(uint32_t time) {
  return (time - core_start) * 125u / 2u;
}

// The next tick's plane may wait already.
static void change_length(void) {
  const tick_length length = length_of_next();
  ATOMIC_BLOCK(ATOMIC_RESTORESTATE) {
    next_length = length;
  }
}

void emission_set_tick(uint32_t ns) {
  tick_ns = ns;
  change_length();
}

void emission_adjust_tick(int32_t ns) {
  adjust_ns = ns;
  change_length();
}
