// The ticks of a run (run.c cuts it into parts), one by one or a block at a time.
//
// State in time is (which step runs, time units since the last step). Advancing by dt:
// - on a side with an index, S[i] + since + dt is looked up in the prefix sums S: one bucket, one
//   comparison
// - on a side without, the codes are walked
// - in cruise, by quotient and remainder of dt / c, computed once a block
// The decelerating side is the same walk through its sums, backwards in time from the end.
#include "engine/run.h"
#include "engine/run_fine_blocks.h"
#include "engine/run_parts.h"
#include "engine/run_slots.h"

#if BUSHD_RAMP_INDEX

// The greatest i with sum[i] <= units. Precondition: units < sum[count].
static uint32_t look_up(const bushd_ramp* ramp, uint32_t units) {
  uint32_t i = ramp->bucket[units >> ramp->bucket_shift];
  while (ramp->sum[i + 1] <= units) ++i;
  return i;
}

// These two do in constant time what advance_accel and advance_decel do step by step.

static uint16_t look_up_accel(bushd_run* run) {
  const bushd_ramp* ramp = &run->table->accel;
  const uint32_t now = ramp->sum[run->accel_at] + (uint32_t)run->since;
  const bool over = now >= ramp->sum[run->accel_end];
  const uint16_t i = over ? run->accel_end : (uint16_t)look_up(ramp, now);
  run->since = now - ramp->sum[i];
  return i;
}

// sum[left] is the time from the last step made to the end; after `since` of it `remaining` is to
// come, and the steps still to be made are the fewest whose time is not less.
static uint16_t look_up_decel(bushd_run* run) {
  const bushd_ramp* ramp = &run->table->decel;
  const uint16_t end = bushd_run_decel_end(run);
  const uint32_t whole = ramp->sum[run->decel_left];
  const uint32_t remaining = whole - (uint32_t)run->since;
  const bool over = run->since >= whole - ramp->sum[end];
  const uint16_t left = over ? end : (uint16_t)(look_up(ramp, remaining - 1) + 1);
  run->since = ramp->sum[left] - remaining;
  return left;
}

#endif

// Each advance_* lets `since` (already grown by the tick) pay for steps of its part, one after the
// other, and returns how many it paid for; what is left in `since` belongs to the next part.

static uint32_t advance_accel(bushd_run* run) {
  const bushd_ramp* ramp = &run->table->accel;
  uint16_t i = run->accel_at;
#if BUSHD_RAMP_INDEX
  if (ramp->sum != NULL) i = look_up_accel(run);
#endif
  while (i < run->accel_end && run->since >= ramp->code[i]) run->since -= ramp->code[i++];
  const uint32_t steps = (uint32_t)(i - run->accel_at);
  run->accel_at = i;
  return steps;
}

static uint32_t advance_cruise(bushd_run* run) {
  if (run->since < run->cruise) return 0;
#if BUSHD_SLOW_RUNS
  // A tick is less than 32 bits, but for what it begins with, and that is less than a delay.
  uint32_t steps = bushd_delay_is_code(run->cruise) ? (uint32_t)run->since / (uint16_t)run->cruise
                                                    : (uint32_t)(run->since / run->cruise);
#else
  uint32_t steps = run->since / run->cruise;
#endif
  if (steps > run->cruise_left) steps = run->cruise_left;
  run->since -= (bushd_since)steps * run->cruise;
  run->cruise_left -= steps;
  return steps;
}

#if BUSHD_RUN_BRAKES
static uint32_t advance_brake(bushd_run* run) {
  const uint16_t* code = run->table->decel.code + run->decel_left;
  const uint16_t before = run->brake_left;
  while (run->brake_left > 0 && run->since >= code[run->brake_left - 1]) {
    run->since -= code[--run->brake_left];
  }
  return (uint32_t)(before - run->brake_left);
}
#endif

static uint32_t advance_decel(bushd_run* run) {
  const bushd_ramp* ramp = &run->table->decel;
  uint16_t left = run->decel_left;
#if BUSHD_RAMP_INDEX
  if (ramp->sum != NULL) left = look_up_decel(run);
#endif
  const uint16_t end = bushd_run_decel_end(run);
  while (left > end && run->since >= ramp->code[left - 1]) run->since -= ramp->code[--left];
  const uint32_t steps = (uint32_t)(run->decel_left - left);
  bushd_run_set_decel(run, left);
  return steps;
}

// One tick across any borders of parts. `since` has not yet grown by it.
static uint32_t advance(bushd_run* run, uint32_t units) {
  uint32_t steps = 0;
  run->since += units;
  if (run->lead_delay != 0) {
    if (run->since < run->lead_delay) return 0;
    run->since -= run->lead_delay;
    run->lead_delay = 0;
    ++steps;
  }
  if (run->accel_at < run->accel_end) steps += advance_accel(run);
#if BUSHD_RUN_BRAKES
  if (run->brake_left != 0) steps += advance_brake(run);
#endif
  if (run->accel_at >= run->accel_end && bushd_run_brake_left(run) == 0) {
    if (run->cruise_left != 0) steps += advance_cruise(run);
    if (run->cruise_left == 0 && run->decel_left != 0) steps += advance_decel(run);
  }
  return steps;
}

#if BUSHD_RAMP_INDEX

// Where coarse displacements go.
typedef struct coarse_out {
  uint8_t* at;
  size_t stride;
  uint8_t direction_bit;
} coarse_out;

// The blocks below, and those of fine ticks, expand many ticks inside one part with its state in
// registers. How many surely stay inside is known before, so that their loops have no way out;
// `advance` takes the ticks across a border.

// Ticks along an indexed side, in its direction (forward) or against it. `*time` is the place on
// the side in units, `*index` the step that runs there. Precondition: buckets not wider than the
// shortest delay, so that one comparison finds the step.
static inline void ramp_ticks(const bushd_ramp* ramp, const bushd_tick_units* tick, size_t ticks,
                              bool forward, bool whole_only, uint32_t* time, uint32_t* index,
                              uint32_t* since_ns, coarse_out out) {
  const uint32_t* const sum = ramp->sum;
  const uint32_t* const bucket = ramp->bucket;
  const uint8_t shift = ramp->bucket_shift;
  const bushd_tick_units t = *tick;
  uint32_t now = *time;
  uint32_t i = *index;
  uint32_t ns = *since_ns;
  for (; ticks > 0; --ticks) {
    const uint32_t units = whole_only ? t.whole : bushd_next_units(&ns, &t);
    now = forward ? now + units : now - units;
    uint32_t next = bucket[now >> shift];
    next += sum[next + 1] <= now;
    *out.at = (uint8_t)((forward ? next - i : i - next) | out.direction_bit);
    out.at += out.stride;
    i = next;
  }
  *time = now;
  *index = i;
  *since_ns = ns;
}

static size_t coarse_accel_block(bushd_run* run, const bushd_tick_units* tick, size_t ticks,
                                 coarse_out out) {
  const bushd_ramp* ramp = &run->table->accel;
  if (ramp->sum == NULL) return 0;
  uint32_t i = run->accel_at;
  uint32_t now = ramp->sum[i] + (uint32_t)run->since;
  ticks = bushd_safe_ramp_ticks(ramp, tick, ticks, ramp->sum[run->accel_end] - now);
  if (tick->rest_ns == 0) {
    ramp_ticks(ramp, tick, ticks, true, true, &now, &i, &run->since_ns, out);
  } else {
    ramp_ticks(ramp, tick, ticks, true, false, &now, &i, &run->since_ns, out);
  }
  bushd_run_count(run, i - run->accel_at);
  run->accel_at = (uint16_t)i;
  run->since = now - ramp->sum[i];
  return ticks;
}

static size_t coarse_decel_block(bushd_run* run, const bushd_tick_units* tick, size_t ticks,
                                 coarse_out out) {
  const bushd_ramp* ramp = &run->table->decel;
  if (ramp->sum == NULL) return 0;
  // One unit before the time that remains, the step that runs is the fewest left, less one
  // (advance_decel).
  uint32_t i = run->decel_left - 1u;
  uint32_t now = ramp->sum[run->decel_left] - (uint32_t)run->since - 1;
  ticks = bushd_safe_ramp_ticks(ramp, tick, ticks, now + 1 - ramp->sum[bushd_run_decel_end(run)]);
  if (tick->rest_ns == 0) {
    ramp_ticks(ramp, tick, ticks, false, true, &now, &i, &run->since_ns, out);
  } else {
    ramp_ticks(ramp, tick, ticks, false, false, &now, &i, &run->since_ns, out);
  }
  bushd_run_count(run, run->decel_left - 1u - i);
  run->decel_left = (uint16_t)(i + 1);
  run->since = ramp->sum[i + 1] - (now + 1);
  return ticks;
}

static size_t coarse_cruise_block(bushd_run* run, const bushd_tick_units* tick, size_t ticks,
                                  coarse_out out) {
  // In units if ticks are whole units, else in ns: one remainder to carry instead of two.
  const bool in_ns = tick->rest_ns != 0;
  const int64_t scale = in_ns ? tick->unit_ns : 1;
  const int64_t delay = (int64_t)run->cruise * scale;
  const int64_t tick_length = in_ns ? tick->whole * scale + tick->rest_ns : tick->whole;
  const uint32_t whole = (uint32_t)(tick_length / delay);
  const int64_t rest = tick_length - whole * delay;
  ticks = bushd_fewer_ticks(ticks, run->cruise_left, whole + 1);
  // Kept negative: what is missing to the next step.
  int64_t missing = (int64_t)run->since * scale + (in_ns ? run->since_ns : 0) - delay;
  const uint8_t byte = (uint8_t)(whole | out.direction_bit);
  uint32_t extra = 0;
  for (size_t n = 0; n < ticks; ++n) {
    const int64_t later = missing + rest;
    const int64_t after_step = missing + (rest - delay);
    const bool more = later >= 0;
    missing = more ? after_step : later;
    extra += more;
    *out.at = (uint8_t)(byte + more);
    out.at += out.stride;
  }
  const int64_t since = missing + delay;
  run->since = (bushd_since)(in_ns ? since / scale : since);
  if (in_ns) run->since_ns = (uint32_t)(since % scale);
  const uint32_t steps = (uint32_t)ticks * whole + extra;
  run->cruise_left -= steps;
  bushd_run_count(run, steps);
  return ticks;
}

static size_t coarse_block(bushd_run* run, const bushd_tick_units* tick, size_t ticks,
                           coarse_out out) {
  if (run->lead_delay != 0 || bushd_run_brake_left(run) != 0 || bushd_run_begins_later(run))
    return 0;
  if (run->accel_at < run->accel_end) return coarse_accel_block(run, tick, ticks, out);
  if (run->cruise_left != 0) return coarse_cruise_block(run, tick, ticks, out);
  return coarse_decel_block(run, tick, ticks, out);
}

#endif

size_t bushd_run_expand_coarse(bushd_run* run, uint32_t tick_ns, size_t ticks, uint8_t* out,
                               size_t stride) {
  const bushd_tick_units tick = bushd_run_tick_units(run, tick_ns);
  const uint8_t direction_bit = run->direction > 0 ? BUSHD_COARSE_DIRECTION : 0;
  size_t n = 0;
  while (n < ticks && bushd_run_parts_left(run) != 0) {
#if BUSHD_RAMP_INDEX
    if (ticks - n >= BUSHD_RUN_BLOCK_TICKS) {
      const coarse_out rest = {out + n * stride, stride, direction_bit};
      n += coarse_block(run, &tick, ticks - n, rest);
      // The block may have made the last step: no tick is active after it.
      if (n == ticks || bushd_run_parts_left(run) == 0) break;
    }
#endif
    const uint32_t steps = advance(run, bushd_next_units(&run->since_ns, &tick));
    bushd_run_count(run, steps);
    out[n++ * stride] = (uint8_t)(steps | direction_bit);
  }
  const size_t active = n;
  for (; n < ticks; ++n) out[n * stride] = 0;
  return active;
}

// How much of the running delay is over, in 1/256 rounded down. A small MCU finds the eight bits
// one by one (bushd_run_share): a division of 32 bits would take it six times as long.
static inline void note_fraction(bushd_run* run, uint32_t unit_ns) {
#if BUSHD_SLOW_RUNS
  const bushd_delay delay = bushd_run_delay(run);
  const uint32_t rest = delay == 0 ? 0 : bushd_run_sub_units(run->since_ns, unit_ns);
  if (delay == 0) {
    run->fraction = 0;
  } else if (bushd_delay_is_code(delay)) {
    run->fraction = (uint8_t)(((uint32_t)run->since * 256u + rest) / (uint16_t)delay);
  } else {
    run->fraction = (uint8_t)((run->since * 256u + rest) / delay);
  }
#else
  (void)unit_ns;
  bushd_run_note_fraction(run);
#endif
}

size_t bushd_run_expand_fine(bushd_run* run, uint32_t tick_ns, size_t ticks, int16_t* out,
                             size_t stride) {
  const bushd_tick_units tick = bushd_run_tick_units(run, tick_ns);
  size_t n = 0;
  while (n < ticks && bushd_run_parts_left(run) != 0) {
#if BUSHD_RAMP_INDEX
    // Behind a block the part of the run goes on: its last step is not made.
    if (ticks - n >= BUSHD_RUN_BLOCK_TICKS) {
      const bushd_fine_out rest = {out + n * stride, stride, run->direction};
      n += bushd_run_fine_block(run, &tick, ticks - n, rest);
      if (n == ticks) break;
    }
#endif
    const uint32_t steps = advance(run, bushd_next_units(&run->since_ns, &tick));
    bushd_run_count(run, steps);
    const uint8_t before = run->fraction;
    note_fraction(run, tick.unit_ns);
    const int32_t displacement = (int32_t)(steps * 256u + run->fraction) - before;
    out[n++ * stride] = (int16_t)(displacement * run->direction);
  }
  const size_t active = n;
  if (n < ticks && run->fraction != 0) {
    out[n++ * stride] = (int16_t)(-(int16_t)run->fraction * run->direction);
    run->fraction = 0;
  }
  for (; n < ticks; ++n) out[n * stride] = 0;
  return active;
}
