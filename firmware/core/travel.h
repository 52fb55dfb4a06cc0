// TRAVEL: a motor that goes from one limit to the other and back, or makes a step that its sensor
// sees, by itself.
#ifndef BUSHD_FIRMWARE_CORE_TRAVEL_H
#define BUSHD_FIRMWARE_CORE_TRAVEL_H

#include <stdbool.h>
#include <stdint.h>

#include "engine/message.h"

typedef struct bushd_mcu bushd_mcu;

// Its number, and when its run begins or has begun, are those of the trigger: one of both has them
// at a time.
typedef struct bushd_mcu_travel {
  uint8_t stage;      // bushd_travel_stage; in the same place as that of homing
  uint8_t motor;      // in the same place as that of homing
  int8_t direction;   // of the run that is made, or was made last
  uint8_t edge;       // at which it begins, 0: at once
  uint8_t sensor;     // of a step
  bool was_inactive;  // the sensor, since the step was asked for
  uint16_t readings;  // of the limits or the sensor that are still to come
  uint32_t steps;     // of either run
  uint32_t delay_ns;
  uint32_t wait_ns;
  uint32_t run_ticks;  // a run takes so long, and
  uint32_t run_ns;     // less than a tick
  uint32_t due_tick;   // when the next run begins
  uint32_t due_ns;
} bushd_mcu_travel;

// The same for a program, from the tick on that is prepared next. What silence and faults end is
// the program's affair. Precondition: its number is 0, and the motor is the program's, and rests.
bushd_status bushd_mcu_begin_travel(bushd_mcu* mcu, const bushd_travel* message);
// Its motor has been stopped, or does not wait any longer.
void bushd_mcu_give_up_travel(bushd_mcu* mcu);
// Before every tick is prepared.
void bushd_mcu_go_travel(bushd_mcu* mcu, uint16_t active_inputs);
// The edge that it waits for (bushd_mcu_trigger).
void bushd_mcu_travel_at_edge(bushd_mcu* mcu, int32_t time_in_tick_ns);
// A limit is active in the direction of the one that travels; false if that is where it was to
// arrive.
bool bushd_mcu_travel_meets_limit(bushd_mcu* mcu);
static inline bool bushd_mcu_travels(const bushd_mcu_travel* travel) {
  return travel->stage >= BUSHD_TRAVEL_STEPS && travel->stage <= BUSHD_TRAVEL_RETURN;
}

#endif
