// What those ask of a run who have motors that follow it (engine/line.h).
#ifndef BUSHD_ENGINE_RUN_PLAN_H
#define BUSHD_ENGINE_RUN_PLAN_H

#include <stdbool.h>
#include <stdint.h>

#include "engine/run.h"

#ifdef __cplusplus
extern "C" {
#endif

// Time that the last `steps` steps of the run take, in time units: their delays, without what has
// passed of the running one. Precondition: steps <= bushd_run_steps_left. O(steps left on the
// ramps) without an index, else O(1).
uint64_t bushd_run_units_of_last(const bushd_run* run, uint32_t steps);

// As bushd_run_ramp_down_after_step, but a run that ramps down already, to its end or to a shortest
// delay, only goes on with that: equal codes that it has still to make are not left out. The
// interval between two steps of a slow motor that follows may hold all of them.
void bushd_run_ramp_down_once(bushd_run* run);

// Whether the run of this table and shortest delay is one that motors of an MCU without the
// capability TABLE_TICKS may follow on a line (docs/protocol.md, LINE_RUN): ticks last for so long
// at least, and all its delays for `delay_ns`. O(1).
#define BUSHD_SLOW_LINE_TICK_NS UINT32_C(2400000)
#define BUSHD_SLOW_LINE_DELAY_NS UINT32_C(270000)
// Where other motors of the MCU may be streamed meanwhile.
#define BUSHD_SHARED_LINE_DELAY_NS UINT32_C(400000)
bool bushd_run_is_slow(const bushd_table* table, bushd_delay shortest_delay, uint32_t tick_ns,
                       uint32_t delay_ns);

#ifdef __cplusplus
}
#endif
#endif
