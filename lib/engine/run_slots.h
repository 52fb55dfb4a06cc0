// A run's steps exact to a slot, where no displacements stand between the table and the outputs.
#ifndef BUSHD_ENGINE_RUN_SLOTS_H
#define BUSHD_ENGINE_RUN_SLOTS_H

#include <stdint.h>

#include "engine/run.h"

#ifdef __cplusplus
extern "C" {
#endif

// A tick in the time units of a table. Made once for many ticks: it takes divisions.
typedef struct bushd_run_tick {
  uint32_t tick_ns;
  uint32_t unit_ns;
  uint32_t units;
  uint32_t rest_ns;
  uint16_t reciprocal;  // of tick_ns, x 2^32
} bushd_run_tick;
bushd_run_tick bushd_run_tick_of(uint32_t tick_ns, uint32_t unit_ns);

// Makes the next tick of a run: sets `bit` in the masks of the slots floor(t x slot_count /
// tick_ns) for the steps at the times t from the tick's start; one at exactly its end falls into
// its last slot. Returns the signed number of steps, 0 when the run is done. The run stands at the
// tick's end afterwards, as bushd_run_expand_coarse would leave it: ticks of both kinds may be
// mixed.
//   masks  slot_count entries (BUSHD_MIN_SLOTS..BUSHD_MAX_SLOTS)
// Precondition: as for bushd_run_expand_*; then no two steps share a slot. `tick` is of the unit of
// the run's table and at most BUSHD_MAX_TICK_NS. O(slots + steps), no division.
int16_t bushd_run_slots(bushd_run* run, const bushd_run_tick* tick, uint16_t slot_count,
                        uint16_t bit, uint16_t* masks);

// Makes the run's fraction what bushd_run_expand_fine would have left, so that ticks of that kind
// may follow. Precondition: it stands at the end of a tick made by bushd_run_slots. No division.
void bushd_run_note_fraction(bushd_run* run);

#ifdef __cplusplus
}
#endif
#endif
