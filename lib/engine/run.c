// A run is cut, when it starts or gets a new target, into at most four parts by the rule
// max(A(j-1), D(N-j), c): a lead (a step taken over in its middle), steps on the accelerating side,
// steps at cruise, steps on the decelerating side. Both sides are sorted, so A(j-1) - D(N-j) never
// rises with j and one binary search finds where deceleration takes over; codes not above c count
// as cruise. A shortest delay of the run is a longer c. To slow down to a shortest delay a run
// brakes, on the decelerating side as far as it lies below the shortest delay, in place of speeding
// up. run_ticks.c goes through the parts.
#include "engine/run.h"

#include "engine/run_parts.h"

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

static bushd_delay cruise_above(const bushd_table* table, bushd_delay shortest_delay) {
  return shortest_delay > table->cruise ? shortest_delay : table->cruise;
}

void bushd_run_start(bushd_run* run, const bushd_table* table, uint32_t steps, int direction,
                     bushd_delay shortest_delay) {
  clear(run, table, direction);
  run->cruise = cruise_above(table, shortest_delay);
  cut(run, 0, steps);
}

void bushd_run_start_as_written(bushd_run* run, const bushd_table* table, uint32_t steps,
                                int direction) {
  clear(run, table, direction);
  run->accel_end = table->accel.count;
  run->decel_left = table->decel.count;
  run->cruise_left = steps - table->accel.count - table->decel.count;
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

bool bushd_run_retarget(bushd_run* run, uint32_t steps_after, bushd_delay shortest_delay) {
  const bushd_delay delay = bushd_run_delay(run);
  if (delay == 0) return false;
  const uint32_t to_stop = bushd_table_steps_to_stop(run->table, delay);
  if (to_stop > steps_after) return false;
  run->lead_delay = delay;
  run->cruise = cruise_above(run->table, shortest_delay);
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

bushd_delay bushd_run_delay(const bushd_run* run) {
  if (run->lead_delay != 0) return run->lead_delay;
  if (run->accel_at < run->accel_end) return run->table->accel.code[run->accel_at];
  if (bushd_run_brake_left(run) != 0)
    return run->table->decel.code[run->decel_left + bushd_run_brake_left(run) - 1];
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
  return bushd_run_parts_left(run);
}

bool bushd_run_done(const bushd_run* run) {
  return bushd_run_parts_left(run) == 0;
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
                       (uint16_t)(run->decel_left + bushd_run_brake_left(run))) -
         (uint64_t)(bushd_signed_since)run->since;
}
