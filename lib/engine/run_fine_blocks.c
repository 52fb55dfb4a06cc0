// Many fine ticks inside one part of a run, with its state in registers (run_ticks.c).
#include "engine/run_fine_blocks.h"

#include "engine/run_parts.h"

#if BUSHD_RAMP_INDEX

// Time is counted in 1/256 unit, rounded down, and the rest in 1/unit_ns of that. So the share of a
// delay is one division of whole numbers (bushd_run_sub_units). On a side no such division waits
// for the one before: reciprocals of the codes, kept beside them, were no faster. In cruise there
// is none.
typedef struct time_256 {
  uint64_t whole;
  uint64_t rest;
} time_256;

static time_256 in_256(uint64_t units, uint32_t ns, uint32_t unit_ns) {
  const uint32_t sub = bushd_run_sub_units(ns, unit_ns);
  const time_256 time = {units * 256u + sub, (uint64_t)ns * 256u - (uint64_t)sub * unit_ns};
  return time;
}

static uint32_t ns_of(const time_256* time, uint32_t unit_ns) {
  return (uint32_t)(((time->whole & 255u) * unit_ns + time->rest) >> 8);
}

// As ramp_ticks of run_ticks.c, in 1/256 unit. `*fraction` is that of the position, before and
// after.
static inline void fine_ramp_ticks(const bushd_ramp* ramp, const bushd_tick_units* tick,
                                   size_t ticks, bool forward, bool whole_only, time_256* time,
                                   uint32_t* index, uint32_t* fraction, bushd_fine_out out) {
  const uint32_t* const sum = ramp->sum;
  const uint32_t* const bucket = ramp->bucket;
  const uint16_t* const code = ramp->code;
  const uint8_t shift = ramp->bucket_shift;
  const time_256 t = in_256(tick->whole, tick->rest_ns, tick->unit_ns);
  const uint32_t unit_ns = tick->unit_ns;
  uint64_t now = time->whole;
  uint64_t rest = time->rest;
  uint32_t i = *index;
  uint32_t part = *fraction;
  uint32_t before = (forward ? i : 0u - i) * 256u + part;
  for (; ticks > 0; --ticks) {
    uint64_t later = t.whole;
    if (!whole_only) {
      rest += t.rest;
      const bool carry = rest >= unit_ns;
      rest = carry ? rest - unit_ns : rest;
      later += carry;
    }
    now = forward ? now + later : now - later;
    const uint32_t units = (uint32_t)(now >> 8);
    i = bucket[units >> shift];
    i += sum[i + 1] <= units;
    const uint32_t since =
        forward ? (uint32_t)now - sum[i] * 256u : sum[i + 1] * 256u - 1u - (uint32_t)now;
    part = since / code[i];
    const uint32_t at = (forward ? i : 0u - i) * 256u + part;
    *out.at = (int16_t)((int32_t)(at - before) * out.direction);
    out.at += out.stride;
    before = at;
  }
  time->whole = now;
  time->rest = rest;
  *index = i;
  *fraction = part;
}

static size_t fine_accel_block(bushd_run* run, const bushd_tick_units* tick, size_t ticks,
                               bushd_fine_out out) {
  const bushd_ramp* ramp = &run->table->accel;
  if (ramp->sum == NULL) return 0;
  uint32_t i = run->accel_at;
  const uint32_t units = ramp->sum[i] + (uint32_t)run->since;
  ticks = bushd_safe_ramp_ticks(ramp, tick, ticks, ramp->sum[run->accel_end] - units);
  if (ticks == 0) return 0;
  time_256 time = in_256(units, run->since_ns, tick->unit_ns);
  uint32_t fraction = run->fraction;
  if (tick->rest_ns == 0) {
    fine_ramp_ticks(ramp, tick, ticks, true, true, &time, &i, &fraction, out);
  } else {
    fine_ramp_ticks(ramp, tick, ticks, true, false, &time, &i, &fraction, out);
    run->since_ns = ns_of(&time, tick->unit_ns);
  }
  bushd_run_count(run, i - run->accel_at);
  run->accel_at = (uint16_t)i;
  run->since = (uint32_t)(time.whole >> 8) - ramp->sum[i];
  run->fraction = (uint8_t)fraction;
  return ticks;
}

static size_t fine_decel_block(bushd_run* run, const bushd_tick_units* tick, size_t ticks,
                               bushd_fine_out out) {
  const bushd_ramp* ramp = &run->table->decel;
  if (ramp->sum == NULL) return 0;
  uint32_t i = run->decel_left - 1u;
  const uint32_t left = ramp->sum[run->decel_left] - (uint32_t)run->since;
  ticks = bushd_safe_ramp_ticks(ramp, tick, ticks, left - ramp->sum[bushd_run_decel_end(run)]);
  if (ticks == 0) return 0;
  // As coarse_decel_block does: one 1/256 unit before the time that remains.
  time_256 time = in_256(0, run->since_ns, tick->unit_ns);
  time.whole = (uint64_t)left * 256u - time.whole - 1u;
  uint32_t fraction = run->fraction;
  if (tick->rest_ns == 0) {
    fine_ramp_ticks(ramp, tick, ticks, false, true, &time, &i, &fraction, out);
  } else {
    fine_ramp_ticks(ramp, tick, ticks, false, false, &time, &i, &fraction, out);
    const time_256 passed = {~time.whole, time.rest};
    run->since_ns = ns_of(&passed, tick->unit_ns);
  }
  bushd_run_count(run, run->decel_left - 1u - i);
  run->decel_left = (uint16_t)(i + 1);
  run->since = ramp->sum[i + 1] - 1u - (uint32_t)(time.whole >> 8);
  run->fraction = (uint8_t)fraction;
  return ticks;
}

// The position after t is floor(256 t / delay): from tick to tick it grows by a constant, or by one
// more where the remainders make a delay.
static size_t fine_cruise_block(bushd_run* run, const bushd_tick_units* tick, size_t ticks,
                                bushd_fine_out out) {
  const bool in_ns = tick->rest_ns != 0;
  const int64_t scale = in_ns ? tick->unit_ns : 1;
  const int64_t delay = (int64_t)run->cruise * scale;
  const int64_t length = 256 * (in_ns ? tick->whole * scale + tick->rest_ns : tick->whole);
  const uint32_t whole = (uint32_t)(length / delay);
  const int64_t rest = length - whole * delay;
  int64_t since = 256 * (int64_t)run->since * scale;
  since += in_ns ? 256 * (int64_t)run->since_ns
                 : (int64_t)bushd_run_sub_units(run->since_ns, tick->unit_ns);
  // What `fraction` leaves of it is less than 1/256 of the delay, unless the tick before was of
  // another kind.
  int64_t missing = since - (int64_t)run->fraction * delay - delay;
  if (missing >= 0 || missing < -delay) return 0;
  ticks = bushd_fewer_ticks(ticks, run->cruise_left - 1u, whole / 256 + 1);
  const int32_t less = (int32_t)whole * out.direction;
  const int32_t more = less + out.direction;
  uint32_t extra = 0;
  for (size_t n = 0; n < ticks; ++n) {
    const int64_t later = missing + rest;
    const int64_t after = missing + (rest - delay);
    const bool carry = later >= 0;
    missing = carry ? after : later;
    extra += carry;
    *out.at = (int16_t)(carry ? more : less);
    out.at += out.stride;
  }
  const uint64_t way = run->fraction + (uint64_t)ticks * whole + extra;
  const uint8_t fraction = (uint8_t)way;
  since = (missing + delay + fraction * delay) / 256;
  run->since = (bushd_since)(in_ns ? since / scale : since);
  if (in_ns) run->since_ns = (uint32_t)(since % scale);
  run->fraction = fraction;
  run->cruise_left -= (uint32_t)(way >> 8);
  bushd_run_count(run, (uint32_t)(way >> 8));
  return ticks;
}

size_t bushd_run_fine_block(bushd_run* run, const bushd_tick_units* tick, size_t ticks,
                            bushd_fine_out out) {
  if (run->lead_delay != 0 || bushd_run_brake_left(run) != 0 || bushd_run_begins_later(run))
    return 0;
  if (run->accel_at < run->accel_end) return fine_accel_block(run, tick, ticks, out);
  if (run->cruise_left != 0) return fine_cruise_block(run, tick, ticks, out);
  return fine_decel_block(run, tick, ticks, out);
}

#endif
