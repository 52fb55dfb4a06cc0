// Limit switches, the emergency input and the supply current: looked at once a tick, before the
// next one is prepared. While nothing is active that is one test of masks.
#include "firmware/core/inputs.h"

#include "firmware/core/access.h"
#include "firmware/core/drivers.h"
#include "firmware/core/limits.h"
#include "firmware/core/local.h"
#include "firmware/core/owner.h"
#include "firmware/core/state.h"
#include "firmware/core/stop.h"

// `changed`: a switch of the motor has just become active or inactive.
static void follow_limit(bushd_mcu* mcu, uint8_t m, bool changed) {
  const uint32_t next = mcu->tick + 1u;
  const int8_t heading = bushd_mcu_heading(mcu, m, next);
  const bool homes = bushd_mcu_owner_of_motor(mcu, m) == BUSHD_MCU_OWNER_HOMING;
  if (heading == 0) {
    if (changed && !homes) {
      bushd_mcu_stands_off_limit(mcu, m, bushd_mcu_last_direction(mcu, m));
    }
    return;
  }
  const bool now_active = changed && (bushd_mcu_at_limits(mcu) & motor_bit(m)) != 0;
  if (!bushd_mcu_limit_stops(mcu, m, heading, now_active, homes)) return;
  const bool cuts = (mcu->inputs.limit_immediate & motor_bit(m)) != 0;
  bushd_mcu_motor_meets_limit(mcu, m, heading, cuts, next);
}

// Not inlined, since few ticks need it: what all do would cost those their registers.
__attribute__((noinline)) static void follow_limits(bushd_mcu* mcu, uint16_t pins) {
  const uint16_t changed = bushd_mcu_debounce_limits(mcu, pins);
  uint16_t concerned =
      bushd_mcu_at_limits(mcu) | mcu->limits.hit_positive | mcu->limits.hit_negative;
  for (uint8_t m = 0; concerned != 0; ++m, concerned = (uint16_t)(concerned >> 1)) {
    if ((concerned & 1u) != 0) follow_limit(mcu, m, (changed & motor_bit(m)) != 0);
  }
}

static uint8_t system_inputs(const bushd_mcu* mcu, bushd_inputs pins) {
  return pins.system ^ mcu->inputs.system_inverted;
}

static void watch_emergency(bushd_mcu* mcu, bushd_inputs pins, uint32_t next) {
  const bushd_set_inputs* settings = &mcu->inputs;
  if (settings->emergency == BUSHD_EMERGENCY_INPUT_IGNORED) return;
  if ((system_inputs(mcu, pins) & BUSHD_INPUT_EMERGENCY) == 0) return;
  const bool disables = settings->emergency == BUSHD_EMERGENCY_INPUT_DISABLE;
  const uint8_t faults = BUSHD_FAULT_EMERGENCY_INPUT | (disables ? BUSHD_FAULT_DISABLED : 0);
  if ((mcu->faults & faults) == faults) return;
  _Static_assert(BUSHD_EMERGENCY_INPUT_RAMP == BUSHD_STOP_RAMP + 1 &&
                     BUSHD_EMERGENCY_INPUT_IMMEDIATE == BUSHD_STOP_IMMEDIATE + 1 &&
                     BUSHD_EMERGENCY_INPUT_DISABLE == BUSHD_STOP_DISABLE + 1,
                 "the same modes, behind that of an input that is ignored");
  bushd_mcu_stop_all(mcu, (bushd_stop_mode)(settings->emergency - 1), next);
  mcu->faults |= faults;
}

void bushd_mcu_watch_emergency_input(bushd_mcu* mcu) {
  watch_emergency(mcu, mcu->port.read_inputs(mcu->port.context), bushd_mcu_first_open(mcu));
}

static void watch_current(bushd_mcu* mcu, uint32_t next) {
  const uint16_t most = mcu->inputs.overcurrent;
  if (most == 0 || mcu->port.read_current(mcu->port.context) <= most) return;
  bushd_mcu_stop_all(mcu, BUSHD_STOP_DISABLE, next);
  mcu->faults |= BUSHD_FAULT_OVERCURRENT;
}

void bushd_mcu_watch_inputs(bushd_mcu* mcu) {
  const uint32_t next = mcu->tick + 1u;
  const bushd_inputs pins = mcu->port.read_inputs(mcu->port.context);
  const uint16_t active = (pins.motors ^ mcu->inputs.inverted) & mcu->limits.watched;
  if ((active | mcu->limits.active | mcu->limits.unsettled | mcu->limits.hit_positive |
       mcu->limits.hit_negative) != 0) {
    follow_limits(mcu, active);
  }
  watch_emergency(mcu, pins, next);
  watch_current(mcu, next);
}

void bushd_mcu_clear_faults(bushd_mcu* mcu, uint8_t faults) {
  const uint8_t others = faults == 0 ? 0 : (uint8_t)~faults;
  mcu->faults &= (uint8_t)(others | BUSHD_FAULT_SELF_TEST);
  // What has caused one may be there still.
  bushd_mcu_watch_emergency_input(mcu);
  watch_current(mcu, bushd_mcu_first_open(mcu));
}

bushd_status bushd_mcu_take_set_inputs(bushd_mcu* mcu, const bushd_set_inputs* message) {
  if (bushd_mcu_engaged(mcu) != 0) return BUSHD_E_STATE;
  const uint16_t limits = message->limit_positive | message->limit_negative;
  if ((limits & ~bushd_mcu_own_motors(mcu)) != 0) return BUSHD_E_FORMAT;
  bushd_mcu_wait_for_local(mcu);
  // What the port has latched was for the settings that were: it latches no more before they go.
  bushd_mcu_unwatch_emergency_input(mcu);
  bushd_mcu_watch_emergency_input(mcu);
  mcu->inputs = *message;
  bushd_mcu_default_switches(mcu);
  bushd_mcu_begin_inputs(mcu);
  return BUSHD_OK;
}

// What is active now counts at once: a start may follow.
void bushd_mcu_begin_inputs(bushd_mcu* mcu) {
  const bushd_inputs pins = mcu->port.read_inputs(mcu->port.context);
  bushd_mcu_begin_limits(mcu, pins.motors ^ mcu->inputs.inverted);
  bushd_mcu_forget_presses(mcu, system_inputs(mcu, pins));
  bushd_mcu_drive_enable(mcu);
}

bushd_status bushd_mcu_take_motor_inputs(bushd_mcu* mcu, const bushd_motor_inputs* message) {
  const uint8_t count = mcu->config.motors;
  if (message->motor >= count || message->positive >= count || message->negative >= count ||
      message->home >= count) {
    return BUSHD_E_FORMAT;
  }
  if (bushd_mcu_engaged(mcu) != 0) return BUSHD_E_STATE;
  bushd_mcu_switches* switches = &mcu->switches[message->motor];
  switches->positive = message->positive & 0xFu;
  switches->negative = message->negative & 0xFu;
  switches->home = message->home & 0xFu;
  // What a motor has hit it has hit: a master that connects tells INPUTS first, and this again.
  const bushd_inputs pins = mcu->port.read_inputs(mcu->port.context);
  bushd_mcu_begin_limits(mcu, pins.motors ^ mcu->inputs.inverted);
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
