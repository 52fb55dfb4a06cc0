// LOCAL: motors that people move by two buttons at the MCU, with a host or without. While FORWARD
// or REVERSE is held they accelerate by their tables and cruise; when it is released, or both are
// held, they ramp down. A press counts when it has lasted for BUSHD_MCU_LOCAL_READINGS readings, a
// release at once. What is active at boot, or when the settings come, may be stuck: it must be
// released first. Motors with VELOCITY settings speed up and down by these, and need not come to
// rest to reverse.
//
// A key of the keypad is such a press, with a speed of its own, as long as no button is active. One
// that cannot move a motor, or no longer, is forgotten: it has to be pressed again. A run of a
// table takes another speed up from rest.
#include "firmware/core/local.h"

#include "firmware/core/access.h"
#include "firmware/core/drivers.h"
#include "firmware/core/keypad.h"
#include "firmware/core/limits.h"
#include "firmware/core/owner.h"
#include "firmware/core/state.h"
#include "firmware/core/table_run.h"
#include "firmware/core/velocity.h"

enum { READINGS = BUSHD_MCU_LOCAL_READINGS };

// Other faults are the host's: without one, people may still move a motor.
static const uint8_t kForbids = BUSHD_FAULT_SELF_TEST | BUSHD_FAULT_EMERGENCY |
                                BUSHD_FAULT_EMERGENCY_INPUT | BUSHD_FAULT_OVERCURRENT |
                                BUSHD_FAULT_DISABLED;

static uint8_t buttons_of(const bushd_mcu* mcu, uint8_t system_inputs) {
  if (mcu->local.settings.motors == 0) return 0;
  return system_inputs & (BUSHD_INPUT_FORWARD | BUSHD_INPUT_REVERSE);
}

static int8_t wish_of(uint8_t buttons) {
  return (int8_t)(((buttons & BUSHD_INPUT_FORWARD) != 0) - ((buttons & BUSHD_INPUT_REVERSE) != 0));
}

static void release(bushd_mcu* mcu) {
  uint16_t moving = (uint16_t)(mcu->local.held & mcu->autonomous);
  mcu->local.held = 0;
  for (uint8_t m = 0; moving != 0; ++m, moving = (uint16_t)(moving >> 1)) {
    if (moving & 1u) bushd_mcu_ramp_down_own_motion(mcu, m);
  }
}

static void steer(bushd_mcu* mcu, uint8_t m) {
  const bushd_mcu_local* local = &mcu->local;
  const int32_t most = local->by_keypad ? bushd_mcu_keypad_speed(mcu) : INT32_MAX;
  bushd_mcu_steer(mcu, m, local->wish, most);
}

// Those that move by the loop still, after a release or a turn. Where a limit inhibits the wanted
// direction they only come to rest: one that still goes the other way must not turn into it.
static void steer_held(bushd_mcu* mcu) {
  if (mcu->config.velocity_motors == 0) return;
  const uint16_t forbidden = bushd_mcu_forbidden(mcu, mcu->local.wish);
  const uint16_t steered = mcu->local.held & bushd_mcu_moved_by_velocity(mcu);
  for (uint8_t m = 0; steered >> m != 0; ++m) {
    if ((steered & motor_bit(m)) == 0) continue;
    if ((forbidden & motor_bit(m)) != 0) {
      bushd_mcu_brake(mcu, m);
    } else {
      steer(mcu, m);
    }
  }
}

// Also those that come to rest only now. What a host moves stays the host's until the next press.
static void begin_held(bushd_mcu* mcu) {
  steer_held(mcu);
  if ((mcu->local.held & ~mcu->autonomous) == 0) return;
  mcu->local.held &= (uint16_t)~(bushd_mcu_engaged(mcu) & ~mcu->autonomous);
  uint16_t begins =
      (uint16_t)(mcu->local.held & ~mcu->autonomous & ~bushd_mcu_forbidden(mcu, mcu->local.wish));
  for (uint8_t m = 0; begins != 0; ++m, begins = (uint16_t)(begins >> 1)) {
    if ((begins & 1u) == 0) continue;
    if (bushd_mcu_has_velocity(mcu, m)) {
      steer(mcu, m);
    } else if (mcu->motor[m].table < 0) {
      mcu->local.held &= (uint16_t)~motor_bit(m);
    } else {
      const bushd_table* table = bushd_mcu_table_of(mcu, &mcu->motor[m]);
      const uint16_t shortest_delay =
          mcu->local.by_keypad ? bushd_mcu_keypad_shortest_delay(mcu, table) : 0;
      const uint32_t counted = bushd_mcu_steps_counted(mcu, m, mcu->local.wish);
      const uint32_t steps = counted < INT32_MAX ? counted : INT32_MAX;
      bushd_mcu_begin_by_itself(mcu, m, steps, mcu->local.wish, shortest_delay, BUSHD_MCU_LOCAL);
    }
  }
}

// Once a host has set the MCU up, EN is its affair: there may be hands in the mechanism.
static bool may_enable(const bushd_mcu* mcu) {
  const uint8_t its = mcu->flags & (BUSHD_FLAG_ENABLED | BUSHD_FLAG_CONFIGURED);
  return its != BUSHD_FLAG_CONFIGURED;
}

// Those that go by their tables come to rest, and begin anew. The loop goes on from where it is.
static void slow_down(bushd_mcu* mcu) {
  if (!mcu->local.pad.slowed) return;
  mcu->local.pad.slowed = false;
  if (!mcu->local.by_keypad) return;
  uint16_t moving =
      (uint16_t)(mcu->local.held & mcu->autonomous & ~bushd_mcu_moved_by_velocity(mcu));
  for (uint8_t m = 0; moving != 0; ++m, moving = (uint16_t)(moving >> 1)) {
    if (moving & 1u) bushd_mcu_ramp_down_own_motion(mcu, m);
  }
}

static bool moves_none(const bushd_mcu* mcu) {
  return (mcu->local.held & ~bushd_mcu_forbidden(mcu, mcu->local.wish)) == 0;
}

void bushd_mcu_move_locally(bushd_mcu* mcu, uint8_t system_inputs) {
  bushd_mcu_local* local = &mcu->local;
  const uint8_t buttons = buttons_of(mcu, system_inputs);
  const bool allowed = may_enable(mcu) && (mcu->faults & kForbids) == 0 && !local->configuring;
  if (!allowed) {
    bushd_mcu_keypad_wait_for_release(mcu);
  } else if (buttons != 0) {
    bushd_mcu_keypad_refuse(mcu);
  }
  const int8_t key = bushd_mcu_keypad_direction(mcu);
  const int8_t wish = key != 0 ? key : wish_of(buttons);
  slow_down(mcu);
  if (wish != local->wish || local->by_keypad != (key != 0) || !allowed) {
    release(mcu);
    local->wish = wish;
    local->by_keypad = key != 0;
    // To clear a fault, or to raise EN, is not to ask for motion: what is held then must be pressed
    // anew.
    local->readings = allowed ? 0 : READINGS;
  }
  if (wish == 0 || !allowed) return;
  if (local->readings < READINGS && ++local->readings == READINGS) {
    const uint16_t motors = local->by_keypad ? local->settings.keypad : local->settings.motors;
    local->held = motors & (uint16_t)~bushd_mcu_moved_by_request(mcu);
    if ((mcu->flags & BUSHD_FLAG_ENABLED) == 0) bushd_mcu_set_enable(mcu, true);
  }
  begin_held(mcu);
  if (local->by_keypad && local->readings == READINGS && moves_none(mcu)) {
    bushd_mcu_keypad_refuse(mcu);
  }
}

void bushd_mcu_forget_presses(bushd_mcu* mcu, uint8_t system_inputs) {
  bushd_mcu_keypad_refuse(mcu);
  mcu->local.held = 0;
  mcu->local.wish = wish_of(buttons_of(mcu, system_inputs));
  mcu->local.by_keypad = false;
  mcu->local.readings = READINGS;
}

void bushd_mcu_wait_for_local(bushd_mcu* mcu) {
  mcu->local.configuring = (mcu->local.settings.motors | mcu->local.settings.keypad) != 0;
}

// Motors that are taken away from those who move them.
static void take_away(bushd_mcu* mcu, uint16_t motors) {
  mcu->local.held &= (uint16_t)~motors;
  motors &= mcu->autonomous;
  for (uint8_t m = 0; motors != 0; ++m, motors = (uint16_t)(motors >> 1)) {
    if (motors & 1u) bushd_mcu_ramp_down_own_motion(mcu, m);
  }
}

bushd_status bushd_mcu_take_local(bushd_mcu* mcu, const bushd_local* message) {
  bushd_local* settings = &mcu->local.settings;
  if (((message->motors | message->keypad) & ~bushd_mcu_own_motors(mcu)) != 0) {
    return BUSHD_E_FORMAT;
  }
  if (message->keypad != 0 && !mcu->config.keypad) return BUSHD_E_FORMAT;
  const uint16_t added =
      (uint16_t)((message->motors & ~settings->motors) | (message->keypad & ~settings->keypad));
  if (added & (bushd_mcu_moving(mcu) | bushd_mcu_program_motors(mcu))) return BUSHD_E_STATE;
  const bool first = settings->motors == 0 && message->motors != 0;
  // A key that moves others would be forgotten.
  if (first && (mcu->local.held & mcu->autonomous) != 0) return BUSHD_E_STATE;
  const bool of_keypad = settings->keypad != message->keypad;
  take_away(
      mcu, mcu->local.held & (uint16_t)~(mcu->local.by_keypad ? message->keypad : message->motors));
  *settings = *message;
  mcu->local.configuring = false;
  if (first) {
    const bushd_inputs pins = mcu->port.read_inputs(mcu->port.context);
    bushd_mcu_forget_presses(mcu, pins.system ^ mcu->inputs.system_inverted);
  }
  if (of_keypad) bushd_mcu_keypad_wait_for_release(mcu);
  return BUSHD_OK;
}
