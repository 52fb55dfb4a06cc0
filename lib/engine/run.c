// A run is cut, when it starts or gets a new target, into at most four parts by the rule
// max(A(j-1), D(N-j), c): a lead (a step taken over in its middle), steps on the accelerating side,
// steps at cruise, steps on the decelerating side. Both sides are sorted, so A(j-1) - D(N-j) never
// rises with j and one binary search finds where deceleration takes over; codes not above c count
// as cruise. A floor is a longer c. To slow down to a floor a run brakes, on the decelerating side
// as far as it lies below the floor, in place of speeding up.
//
// State in time is (which step runs, time units since the last step). Advancing by dt:
// - on a side with an index, S[i] + since + dt is looked up in the prefix sums S: one bucket, one
//   comparison
// - on a side without, the codes are walked
// - in cruise, by quotient and remainder of dt / c, computed once a block
// The decelerating side is the same walk through its sums, backwards in time from the end.
#include "engine/run.h"

// First index of a side whose code is <= delay.
static uint16_t codes_above(const bushd_ramp* ramp, bushd_delay delay) {
  uint16_t low = 0;
  uint16_t high = ramp->count;
  while (low < high) {
    const uint16_t middle = (uint16_t)(low + (uint16_t)(high - low) / 2u);
    if (ramp->code[middle] <= delay) {
      high = middle;
    } else {
      low = (uint16_t)(middle + 1u);
    }
  }
  return low;
}

static void clear(bushd_run* run, const bushd_table* table, int direction) {
  run->table = table;
  run->cruise = table->cruise;
#if BUSHD_RUN_COUNTS
  run->steps_done = 0;
#endif
  run->accel_at = 0;
  run->accel_end = 0;
  run->cruise_left = 0;
  run->decel_left = 0;
#if BUSHD_RUN_BRAKES
  run->brake_left = 0;
#endif
  run->since = 0;
  run->since_ns = 0;
  run->lead_delay = 0;
  run->fraction = 0;
  run->direction = direction < 0 ? -1 : 1;
}

// `steps` to rest, the first of them with the delay A(first): max(A(first + j-1), D(steps-j), c).
static void cut(bushd_run* run, uint16_t first, uint32_t steps) {
  const bushd_table* table = run->table;
  const uint16_t accel_codes = codes_above(&table->accel, run->cruise);
  const uint16_t decel_codes = codes_above(&table->decel, run->cruise);
  if (first > accel_codes) first = accel_codes;  // from there on all is cruise
  uint16_t up = (uint16_t)(accel_codes - first);
  uint16_t down = steps < decel_codes ? (uint16_t)steps : decel_codes;
  if (steps < (uint32_t)up + down) {
    // Too short for both. The first `low` steps have A(first + j-1) >= D(steps-j): at least those
    // with D <= c.
    uint16_t low = (uint16_t)(steps - down);
    uint16_t high = steps < up ? (uint16_t)steps : up;
    while (low < high) {
      const uint16_t j = (uint16_t)(low + (uint16_t)(high - low) / 2u + 1u);
      if (table->accel.code[first + j - 1u] >= bushd_table_decel(table, steps - j)) {
        low = j;
      } else {
        high = (uint16_t)(j - 1u);
      }
    }
    up = low;
    down = (uint16_t)(steps - low);
  }
  run->accel_at = first;
  run->accel_end = (uint16_t)(first + up);
  run->cruise_left = steps - up - down;
  run->decel_left = down;
}

static bushd_delay cruise_above(const bushd_table* table, bushd_delay floor) {
  return floor > table->cruise ? floor : table->cruise;
}

void bushd_run_start(bushd_run* run, const bushd_table* table, uint32_t steps, int direction,
                     bushd_delay floor) {
  clear(run, table, direction);
  run->cruise = cruise_above(table, floor);
  cut(run, 0, steps);
}

void bushd_run_begin_late(bushd_run* run, uint32_t ns) {
  const uint32_t unit_ns = run->table->time_unit_ns;
  const uint32_t units = ns / unit_ns + (ns % unit_ns != 0);
  run->since = 0u - (bushd_since)units;
  run->since_ns = units * unit_ns - ns;
}

// The longest delay that a ramp-down waits for, in whole time units.
static uint32_t longest_wait(const bushd_run* run) {
  return BUSHD_RUN_WAITS_NS / run->table->time_unit_ns;
}

void bushd_run_leave_out_slow(bushd_run* run) {
  const uint32_t longest = longest_wait(run);
  if (longest >= UINT16_MAX || run->decel_left == 0) return;
  const bool runs = run->lead_delay == 0;  // the first of them does
  uint16_t out = codes_above(&run->table->decel, (uint16_t)longest);
  if (out >= run->decel_left) out = (uint16_t)(run->decel_left - (runs ? 1u : 0u));
  if (out == 0) return;
  run->accel_end = 0;
  run->accel_at = out;
  bushd_run_set_decel(run, run->decel_left);
}

// delay x unit - (since x unit + since_ns) > BUSHD_RUN_WAITS_NS, in 32 bits.
static bool waits_too_long(const bushd_run* run) {
  const uint32_t unit_ns = run->table->time_unit_ns;
  const bushd_since left = run->lead_delay - run->since;
  const bushd_signed_since more = (bushd_signed_since)(left - longest_wait(run));
  if (more <= 0) return false;
  return more > 1 || run->since_ns < unit_ns - BUSHD_RUN_WAITS_NS % unit_ns;
}

static void lead_then_ramp_down(bushd_run* run, bushd_delay delay) {
  run->lead_delay = delay;
  run->accel_at = run->accel_end;
#if BUSHD_RUN_BRAKES
  run->brake_left = 0;
#endif
  run->cruise_left = 0;
  run->decel_left = (uint16_t)bushd_table_steps_to_stop(run->table, delay);
  bushd_run_leave_out_slow(run);
}

static void rest_if_it_waits(bushd_run* run) {
  if (!waits_too_long(run)) return;
  run->lead_delay = 0;
  run->decel_left = 0;
  run->accel_at = run->accel_end;
}

void bushd_run_start_ramp_down(bushd_run* run, const bushd_table* table, bushd_delay delay,
                               uint8_t fraction, int direction) {
  clear(run, table, direction);
  if (delay == 0) return;
  // Rounded up to whole ns: rounded down, the position would first fall back behind `fraction`.
  const uint32_t unit_ns = table->time_unit_ns;
  const uint64_t over_ns = ((uint64_t)delay * unit_ns * fraction + 255u) / 256u;
  run->since = (bushd_since)(over_ns / unit_ns);
  run->since_ns = (uint32_t)(over_ns % unit_ns);
  run->fraction = fraction;
  lead_then_ramp_down(run, delay);
  rest_if_it_waits(run);
}

void bushd_run_ramp_down_after_step(bushd_run* run) {
  const bushd_delay delay = bushd_run_delay(run);
  if (delay != 0) lead_then_ramp_down(run, delay);
}

void bushd_run_ramp_down(bushd_run* run) {
  bushd_run_ramp_down_after_step(run);
  rest_if_it_waits(run);
}

#if BUSHD_RUN_BRAKES

// After a lead faster than the cruise delay: along the decelerating side down to that, and at the
// end along the rest of it. Precondition: steps >= to_stop, the lead's.
static void brake(bushd_run* run, uint32_t to_stop, uint32_t steps) {
  const uint16_t decel_codes = codes_above(&run->table->decel, run->cruise);
  run->accel_at = run->accel_end = codes_above(&run->table->accel, run->cruise);
  run->brake_left = (uint16_t)(to_stop - decel_codes);
  run->cruise_left = steps - to_stop;
  run->decel_left = decel_codes;
}

bool bushd_run_retarget(bushd_run* run, uint32_t steps_after, bushd_delay floor) {
  const bushd_delay delay = bushd_run_delay(run);
  if (delay == 0) return false;
  const uint32_t to_stop = bushd_table_steps_to_stop(run->table, delay);
  if (to_stop > steps_after) return false;
  run->lead_delay = delay;
  run->cruise = cruise_above(run->table, floor);
  if (delay < run->cruise) {
    brake(run, to_stop, steps_after);
    return true;
  }
  run->brake_left = 0;
  const bushd_ramp* accel = &run->table->accel;
  const uint16_t at = codes_above(accel, delay);
  const bool there = at < accel->count && accel->code[at] == delay;
  cut(run, there ? (uint16_t)(at + 1u) : at, steps_after);
  return true;
}

#endif

// Steps left on the decelerating side before those at the cruise delay.
static inline uint16_t brake_left(const bushd_run* run) {
#if BUSHD_RUN_BRAKES
  return run->brake_left;
#else
  (void)run;
  return 0;
#endif
}

bushd_delay bushd_run_delay(const bushd_run* run) {
  if (run->lead_delay != 0) return run->lead_delay;
  if (run->accel_at < run->accel_end) return run->table->accel.code[run->accel_at];
  if (brake_left(run) != 0) return run->table->decel.code[run->decel_left + brake_left(run) - 1];
  if (run->cruise_left != 0) return run->cruise;
  if (run->decel_left != 0) return run->table->decel.code[run->decel_left - 1];
  return 0;
}

#if BUSHD_RUN_BRAKES
bushd_delay bushd_run_take_step(bushd_run* run) {
  const bushd_delay delay = bushd_run_delay(run);
  if (delay == 0) return 0;
  if (run->lead_delay != 0) {
    run->lead_delay = 0;
  } else if (run->accel_at < run->accel_end) {
    ++run->accel_at;
  } else if (run->brake_left != 0) {
    --run->brake_left;
  } else if (run->cruise_left != 0) {
    --run->cruise_left;
  } else {
    bushd_run_set_decel(run, (uint16_t)(run->decel_left - 1u));
  }
  run->since = 0;
  run->since_ns = 0;
  run->fraction = 0;
  bushd_run_count(run, 1);
  return delay;
}
#endif

uint32_t bushd_run_steps_left(const bushd_run* run) {
  // In a ramp-down that leaves some out the second of these is negative.
  return (uint32_t)(run->lead_delay != 0) + run->accel_end - run->accel_at + brake_left(run) +
         run->cruise_left + run->decel_left;
}

bool bushd_run_done(const bushd_run* run) {
  return bushd_run_steps_left(run) == 0;
}

static uint32_t units_between(const bushd_ramp* ramp, uint16_t from, uint16_t to) {
#if BUSHD_RAMP_INDEX
  if (ramp->sum != NULL) return ramp->sum[to] - ramp->sum[from];
#endif
  uint32_t units = 0;  // bushd_table_check
  for (uint16_t i = from; i < to; ++i) units += ramp->code[i];
  return units;
}

uint64_t bushd_run_units_left(const bushd_run* run) {
  if (bushd_run_done(run)) return 0;
  const bushd_table* table = run->table;
  // Where steps are left out, accel_at may lie beyond the side.
  const bool rises = run->accel_at < run->accel_end;
  const uint32_t rising = rises ? units_between(&table->accel, run->accel_at, run->accel_end) : 0u;
  uint64_t cruising = (uint64_t)run->cruise_left * run->cruise;
#if BUSHD_SLOW_RUNS
  if (__builtin_mul_overflow(run->cruise_left, run->cruise, &cruising) ||
      cruising > INT64_MAX / 2) {
    cruising = INT64_MAX / 2;
  }
#endif
  return (uint64_t)run->lead_delay + rising + cruising +
         units_between(&table->decel, bushd_run_decel_end(run),
                       (uint16_t)(run->decel_left + brake_left(run))) -
         (uint64_t)(bushd_signed_since)run->since;
}

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
  if (run->accel_at >= run->accel_end && brake_left(run) == 0) {
    if (run->cruise_left != 0) steps += advance_cruise(run);
    if (run->cruise_left == 0 && run->decel_left != 0) steps += advance_decel(run);
  }
  return steps;
}

// A tick in whole units and the rest; `since_ns` collects the rests until they make a unit.
typedef struct tick_units {
  uint32_t whole;
  uint32_t rest_ns;
  uint32_t unit_ns;
} tick_units;

static tick_units in_units(const bushd_run* run, uint32_t tick_ns) {
  const uint32_t unit_ns = run->table->time_unit_ns;
  const tick_units tick = {tick_ns / unit_ns, tick_ns % unit_ns, unit_ns};
  return tick;
}

static inline uint32_t next_units(uint32_t* since_ns, const tick_units* tick) {
  const uint32_t sum = *since_ns + tick->rest_ns;
  const bool carry = sum >= tick->unit_ns;
  *since_ns = carry ? sum - tick->unit_ns : sum;
  return tick->whole + carry;
}

// A small MCU makes few ticks at a time, and has no stack for blocks.
#if BUSHD_RAMP_INDEX

// Below this many ticks the divisions that a block begins with cost more than it saves.
#define BLOCK_TICKS 4u

// Where coarse displacements go.
typedef struct coarse_out {
  uint8_t* at;
  size_t stride;
  uint8_t direction_bit;
} coarse_out;

// The blocks below expand many ticks inside one part with its state in registers. How many surely
// stay inside is known before, so that their loops have no way out; `advance` takes the ticks
// across a border. Only coarse ones exist: a fine tick is dominated by its division.

// Ticks along an indexed side, in its direction (forward) or against it. `*time` is the place on
// the side in units, `*index` the step that runs there. Precondition: buckets not wider than the
// shortest delay, so that one comparison finds the step.
static inline void ramp_ticks(const bushd_ramp* ramp, const tick_units* tick, size_t ticks,
                              bool forward, bool whole_only, uint32_t* time, uint32_t* index,
                              uint32_t* since_ns, coarse_out out) {
  const uint32_t* const sum = ramp->sum;
  const uint32_t* const bucket = ramp->bucket;
  const uint8_t shift = ramp->bucket_shift;
  const tick_units t = *tick;
  uint32_t now = *time;
  uint32_t i = *index;
  uint32_t ns = *since_ns;
  for (; ticks > 0; --ticks) {
    const uint32_t units = whole_only ? t.whole : next_units(&ns, &t);
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

// Ticks that surely end before `units` more have passed; 0 if the buckets are too wide for
// ramp_ticks.
static uint32_t safe_ramp_ticks(const bushd_ramp* ramp, const tick_units* tick, uint32_t units) {
  if (UINT32_C(1) << ramp->bucket_shift > ramp->code[ramp->count - 1]) return 0;
  return (units - 1) / (tick->whole + (tick->rest_ns != 0));
}

static size_t coarse_accel_block(bushd_run* run, const tick_units* tick, size_t ticks,
                                 coarse_out out) {
  const bushd_ramp* ramp = &run->table->accel;
  if (ramp->sum == NULL) return 0;
  uint32_t i = run->accel_at;
  uint32_t now = ramp->sum[i] + (uint32_t)run->since;
  const uint32_t safe = safe_ramp_ticks(ramp, tick, ramp->sum[run->accel_end] - now);
  if (ticks > safe) ticks = (size_t)safe;
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

static size_t coarse_decel_block(bushd_run* run, const tick_units* tick, size_t ticks,
                                 coarse_out out) {
  const bushd_ramp* ramp = &run->table->decel;
  if (ramp->sum == NULL) return 0;
  // One unit before the time that remains, the step that runs is the fewest left, less one
  // (advance_decel).
  uint32_t i = run->decel_left - 1u;
  uint32_t now = ramp->sum[run->decel_left] - (uint32_t)run->since - 1;
  const uint32_t safe = safe_ramp_ticks(ramp, tick, now + 1 - ramp->sum[bushd_run_decel_end(run)]);
  if (ticks > safe) ticks = (size_t)safe;
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

static size_t coarse_cruise_block(bushd_run* run, const tick_units* tick, size_t ticks,
                                  coarse_out out) {
  // In units if ticks are whole units, else in ns: one remainder to carry instead of two.
  const bool in_ns = tick->rest_ns != 0;
  const int64_t scale = in_ns ? tick->unit_ns : 1;
  const int64_t delay = (int64_t)run->cruise * scale;
  const int64_t tick_length = in_ns ? tick->whole * scale + tick->rest_ns : tick->whole;
  const uint32_t whole = (uint32_t)(tick_length / delay);
  const int64_t rest = tick_length - whole * delay;
  const uint32_t safe = run->cruise_left / (whole + 1);
  if (ticks > safe) ticks = (size_t)safe;
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

static size_t coarse_block(bushd_run* run, const tick_units* tick, size_t ticks, coarse_out out) {
  if (run->lead_delay != 0 || brake_left(run) != 0 || bushd_run_begins_later(run)) return 0;
  if (run->accel_at < run->accel_end) return coarse_accel_block(run, tick, ticks, out);
  if (run->cruise_left != 0) return coarse_cruise_block(run, tick, ticks, out);
  return coarse_decel_block(run, tick, ticks, out);
}

#endif

size_t bushd_run_expand_coarse(bushd_run* run, uint32_t tick_ns, size_t ticks, uint8_t* out,
                               size_t stride) {
  const tick_units tick = in_units(run, tick_ns);
  const uint8_t direction_bit = run->direction > 0 ? BUSHD_COARSE_DIRECTION : 0;
  size_t n = 0;
  while (n < ticks && !bushd_run_done(run)) {
#if BUSHD_RAMP_INDEX
    if (ticks - n >= BLOCK_TICKS) {
      const coarse_out rest = {out + n * stride, stride, direction_bit};
      n += coarse_block(run, &tick, ticks - n, rest);
      // The block may have made the last step: no tick is active after it.
      if (n == ticks || bushd_run_done(run)) break;
    }
#endif
    const uint32_t steps = advance(run, next_units(&run->since_ns, &tick));
    bushd_run_count(run, steps);
    out[n++ * stride] = (uint8_t)(steps | direction_bit);
  }
  const size_t active = n;
  for (; n < ticks; ++n) out[n * stride] = 0;
  return active;
}

// 256 since_ns / unit_ns, rounded down. Dividing what is rounded down rounds as dividing the exact
// sum does, so the fraction of a step needs 32 bits only; on an 8-bit MCU 64-bit divisions would
// not fit into a tick.
static uint32_t sub_units(uint32_t since_ns, uint32_t unit_ns) {
  if (since_ns == 0) return 0;
  if (since_ns < UINT32_C(1) << 24) return since_ns * 256u / unit_ns;
  return (uint32_t)((uint64_t)since_ns * 256u / unit_ns);
}

// Of the running delay, 1/256 rounded down.
static inline uint32_t fraction_now(const bushd_run* run, uint32_t unit_ns) {
  const bushd_delay delay = bushd_run_delay(run);
  if (delay == 0) return 0;
  const uint32_t rest = sub_units(run->since_ns, unit_ns);
#if BUSHD_SLOW_RUNS
  if (!bushd_delay_is_code(delay)) return (uint32_t)((run->since * 256u + rest) / delay);
#endif
  return ((uint32_t)run->since * 256u + rest) / (uint16_t)delay;
}

size_t bushd_run_expand_fine(bushd_run* run, uint32_t tick_ns, size_t ticks, int16_t* out,
                             size_t stride) {
  const tick_units tick = in_units(run, tick_ns);
  size_t n = 0;
  while (n < ticks && !bushd_run_done(run)) {
    const uint32_t steps = advance(run, next_units(&run->since_ns, &tick));
    bushd_run_count(run, steps);
    const uint32_t fraction = fraction_now(run, tick.unit_ns);
    const int32_t displacement = (int32_t)(steps * 256u + fraction) - (int32_t)run->fraction;
    run->fraction = (uint8_t)fraction;
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
