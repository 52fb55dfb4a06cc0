// How the steps of a tick get to the pins (RU 2704486): which settings a grid of slots can keep,
// and in which slots the pulses lie where a step's own time does not decide it.
//
// T_step is `period_slots`. A motor with c steps in a tick has one of them in each of the tick's
// first c periods; period k begins at slot  setup_slots + k period_slots.  In it, the motors that
// still have steps
//     burst       (claim 1)  pulse together, in its first slot
//     common-dir  (claim 3)  pulse in its first slot if they go left, in its second if right; the
//                            one DIR line is low in even slots and high in odd ones
//     staggered   (claim 4)  pulse one after the other, dt_p apart if dt_p < dt_n = T_step / n_d,
//                            else dt_n; n_d motors, in rising order
//     both        (claims 11, 12)  those that go left pulse in turn in even slots, then those that
//                            go right in odd ones; T_step and dt_p are even numbers of slots
#ifndef BUSHD_ENGINE_EMISSION_H
#define BUSHD_ENGINE_EMISSION_H

#include <stdint.h>

#include "engine/message.h"

#ifdef __cplusplus
extern "C" {
#endif

// An MCU that follows the bus makes a tick shorter by this share of it at most.
#define BUSHD_TICK_SLEW_DIVISOR 64u

// Settings in slots.
typedef struct bushd_emission_grid {
  uint8_t mode;       // bushd_emission_mode
  uint8_t max_steps;  // of a motor in a tick
  uint16_t period_slots;
  uint16_t setup_slots;   // from the beginning of a tick, where DIR changes, until the first step
  uint16_t settle_slots;  // dt_p; UINT16_MAX: not known
} bushd_emission_grid;

// BUSHD_E_PULSE_WIDTH: half a slot is shorter than the pulses are to be. BUSHD_E_DIR_SETUP: DIR
// cannot be early enough. A tick that is shortened to follow the bus keeps both too.
// BUSHD_E_STEP_PERIOD: T_step does not fit into a tick. Divisions; for set-up only.
bushd_status bushd_emission_fit(const bushd_emission* settings, uint32_t tick_ns,
                                uint16_t slot_count, bushd_emission_grid* grid);

// `settle_slots` for this time; 0: not known.
uint16_t bushd_emission_settle_slots(uint32_t settle_ns, uint32_t tick_ns, uint16_t slot_count);

// Makes the masks of all slots anew, for modes with periods. steps[m] is bit m's
// signed number, |steps[m]| <= grid->max_steps. O(slots + motors), for staggered O(slots + steps).
void bushd_emission_fill(uint16_t* masks, uint16_t slot_count, const bushd_emission_grid* grid,
                         const int16_t* steps, uint8_t motors);

// Steps of these motors in the first setup_slots slots move to the first slots from there on in
// which they have none. Precondition: each has slot_count - setup_slots steps at most.
void bushd_emission_defer(uint16_t* masks, uint16_t motors, uint16_t setup_slots);

// Levels of a motor's four outputs (three of them for three-phase) at a position, and after how
// many steps they come again.
uint8_t bushd_phase_count(uint8_t sequence);
uint8_t bushd_phase_levels(uint8_t sequence, uint8_t phase);

#ifdef __cplusplus
}
#endif
#endif
