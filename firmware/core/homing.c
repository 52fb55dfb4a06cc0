// HOME: a motor looks for its switch by itself, and its position is set there. One motor of an MCU
// at a time; in stages, each of them a run:
//
//     fast        by the motor's table until the switch is active, and the ramp-down from there
//     back-off    slowly away from it until it is released
//     approach    slowly towards it until it is active again
//
// A limit that comes before the switch turns the fast stage round, once: the switch is looked for
// on the limit's far side, and backed off in the same direction as ever, so that home is where the
// switch becomes active towards it, wherever the motor came from.
//
// A run of the slow stages is one of a table with a single code. It is not shorter than a tick, so
// at most one step falls between two readings of the switch: the step at which it becomes active is
// known to a step. A contact bounces; it counts as active, or as released, after READINGS readings
// in a row. Home is where the motor stood at the beginning of the tick with the first of them, and
// what it makes beyond is counted from there.
#include "firmware/core/homing.h"

#include <string.h>

#include "firmware/core/access.h"
#include "firmware/core/limits.h"
#include "firmware/core/owner.h"
#include "firmware/core/state.h"
#include "firmware/core/table_run.h"

enum { READINGS = 3 };

static bool under_way(const bushd_mcu_homing* homing) {
  return homing->stage >= BUSHD_HOMING_FAST && homing->stage <= BUSHD_HOMING_APPROACH;
}

static void set_stage(bushd_mcu* mcu, bushd_homing stage) {
  mcu->homing.stage = (uint8_t)stage;
  bushd_mcu_tell(mcu, BUSHD_TELLS_AUTONOMOUS);
}

static void begin_slow(bushd_mcu* mcu, bushd_homing stage, int8_t direction) {
  bushd_mcu_homing* homing = &mcu->homing;
  set_stage(mcu, stage);
  homing->readings = 0;
#if BUSHD_SLOW_RUNS
  const bushd_delay shortest_delay = homing->slow_shortest_delay;
#else
  const bushd_delay shortest_delay = 0;
#endif
  bushd_run_start(&mcu->motor[homing->motor].made.run, &homing->slow, homing->slow_steps, direction,
                  shortest_delay);
}

static void end(bushd_mcu* mcu, bushd_homing stage) {
  const uint8_t m = mcu->homing.motor;
  set_stage(mcu, stage);
  if (bushd_mcu_owner_of_motor(mcu, m) != BUSHD_MCU_OWNER_HOMING) return;
  bushd_mcu_give_to_queue(mcu, m);
  mcu->motor[m].remainder = 0;
}

static void arrive(bushd_mcu* mcu) {
  const bushd_mcu_homing* homing = &mcu->homing;
  bushd_mcu_motor* motor = &mcu->motor[homing->motor];
  const uint32_t beyond = (uint32_t)motor->position_steps - (uint32_t)homing->seen_steps;
  motor->position_steps = (int32_t)((uint32_t)homing->home_steps + beyond);
  mcu->homed |= motor_bit(homing->motor);
  bushd_mcu_stands_at_switch(mcu, homing->motor, homing->direction);
  end(mcu, BUSHD_HOMING_DONE);
  mcu->reports.moved |= motor_bit(homing->motor);  // its position has another name
}

// Counts the readings in a row that are as `wanted`; true if they are enough.
static bool is_sure(bushd_mcu* mcu, bool as_wanted) {
  bushd_mcu_homing* homing = &mcu->homing;
  if (!as_wanted) {
    homing->readings = 0;
    return false;
  }
  if (homing->readings == 0) homing->seen_steps = mcu->motor[homing->motor].position_steps;
  return ++homing->readings >= READINGS;
}

// Ends the fast stage.
static void begin_to_stop(bushd_mcu* mcu, bool cuts) {
  bushd_run* run = &mcu->motor[mcu->homing.motor].made.run;
  // One that has not made a step need not begin in order to stop.
  if (!cuts && bushd_run_steps_left(run) != mcu->homing.most_steps) {
    bushd_run_ramp_down(run);
  } else {
    bushd_run_start(run, run->table, 0, run->direction, 0);
  }
}

void bushd_mcu_homing_meets_limit(bushd_mcu* mcu, bool cuts) {
  bushd_mcu_homing* homing = &mcu->homing;
  switch (homing->stage) {
    case BUSHD_HOMING_FAST:
      if (cuts || !homing->meets_limit) begin_to_stop(mcu, cuts);
      homing->meets_limit = true;
      break;
    case BUSHD_HOMING_RAMP_DOWN:
      if (cuts) begin_to_stop(mcu, true);
      break;
    default:
      end(mcu, BUSHD_HOMING_LIMIT);
  }
}

// A limit that is not the switch which it looks for is active there.
static bool is_inhibited(const bushd_mcu* mcu, int8_t direction) {
  const uint8_t m = mcu->homing.motor;
  return (bushd_mcu_forbidden(mcu, direction) & motor_bit(m)) != 0 &&
         !bushd_mcu_homes_at_limit(mcu, m, direction);
}

static void end_fast(bushd_mcu* mcu) {
  bushd_mcu_homing* homing = &mcu->homing;
  if (!homing->meets_limit || homing->turned || is_inhibited(mcu, (int8_t)-homing->direction)) {
    end(mcu, BUSHD_HOMING_NOT_FOUND);
    return;
  }
  homing->meets_limit = false;
  homing->turned = true;
  bushd_run* run = &mcu->motor[homing->motor].made.run;
  bushd_run_start(run, run->table, homing->most_steps, -homing->direction, homing->shortest_delay);
}

static void watch_silence(bushd_mcu* mcu) {
  if (mcu->reception.silent_ticks < mcu->reception.comm_timeout_ticks) return;
  mcu->faults |= BUSHD_FAULT_LINK;
  bushd_mcu_count_ramp_down(mcu);
  bushd_mcu_ramp_down_run(mcu, mcu->homing.motor);
}

static void go_on(bushd_mcu* mcu, bool active) {
  bushd_mcu_homing* homing = &mcu->homing;
  const bool done = bushd_run_done(&mcu->motor[homing->motor].made.run);
  switch (homing->stage) {
    case BUSHD_HOMING_FAST:
      if (active) {
        // Whatever ends the homing before it has backed off.
        bushd_mcu_stands_at_switch(mcu, homing->motor, homing->direction);
        if (!homing->meets_limit) begin_to_stop(mcu, false);
        set_stage(mcu, BUSHD_HOMING_RAMP_DOWN);
      } else if (done) {
        end_fast(mcu);
      }
      break;
    case BUSHD_HOMING_RAMP_DOWN:
      if (!done) break;
      if (is_inhibited(mcu, (int8_t)-homing->direction)) {
        end(mcu, BUSHD_HOMING_LIMIT);
      } else {
        begin_slow(mcu, BUSHD_HOMING_BACK_OFF, (int8_t)-homing->direction);
      }
      break;
    case BUSHD_HOMING_BACK_OFF:
      if (is_sure(mcu, !active)) {
        bushd_mcu_has_left_switch(mcu, homing->motor, homing->direction);
        begin_slow(mcu, BUSHD_HOMING_APPROACH, homing->direction);
      } else if (done && homing->readings == 0) {
        end(mcu, BUSHD_HOMING_STUCK);
      }
      break;
    default:
      if (is_sure(mcu, active)) {
        arrive(mcu);
      } else if (done && homing->readings == 0) {
        end(mcu, BUSHD_HOMING_LOST);
      }
  }
}

void bushd_mcu_go_home(bushd_mcu* mcu, uint16_t active_inputs) {
  if (!under_way(&mcu->homing)) return;
  watch_silence(mcu);
  const uint8_t m = mcu->homing.motor;
  if (bushd_mcu_owner_of_motor(mcu, m) == BUSHD_MCU_OWNER_HOMING) {
    go_on(mcu, (active_inputs & motor_bit(mcu->switches[m].home)) != 0);
  } else {
    end(mcu, BUSHD_HOMING_STOPPED);
  }
}

static bool slow_enough(const bushd_mcu* mcu, const bushd_home* message) {
  const bushd_table* table = &mcu->tables.bank[mcu->motor[message->motor].table].table;
  const uint16_t first = bushd_table_accel(table, 0);
  const uint16_t last = bushd_table_decel(table, 0);
  const uint64_t slowest_ns = (uint64_t)(first > last ? first : last) * table->time_unit_ns;
  if (!bushd_delay_is_code(message->slow_delay)) return true;  // 0.6 s are more than any of these
  const uint32_t slow_ns = (uint32_t)message->slow_delay * BUSHD_HOME_UNIT_NS;
  return slow_ns >= mcu->tick_ns && slow_ns >= slowest_ns;
}

// Wherever its stages may lead.
static bool is_counted(const bushd_mcu* mcu, const bushd_home* message) {
  for (int direction = -1; direction <= 1; direction += 2) {
    const uint32_t counted = bushd_mcu_steps_counted(mcu, message->motor, direction);
    if (message->most_steps > counted || message->slow_steps > counted - message->most_steps) {
      return false;
    }
  }
  return true;
}

static bool on_switch(const bushd_mcu* mcu, uint8_t m) {
  const bushd_inputs pins = mcu->port.read_inputs(mcu->port.context);
  return ((pins.motors ^ mcu->inputs.inverted) & motor_bit(mcu->switches[m].home)) != 0;
}

// In which direction the fast stage begins; 0: in none. On its switch a motor has to back off. It
// must not look for a switch that it has overrun; at another limit it may begin.
static int8_t first_direction(const bushd_mcu* mcu, uint8_t m, int8_t direction) {
  const uint16_t bit = motor_bit(m);
  const int8_t back = (int8_t)-direction;
  const bool ahead = (bushd_mcu_forbidden(mcu, direction) & bit) != 0;
  const bool behind = (bushd_mcu_forbidden(mcu, back) & bit) != 0;
  if (on_switch(mcu, m)) return behind ? 0 : direction;
  if (behind && (ahead || bushd_mcu_homes_at_limit(mcu, m, back))) return 0;
  if (!ahead) return direction;
  return bushd_mcu_homes_at_limit(mcu, m, direction) ? 0 : back;
}

bool bushd_mcu_homing_in_use(const bushd_mcu* mcu) {
  const uint8_t m = mcu->homing.motor;
  return under_way(&mcu->homing) ||
         (bushd_mcu_owner_of_motor(mcu, m) == BUSHD_MCU_OWNER_RAMP_DOWN &&
          mcu->motor[m].made.run.table == &mcu->homing.slow);
}

static bushd_status check(bushd_mcu* mcu, const bushd_home* message) {
  const uint16_t bit = motor_bit(message->motor);
  bushd_mcu_update_state(mcu);
  if (mcu->state != BUSHD_STATE_READY && mcu->state != BUSHD_STATE_RUN) return BUSHD_E_STATE;
  if (mcu->motor[message->motor].table < 0) return BUSHD_E_NO_TABLE;
  if (bushd_mcu_homing_in_use(mcu) || bushd_mcu_travels(&mcu->travel) ||
      (bushd_mcu_engaged(mcu) & bit) != 0) {
    return BUSHD_E_STATE;
  }
  return slow_enough(mcu, message) && is_counted(mcu, message) ? BUSHD_OK : BUSHD_E_FORMAT;
}

bushd_status bushd_mcu_take_home(bushd_mcu* mcu, const bushd_home* message) {
  bushd_mcu_homing* homing = &mcu->homing;
  if (message->motor >= mcu->config.motors) return BUSHD_E_FORMAT;
  if (!bushd_mcu_runs_so_slowly(mcu, message->shortest_delay) ||
      !bushd_mcu_runs_so_slowly(mcu, message->slow_delay)) {
    return BUSHD_E_LENGTH;
  }
  const bool same = under_way(homing) && homing->motor == message->motor;
  if (message->most_steps == 0) {
    if (same) bushd_mcu_ramp_down_run(mcu, message->motor);
    return BUSHD_OK;
  }
  if (same) return BUSHD_OK;
  const bushd_status status = check(mcu, message);
  if (status != BUSHD_OK) return status;
  const int8_t begins = first_direction(mcu, message->motor, message->direction);
  if (begins == 0) return BUSHD_E_FORBIDDEN;
  memset(homing, 0, sizeof *homing);
  set_stage(mcu, BUSHD_HOMING_FAST);
  homing->motor = message->motor;
  homing->direction = message->direction;
  homing->turned = begins != message->direction;
  homing->shortest_delay = message->shortest_delay;
  homing->most_steps = message->most_steps;
  homing->slow_steps = message->slow_steps;
  homing->home_steps = message->position_steps;
  homing->slow.cruise = (uint16_t)message->slow_delay;
#if BUSHD_SLOW_RUNS
  if (!bushd_delay_is_code(message->slow_delay)) {
    homing->slow.cruise = UINT16_MAX;
    homing->slow_shortest_delay = message->slow_delay;
  }
#endif
  homing->slow.accel.code = homing->slow.decel.code = &homing->slow.cruise;
  homing->slow.accel.count = homing->slow.decel.count = 1;
  homing->slow.time_unit_ns = BUSHD_HOME_UNIT_NS;
  const uint16_t bit = motor_bit(message->motor);
  mcu->homed &= (uint16_t)~bit;
  mcu->local.held &= (uint16_t)~bit;
  bushd_mcu_begin_by_itself(mcu, message->motor, message->most_steps, begins,
                            message->shortest_delay, BUSHD_MCU_HOMING);
  return BUSHD_OK;
}
