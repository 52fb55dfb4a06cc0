#include "engine/run_plan.h"

#include <stdbool.h>

#include "engine/run_parts.h"

static uint64_t units_between(const bushd_ramp* ramp, uint32_t from, uint32_t to) {
#if BUSHD_RAMP_INDEX
  if (ramp->sum != NULL) return ramp->sum[to] - ramp->sum[from];
#endif
  uint64_t units = 0;
  for (uint32_t i = from; i < to; ++i) units += ramp->code[i];
  return units;
}

// Takes as many of the steps as the part has; returns how many.
static uint32_t take(uint32_t* steps, uint32_t part) {
  const uint32_t taken = *steps < part ? *steps : part;
  *steps -= taken;
  return taken;
}

uint64_t bushd_run_units_of_last(const bushd_run* run, uint32_t steps) {
  const bushd_table* table = run->table;
  const uint32_t end = bushd_run_decel_end(run);
  uint64_t units = units_between(&table->decel, end, end + take(&steps, run->decel_left - end));
  units += (uint64_t)take(&steps, run->cruise_left) * run->cruise;
  const uint32_t braked = take(&steps, bushd_run_brake_left(run));
  units += units_between(&table->decel, run->decel_left, run->decel_left + braked);
  const uint32_t rising =
      run->accel_at < run->accel_end ? (uint32_t)(run->accel_end - run->accel_at) : 0u;
  const uint32_t made_up = take(&steps, rising);
  units += units_between(&table->accel, run->accel_end - made_up, run->accel_end);
  return steps == 0 ? units : units + run->lead_delay;
}

void bushd_run_ramp_down_once(bushd_run* run) {
  if (bushd_run_brake_left(run) == 0) {
    const bool ramps_down = run->accel_at >= run->accel_end && run->cruise_left == 0;
    if (!ramps_down) bushd_run_ramp_down_after_step(run);
    if (ramps_down && run->accel_at == run->accel_end) bushd_run_leave_out_slow(run);
    return;
  }
#if BUSHD_RUN_BRAKES
  run->decel_left = (uint16_t)(run->decel_left + run->brake_left);
  run->brake_left = 0;
  run->cruise_left = 0;
  bushd_run_leave_out_slow(run);
#endif
}

bool bushd_run_is_slow(const bushd_table* table, bushd_delay shortest_delay, uint32_t tick_ns,
                       uint32_t delay_ns) {
  const uint16_t fastest = bushd_table_fastest(table);
  const bushd_delay shortest = fastest > shortest_delay ? fastest : shortest_delay;
  return tick_ns >= BUSHD_SLOW_LINE_TICK_NS && (uint64_t)shortest * table->time_unit_ns >= delay_ns;
}
