#include "engine/run_state.h"

// In cruise now and for `ticks` more: then the numbers of the other parts need not be told.
static bool cruises(const bushd_run* run, uint32_t tick_ns, uint16_t ticks) {
  if (run->lead_steps != 0 || run->accel_at != run->accel_end || run->cruise_left == 0) {
    return false;
  }
  const uint64_t step_ns = (uint64_t)run->table->cruise * run->table->time_unit_ns;
  const uint64_t since_ns = (uint64_t)run->since * run->table->time_unit_ns + run->since_ns;
  return since_ns + (uint64_t)tick_ns * ticks < step_ns * run->cruise_left;
}

bushd_run_state bushd_run_save(const bushd_run* run, uint32_t tick_ns, uint16_t ticks) {
  const bushd_run_state state = {run->direction,
                                 cruises(run, tick_ns, ticks),
                                 (uint16_t)run->since,
                                 run->since_ns,
                                 run->lead_steps != 0 ? run->lead_delay : (uint16_t)0,
                                 (uint16_t)run->accel_at,
                                 (uint16_t)run->accel_end,
                                 run->cruise_left,
                                 (uint16_t)run->decel_left};
  return state;
}

// A part's codes lie above the cruise delay (engine/run.c); anything faster was never planned.
static bool part_fits(const bushd_ramp* ramp, uint16_t cruise, uint16_t end) {
  return end == 0 || (end <= ramp->count && ramp->code[end - 1] > cruise);
}

bool bushd_run_restore(bushd_run* run, const bushd_table* table, const bushd_run_state* state) {
  bushd_run_start(run, table, 0, state->direction);
  if (state->cruises) {
    run->cruise_left = UINT32_MAX;
  } else {
    if (state->accel_at > state->accel_end ||
        !part_fits(&table->accel, table->cruise, state->accel_end) ||
        !part_fits(&table->decel, table->cruise, state->decel_left)) {
      return false;
    }
    run->accel_at = state->accel_at;
    run->accel_end = state->accel_end;
    run->cruise_left = state->cruise_left;
    run->decel_left = state->decel_left;
  }
  if (state->lead_delay != 0) {
    if (state->lead_delay < table->cruise) return false;
    run->lead_steps = 1;
    run->lead_delay = state->lead_delay;
  }
  const uint16_t delay = bushd_run_delay(run);
  if (state->since >= delay || state->since_ns >= table->time_unit_ns) return false;
  run->since = state->since;
  run->since_ns = state->since_ns;
  // As the tick before left it, by the rule of bushd_run_expand_fine.
  const uint64_t since_ns = (uint64_t)state->since * table->time_unit_ns + state->since_ns;
  run->fraction = (uint8_t)(since_ns * 256u / ((uint64_t)delay * table->time_unit_ns));
  return true;
}
