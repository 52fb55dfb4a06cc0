// LOCAL: motors that people move by two buttons at the MCU, with a host or without. While FORWARD
// or REVERSE is held they accelerate by their tables and cruise; when it is released, or both are
// held, they ramp down. A press counts when it has lasted for READINGS readings, a release at
// once. What is active at boot, or when the settings come, may be stuck: it must be released first.
// Motors with VELOCITY settings speed up and down by these, and need not come to rest to reverse.
#include "firmware/core/local.h"

#include "firmware/core/access.h"
#include "firmware/core/drivers.h"
#include "firmware/core/homing.h"
#include "firmware/core/limits.h"
#include "firmware/core/state.h"
#include "firmware/core/table_run.h"
#include "firmware/core/travel.h"
#include "firmware/core/velocity.h"

enum { READINGS = 3 };

// Other faults are the host's: without one, people may still move a motor.
static const uint8_t kForbids = BUSHD_FAULT_SELF_TEST | BUSHD_FAULT_EMERGENCY |
                                BUSHD_FAULT_EMERGENCY_INPUT | BUSHD_FAULT_OVERCURRENT;

static int8_t wish_of(uint8_t system_inputs) {
  const bool forward = (system_inputs & BUSHD_INPUT_FORWARD) != 0;
  const bool reverse = (system_inputs & BUSHD_INPUT_REVERSE) != 0;
  return (int8_t)(forward - reverse);
}

static void release(bushd_mcu* mcu) {
  uint16_t moving = (uint16_t)(mcu->local.held & mcu->autonomous);
  mcu->local.held = 0;
  for (uint8_t m = 0; moving != 0; ++m, moving = (uint16_t)(moving >> 1)) {
    if (moving & 1u) bushd_mcu_ramp_down_run(mcu, m);
  }
}

// Those that move by the loop still, after a release or a turn.
static void steer_held(bushd_mcu* mcu) {
  if (mcu->config.velocity_motors == 0) return;
  const uint16_t held = (uint16_t)(mcu->local.held & ~bushd_mcu_forbidden(mcu, mcu->local.wish));
  const uint16_t steered = held & bushd_mcu_moved_by_velocity(mcu);
  for (uint8_t m = 0; steered >> m != 0; ++m) {
    if ((steered & motor_bit(m)) != 0) bushd_mcu_steer(mcu, m, mcu->local.wish);
  }
}

// Also those that come to rest only now. What a host moves stays the host's until the next press.
static void begin_held(bushd_mcu* mcu) {
  steer_held(mcu);
  if ((mcu->local.held & ~mcu->autonomous) == 0) return;
  mcu->local.held &= (uint16_t) ~(bushd_mcu_engaged(mcu) & ~mcu->autonomous);
  uint16_t begins =
      (uint16_t)(mcu->local.held & ~mcu->autonomous & ~bushd_mcu_forbidden(mcu, mcu->local.wish));
  for (uint8_t m = 0; begins != 0; ++m, begins = (uint16_t)(begins >> 1)) {
    if ((begins & 1u) == 0) continue;
    if (bushd_mcu_has_velocity(mcu, m)) {
      bushd_mcu_steer(mcu, m, mcu->local.wish);
    } else if (mcu->motor[m].table < 0) {
      mcu->local.held &= (uint16_t)~motor_bit(m);
    } else {
      bushd_mcu_begin_by_itself(mcu, m, INT32_MAX, mcu->local.wish, 0);
    }
  }
}

// Once a host has set the MCU up, EN is its affair: there may be hands in the mechanism.
static bool may_enable(const bushd_mcu* mcu) {
  const uint8_t its = mcu->flags & (BUSHD_FLAG_ENABLED | BUSHD_FLAG_CONFIGURED);
  return its != BUSHD_FLAG_CONFIGURED;
}

void bushd_mcu_move_locally(bushd_mcu* mcu, uint8_t system_inputs) {
  bushd_mcu_local* local = &mcu->local;
  const int8_t wish = wish_of(system_inputs);
  const bool allowed = may_enable(mcu) && (mcu->faults & kForbids) == 0;
  if (wish != local->wish || !allowed) {
    release(mcu);
    local->wish = wish;
    // To clear a fault, or to raise EN, is not to ask for motion: what is held then must be pressed
    // anew.
    local->readings = allowed ? 0 : READINGS;
  }
  if (wish == 0 || !allowed) return;
  if (local->readings < READINGS && ++local->readings == READINGS) {
    local->held =
        (uint16_t)(local->motors & ~(bushd_mcu_homing_motor(mcu) | bushd_mcu_travel_motor(mcu)));
    if ((mcu->flags & BUSHD_FLAG_ENABLED) == 0) bushd_mcu_set_enable(mcu, true);
  }
  begin_held(mcu);
}

void bushd_mcu_forget_presses(bushd_mcu* mcu, uint8_t system_inputs) {
  mcu->local.held = 0;
  mcu->local.wish = wish_of(system_inputs);
  mcu->local.readings = READINGS;
}

bushd_status bushd_mcu_set_local(bushd_mcu* mcu, const bushd_local* message) {
  if ((message->motors & ~bushd_mcu_own_motors(mcu)) != 0) return BUSHD_E_FORMAT;
  const uint16_t changed = (uint16_t)(mcu->local.motors ^ message->motors);
  if (changed & bushd_mcu_moving(mcu)) return BUSHD_E_STATE;
  if (mcu->local.motors == 0) {
    const bushd_inputs pins = mcu->port.read_inputs(mcu->port.context);
    bushd_mcu_forget_presses(mcu, pins.system ^ mcu->inputs.system_inverted);
  }
  mcu->local.motors = message->motors;
  mcu->local.held &= message->motors;
  return BUSHD_OK;
}
