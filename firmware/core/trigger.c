// Runs of tables, or that of a line, that an edge at the trigger input starts. With e the time of
// the edge as the port has captured it, they begin at
//
//     e + BUSHD_TRIGGER_FIXED_TICKS ticks + delay
//
// wherever in a tick that is: the run's own time then begins there (bushd_run_begin_late). One tick
// is being emitted and the next one is prepared when the edge is noticed; the third is the port's
// time to notice it. Times are the bus's, so all MCUs that wait for one edge begin together.
#include "firmware/core/trigger.h"

#include "firmware/core/access.h"
#include "firmware/core/limits.h"
#include "firmware/core/line_run.h"
#include "firmware/core/state.h"
#include "firmware/core/table_run.h"

static bushd_status check_entry(const bushd_mcu* mcu, const bushd_table_run_entry* entry) {
  if (entry->motor >= mcu->config.motors) return BUSHD_E_FORMAT;
  if (mcu->motor[entry->motor].table != (int8_t)entry->bank) return BUSHD_E_NO_TABLE;
  if (!bushd_mcu_runs_so_slowly(mcu, entry->shortest_delay)) return BUSHD_E_FORMAT;
  const bool forbidden =
      (bushd_mcu_forbidden(mcu, entry->direction) & motor_bit(entry->motor)) != 0;
  return forbidden ? BUSHD_E_FORBIDDEN : BUSHD_OK;
}

bushd_edge bushd_mcu_edge_of_pin(const bushd_mcu* mcu, bushd_edge edge) {
  if ((mcu->inputs.system_inverted & BUSHD_INPUT_TRIGGER) == 0) return edge;
  return edge == BUSHD_EDGE_RISING ? BUSHD_EDGE_FALLING : BUSHD_EDGE_RISING;
}

static bool may_arm(bushd_mcu* mcu) {
  bushd_mcu_update_state(mcu);
  if (mcu->state != BUSHD_STATE_READY && mcu->state != BUSHD_STATE_RUN) return false;
  return mcu->trigger.armed == 0 && !bushd_mcu_travels(&mcu->travel);
}

static void await_edge(bushd_mcu* mcu, uint16_t motors, uint8_t number, bushd_edge edge,
                       uint32_t delay_us) {
  bushd_mcu_tell(mcu, BUSHD_TELLS_AUTONOMOUS);
  mcu->trigger.armed = motors;
  mcu->trigger.number = number;
  mcu->trigger.state = BUSHD_TRIGGER_ARMED;
  mcu->trigger.delay_us = delay_us;
  mcu->port.set_trigger(mcu->port.context, bushd_mcu_edge_of_pin(mcu, edge));
}

bushd_status bushd_mcu_take_trigger(bushd_mcu* mcu, const bushd_trigger* message) {
  if (mcu->port.set_trigger == NULL) return BUSHD_E_UNKNOWN_MESSAGE;
  if (message->edge == BUSHD_EDGE_NONE) {
    if (mcu->trigger.armed != 0) bushd_mcu_disarm(mcu, BUSHD_TRIGGER_DISARMED);
    return BUSHD_OK;
  }
  // Its acknowledgement was lost. The edge may have come since.
  if (message->number == mcu->trigger.number) return BUSHD_OK;
  if (!may_arm(mcu)) return BUSHD_E_STATE;
  uint16_t mask = 0;
  const uint8_t* at = message->entries;
  for (uint8_t i = 0; i < message->count; ++i) {
    const bushd_table_run_entry entry = bushd_next_table_run_entry(&at);
    const bushd_status status = check_entry(mcu, &entry);
    if (status != BUSHD_OK) return status;
    mask |= motor_bit(entry.motor);
  }
  if (bushd_mcu_engaged(mcu) & mask) return BUSHD_E_STATE;
  mcu->stream.starting &= (uint16_t)~mask;
  at = message->entries;
  for (uint8_t i = 0; i < message->count; ++i) {
    const bushd_table_run_entry entry = bushd_next_table_run_entry(&at);
    uint32_t* const spare_ns = &mcu->motor[entry.motor].spare_ns;
    if (!bushd_mcu_make_run(mcu, &entry, spare_ns)) return BUSHD_E_CAPACITY;
  }
  mcu->line.waits = false;
  await_edge(mcu, mask, message->number, message->edge, message->delay_us);
  return BUSHD_OK;
}

bushd_status bushd_mcu_take_line_trigger(bushd_mcu* mcu, const bushd_line_trigger* message) {
  if (message->number == mcu->trigger.number) return BUSHD_OK;  // as above
  if (!may_arm(mcu)) return BUSHD_E_STATE;
  uint16_t motors;
  const bushd_status status = bushd_mcu_hold_line(mcu, &message->line, &motors);
  if (status != BUSHD_OK) return status;
  await_edge(mcu, motors, message->number, message->edge, message->delay_us);
  return BUSHD_OK;
}

void bushd_mcu_disarm(bushd_mcu* mcu, bushd_trigger_state why) {
  bushd_mcu_tell(mcu, BUSHD_TELLS_AUTONOMOUS);
  mcu->trigger.armed = 0;
  mcu->trigger.state = (uint8_t)why;
  mcu->port.set_trigger(mcu->port.context, BUSHD_EDGE_NONE);
}

// A tick that is lengthened or shortened to follow the bus is as long as any other by the bus's
// time.
int32_t bushd_mcu_bus_ns(const bushd_mcu* mcu, int32_t time_in_tick_ns) {
  const int32_t longer_ns = mcu->clock.slew_now_ns + mcu->clock.rate_now_ns;
  return time_in_tick_ns - (int32_t)((int64_t)time_in_tick_ns * longer_ns / (int32_t)mcu->tick_ns);
}

static bool is_forbidden(const bushd_mcu* mcu, uint16_t motors) {
  const uint16_t positive = bushd_mcu_forbidden(mcu, 1) & motors;
  const uint16_t negative = bushd_mcu_forbidden(mcu, -1) & motors;
  uint16_t left = positive | negative;
  for (uint8_t m = 0; left != 0; ++m, left = (uint16_t)(left >> 1)) {
    const bushd_mcu_motor* motor = &mcu->motor[m];
    const int8_t direction = mcu->line.waits ? motor->on_line.direction : motor->made.run.direction;
    if ((direction > 0 ? positive : negative) & motor_bit(m)) return true;
  }
  return false;
}

static void begin_late(bushd_mcu* mcu, uint8_t m, uint32_t first_tick, uint32_t ns) {
  bushd_mcu_motor* motor = &mcu->motor[m];
  const uint32_t ticks = motor->made.until + (ns > motor->spare_ns);
  bushd_run_begin_late(&motor->made.run, ns);
  bushd_mcu_begin_run(mcu, m, first_tick, ticks);
}

void bushd_mcu_begin_armed(bushd_mcu* mcu, int32_t time_in_tick_ns) {
  uint16_t armed = mcu->trigger.armed;
  if (mcu->faults != 0 || is_forbidden(mcu, armed)) {
    bushd_mcu_disarm(mcu, mcu->faults != 0 ? BUSHD_TRIGGER_FAULT : BUSHD_TRIGGER_FORBIDDEN);
    return;
  }
  const int32_t ns = bushd_mcu_bus_ns(mcu, time_in_tick_ns) +
                     (int32_t)(BUSHD_TRIGGER_FIXED_TICKS * mcu->tick_ns) +
                     (int32_t)(mcu->trigger.delay_us * 1000u);
  const uint32_t after_ns = ns > 0 ? (uint32_t)ns : 0;
  const uint32_t tick = mcu->tick + after_ns / mcu->tick_ns;
  if (ticks_after(tick, bushd_mcu_first_open(mcu)) < 0) {
    bushd_mcu_disarm(mcu, BUSHD_TRIGGER_LATE);
    return;
  }
  bushd_mcu_disarm(mcu, BUSHD_TRIGGER_STARTED);
  mcu->stream.queue_summary.stale = true;
  mcu->trigger.start_tick = tick;
  mcu->trigger.start_ns = after_ns % mcu->tick_ns;
  if (mcu->line.waits) {
    bushd_mcu_begin_held_line(mcu, armed, tick, mcu->trigger.start_ns);
    return;
  }
  for (uint8_t m = 0; armed != 0; ++m, armed = (uint16_t)(armed >> 1)) {
    if (armed & 1u) begin_late(mcu, m, tick, mcu->trigger.start_ns);
  }
}
