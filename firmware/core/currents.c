#include "firmware/core/currents.h"

#include <string.h>

#include "firmware/core/access.h"
#include "firmware/core/owner.h"
#include "firmware/core/state.h"

// Two displacements of one speed differ by so much at most: rounding, to 1/256 step or to a step.
static uint16_t tolerance_of(const bushd_mcu* mcu, const bushd_mcu_motor* motor) {
  if (motor->exact) return 0;
  return mcu->format == BUSHD_FORMAT_FINE ? 1 : 256;
}

// 0 at rest. A run tells the delay of its running step; a stream what it makes in this tick.
static uint16_t speed_of(const bushd_mcu* mcu, uint8_t m) {
  const bushd_mcu_motor* motor = &mcu->motor[m];
  const bushd_slot_buffer* next = &mcu->slot_buffer[mcu->front ^ 1u];
  if (((bushd_mcu_moving(mcu) | next->active) & motor_bit(m)) == 0) return 0;
  if (motor->exact && motor->mode != BUSHD_MCU_STREAM) return bushd_mcu_step_delay(mcu, m);
  if (mcu->format == BUSHD_FORMAT_FINE) {
    return (motor->displacement & BUSHD_MCU_SELDOM) != 0 ? (uint16_t)1 : motor->displacement;
  }
  const int16_t steps = next->steps[m];
  return (uint16_t)((steps < 0 ? -steps : steps) << 8);
}

static void choose(bushd_mcu* mcu, uint8_t m) {
  bushd_mcu_currents* its = &mcu->config.currents[m];
  if (its->settings.ramp_ma == 0 && its->now_ma == 0) return;  // in most MCUs
  const uint16_t speed = speed_of(mcu, m);
  const uint16_t change = (uint16_t)(speed > its->speed ? speed - its->speed : its->speed - speed);
  const bool begins_or_ends = (speed == 0) != (its->speed == 0);
  if (begins_or_ends || change > tolerance_of(mcu, &mcu->motor[m])) {
    its->speed = speed;
    its->steady_ticks = 0;
  } else if (its->steady_ticks < BUSHD_CURRENT_TICKS) {
    ++its->steady_ticks;
  }
  uint16_t ma = its->settings.ramp_ma;
  if (its->steady_ticks == BUSHD_CURRENT_TICKS) {
    ma = speed == 0 ? its->settings.hold_ma : its->settings.cruise_ma;
  }
  if (mcu->emission.grid.mode != BUSHD_EMISSION_PHASES) ma = 0;
  if (ma == its->now_ma) return;
  its->now_ma = ma;
  mcu->port.set_current(mcu->port.context, m, ma, its->settings.decay == BUSHD_DECAY_FAST);
}

void bushd_mcu_choose_currents(bushd_mcu* mcu) {
  if (mcu->port.set_current == NULL) return;
  for (uint8_t m = 0; m < mcu->config.current_motors; ++m) choose(mcu, m);
}

bushd_status bushd_mcu_take_currents(bushd_mcu* mcu, const bushd_currents* message) {
  if (message->motor >= mcu->config.current_motors) {
    const bool none = message->ramp_ma == 0 && bushd_mcu_has_output(mcu, message->motor);
    return none ? BUSHD_OK : BUSHD_E_FORMAT;
  }
  bushd_mcu_currents* its = &mcu->config.currents[message->motor];
  if (memcmp(message, &its->settings, sizeof *message) == 0) return BUSHD_OK;
  if ((bushd_mcu_moving(mcu) & motor_bit(message->motor)) != 0) return BUSHD_E_STATE;
  its->settings = *message;
  its->speed = 0;
  its->steady_ticks = BUSHD_CURRENT_TICKS;
  its->now_ma = UINT16_MAX;  // told anew
  return BUSHD_OK;
}
