// A running move: the table's step times turned into displacements per tick.
//
// Step j of a run falls at the sum of its first j delays (engine/table.h). A motor's position at
// the end of a tick counts every step whose time is <= that end; the fine format adds the elapsed
// share of the running delay, rounded down to 1/256 step. A displacement is the difference of two
// such positions. All in integers; nothing is lost over any number of ticks, calls or block sizes.
#ifndef BUSHD_ENGINE_RUN_H
#define BUSHD_ENGINE_RUN_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "engine/table.h"

#ifdef __cplusplus
extern "C" {
#endif

// Coarse displacement, the byte of RU 2704486: bit 7 direction (1 = positive), bits 6..0 steps.
// Fine displacement: int16, steps x 256, signed. Both hold at most 127 steps a tick.
#define BUSHD_MAX_STEPS_PER_TICK 127u
#define BUSHD_COARSE_DIRECTION 0x80u

// Runs may count their steps. A build for a small MCU does without, and with the memory for it.
#ifndef BUSHD_RUN_COUNTS
#define BUSHD_RUN_COUNTS 1
#endif

// Runs may slow down to another speed in flight. Only who plans runs does that.
#ifndef BUSHD_RUN_BRAKES
#define BUSHD_RUN_BRAKES 1
#endif

// Plain state, copyable: a copy taken at some tick replays the same ticks. Private to run*.c but
// for the fields named here: `direction` (+1 / -1), `steps_done`.
typedef struct bushd_run {
  const bushd_table* table;
#if BUSHD_RUN_COUNTS
  uint32_t steps_done;
#endif
  uint32_t cruise_left;  // steps left at the cruise delay
  bushd_since since;     // whole time units since the last step; before the run begins (begin_late)
                         // negative
  uint32_t since_ns;     // and the rest, < time_unit_ns
  bushd_delay cruise;    // the table's cruise delay, or the run's shortest delay above it
  bushd_delay lead_delay;  // of a step with a delay of its own, before all others; 0: none
  uint16_t accel_at;       // next index on the accelerating side
  uint16_t accel_end;  // and where that part ends; of a ramp-down, where it lies before accel_at,
                       // so many steps at its end are left out
#if BUSHD_RUN_BRAKES
  uint16_t brake_left;  // steps on the decelerating side before those at the cruise delay
#endif
  uint16_t decel_left;  // steps left on the decelerating side, at the end
  uint8_t fraction;     // of the position at the end of the last fine tick, 1/256 step
  int8_t direction;
} bushd_run;

// A move of `steps` (>= 0) from rest; direction is +1 or -1. The first tick expanded is the one in
// which the move starts at its beginning. O(log steps).
//   shortest delay  no delay is shorter, time units; the table's own delays where they are longer.
//   0: none.
//          Beyond all codes it is the delay of every step
// Precondition: the table passed bushd_table_check.
void bushd_run_start(bushd_run* run, const bushd_table* table, uint32_t steps, int direction,
                     bushd_delay shortest_delay);

// A run of all codes of both sides as they stand, in any order: A(0) .. A(last), then c so often
// that it has `steps`, then the decelerating side down to D(0). Such a run can neither ramp down
// nor be retargeted. Precondition: the table passed bushd_table_check_written; steps >= the codes
// of both sides. O(1).
void bushd_run_start_as_written(bushd_run* run, const bushd_table* table, uint32_t steps,
                                int direction);

// Puts the beginning of a run that has just been started `ns` after the beginning of its first
// tick. Precondition: ns <= length of the ticks that it will be expanded in. O(1).
void bushd_run_begin_late(bushd_run* run, uint32_t ns);
// Its first tick has not been expanded: it begins later in it. O(1).
static inline bool bushd_run_begins_later(const bushd_run* run) {
  return (bushd_signed_since)run->since < 0;
}

// A ramp-down waits for no step that is to come later: a motor that slow may just stand. The
// running step is not made if more than this is left of it, and no step on the way down with a
// longer delay.
#define BUSHD_RUN_WAITS_NS UINT32_C(500000000)

// A ramp-down taken up in the middle of a step whose delay is `delay`, of which fraction/256
// (rounded up to whole ns) is over: that step, then D(k-1) .. D(0), but for those that it does not
// wait for. It is what an MCU runs when its queue ends early. O(log count).
void bushd_run_start_ramp_down(bushd_run* run, const bushd_table* table, bushd_delay delay,
                               uint8_t fraction, int direction);

// Shortens the run to the nearest end that its table allows: the running step is completed, then
// the fewest steps k with D(k) <= its delay, but for those that it does not wait for. Does nothing
// to a run that is done. O(log count).
void bushd_run_ramp_down(bushd_run* run);
// The same, but the running step is completed however long it takes: motors that follow the run may
// have made theirs.
void bushd_run_ramp_down_after_step(bushd_run* run);
// Leaves out the steps that a run does not wait for, but not the running one, where it ramps down
// from here on. For run_plan.c.
void bushd_run_leave_out_slow(bushd_run* run);

// Changes where the run ends, in its direction, and its shortest delay: the running step, of delay
// x, is completed, and `steps_after` more follow. They take up the accelerating side where x stands
// in it: with a the first index of A(a) <= x, or the one after it if A(a) == x, and k the fewest
// steps with D(k) <= x, the delay before step j of these n is
//
//     max( A(a+j-1), D(n-j), c, f(j) ),   f(j) = min( shortest_delay, D(k-j) ) while j <= k, else
//     shortest_delay
//
// so that the run goes on speeding up, slows down to its shortest delay, holds cruise, or ramps
// down, whatever it did before. Returns false, and changes nothing, if a ramp-down takes more steps
// than that (the run would overshoot) or the run is done. O(log steps).
bool bushd_run_retarget(bushd_run* run, uint32_t steps_after, bushd_delay shortest_delay);

// The next `ticks` displacements of `tick_ns` each into out[0], out[stride], ... ; after the end of
// the run they are 0. If that came in the middle of a step, the first fine one after it leads back
// to the whole step. Returns the number of ticks in which the run was still active (<= ticks), so
// a return value below `ticks` says that it has ended. O(1) amortised per tick.
// Precondition: tick_ns >= 1, bushd_table_max_steps_per_tick(table, tick_ns) <=
// BUSHD_MAX_STEPS_PER_TICK, and a run uses one tick length and one format throughout.
size_t bushd_run_expand_coarse(bushd_run* run, uint32_t tick_ns, size_t ticks, uint8_t* out,
                               size_t stride);
size_t bushd_run_expand_fine(bushd_run* run, uint32_t tick_ns, size_t ticks, int16_t* out,
                             size_t stride);

// The delay of the step that is running, time units; 0 when the run is done. O(1).
bushd_delay bushd_run_delay(const bushd_run* run);
bool bushd_run_done(const bushd_run* run);
#if BUSHD_RUN_BRAKES
// Makes the next step, whenever that is: returns the delay before it, time units; 0 when the run is
// done. What is over of the running step is forgotten. O(1).
bushd_delay bushd_run_take_step(bushd_run* run);
#endif
// Steps still to be made. O(1).
uint32_t bushd_run_steps_left(const bushd_run* run);
// Time from now to the last step, in time units and rounded up; what 62 bits do not hold is cut
// off. O(steps left on the ramps) without an index, else O(1).
uint64_t bushd_run_units_left(const bushd_run* run);

#ifdef __cplusplus
}
#endif
#endif
