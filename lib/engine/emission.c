#include "engine/emission.h"

#include <stdbool.h>
#include <string.h>

#include "engine/run.h"

// How many slots last at least `ns`.
static uint32_t slots_in(uint32_t ns, uint32_t tick_ns, uint16_t slot_count) {
  return (uint32_t)(((uint64_t)ns * slot_count + tick_ns - 1u) / tick_ns);
}

bushd_status bushd_emission_fit(const bushd_emission* settings, uint32_t tick_ns,
                                uint16_t slot_count, bushd_emission_grid* grid) {
  const uint32_t shortest_ns = tick_ns - tick_ns / BUSHD_TICK_SLEW_DIVISOR;
  const uint32_t half_slot_ns = shortest_ns / (2u * slot_count);
  const uint32_t setup_ns = (uint32_t)settings->dir_setup_us * 1000u;
  const bool common_dir = bushd_emission_has_common_dir(settings->mode);
  memset(grid, 0, sizeof *grid);
  grid->mode = settings->mode;
  grid->period_slots = 1;
  // Levels of phases last for a whole slot at least, and have no direction.
  if (settings->mode != BUSHD_EMISSION_PHASES) {
    if ((uint32_t)settings->pulse_us * 1000u > half_slot_ns) return BUSHD_E_PULSE_WIDTH;
    if (common_dir) {
      if (setup_ns > half_slot_ns) return BUSHD_E_DIR_SETUP;
    } else {
      const uint32_t setup_slots = slots_in(setup_ns, shortest_ns, slot_count);
      if (setup_slots >= slot_count) return BUSHD_E_DIR_SETUP;
      grid->setup_slots = (uint16_t)setup_slots;
    }
  }
  if (bushd_emission_has_periods(settings->mode)) {
    uint32_t period = slots_in((uint32_t)settings->step_us * 1000u, tick_ns, slot_count);
    // Left in even slots, right in odd ones.
    if (common_dir) period = (period + 1u) & ~(uint32_t)1u;
    if (period > (uint32_t)slot_count - grid->setup_slots) return BUSHD_E_STEP_PERIOD;
    grid->period_slots = (uint16_t)period;
  }
  const uint16_t most = (uint16_t)((slot_count - grid->setup_slots) / grid->period_slots);
  grid->max_steps = most < BUSHD_MAX_STEPS_PER_TICK ? (uint8_t)most : BUSHD_MAX_STEPS_PER_TICK;
  grid->settle_slots =
      bushd_emission_settle_slots((uint32_t)settings->settle_us * 1000u, tick_ns, slot_count);
  return BUSHD_OK;
}

uint16_t bushd_emission_settle_slots(uint32_t settle_ns, uint32_t tick_ns, uint16_t slot_count) {
  const uint32_t slots = slots_in(settle_ns, tick_ns, slot_count);
  return slots == 0 || slots > UINT16_MAX ? UINT16_MAX : (uint16_t)slots;
}

// Places are slots, or with a common DIR pairs of slots: those to the left pulse in the first slot
// of theirs, and come first; the others in the second one.
static void stagger(uint16_t* masks, const bushd_emission_grid* grid, uint16_t due,
                    uint16_t right) {
  const uint8_t pairs = grid->mode == BUSHD_EMISSION_COMMON_STAGGERED ? 1 : 0;
  const uint16_t places = (uint16_t)(grid->period_slots >> pairs);
  const uint32_t settle = ((uint32_t)grid->settle_slots + pairs) >> pairs;
  uint8_t count = 0;
  for (uint16_t left = due; left != 0; left = (uint16_t)(left & (left - 1u))) ++count;
  const bool settles = settle * count < places;
  const uint16_t apart = (uint16_t)(settles ? settle : places / count);
  const uint16_t apart_rest = (uint16_t)(settles ? 0 : places % count);
  uint16_t now = pairs == 0 ? due : (uint16_t)(due & ~right);
  due = (uint16_t)(due & ~now);
  uint16_t at = 0;
  uint16_t rest = 0;
  for (uint16_t bit = 1; now != 0 || due != 0; bit = (uint16_t)(bit << 1)) {
    if (now == 0) {
      now = due;
      due = 0;
      bit = 1;
      ++masks;
    }
    if ((now & bit) == 0) continue;
    now &= (uint16_t)~bit;
    masks[(uint16_t)(at << pairs)] |= bit;
    at = (uint16_t)(at + apart);
    rest = (uint16_t)(rest + apart_rest);
    if (rest >= count) {
      rest = (uint16_t)(rest - count);
      ++at;
    }
  }
}

// Entry c holds at first the motors with c steps. They are read from the last to the first, each
// before a period is written there: period k begins at slot k or later.
void bushd_emission_fill(uint16_t* masks, uint16_t slot_count, const bushd_emission_grid* grid,
                         const int16_t* steps, uint8_t motors) {
  memset(masks, 0, slot_count * sizeof masks[0]);
  uint8_t most = 0;
  uint16_t right = 0;
  uint16_t bit = 1;
  for (uint8_t m = 0; m < motors; ++m, bit = (uint16_t)(bit << 1)) {
    const uint8_t count = (uint8_t)(steps[m] < 0 ? -steps[m] : steps[m]);
    if (count == 0) continue;
    if (steps[m] > 0) right |= bit;
    if (count > most) most = count;
    masks[count] |= bit;
  }
  uint16_t due = 0;
  uint16_t joining = masks[most];
  masks[most] = 0;
  uint16_t* period = masks + grid->setup_slots + (uint16_t)(most * grid->period_slots);
  for (uint8_t k = most; k > 0;) {
    due |= joining;
    --k;
    joining = masks[k];
    masks[k] = 0;
    period -= grid->period_slots;
    if (bushd_emission_is_staggered(grid->mode)) {
      stagger(period, grid, due, right);
    } else if (grid->mode == BUSHD_EMISSION_COMMON_DIR) {
      period[0] = due & (uint16_t)~right;
      period[1] = due & right;
    } else {
      period[0] = due;
    }
  }
}

void bushd_emission_defer(uint16_t* masks, uint16_t motors, uint16_t setup_slots) {
  for (uint16_t slot = 0; slot < setup_slots; ++slot) {
    uint16_t early = masks[slot] & motors;
    masks[slot] &= (uint16_t)~early;
    for (uint16_t* later = masks + setup_slots; early != 0; ++later) {
      const uint16_t placed = early & (uint16_t)~*later;
      *later |= placed;
      early &= (uint16_t)~placed;
    }
  }
}

// One phase on, two phases on, both by turns: of a motor with four windings. With three it goes by
// six.
// Phase i is digit i of these, from the right: on a small MCU tables would take RAM.
#define WAVE 0x8421u
#define FULL 0x9C63u
#define HALF 0x98C46231u
#define THREE_PHASES 0x546231u

uint8_t bushd_phase_count(uint8_t sequence) {
  switch (sequence) {
    case BUSHD_PHASES_HALF:
      return 8;
    case BUSHD_PHASES_THREE:
      return 6;
    default:
      return 4;
  }
}

uint8_t bushd_phase_levels(uint8_t sequence, uint8_t phase) {
  const uint32_t levels = sequence == BUSHD_PHASES_WAVE   ? WAVE
                          : sequence == BUSHD_PHASES_FULL ? FULL
                          : sequence == BUSHD_PHASES_HALF ? HALF
                                                          : THREE_PHASES;
  return (uint8_t)(levels >> 4 * phase & 0xFu);
}
