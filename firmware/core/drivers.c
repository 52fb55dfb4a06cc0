// EN, common to all drivers of the MCU.
#include "firmware/core/drivers.h"

#include "firmware/core/access.h"

void bushd_mcu_keep_enable(bushd_mcu* mcu) {
  const bool on = (mcu->flags & BUSHD_FLAG_ENABLED) != 0;
  mcu->port.keep_enable(mcu->port.context, on && mcu->inputs.enable_after_watchdog);
}

void bushd_mcu_set_enable(bushd_mcu* mcu, bool on) {
  mcu->flags &= (uint8_t)~BUSHD_FLAG_ENABLED;
  if (on) mcu->flags |= BUSHD_FLAG_ENABLED;
  mcu->port.set_enable(mcu->port.context, on);
  bushd_mcu_keep_enable(mcu);
}
