// How steps get to the pins: the settings that a master has chosen, and the masks of a tick's slots
// where these are not simply the slots of the steps' own times.
#include "firmware/core/emission.h"

#include <string.h>

#include "firmware/core/access.h"
#include "firmware/core/local.h"
#include "firmware/core/settle.h"
#include "firmware/core/state.h"
#include "firmware/core/velocity.h"

// Windings stay on for so long after a move, until the rotor has come to rest.
#define ROTOR_SETTLES_NS 100000000u

// Capabilities of the modes follow each other as the modes do; the last mode needs two.
static bool is_disabled(const bushd_mcu* mcu, uint8_t mode) {
  uint32_t needed = mode == BUSHD_EMISSION_EVEN ? 0 : (uint32_t)BUSHD_CAN_BURST << (mode - 1);
  if (mode == BUSHD_EMISSION_COMMON_STAGGERED) needed = BUSHD_CAN_COMMON_DIR | BUSHD_CAN_STAGGERED;
  return (needed & mcu->config.disabled_capabilities) != 0;
}

static bushd_status use(bushd_mcu* mcu, const bushd_emission* settings) {
  bushd_emission_grid grid;
  const bushd_status status = bushd_emission_fit(settings, mcu->tick_ns, mcu->config.slots, &grid);
  if (status != BUSHD_OK) return status;
  bushd_mcu_emission* emission = &mcu->emission;
  const bool settles = bushd_emission_is_staggered(settings->mode);
  const bool phases = settings->mode == BUSHD_EMISSION_PHASES;
  if (settles || bushd_emission_is_staggered(emission->settings.mode) ||
      (phases && emission->of.windings.sequence != settings->sequence)) {
    memset(&emission->of, 0, sizeof emission->of);
  }
  if (phases) emission->of.windings.sequence = settings->sequence;
  emission->settings = *settings;
  emission->grid = grid;
  return BUSHD_OK;
}

void bushd_mcu_default_emission(bushd_mcu* mcu) {
  bushd_emission even;
  memset(&even, 0, sizeof even);
  use(mcu, &even);
}

// After a reset with tables and assignments of before.
void bushd_mcu_restore_emission(bushd_mcu* mcu) {
  const bushd_emission kept = mcu->emission.settings;
  if (use(mcu, &kept) != BUSHD_OK) bushd_mcu_default_emission(mcu);
}

// STEP pulses last for so long at least, also in a tick that is shortened to follow the bus.
static int32_t shortest_pulse_ns(const bushd_mcu* mcu) {
  const int32_t pulse_ns = mcu->config.pulse_ns;
  if (pulse_ns > 0) return pulse_ns;
  const uint32_t tick_ns = mcu->tick_ns - mcu->tick_ns / BUSHD_TICK_SLEW_DIVISOR;
  return (int32_t)(tick_ns / (2u * mcu->config.slots)) + pulse_ns;
}

static bool keeps_pulses(const bushd_mcu* mcu, const bushd_emission* of) {
  if (of->pulse_us == 0 || of->mode == BUSHD_EMISSION_PHASES) return true;
  return (int32_t)of->pulse_us * 1000 <= shortest_pulse_ns(mcu);
}

bushd_status bushd_mcu_take_emission(bushd_mcu* mcu, const bushd_emission* message) {
  if ((mcu->flags & BUSHD_FLAG_CONFIGURED) == 0) return BUSHD_E_STATE;
  if (memcmp(message, &mcu->emission.settings, sizeof *message) == 0) return BUSHD_OK;
  if (bushd_mcu_engaged(mcu) != 0) return BUSHD_E_STATE;
  if (is_disabled(mcu, message->mode)) return BUSHD_E_FORMAT;
  // Levels of windings are what their transistors want.
  const bool phases = message->mode == BUSHD_EMISSION_PHASES;
  if (phases && mcu->config.outputs.step_low != 0) return BUSHD_E_FORMAT;
  if (!keeps_pulses(mcu, message)) return BUSHD_E_PULSE_WIDTH;
  const bushd_status status = use(mcu, message);
  if (status != BUSHD_OK) return status;
  bushd_mcu_wait_for_local(mcu);
  // What was good for another number of steps in a tick must be asked for again.
  for (uint8_t m = 0; m < mcu->config.motors; ++m) mcu->motor[m].table = -1;
  bushd_mcu_forget_velocities(mcu);
  return BUSHD_OK;
}

// Nothing of a motor is on that has been at rest for long and is not to hold.
static bool is_on(bushd_mcu* mcu, uint8_t m, bool moves) {
  uint8_t* const left = &mcu->emission.of.windings.on_ticks[m];
  if ((mcu->flags & BUSHD_FLAG_ENABLED) == 0) {
    *left = 0;
    return false;
  }
  if (moves) {
    const uint32_t ticks = ROTOR_SETTLES_NS / mcu->tick_ns + 1u;
    *left = ticks < UINT8_MAX ? (uint8_t)ticks : UINT8_MAX;
    return true;
  }
  if (*left != 0) --*left;
  return *left != 0 || mcu->emission.settings.hold_current;
}

static uint8_t next_phase(uint8_t phase, uint8_t count, bool forward) {
  if (forward) return phase + 1u == count ? 0 : (uint8_t)(phase + 1u);
  return phase == 0 ? (uint8_t)(count - 1u) : (uint8_t)(phase - 1u);
}

// The levels of motor m, at the outputs that are its.
static uint16_t levels_of(const bushd_mcu* mcu, uint8_t m) {
  const uint8_t phase = mcu->emission.of.windings.phase[m];
  const uint16_t levels = bushd_phase_levels(mcu->emission.settings.sequence, phase);
  return (uint16_t)(levels << (BUSHD_PHASE_OUTPUTS * m));
}

// Pulses into levels. A phase goes on with every step that is counted, so it belongs to the
// position whatever way the motor came.
static void shape_phases(bushd_mcu* mcu, bushd_slot_buffer* slot_buffer) {
  const uint8_t count = bushd_phase_count(mcu->emission.settings.sequence);
  const uint16_t moving = bushd_mcu_moving(mcu);
  const uint8_t motors = bushd_mcu_motors_with_outputs(mcu);
  uint16_t on = 0;
  uint16_t levels = 0;
  for (uint8_t m = 0; m < motors; ++m) {
    if (!is_on(mcu, m, (moving & motor_bit(m)) != 0)) continue;
    on |= motor_bit(m);
    levels |= levels_of(mcu, m);
  }
  for (uint16_t slot = 0; slot < mcu->config.slots; ++slot) {
    uint16_t steps = slot_buffer->step[slot];
    for (uint8_t m = 0; steps != 0; ++m, steps = (uint16_t)(steps >> 1)) {
      if ((steps & 1u) == 0) continue;
      uint8_t* const phase = &mcu->emission.of.windings.phase[m];
      *phase = next_phase(*phase, count, (mcu->direction & motor_bit(m)) != 0);
      if ((on & motor_bit(m)) == 0) continue;
      levels &= (uint16_t)~(0xFu << (BUSHD_PHASE_OUTPUTS * m));
      levels |= levels_of(mcu, m);
    }
    slot_buffer->step[slot] = levels;
  }
}

// Instead of the steps of the tick: there are none while it is measured.
static bool make_settle_step(bushd_mcu* mcu, bushd_slot_buffer* slot_buffer) {
  // A motor that an input moves disturbs what is measured.
  if (slot_buffer->active != 0) {
    mcu->emission.of.settle.ticks = 0;
    return false;
  }
  uint8_t m = 0;
  const int8_t step = bushd_mcu_settle_step(mcu, &m);
  if (step == 0) return false;
  if (step > 0) {
    mcu->direction |= motor_bit(m);
  } else {
    mcu->direction &= (uint16_t)~motor_bit(m);
  }
  slot_buffer->direction = mcu->direction ^ mcu->config.outputs.direction_low;
  slot_buffer->steps[m] = step;
  slot_buffer->active = motor_bit(m);
  memset(slot_buffer->step, 0, sizeof slot_buffer->step);
  uint16_t slot = bushd_mcu_settle_slot(mcu);
  if (step < 0 && bushd_emission_has_common_dir(mcu->emission.grid.mode)) --slot;
  slot_buffer->step[slot] = motor_bit(m);
  return true;
}

static void use_common_dir(bushd_slot_buffer* slot_buffer) {
  slot_buffer->outputs = BUSHD_OUTPUTS_COMMON_DIR;
  slot_buffer->direction = 0;
}

void bushd_mcu_shape(bushd_mcu* mcu, bushd_slot_buffer* slot_buffer) {
  const bushd_emission_grid* grid = &mcu->emission.grid;
  if (grid->mode == BUSHD_EMISSION_PHASES) {
    slot_buffer->outputs = BUSHD_OUTPUTS_LEVELS;
    shape_phases(mcu, slot_buffer);
  } else if (grid->mode == BUSHD_EMISSION_EVEN) {
    const uint16_t changed = slot_buffer->direction ^ mcu->slot_buffer[mcu->front].direction;
    bushd_emission_defer(slot_buffer->step, changed & slot_buffer->active, grid->setup_slots);
  } else {
    if (!bushd_emission_is_staggered(grid->mode) || !make_settle_step(mcu, slot_buffer)) {
      bushd_emission_fill(slot_buffer->step, mcu->config.slots, grid, slot_buffer->steps,
                          mcu->config.motors);
    }
    if (bushd_emission_has_common_dir(grid->mode)) use_common_dir(slot_buffer);
  }
}
