// Blocks of fine ticks, and what they share with coarse ones, for run_ticks.c alone.
#ifndef BUSHD_ENGINE_RUN_FINE_BLOCKS_H
#define BUSHD_ENGINE_RUN_FINE_BLOCKS_H

#include "engine/run.h"

// A tick in whole units and the rest; `since_ns` collects the rests until they make a unit.
typedef struct bushd_tick_units {
  uint32_t whole;
  uint32_t rest_ns;
  uint32_t unit_ns;
} bushd_tick_units;

static inline bushd_tick_units bushd_run_tick_units(const bushd_run* run, uint32_t tick_ns) {
  const uint32_t unit_ns = run->table->time_unit_ns;
  const bushd_tick_units tick = {tick_ns / unit_ns, tick_ns % unit_ns, unit_ns};
  return tick;
}

static inline uint32_t bushd_next_units(uint32_t* since_ns, const bushd_tick_units* tick) {
  const uint32_t sum = *since_ns + tick->rest_ns;
  const bool carry = sum >= tick->unit_ns;
  *since_ns = carry ? sum - tick->unit_ns : sum;
  return tick->whole + carry;
}

// 256 since_ns / unit_ns, rounded down. Dividing what is rounded down rounds as dividing the exact
// sum does, so the fraction of a step needs 32 bits only; on an 8-bit MCU 64-bit divisions would
// not fit into a tick.
static inline uint32_t bushd_run_sub_units(uint32_t since_ns, uint32_t unit_ns) {
  if (since_ns == 0) return 0;
  if (since_ns < UINT32_C(1) << 24) return since_ns * 256u / unit_ns;
  return (uint32_t)((uint64_t)since_ns * 256u / unit_ns);
}

// A small MCU makes few ticks at a time, and has no stack for blocks.
#if BUSHD_RAMP_INDEX

// Below this many ticks the divisions that a block begins with cost more than it saves.
#define BUSHD_RUN_BLOCK_TICKS 4u

// The fewer of `ticks` and `room / of_each`. A division only where it matters.
static inline size_t bushd_fewer_ticks(size_t ticks, uint32_t room, uint32_t of_each) {
  if (ticks <= UINT32_MAX && (uint64_t)ticks * of_each <= room) return ticks;
  return room / of_each;
}

// Ticks that surely end before `units` more have passed; 0 if the buckets are wider than
// the shortest delay, so that one comparison does not find the step.
static inline size_t bushd_safe_ramp_ticks(const bushd_ramp* ramp, const bushd_tick_units* tick,
                                           size_t ticks, uint32_t units) {
  if (UINT32_C(1) << ramp->bucket_shift > ramp->code[ramp->count - 1]) return 0;
  return bushd_fewer_ticks(ticks, units - 1, tick->whole + (tick->rest_ns != 0));
}

// Where displacements go.
typedef struct bushd_fine_out {
  int16_t* at;
  size_t stride;
  int direction;
} bushd_fine_out;

// Up to `ticks` of them, as many as surely end before the part of the run does; 0 if that is none,
// or if the part is not for blocks. Returns how many were made.
size_t bushd_run_fine_block(bushd_run* run, const bushd_tick_units* tick, size_t ticks,
                            bushd_fine_out out);

#endif
#endif
