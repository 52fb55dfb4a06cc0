// A travel between limits is two runs of the motor's table, each from rest. With e the time of the
// edge, s when the first run begins and t how long it takes, they begin at
//
//     s  =  e + delay      or at the first tick that is not prepared, without an edge
//     max( e + wait, a )   or  max( s + t + wait, a )
//
// wherever in a tick that is (bushd_run_begin_late); a is the tick after the one that is prepared
// when the limit has been seen. It must not be active while steps of later ticks are to come. It
// must be so, and the other one not, with one of the readings that debouncing takes after the last
// step: contacts bounce for as many ticks as debouncing has, and it then counts as many and one
// more.
#include "firmware/core/travel.h"

#include <string.h>

#include "firmware/core/access.h"
#include "firmware/core/homing.h"
#include "firmware/core/owner.h"
#include "firmware/core/state.h"
#include "firmware/core/table_run.h"
#include "firmware/core/trigger.h"

static bool is_run(const bushd_mcu_travel* travel) {
  return travel->stage == BUSHD_TRAVEL_RUN || travel->stage == BUSHD_TRAVEL_RETURN;
}

static void set_stage(bushd_mcu* mcu, bushd_travel_stage stage) {
  mcu->travel.stage = (uint8_t)stage;
  bushd_mcu_tell(mcu, BUSHD_TELLS_AUTONOMOUS);
}

static void end(bushd_mcu* mcu, bushd_travel_stage stage) {
  bushd_mcu_travel* travel = &mcu->travel;
  if (travel->stage == BUSHD_TRAVEL_ARMED) {
    mcu->port.set_trigger(mcu->port.context, BUSHD_EDGE_NONE);
  }
  set_stage(mcu, stage);
  if (bushd_mcu_owner_of_motor(mcu, travel->motor) != BUSHD_MCU_OWNER_TRAVEL) return;
  bushd_mcu_give_to_queue(mcu, travel->motor);
  mcu->motor[travel->motor].remainder = 0;
}

static void wait_for_edge(bushd_mcu* mcu) {
  set_stage(mcu, BUSHD_TRAVEL_ARMED);
  mcu->trigger.state = BUSHD_TRIGGER_ARMED;
  mcu->port.set_trigger(mcu->port.context,
                        bushd_mcu_edge_of_pin(mcu, (bushd_edge)mcu->travel.edge));
}

static void start_run(bushd_mcu* mcu, uint8_t m, uint32_t steps, int direction) {
  bushd_run* run = &mcu->motor[m].made.run;
  const bushd_table* table = bushd_mcu_table_of(mcu, &mcu->motor[m]);
  if (bushd_mcu_travels_by_scratch(mcu, m)) {
    table = &mcu->config.scratch->entry.table;
    if (mcu->config.scratch->written) {
      bushd_run_start_as_written(run, table, steps, direction);
      return;
    }
  }
  bushd_run_start(run, table, steps, direction, 0);
}

static void begin(bushd_mcu* mcu, bushd_travel_stage stage) {
  bushd_mcu_travel* travel = &mcu->travel;
  bushd_mcu_motor* motor = &mcu->motor[travel->motor];
  if (stage == BUSHD_TRAVEL_RETURN) travel->direction = (int8_t)-travel->direction;
  if (bushd_mcu_forbidden(mcu, travel->direction) & motor_bit(travel->motor)) {
    end(mcu, BUSHD_TRAVEL_EARLY);
    return;
  }
  set_stage(mcu, stage);
  travel->readings = (uint16_t)(2u * mcu->inputs.debounce_ticks + 2u);
  start_run(mcu, travel->motor, travel->steps, travel->direction);
  if (travel->due_ns != 0) bushd_run_begin_late(&motor->made.run, travel->due_ns);
  mcu->trigger.state = BUSHD_TRIGGER_STARTED;
  mcu->trigger.start_tick = travel->due_tick;
  mcu->trigger.start_ns = travel->due_ns;
}

// The return: from the beginning of the first run on.
static void plan_return(bushd_mcu* mcu) {
  bushd_mcu_travel* travel = &mcu->travel;
  const uint32_t tick_ns = mcu->tick_ns;
  const uint32_t first = bushd_mcu_first_open(mcu);
  travel->due_tick = mcu->trigger.start_tick;
  int64_t ns = (int64_t)mcu->trigger.start_ns + travel->wait_ns;
  if (travel->edge == BUSHD_EDGE_NONE) {
    travel->due_tick += travel->run_ticks;
    ns += travel->run_ns;
  } else {
    ns -= travel->delay_ns;
  }
  if (ns > 0) {
    travel->due_tick += (uint32_t)(ns / tick_ns);
    travel->due_ns = (uint32_t)(ns % tick_ns);
  }
  if (ns <= 0 || ticks_after(travel->due_tick, first) < 0) {
    travel->due_tick = first;
    travel->due_ns = 0;
  }
  set_stage(mcu, BUSHD_TRAVEL_RETURN_DELAY);
}

static bool is_at(const bushd_mcu* mcu, int8_t direction) {
  const uint16_t motors = direction > 0 ? mcu->limits.at_positive : mcu->limits.at_negative;
  return (motors & motor_bit(mcu->travel.motor)) != 0;
}

// All steps of the run have been made.
static void arrive(bushd_mcu* mcu) {
  bushd_mcu_travel* travel = &mcu->travel;
  const bool reached = is_at(mcu, travel->direction);
  if (!reached || is_at(mcu, (int8_t)-travel->direction)) {
    if (--travel->readings == 0)
      end(mcu, reached ? BUSHD_TRAVEL_NOT_LEFT : BUSHD_TRAVEL_NOT_REACHED);
  } else if (travel->stage == BUSHD_TRAVEL_RUN) {
    plan_return(mcu);
  } else if (travel->edge == BUSHD_EDGE_NONE) {
    end(mcu, BUSHD_TRAVEL_DONE);
  } else {
    travel->direction = (int8_t)-travel->direction;
    wait_for_edge(mcu);
  }
}

static void watch_sensor(bushd_mcu* mcu, uint16_t active_inputs) {
  bushd_mcu_travel* travel = &mcu->travel;
  const bool active = (active_inputs & motor_bit(travel->sensor)) != 0;
  const bool seen = active && travel->was_inactive;
  if (!active) travel->was_inactive = true;
  if (!bushd_run_done(&mcu->motor[travel->motor].made.run)) return;
  if (seen) {
    end(mcu, BUSHD_TRAVEL_DONE);
  } else if (--travel->readings == 0) {
    end(mcu, BUSHD_TRAVEL_NOT_SEEN);
  }
}

static void go_on(bushd_mcu* mcu, uint16_t active_inputs) {
  bushd_mcu_travel* travel = &mcu->travel;
  const bool is_due = ticks_after(mcu->tick + 1u, travel->due_tick) >= 0;
  switch (travel->stage) {
    case BUSHD_TRAVEL_STEPS:
      watch_sensor(mcu, active_inputs);
      break;
    case BUSHD_TRAVEL_DELAY:
      if (is_due) begin(mcu, BUSHD_TRAVEL_RUN);
      break;
    case BUSHD_TRAVEL_RETURN_DELAY:
      if (is_due) begin(mcu, BUSHD_TRAVEL_RETURN);
      break;
    case BUSHD_TRAVEL_RUN:
    case BUSHD_TRAVEL_RETURN:
      // The last step may lie in the tick that is being emitted: it is read about in the next one.
      if (mcu->slot_buffer[mcu->front].active & motor_bit(travel->motor)) break;
      if (bushd_run_done(&mcu->motor[travel->motor].made.run)) arrive(mcu);
      break;
    default:
      break;  // waits for the edge
  }
}

static void end_by_faults(bushd_mcu* mcu) {
  bushd_mcu_travel* travel = &mcu->travel;
  if (mcu->reception.silent_ticks >= mcu->reception.comm_timeout_ticks) {
    mcu->faults |= BUSHD_FAULT_LINK;
    if (is_run(travel)) bushd_mcu_count_ramp_down(mcu);
  }
  if (mcu->faults != 0) bushd_mcu_ramp_down_run(mcu, travel->motor);
}

void bushd_mcu_go_travel(bushd_mcu* mcu, uint16_t active_inputs) {
  bushd_mcu_travel* travel = &mcu->travel;
  if (!bushd_mcu_travels(travel)) return;
  if ((bushd_mcu_program_motors(mcu) & motor_bit(travel->motor)) == 0) end_by_faults(mcu);
  if (bushd_mcu_owner_of_motor(mcu, travel->motor) == BUSHD_MCU_OWNER_TRAVEL) {
    go_on(mcu, active_inputs);
  } else {
    end(mcu, BUSHD_TRAVEL_STOPPED);
  }
}

void bushd_mcu_travel_at_edge(bushd_mcu* mcu, int32_t time_in_tick_ns) {
  bushd_mcu_travel* travel = &mcu->travel;
  const int64_t after_ns = (int64_t)bushd_mcu_bus_ns(mcu, time_in_tick_ns) + travel->delay_ns;
  travel->due_tick = mcu->tick + (uint32_t)(after_ns / mcu->tick_ns);
  travel->due_ns = (uint32_t)(after_ns % mcu->tick_ns);
  set_stage(mcu, BUSHD_TRAVEL_DELAY);
  mcu->port.set_trigger(mcu->port.context, BUSHD_EDGE_NONE);
}

bool bushd_mcu_travel_meets_limit(bushd_mcu* mcu) {
  if (bushd_run_done(&mcu->motor[mcu->travel.motor].made.run)) return false;
  if (is_run(&mcu->travel)) set_stage(mcu, BUSHD_TRAVEL_EARLY);
  return true;
}

static bool has_both_limits(const bushd_mcu* mcu, uint16_t bit) {
  const uint16_t both = mcu->inputs.limit_positive & mcu->inputs.limit_negative;
  return (both & (uint16_t)~mcu->limits.both_ends & bit) != 0;
}

static bushd_status check(const bushd_mcu* mcu, const bushd_travel* message) {
  const uint16_t bit = motor_bit(message->motor);
  const bool at_edges = message->edge != BUSHD_EDGE_NONE;
  const uint64_t delay_ns = (uint64_t)message->delay_us * 1000u;
  if (bushd_mcu_travels(&mcu->travel) || bushd_mcu_homing_in_use(mcu) || mcu->trigger.armed != 0) {
    return BUSHD_E_STATE;
  }
  if (message->steps > bushd_mcu_steps_counted(mcu, message->motor, message->direction)) {
    return BUSHD_E_FORMAT;
  }
  if (message->kind == BUSHD_TRAVEL_STEP) {
    if (message->sensor >= mcu->config.motors) return BUSHD_E_FORMAT;
  } else if (!has_both_limits(mcu, bit) || (at_edges && mcu->port.set_trigger == NULL) ||
             (at_edges && delay_ns < (BUSHD_TRIGGER_FIXED_TICKS + 1u) * (uint64_t)mcu->tick_ns)) {
    return BUSHD_E_FORMAT;
  }
  return (bushd_mcu_forbidden(mcu, message->direction) & bit) != 0 ? BUSHD_E_FORBIDDEN : BUSHD_OK;
}

static void take(bushd_mcu* mcu, const bushd_travel* message, uint32_t due, uint32_t ticks,
                 uint32_t spare_ns) {
  bushd_mcu_travel* travel = &mcu->travel;
  memset(travel, 0, sizeof *travel);
  travel->motor = message->motor;
  travel->direction = message->direction;
  travel->edge = (uint8_t)message->edge;
  travel->sensor = message->sensor;
  travel->steps = message->steps;
  travel->delay_ns = message->delay_us * 1000u;
  travel->wait_ns = message->wait_us * 1000u;
  travel->run_ticks = spare_ns == 0 ? ticks : ticks - 1u;
  travel->run_ns = spare_ns == 0 ? 0 : mcu->tick_ns - spare_ns;
  travel->due_tick = due;
  mcu->trigger.number = message->number;
  mcu->trigger.state = BUSHD_TRIGGER_STARTED;
  mcu->trigger.start_tick = travel->due_tick;
  mcu->trigger.start_ns = 0;
  mcu->local.held &= (uint16_t)~motor_bit(message->motor);
}

// `due`: the first tick in which it may begin.
static bushd_status begin_first(bushd_mcu* mcu, const bushd_travel* message, uint32_t due) {
  const bushd_status status = check(mcu, message);
  if (status != BUSHD_OK) return status;
  bushd_mcu_motor* motor = &mcu->motor[message->motor];
  uint32_t ticks;
  uint32_t spare_ns;
  start_run(mcu, message->motor, message->steps, message->direction);
  if (!bushd_mcu_ticks_of_run(&motor->made.run, mcu->tick_ns, &ticks, &spare_ns)) {
    return BUSHD_E_CAPACITY;
  }
  take(mcu, message, due, ticks, spare_ns);
  bushd_mcu_travel* travel = &mcu->travel;
  const bool steps = message->kind == BUSHD_TRAVEL_STEP;
  bushd_mcu_begin_by_itself(mcu, message->motor, steps ? 1 : 0, message->direction, 0,
                            BUSHD_MCU_TRAVEL);
  if (steps) {
    set_stage(mcu, BUSHD_TRAVEL_STEPS);
    travel->readings = (uint16_t)((travel->wait_ns + mcu->tick_ns - 1u) / mcu->tick_ns + 1u);
  } else if (travel->edge != BUSHD_EDGE_NONE) {
    wait_for_edge(mcu);
  } else {
    set_stage(mcu, BUSHD_TRAVEL_DELAY);
  }
  return BUSHD_OK;
}

bushd_status bushd_mcu_take_travel(bushd_mcu* mcu, const bushd_travel* message) {
  if (message->motor >= mcu->config.motors) return BUSHD_E_FORMAT;
  if (message->kind == BUSHD_TRAVEL_NONE) {
    if (bushd_mcu_owner_of_motor(mcu, message->motor) == BUSHD_MCU_OWNER_TRAVEL) {
      bushd_mcu_ramp_down_run(mcu, message->motor);
      end(mcu, BUSHD_TRAVEL_STOPPED);
    }
    return BUSHD_OK;
  }
  // Its acknowledgement was lost.
  if (message->number == mcu->trigger.number) return BUSHD_OK;
  bushd_mcu_update_state(mcu);
  if (mcu->state != BUSHD_STATE_READY && mcu->state != BUSHD_STATE_RUN) return BUSHD_E_STATE;
  if (mcu->motor[message->motor].table < 0) return BUSHD_E_NO_TABLE;
  if ((bushd_mcu_engaged(mcu) & motor_bit(message->motor)) != 0) return BUSHD_E_STATE;
  return begin_first(mcu, message, bushd_mcu_first_open(mcu));
}

#if BUSHD_PROGRAMS
bushd_status bushd_mcu_begin_travel(bushd_mcu* mcu, const bushd_travel* message) {
  const bushd_status status = begin_first(mcu, message, mcu->tick + 1u);
  // Else it may be another motor's, which waits for its own time.
  const bool waits = mcu->travel.stage == BUSHD_TRAVEL_DELAY;
  if (status == BUSHD_OK && waits) begin(mcu, BUSHD_TRAVEL_RUN);
  return status;
}

void bushd_mcu_give_up_travel(bushd_mcu* mcu) {
  if (bushd_mcu_travels(&mcu->travel)) end(mcu, BUSHD_TRAVEL_STOPPED);
}
#endif
