// Limit switches, the emergency input and the supply current: looked at once a tick, before the
// next one is prepared. While nothing is active that is one test of masks.
//
// A limit switch forbids the direction towards it
// - while it is active, if it is at one end
// - from when a motor has been stopped by it until that motor has moved away and it is inactive: so
//   one that was overrun, or stands at both ends' switch, still bars the way
#include "firmware/core/internal.h"

#define DEBOUNCE_BITS (sizeof((bushd_mcu*)0)->bounces / sizeof(uint16_t))

uint16_t bushd_mcu_forbidden(const bushd_mcu* mcu, int8_t direction) {
  const bushd_set_inputs* settings = &mcu->inputs;
  return direction > 0 ? mcu->hit_positive | (mcu->active_limits & settings->limit_positive &
                                              (uint16_t)~settings->limit_negative)
                       : mcu->hit_negative | (mcu->active_limits & settings->limit_negative &
                                              (uint16_t)~settings->limit_positive);
}

static int8_t first_direction(const bushd_ticks* ticks, uint8_t column) {
  const bool fine = (ticks->flags & BUSHD_TICKS_FINE) != 0;
  for (uint8_t row = 0; row < ticks->count; ++row) {
    const uint16_t at = (uint16_t)((uint16_t)row * ticks->motors + column);
    const int16_t displacement = fine ? bushd_get_i16(ticks->displacements + 2u * at)
                                      : bushd_coarse_to_fine(ticks->displacements[at]);
    if (displacement != 0) return displacement > 0 ? 1 : -1;
  }
  return 0;
}

bool bushd_mcu_starts_into_limit(const bushd_mcu* mcu, const bushd_ticks* ticks) {
  const uint16_t positive = bushd_mcu_forbidden(mcu, 1);
  const uint16_t negative = bushd_mcu_forbidden(mcu, -1);
  if ((ticks->flags & BUSHD_TICKS_START) == 0 || ((positive | negative) & ticks->mask) == 0) {
    return false;
  }
  uint8_t column = 0;
  for (uint8_t m = 0; m < mcu->config.motors; ++m) {
    if ((ticks->mask & motor_bit(m)) == 0) continue;
    const int8_t direction = first_direction(ticks, column++);
    if (direction == 0 || ((direction > 0 ? positive : negative) & motor_bit(m)) == 0) return false;
  }
  return true;
}

// How long each input has differed from what it counts as is counted for all of them at once: bit k
// of motor m's counter is bit m of bounces[k].
static void debounce(bushd_mcu* mcu, uint16_t pins) {
  const uint16_t differs = pins ^ mcu->active_limits;
  const uint16_t fresh = differs & (uint16_t)~mcu->unsettled;
  uint16_t settled = differs;
  uint16_t carry = differs;
  for (uint8_t k = 0; k < DEBOUNCE_BITS; ++k) {
    const uint16_t counter = mcu->bounces[k] & (uint16_t)~fresh;
    settled &= (mcu->inputs.debounce_ticks >> k & 1) != 0 ? counter : (uint16_t)~counter;
    mcu->bounces[k] = counter ^ carry;
    carry &= counter;
  }
  mcu->active_limits ^= settled;
  mcu->unsettled = differs & (uint16_t)~settled;
}

static uint16_t* hit_towards(bushd_mcu* mcu, int8_t direction) {
  return direction > 0 ? &mcu->hit_positive : &mcu->hit_negative;
}

// `now_active`: the motor's switch has just become so.
static void follow_limit(bushd_mcu* mcu, uint8_t m, bool now_active) {
  const uint16_t bit = motor_bit(m);
  const uint32_t next = mcu->tick + 1u;
  const int8_t heading = bushd_mcu_heading(mcu, m, next);
  if (heading == 0) return;
  uint16_t* const ahead = hit_towards(mcu, heading);
  uint16_t* const behind = hit_towards(mcu, (int8_t)-heading);
  const bool both_ends = (mcu->inputs.limit_positive & mcu->inputs.limit_negative & bit) != 0;
  if (both_ends && now_active && (*behind & bit) == 0) *ahead |= bit;
  if ((bushd_mcu_forbidden(mcu, heading) & bit) != 0) {
    *ahead |= bit;
    // One that only turns towards the switch is at rest as far as this direction goes.
    const bool turns = heading != bushd_mcu_last_direction(mcu, m);
    const bool cut = turns || (mcu->inputs.limit_cuts & bit) != 0;
    if (cut || mcu->motor[m].mode != BUSHD_MCU_RAMP_DOWN) {
      bushd_mcu_stop_motor(mcu, m, cut ? BUSHD_CUT : BUSHD_RAMP_DOWN, next);
    }
  } else if ((mcu->active_limits & bit) == 0) {
    *behind &= (uint16_t)~bit;
  }
}

static void follow_limits(bushd_mcu* mcu, uint16_t pins) {
  const uint16_t before = mcu->active_limits;
  debounce(mcu, pins);
  const uint16_t now_active = mcu->active_limits & (uint16_t)~before;
  uint16_t concerned = mcu->active_limits | mcu->hit_positive | mcu->hit_negative;
  concerned &= (uint16_t)~bushd_mcu_homing_motor(mcu);
  for (uint8_t m = 0; concerned != 0; ++m, concerned = (uint16_t)(concerned >> 1)) {
    if ((concerned & 1u) != 0) follow_limit(mcu, m, (now_active & motor_bit(m)) != 0);
  }
}

void bushd_mcu_stands_at_switch(bushd_mcu* mcu, uint8_t m, int8_t direction) {
  const uint16_t limits = direction > 0 ? mcu->inputs.limit_positive : mcu->inputs.limit_negative;
  *hit_towards(mcu, direction) |= limits & motor_bit(m);
}

void bushd_mcu_has_left_switch(bushd_mcu* mcu, uint8_t m, int8_t direction) {
  *hit_towards(mcu, direction) &= (uint16_t)~motor_bit(m);
}

static void keep_enable(bushd_mcu* mcu) {
  const bool on = (mcu->flags & BUSHD_FLAG_ENABLED) != 0;
  mcu->port.keep_enable(mcu->port.context, on && mcu->inputs.enable_after_watchdog);
}

void bushd_mcu_set_enable(bushd_mcu* mcu, bool on) {
  mcu->flags &= (uint8_t)~BUSHD_FLAG_ENABLED;
  if (on) mcu->flags |= BUSHD_FLAG_ENABLED;
  mcu->port.set_enable(mcu->port.context, on);
  keep_enable(mcu);
}

static uint8_t system_inputs(const bushd_mcu* mcu, bushd_inputs pins) {
  return pins.system ^ mcu->inputs.system_inverted;
}

static void watch_emergency(bushd_mcu* mcu, bushd_inputs pins, uint32_t next) {
  const bushd_set_inputs* settings = &mcu->inputs;
  if (settings->emergency == BUSHD_EMERGENCY_INPUT_IGNORED) return;
  if ((system_inputs(mcu, pins) & BUSHD_INPUT_EMERGENCY) == 0) return;
  if (mcu->faults & BUSHD_FAULT_EMERGENCY_INPUT) return;
  const bool cuts = settings->emergency == BUSHD_EMERGENCY_INPUT_CUTS;
  bushd_mcu_stop_all(mcu, cuts ? BUSHD_CUT : BUSHD_RAMP_DOWN, next);
  mcu->faults |= BUSHD_FAULT_EMERGENCY_INPUT;
}

static void watch_current(bushd_mcu* mcu, uint32_t next) {
  const uint16_t most = mcu->inputs.overcurrent;
  if (most == 0 || mcu->port.read_current(mcu->port.context) <= most) return;
  bushd_mcu_set_enable(mcu, false);
  bushd_mcu_stop_all(mcu, BUSHD_CUT, next);
  mcu->faults |= BUSHD_FAULT_OVERCURRENT;
}

void bushd_mcu_watch_inputs(bushd_mcu* mcu) {
  const uint32_t next = mcu->tick + 1u;
  const bushd_inputs pins = mcu->port.read_inputs(mcu->port.context);
  const uint16_t limits = mcu->inputs.limit_positive | mcu->inputs.limit_negative;
  const uint16_t active = (pins.motors ^ mcu->inputs.inverted) & limits;
  if ((active | mcu->active_limits | mcu->unsettled | mcu->hit_positive | mcu->hit_negative) != 0) {
    follow_limits(mcu, active);
  }
  watch_emergency(mcu, pins, next);
  watch_current(mcu, next);
}

void bushd_mcu_clear_faults(bushd_mcu* mcu) {
  mcu->faults &= BUSHD_FAULT_SELF_TEST;
  // What has caused one may be there still.
  watch_emergency(mcu, mcu->port.read_inputs(mcu->port.context), FIRST_OPEN(mcu));
  watch_current(mcu, FIRST_OPEN(mcu));
}

bushd_status bushd_mcu_set_inputs(bushd_mcu* mcu, const bushd_set_inputs* message) {
  if (bushd_mcu_engaged(mcu) != 0) return BUSHD_E_STATE;
  const uint16_t limits = message->limit_positive | message->limit_negative;
  if ((limits & ~own_motors(mcu)) != 0) return BUSHD_E_FORMAT;
  mcu->inputs = *message;
  mcu->hit_positive &= message->limit_positive;
  mcu->hit_negative &= message->limit_negative;
  // What is active now counts at once: a start may follow.
  const bushd_inputs pins = mcu->port.read_inputs(mcu->port.context);
  mcu->active_limits = (pins.motors ^ message->inverted) & limits;
  bushd_mcu_forget_presses(mcu, system_inputs(mcu, pins));
  mcu->unsettled = 0;
  keep_enable(mcu);
  return BUSHD_OK;
}

void bushd_mcu_report_inputs(const bushd_mcu* mcu, bushd_report* report) {
  const bushd_inputs pins = mcu->port.read_inputs(mcu->port.context);
  report->inputs = pins.motors ^ mcu->inputs.inverted;
  report->system_inputs = system_inputs(mcu, pins);
  report->forbidden_positive = bushd_mcu_forbidden(mcu, 1);
  report->forbidden_negative = bushd_mcu_forbidden(mcu, -1);
  report->current = mcu->port.read_current(mcu->port.context);
}
