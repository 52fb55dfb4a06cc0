#include "engine/run_state.h"

#include "engine/run_parts.h"

// In cruise now and for `ticks` more: then the numbers of the other parts need not be told.
static bool cruises(const bushd_run* run, uint32_t tick_ns, uint16_t ticks) {
  if (run->lead_delay != 0 || run->accel_at != run->accel_end || run->cruise_left == 0) {
    return false;
  }
  const uint64_t step_ns = (uint64_t)run->cruise * run->table->time_unit_ns;
  const uint64_t since_ns = (uint64_t)run->since * run->table->time_unit_ns + run->since_ns;
  return since_ns + (uint64_t)tick_ns * ticks < step_ns * run->cruise_left;
}

bool bushd_run_has_state(const bushd_run* run) {
  const uint32_t left = bushd_run_steps_left(run);
  if (left == 0 || bushd_run_begins_later(run) || bushd_run_decel_end(run) != 0) return false;
#if BUSHD_RUN_BRAKES
  if (run->brake_left != 0) return false;
#endif
  // All that would come after the running step is left out.
  if (left == 1 && bushd_table_decel(run->table, 0) > bushd_run_delay(run)) return false;
  return bushd_delay_is_code(bushd_run_delay(run)) && bushd_delay_is_code(run->cruise);
}

bushd_run_state bushd_run_save(const bushd_run* run, uint32_t tick_ns, uint16_t ticks) {
  const uint16_t cruise = run->cruise == run->table->cruise ? (uint16_t)0 : (uint16_t)run->cruise;
  const bushd_run_state state = {run->direction,
                                 cruises(run, tick_ns, ticks),
                                 (uint16_t)run->since,
                                 run->since_ns,
                                 (uint16_t)run->lead_delay,
                                 run->accel_at,
                                 run->accel_end,
                                 run->cruise_left,
                                 run->decel_left,
                                 cruise};
  return state;
}

// A part's codes lie above the cruise delay (engine/run.c); anything faster was never planned.
static bool part_fits(const bushd_ramp* ramp, uint16_t cruise, uint16_t end) {
  return end == 0 || (end <= ramp->count && ramp->code[end - 1] > cruise);
}

// Where one part follows another a jump in speed could hide. A step of delay x may be followed by
// the first code of the accelerating side that is below x, and by anything slower; with n steps to
// come after it, x must be at least D(n). Within a part both hold, since sides are sorted.

// Codes from `at` on may follow a step of delay x.
static bool may_follow(const bushd_table* table, uint16_t x, uint16_t at) {
  return at == 0 || bushd_table_accel(table, at - 1u) >= x;
}

static bool speeds_up_in_order(const bushd_table* table, uint16_t cruise,
                               const bushd_run_state* state) {
  const uint16_t top = state->accel_end;
  const bool rises = state->accel_at < top;
  const bool on_top = bushd_table_accel(table, top) <= cruise;
  const uint16_t brake =
      state->decel_left != 0 ? table->decel.code[state->decel_left - 1] : UINT16_MAX;
  if (state->cruise_left != 0) {
    if (!on_top) return false;
  } else if (rises && brake < bushd_table_accel(table, top)) {
    return false;
  }
  if (state->lead_delay == 0) return true;
  if (rises && table->accel.code[state->accel_at] > state->lead_delay) return false;
  if (rises || state->cruise_left != 0) {
    return may_follow(table, state->lead_delay, state->accel_at);
  }
  return brake >= state->lead_delay ||
         (may_follow(table, state->lead_delay, top) && brake >= bushd_table_accel(table, top));
}

// A lead faster than the cruise delay goes over to it where no code of the decelerating side lies
// between them.
static bool lead_may_cruise(const bushd_table* table, uint16_t cruise,
                            const bushd_run_state* state) {
  return state->lead_delay >= cruise || state->cruise_left == 0 ||
         bushd_table_steps_to_stop(table, cruise) ==
             bushd_table_steps_to_stop(table, state->lead_delay);
}

static bool slows_down_in_order(const bushd_table* table, uint16_t cruise,
                                const bushd_run_state* state) {
  const uint16_t brakes_from = bushd_table_decel(table, state->decel_left);
  if (state->cruise_left != 0) {
    if (brakes_from > cruise) return false;
  } else if (state->accel_at < state->accel_end) {
    if (brakes_from > table->accel.code[state->accel_end - 1]) return false;
  }
  const uint32_t after_lead =
      (uint32_t)state->decel_left + state->cruise_left + (state->accel_end - state->accel_at);
  return state->lead_delay == 0 || bushd_table_decel(table, after_lead) <= state->lead_delay;
}

static bool parts_fit(const bushd_table* table, uint16_t cruise, const bushd_run_state* state) {
  const uint32_t most = UINT32_MAX - 1u - state->accel_end - state->decel_left;
  // A ramp-down begins anywhere.
  const bool after_lead_only = state->accel_at == state->accel_end && state->cruise_left == 0;
  return state->accel_at <= state->accel_end && state->cruise_left <= most &&
         part_fits(&table->accel, cruise, state->accel_end) &&
         part_fits(&table->decel, after_lead_only ? table->cruise : cruise, state->decel_left) &&
         (state->lead_delay == 0 ||
          (state->lead_delay >= table->cruise && lead_may_cruise(table, cruise, state))) &&
         speeds_up_in_order(table, cruise, state) && slows_down_in_order(table, cruise, state);
}

bool bushd_run_restore(bushd_run* run, const bushd_table* table, const bushd_run_state* state) {
  if (state->cruise != 0 && state->cruise <= table->cruise) return false;
  bushd_run_start(run, table, 0, state->direction, state->cruise);
  if (state->cruises) {
    if (state->lead_delay != 0) return false;
    run->cruise_left = UINT32_MAX;
  } else {
    if (!parts_fit(table, (uint16_t)run->cruise, state)) return false;
    run->lead_delay = state->lead_delay;
    run->accel_at = state->accel_at;
    run->accel_end = state->accel_end;
    run->cruise_left = state->cruise_left;
    run->decel_left = state->decel_left;
  }
  const bushd_delay delay = bushd_run_delay(run);
  if (state->since >= delay || state->since_ns >= table->time_unit_ns) return false;
  run->since = state->since;
  run->since_ns = state->since_ns;
  // As the tick before left it, by the rule of bushd_run_expand_fine.
  const uint64_t since_ns = (uint64_t)state->since * table->time_unit_ns + state->since_ns;
  run->fraction = (uint8_t)(since_ns * 256u / ((uint64_t)delay * table->time_unit_ns));
  return true;
}
