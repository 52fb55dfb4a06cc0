// Local motion by the velocity loop (engine/velocity.h), in place of a table: a motor that has
// VELOCITY settings speeds up and down by a constant acceleration, reverses through zero without
// resting, and makes its steps exact to a slot.
//
// The loop counts intervals of 25 us from the tick in which the motion begins; a step falls at the
// end of one, in slot floor(t x slots / tick). DIR is constant within a tick: where a step would
// follow one of the other direction in the same tick, the loop stands still until the next one, so
// no two steps come closer than it would make them.
#ifndef BUSHD_FIRMWARE_CORE_VELOCITY_H
#define BUSHD_FIRMWARE_CORE_VELOCITY_H

#include <stdbool.h>
#include <stdint.h>

#include "engine/message.h"
#include "engine/velocity.h"
#include "firmware/core/slot_buffer.h"

typedef struct bushd_mcu bushd_mcu;

// What VELOCITY has said; of bushd_set_velocity. All 0: the motor has none.
typedef struct bushd_mcu_velocity_settings {
  int32_t least;
  int32_t most;
  int32_t acceleration;
} bushd_mcu_velocity_settings;

// The velocity loop of a motor; memory of the port (bushd_mcu_config.velocity).
typedef struct bushd_mcu_velocity {
  bushd_mcu_velocity_settings settings;
  // While its mode is BUSHD_MCU_VELOCITY.
  bushd_velocity loop;  // at the beginning of the first tick that is not prepared
  uint16_t since_ns;    // there: how much of the running interval has passed
} bushd_mcu_velocity;
#define BUSHD_MAX_VELOCITY_MOTORS 4u

// Another tick or emission has other room for steps: they must be set again.
void bushd_mcu_forget_velocities(bushd_mcu* mcu);
bool bushd_mcu_has_velocity(const bushd_mcu* mcu, uint8_t m);
// Motors that move by it.
uint16_t bushd_mcu_moved_by_velocity(const bushd_mcu* mcu);

// Precondition of these: the motor has settings. It is to move in this direction (+1, -1) as fast
// as they allow, and as `most`, in 1/64 step/s, does: from rest, or if it moves by the loop
// already, by way of zero if need be.
void bushd_mcu_steer(bushd_mcu* mcu, uint8_t m, int8_t direction, int32_t most);
// Brings a motor that moves by the loop to rest.
void bushd_mcu_brake(bushd_mcu* mcu, uint8_t m);
// Where it goes: +1, -1; 0 if it only comes to rest.
int8_t bushd_mcu_velocity_heading(const bushd_mcu* mcu, uint8_t m);
bool bushd_mcu_is_braking(const bushd_mcu* mcu, uint8_t m);
// Intervals of the running step.
uint16_t bushd_mcu_velocity_period(const bushd_mcu* mcu, uint8_t m);

// Makes the tick of those among `exact`, whose run is made exact to a slot, that move by the loop,
// and returns them. O(steps), four divisions of 32 bits for each motor at most.
uint16_t bushd_mcu_emit_velocity(bushd_mcu* mcu, bushd_slot_buffer* slot_buffer, uint16_t exact);

#endif
