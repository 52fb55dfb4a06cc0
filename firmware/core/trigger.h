// Runs that an edge at the trigger input starts.
#ifndef BUSHD_FIRMWARE_CORE_TRIGGER_H
#define BUSHD_FIRMWARE_CORE_TRIGGER_H

#include <stdint.h>

#include "engine/message.h"

typedef struct bushd_mcu bushd_mcu;

// Runs that wait for the trigger, and what became of the last ones (trigger.c). The runs are in
// their motors, that of a line (line_run.h) in its place.
typedef struct bushd_mcu_trigger_input {
  uint16_t armed;  // motors
  uint8_t number;
  uint8_t state;      // bushd_trigger_state
  uint32_t delay_us;  // the edge's
  uint32_t start_tick;
  uint32_t start_ns;
} bushd_mcu_trigger_input;

// The edge that armed motors wait for (bushd_mcu_trigger).
void bushd_mcu_begin_armed(bushd_mcu* mcu, int32_t time_in_tick_ns);
// The port knows nothing of inputs that are inverted.
bushd_edge bushd_mcu_edge_of_pin(const bushd_mcu* mcu, bushd_edge edge);
// A time in the present tick as the bus has it.
int32_t bushd_mcu_bus_ns(const bushd_mcu* mcu, int32_t time_in_tick_ns);
void bushd_mcu_disarm(bushd_mcu* mcu, bushd_trigger_state why);

#endif
