// What depends on who owns a motor.
#include "firmware/core/owner.h"

#include "firmware/core/homing.h"
#include "firmware/core/line_run.h"
#include "firmware/core/stream.h"
#include "firmware/core/stream_stop.h"
#include "firmware/core/table_run.h"
#include "firmware/core/travel.h"
#include "firmware/core/velocity.h"

// By masks: to ask for the owner of each motor would cost every tick of a run.
void bushd_mcu_make_steps(bushd_mcu* mcu, bushd_slot_buffer* slot_buffer, uint16_t motors) {
  motors &= (uint16_t)~bushd_mcu_emit_velocity(mcu, slot_buffer, motors);
  const uint16_t on_line = motors & mcu->line.motors;
  if (motors != on_line) bushd_mcu_emit_runs(mcu, slot_buffer, motors & (uint16_t)~on_line);
  if (on_line != 0) bushd_mcu_emit_line(mcu, slot_buffer, on_line);
}

// Whether the run of a motor that a table run or a line owns makes this tick; else the queue does.
static bool run_makes(const bushd_mcu_motor* motor, uint32_t next) {
  if (motor->mode == BUSHD_MCU_RAMP_DOWN) return true;
  const bool begun = motor->mode == BUSHD_MCU_TABLE_RUN || motor->start.tick == (uint16_t)next;
  return begun && ticks_after(motor->made.until, next) > 0;
}

static int8_t queued_heading(const bushd_mcu* mcu, uint8_t m, uint32_t next) {
  const int16_t queued = ticks_after(mcu->motor[m].known_until, next) > 0
                             ? *bushd_mcu_queue_at((bushd_mcu*)mcu, next, m)
                             : (int16_t)0;
  if (queued != 0) return queued > 0 ? 1 : -1;
  return (mcu->stream.begun & motor_bit(m)) != 0 ? bushd_mcu_last_direction(mcu, m) : (int8_t)0;
}

int8_t bushd_mcu_heading(const bushd_mcu* mcu, uint8_t m, uint32_t next) {
  const bushd_mcu_motor* motor = &mcu->motor[m];
  switch (bushd_mcu_owner_of_motor(mcu, m)) {
    case BUSHD_MCU_OWNER_QUEUE:
    case BUSHD_MCU_OWNER_TRIGGER:
    case BUSHD_MCU_OWNER_PROGRAM:
      return queued_heading(mcu, m, next);
    case BUSHD_MCU_OWNER_TABLE_RUN:
    case BUSHD_MCU_OWNER_LINE:
      return run_makes(motor, next) ? bushd_mcu_run_direction(mcu, m)
                                    : queued_heading(mcu, m, next);
    case BUSHD_MCU_OWNER_VELOCITY:
      return bushd_mcu_velocity_heading(mcu, m);
    default:
      return motor->made.run.direction;
  }
}

uint16_t bushd_mcu_step_delay(const bushd_mcu* mcu, uint8_t m) {
  switch (bushd_mcu_owner_of_motor(mcu, m)) {
    case BUSHD_MCU_OWNER_VELOCITY:
      return bushd_mcu_velocity_period(mcu, m);
    case BUSHD_MCU_OWNER_LINE:
      return bushd_mcu_line_delay(mcu, m);
    default: {
      const bushd_delay delay = bushd_run_delay(&mcu->motor[m].made.run);
      return bushd_delay_is_code(delay) ? (uint16_t)delay : UINT16_MAX;
    }
  }
}

void bushd_mcu_ramp_down_own_motion(bushd_mcu* mcu, uint8_t m) {
  switch (bushd_mcu_owner_of_motor(mcu, m)) {
    case BUSHD_MCU_OWNER_TABLE_RUN:
    case BUSHD_MCU_OWNER_HOMING:
    case BUSHD_MCU_OWNER_TRAVEL:
    case BUSHD_MCU_OWNER_LOCAL:
      bushd_mcu_ramp_down_run(mcu, m);
      break;
    case BUSHD_MCU_OWNER_VELOCITY:
      bushd_mcu_brake(mcu, m);
      break;
    default:
      break;
  }
}

static void ramp_down(bushd_mcu* mcu, uint8_t m, const bushd_mcu_stream_motion* queued) {
  switch (bushd_mcu_owner_of_motor(mcu, m)) {
    case BUSHD_MCU_OWNER_QUEUE:
    case BUSHD_MCU_OWNER_TRIGGER:
    case BUSHD_MCU_OWNER_PROGRAM:
      if (queued->moves) bushd_mcu_ramp_down_stream(mcu, m, queued->delay);
      break;
    case BUSHD_MCU_OWNER_LINE:
      // Else all do, along the line.
      if (mcu->motor[m].mode != BUSHD_MCU_RAMP_DOWN) bushd_mcu_ramp_down_from_line(mcu, m);
      break;
    default:
      bushd_mcu_ramp_down_own_motion(mcu, m);
  }
}

static void cut(bushd_mcu* mcu, uint8_t m, const bushd_mcu_stream_motion* queued) {
  bushd_mcu_motor* motor = &mcu->motor[m];
  if (motor->mode != BUSHD_MCU_STREAM || queued->moves) motor->remainder = 0;
  bushd_mcu_give_to_queue(mcu, m);
}

void bushd_mcu_stop_motor(bushd_mcu* mcu, uint8_t m, bushd_stop_mode mode, uint32_t next) {
  bushd_mcu_finish_rows(mcu);
  bushd_mcu_stream_motion queued = {false, 0};
  if (bushd_mcu_is_queued(&mcu->motor[m])) queued = bushd_mcu_stream_motion_at(mcu, m, next);
  bushd_mcu_cut_queue(mcu, m, next);  // a run that waits, too: the motor is the queue's then
  if (mode == BUSHD_STOP_RAMP) {
    ramp_down(mcu, m, &queued);
  } else {
    cut(mcu, m, &queued);
  }
}

static bool is_ramping_down(const bushd_mcu* mcu, uint8_t m) {
  if (bushd_mcu_owner_of_motor(mcu, m) == BUSHD_MCU_OWNER_VELOCITY) {
    return bushd_mcu_is_braking(mcu, m);
  }
  return mcu->motor[m].mode == BUSHD_MCU_RAMP_DOWN;
}

void bushd_mcu_motor_meets_limit(bushd_mcu* mcu, uint8_t m, int8_t heading, bool cuts,
                                 uint32_t next) {
  const bushd_mcu_motor_owner owner = bushd_mcu_owner_of_motor(mcu, m);
  if (owner == BUSHD_MCU_OWNER_HOMING) {
    bushd_mcu_homing_meets_limit(mcu, cuts);
    return;
  }
  if (owner == BUSHD_MCU_OWNER_TRAVEL && !bushd_mcu_travel_meets_limit(mcu)) return;
  // One that only turns towards the switch is at rest as far as this direction goes.
  const bool immediate = cuts || heading != bushd_mcu_last_direction(mcu, m);
  if (!immediate && is_ramping_down(mcu, m)) return;
  bushd_mcu_stop_motor(mcu, m, immediate ? BUSHD_STOP_IMMEDIATE : BUSHD_STOP_RAMP, next);
}
