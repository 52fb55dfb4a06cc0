// Reports: what the MCU tells of itself when it is asked.
#ifndef BUSHD_FIRMWARE_CORE_REPORT_H
#define BUSHD_FIRMWARE_CORE_REPORT_H

#include <stddef.h>
#include <stdint.h>

#include "engine/message.h"

typedef struct bushd_mcu bushd_mcu;

// The last report, as far as the next one needs it. A master that has it is told what has changed
// since, any other is told all: nothing need be kept of reports before.
typedef struct bushd_mcu_reports {
  uint8_t number;   // 0: none since boot
  uint8_t changed;  // BUSHD_TELLS_*: in these something may have changed since
  uint16_t moved;   // motors that have made a step since, or whose position was set
  // As it told them: low water, and inputs, which change without the core.
  uint16_t low_water_ticks;
  uint16_t inputs;
  uint8_t system_inputs;
} bushd_mcu_reports;

// The answer to a POLL that has this entry; returns its size. O(motors).
size_t bushd_mcu_encode_report(bushd_mcu* mcu, const bushd_poll_entry* entry, uint8_t* payload);

#endif
