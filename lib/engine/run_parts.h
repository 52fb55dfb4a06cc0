// The parts of a run (run.c), for run*.c alone.
#ifndef BUSHD_ENGINE_RUN_PARTS_H
#define BUSHD_ENGINE_RUN_PARTS_H

#include "engine/run.h"

// Where the decelerating side ends.
static inline uint16_t bushd_run_decel_end(const bushd_run* run) {
  return run->accel_at > run->accel_end ? (uint16_t)(run->accel_at - run->accel_end) : (uint16_t)0;
}
// Steps on it have been made; with the last one the run is done.
static inline void bushd_run_set_decel(bushd_run* run, uint16_t left) {
  run->decel_left = left;
  if (left != bushd_run_decel_end(run)) return;
  run->decel_left = 0;
  run->accel_at = run->accel_end;
}
// Steps left on the decelerating side before those at the cruise delay.
static inline uint16_t bushd_run_brake_left(const bushd_run* run) {
#if BUSHD_RUN_BRAKES
  return run->brake_left;
#else
  (void)run;
  return 0;
#endif
}
// Steps have been made.
static inline void bushd_run_count(bushd_run* run, uint32_t steps) {
#if BUSHD_RUN_COUNTS
  run->steps_done += steps;
#else
  (void)run;
  (void)steps;
#endif
}
// bushd_run_steps_left, in line where it is asked for in every tick.
static inline uint32_t bushd_run_parts_left(const bushd_run* run) {
  // In a ramp-down that leaves some out the second of these is negative.
  return (uint32_t)(run->lead_delay != 0) + run->accel_end - run->accel_at +
         bushd_run_brake_left(run) + run->cruise_left + run->decel_left;
}

#endif
