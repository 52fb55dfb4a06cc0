// A motor has one owner at a time, which decides what it does next. This file says which, and what
// depends on it: how the next tick is made, how it stops, what a limit does, what may follow.
//
// The owner is told from the motor's mode, and from three masks: the motors on a line, those that
// are armed, and those of a program. Who takes a motor gives it a mode (bushd_mcu_give_motor), and
// in the end gives it back to the queue. docs/states.md has the picture.
#ifndef BUSHD_FIRMWARE_CORE_OWNER_H
#define BUSHD_FIRMWARE_CORE_OWNER_H

#include "firmware/core/access.h"

// All but the last two are numbered as the modes are.
typedef enum bushd_mcu_motor_owner {
  BUSHD_MCU_OWNER_QUEUE = BUSHD_MCU_STREAM,         // ticks of a master, or rest
  BUSHD_MCU_OWNER_TRIGGER = BUSHD_MCU_RUN_WAITS,    // it rests until the edge comes
  BUSHD_MCU_OWNER_TABLE_RUN = BUSHD_MCU_TABLE_RUN,  // also before its start
  BUSHD_MCU_OWNER_RAMP_DOWN = BUSHD_MCU_RAMP_DOWN,  // it comes to rest by its own table
  BUSHD_MCU_OWNER_HOMING = BUSHD_MCU_HOMING,
  BUSHD_MCU_OWNER_TRAVEL = BUSHD_MCU_TRAVEL,
  BUSHD_MCU_OWNER_LOCAL = BUSHD_MCU_LOCAL,
  BUSHD_MCU_OWNER_VELOCITY = BUSHD_MCU_VELOCITY,
  BUSHD_MCU_OWNER_LINE = 8,    // also before its start, and while the line ramps down
  BUSHD_MCU_OWNER_PROGRAM = 9  // it rests until a frame moves it; then by a table run, or a line
} bushd_mcu_motor_owner;

static inline bushd_mcu_motor_owner bushd_mcu_owner_of_motor(const bushd_mcu* mcu, uint8_t m) {
  const uint8_t mode = mcu->motor[m].mode;
  if (mode == BUSHD_MCU_STREAM) {
    const bool armed = (mcu->trigger.armed & motor_bit(m)) != 0;
    if (armed) return BUSHD_MCU_OWNER_TRIGGER;
    const bool programmed = (bushd_mcu_program_motors(mcu) & motor_bit(m)) != 0;
    return programmed ? BUSHD_MCU_OWNER_PROGRAM : BUSHD_MCU_OWNER_QUEUE;
  }
  if ((mcu->line.motors & motor_bit(m)) != 0) return BUSHD_MCU_OWNER_LINE;
  return mode == BUSHD_MCU_RUN_WAITS ? BUSHD_MCU_OWNER_TABLE_RUN : (bushd_mcu_motor_owner)mode;
}

// Nobody else sets a mode. A motor on a line is told so in bushd_mcu.line.motors before.
static inline void bushd_mcu_give_motor(bushd_mcu* mcu, uint8_t m, bushd_mcu_mode mode) {
  mcu->motor[m].mode = (uint8_t)mode & 7u;
  mcu->stream.queue_summary.stale = true;
}
// A motor that was on a line has left it. In stream.c.
void bushd_mcu_give_to_queue(bushd_mcu* mcu, uint8_t m);

// What may be asked of a motor while it has this owner.

// The queue has its steps, though the start of a run may be near.
static inline bool bushd_mcu_is_queued(const bushd_mcu_motor* motor) {
  return motor->mode == BUSHD_MCU_STREAM || motor->mode == BUSHD_MCU_RUN_WAITS;
}
// There is room for a run, or for ticks beyond a gap.
static inline bool bushd_mcu_has_no_run(const bushd_mcu_motor* motor) {
  return motor->mode == BUSHD_MCU_STREAM;
}
// A start may be queued behind what it does. A ramp-down has no end that is known; and one start
// can wait at a time if it is a run's.
static inline bool bushd_mcu_may_be_followed(const bushd_mcu_motor* motor) {
  return motor->mode == BUSHD_MCU_STREAM || motor->mode == BUSHD_MCU_TABLE_RUN;
}
// Motors that ticks and runs say nothing to, until they are at rest.
static inline uint16_t bushd_mcu_not_for_ticks(const bushd_mcu* mcu) {
  return mcu->autonomous | mcu->trigger.armed | bushd_mcu_program_motors(mcu);
}
// Motors that move by themselves for a master, as a mask: one homes or travels at a time.
static inline uint16_t bushd_mcu_moved_by_request(const bushd_mcu* mcu) {
  const uint8_t m = mcu->homing.motor;  // in the same place as that of travel
  const uint8_t mode = mcu->motor[m].mode;
  return mode == BUSHD_MCU_HOMING || mode == BUSHD_MCU_TRAVEL ? motor_bit(m) : (uint16_t)0;
}

// Makes the next tick of these motors, whose steps the queue does not decide.
void bushd_mcu_make_steps(bushd_mcu* mcu, bushd_slot_buffer* slot_buffer, uint16_t motors);
// Where it goes at `next`, the first tick that is not prepared: +1, -1; 0: at rest.
int8_t bushd_mcu_heading(const bushd_mcu* mcu, uint8_t m, uint32_t next);
// The delay of its running step. Precondition: its steps are not the queue's.
uint16_t bushd_mcu_step_delay(const bushd_mcu* mcu, uint8_t m);
// Stops it from `next` on.
void bushd_mcu_stop_motor(bushd_mcu* mcu, uint8_t m, bushd_stop_mode mode, uint32_t next);
// Brings a motor to rest that moves by a run of its own or by the velocity loop; others are left
// alone.
void bushd_mcu_ramp_down_own_motion(bushd_mcu* mcu, uint8_t m);
// A limit is active where it goes. `cuts`: it stops there without another step; otherwise it ramps
// down.
void bushd_mcu_motor_meets_limit(bushd_mcu* mcu, uint8_t m, int8_t heading, bool cuts,
                                 uint32_t next);

#endif
