// EN, common to all drivers of the MCU, and the levels at which drivers do what they are to do.
#include "firmware/core/drivers.h"

#include "firmware/core/access.h"
#include "firmware/core/state.h"

static bushd_edge disabling_edge(const bushd_mcu* mcu) {
  if (mcu->inputs.emergency != BUSHD_EMERGENCY_INPUT_DISABLE) return BUSHD_EDGE_NONE;
  const bool inverted = (mcu->inputs.system_inverted & BUSHD_INPUT_EMERGENCY) != 0;
  return inverted ? BUSHD_EDGE_FALLING : BUSHD_EDGE_RISING;
}

void bushd_mcu_drive_enable(bushd_mcu* mcu) {
  const bool on = (mcu->flags & BUSHD_FLAG_ENABLED) != 0;
  // A master that knows nothing of levels wants these.
  if (on && mcu->config.outputs.enabled == 0) mcu->config.outputs.enabled = BUSHD_ENABLED_HIGH;
  // First: what the port makes void when it switches off is not written again.
  mcu->port.keep_enable(mcu->port.context, on && mcu->inputs.enable_after_watchdog);
  const bushd_edge off_at = on ? disabling_edge(mcu) : BUSHD_EDGE_NONE;
  mcu->port.set_enable(mcu->port.context, on, &mcu->config.outputs, off_at);
}

void bushd_mcu_unwatch_emergency_input(bushd_mcu* mcu) {
  const bool on = (mcu->flags & BUSHD_FLAG_ENABLED) != 0;
  mcu->port.set_enable(mcu->port.context, on, &mcu->config.outputs, BUSHD_EDGE_NONE);
}

void bushd_mcu_set_enable(bushd_mcu* mcu, bool on) {
  mcu->flags &= (uint8_t)~BUSHD_FLAG_ENABLED;
  if (on) mcu->flags |= BUSHD_FLAG_ENABLED;
  bushd_mcu_drive_enable(mcu);
}

// A level of STEP that changes may look like a step to a driver: it is off meanwhile.
bushd_status bushd_mcu_set_outputs(bushd_mcu* mcu, const bushd_set_outputs* message) {
  if ((mcu->flags & BUSHD_FLAG_CONFIGURED) == 0) return BUSHD_E_STATE;
  bushd_set_outputs* const outputs = &mcu->config.outputs;
  if (outputs->step_low == message->step_low && outputs->direction_low == message->direction_low &&
      outputs->enabled == message->enabled) {
    return BUSHD_OK;
  }
  if (bushd_mcu_engaged(mcu) != 0) return BUSHD_E_STATE;
  if (message->step_low != 0 && mcu->emission.grid.mode == BUSHD_EMISSION_PHASES) {
    return BUSHD_E_FORMAT;
  }
  if (outputs->enabled != 0) bushd_mcu_set_enable(mcu, false);
  *outputs = *message;
  bushd_mcu_set_enable(mcu, false);
  return BUSHD_OK;
}
