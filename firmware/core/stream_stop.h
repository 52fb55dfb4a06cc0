// How a motor stops whose steps the queue decides.
#ifndef BUSHD_FIRMWARE_CORE_STREAM_STOP_H
#define BUSHD_FIRMWARE_CORE_STREAM_STOP_H

#include <stdbool.h>
#include <stdint.h>

typedef struct bushd_mcu bushd_mcu;

// What the queue has it do at a tick.
typedef struct bushd_mcu_stream_motion {
  bool moves;      // makes a step or part of one from there on
  uint16_t delay;  // of the running step; 0: it all but stands
} bushd_mcu_stream_motion;

// At `next`, the first tick that is not prepared. Nothing must have been cut. O(ticks queued).
bushd_mcu_stream_motion bushd_mcu_stream_motion_at(const bushd_mcu* mcu, uint8_t m, uint32_t next);
// A start is to come at `next` or later: the motor rests from *rest_from on until then.
bool bushd_mcu_start_waits(const bushd_mcu* mcu, uint8_t m, uint32_t next, uint32_t* rest_from);
// Ramps it down; `delay` is that of the running step, 0: it rests at once.
void bushd_mcu_ramp_down_stream(bushd_mcu* mcu, uint8_t m, uint16_t delay);

#endif
