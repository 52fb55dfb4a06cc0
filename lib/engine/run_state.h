// A run's state in few bytes: enough for an MCU that has the same table to go on with the run from
// a tick boundary, with the same displacements as the host.
#ifndef BUSHD_ENGINE_RUN_STATE_H
#define BUSHD_ENGINE_RUN_STATE_H

#include <stdbool.h>
#include <stdint.h>

#include "engine/run.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct bushd_run_state {
  int8_t direction;     // +1, -1
  bool cruises;         // throughout what is asked for: the fields from accel_at on mean nothing
  uint16_t since;       // whole time units since the last step
  uint32_t since_ns;    // and the rest, less than a unit
  uint16_t lead_delay;  // time units; 0: no lead
  uint16_t accel_at;
  uint16_t accel_end;
  uint32_t cruise_left;
  uint16_t decel_left;
  uint16_t cruise;  // the delay, time units, if above the table's; else 0
} bushd_run_state;

// Whether its state may be told: it is not done, has begun (bushd_run_begin_late), does not brake
// (bushd_run_retarget), leaves out no steps (bushd_run_ramp_down), and its delays have 16 bits.
// O(1).
bool bushd_run_has_state(const bushd_run* run);

// The state of a run, for going on with it for `ticks` ticks. Precondition: bushd_run_has_state,
// and the run stands at a tick boundary. O(1).
bushd_run_state bushd_run_save(const bushd_run* run, uint32_t tick_ns, uint16_t ticks);

// A run in that state; steps_done, where it is counted, begins at 0. Returns false, and leaves the
// run undefined, if no run of this table can be in that state: nothing in `state` is believed.
// O(log count).
bool bushd_run_restore(bushd_run* run, const bushd_table* table, const bushd_run_state* state);

#ifdef __cplusplus
}
#endif
#endif
