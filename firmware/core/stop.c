// How motors stop, each by its own table. They do when
// - their queue ends while they move
// - no master is heard for too long while they are in a table run, or no SYNC while on a line
// - an emergency stop is commanded, or an input asks for one
// - they come to a limit switch
#include "firmware/core/stop.h"

#include "firmware/core/access.h"
#include "firmware/core/line_run.h"
#include "firmware/core/stream.h"
#include "firmware/core/table_run.h"
#include "firmware/core/velocity.h"

// By the last displacement of the fine format. One of 1/256 step may be of any slower speed: then
// by the time between two of them. 0: there was none.
typedef struct last_way {
  uint16_t displacement;
  uint16_t ticks;
} last_way;

static last_way last_way_of(const bushd_mcu_motor* motor) {
  const bool seldom = (motor->displacement & BUSHD_MCU_SELDOM) != 0;
  const uint16_t ticks = (uint16_t)(motor->still_ticks + 1u);
  const uint16_t apart = seldom ? motor->displacement & (uint16_t)~BUSHD_MCU_SELDOM : 0;
  const last_way way = {seldom ? 1u : motor->displacement, apart > ticks ? apart : ticks};
  return way;
}

// Whether the running step, of which `progress`/256 are over, takes too long to be waited for. Its
// delay is told as 65535 time units, and may be longer: in the fine format the last displacement,
// or the time between two of 1/256 step, tells by how much. One that is less than twice as long may
// be a table's own.
static bool waits_too_long(const bushd_mcu* mcu, uint8_t m, uint8_t progress) {
  const bushd_mcu_motor* motor = &mcu->motor[m];
  const last_way way = last_way_of(motor);
  if (mcu->format != BUSHD_FORMAT_FINE || way.displacement == 0) return false;
  const uint64_t time_ns = (uint64_t)mcu->tick_ns * way.ticks;
  const uint64_t told_ns = (uint64_t)bushd_mcu_table_of(mcu, motor)->time_unit_ns * UINT16_MAX;
  if (time_ns * 128u <= told_ns * way.displacement) return false;
  return way.ticks > UINT8_MAX ||
         time_ns * (256u - progress) > (uint64_t)BUSHD_RUN_WAITS_NS * way.displacement;
}

void bushd_mcu_ramp_down_stream(bushd_mcu* mcu, uint8_t m, uint16_t delay) {
  bushd_mcu_motor* motor = &mcu->motor[m];
  const bushd_table* table = bushd_mcu_table_of(mcu, motor);
  // A delay below cruise cannot be running; the ramp must not reach codes that no move uses.
  if (delay != 0 && delay < table->cruise) delay = table->cruise;
  const int direction = bushd_mcu_last_direction(mcu, m);
  // In the fine format the remainder is the elapsed share of the running delay; in the coarse one
  // that share is unknown, and taking it as 0 makes the next step late rather than early.
  const int32_t progress = (int32_t)motor->remainder * direction;
  const uint8_t fraction = progress > 0 && progress < 256 ? (uint8_t)progress : 0;
  if (delay == UINT16_MAX && waits_too_long(mcu, m, fraction)) delay = 0;
  bushd_run_start_ramp_down(&motor->made.run, table, delay, fraction, direction);
  motor->exact = false;
  if (!bushd_run_done(&motor->made.run)) {
    motor->mode = BUSHD_MCU_RAMP_DOWN;
    return;
  }
  motor->mode = BUSHD_MCU_STREAM;
  motor->remainder = 0;
  mcu->stream.begun &= (uint16_t)~motor_bit(m);
}

static bool in_run(const bushd_mcu_motor* motor) {
  return motor->mode == BUSHD_MCU_AUTONOMOUS || motor->mode == BUSHD_MCU_TABLE_RUN ||
         motor->mode == BUSHD_MCU_VELOCITY;
}

// A start is to come at `next`, the first tick that is not prepared, or later: the motor rests
// from *rest_from on until then.
static bool start_waits(const bushd_mcu* mcu, uint8_t m, uint32_t next, uint32_t* rest_from) {
  if ((mcu->stream.starting & motor_bit(m)) == 0) return false;
  const bushd_mcu_start* start = &mcu->motor[m].start;
  *rest_from = near_tick(start->rest_from, next);
  return ticks_after(next, near_tick(start->tick, next)) <= 0;
}

// Ends a run that goes on without `next`, or one that waits.
static void end_in_silence(bushd_mcu* mcu, uint8_t m, bool runs, uint32_t next) {
  uint32_t from = next;
  uint32_t rest_from;
  if (runs) {
    mcu->ramp_downs = saturating_increment(mcu->ramp_downs);
  } else if (start_waits(mcu, m, next, &rest_from) && ticks_after(rest_from, next) > 0) {
    from = rest_from;  // ticks before it are still made
  }
  bushd_mcu_cut_queue(mcu, m, from);
  mcu->faults |= BUSHD_FAULT_LINK;
}

static void watch_line(bushd_mcu* mcu, uint32_t next) {
  if (mcu->line.motors == 0 || ticks_after(next, bushd_mcu_line_deadline(mcu)) < 0) return;
  uint16_t concerned = bushd_mcu_ramp_down_line(mcu);
  for (uint8_t m = 0; concerned != 0; ++m, concerned = (uint16_t)(concerned >> 1)) {
    if (concerned & 1u) end_in_silence(mcu, m, true, next);
  }
}

void bushd_mcu_watch_comm_timeout(bushd_mcu* mcu) {
  const uint32_t next = mcu->tick + 1u;
  watch_line(mcu, next);
  if (mcu->reception.silent_ticks < mcu->reception.comm_timeout_ticks) return;
  if (mcu->trigger.armed != 0) mcu->faults |= BUSHD_FAULT_LINK;
  for (uint8_t m = 0; m < mcu->config.motors; ++m) {
    bushd_mcu_motor* motor = &mcu->motor[m];
    const bool runs = motor->mode == BUSHD_MCU_TABLE_RUN;
    if (!runs && motor->mode != BUSHD_MCU_RUN_WAITS) continue;
    const bool on_line = (mcu->line.motors & motor_bit(m)) != 0;
    if (on_line ? runs : bushd_run_done(&motor->made.run)) continue;
    if (runs) bushd_mcu_ramp_down_run(mcu, m);
    end_in_silence(mcu, m, runs, next);
  }
}

// The rest of the motion that is under way at `next`; a start may wait behind it.
typedef struct rest_of_stream {
  uint32_t until;  // the first tick that is not known to be its
  bool goes_on;    // beyond that
  bool moves;      // makes a step or part of one from `next` on
  int16_t steps;   // whole ones in its first TICKS_AHEAD ticks
} rest_of_stream;

enum { TICKS_AHEAD = 2 };

static rest_of_stream rest_of(const bushd_mcu* mcu, uint8_t m, uint32_t next) {
  const bushd_mcu_motor* motor = &mcu->motor[m];
  rest_of_stream rest = {motor->known_until, motor->delay != 0, motor->delay != 0, 0};
  uint32_t rest_from;
  if (start_waits(mcu, m, next, &rest_from) && ticks_after(rest_from, next) > 0) {
    rest.until = rest_from;
    rest.goes_on = rest.moves = false;
  }
  // A table run is known for longer than the queue is deep.
  const int32_t known = ticks_after(rest.until, next);
  const uint16_t depth = mcu->config.queue_ticks;
  const uint32_t end = known < depth ? rest.until : next + depth;
  for (uint32_t tick = next; ticks_after(end, tick) > 0; ++tick) {
    const int16_t queued = *bushd_mcu_queue_at((bushd_mcu*)mcu, tick, m);
    if (queued == 0) continue;
    rest.moves = true;
    if (tick - next < TICKS_AHEAD) rest.steps = (int16_t)(rest.steps + queued / 256);
  }
  return rest;
}

static uint16_t delay_for(const bushd_mcu* mcu, const bushd_mcu_motor* motor, uint64_t time_ns,
                          uint16_t displacement) {
  const uint64_t unit = (uint64_t)bushd_mcu_table_of(mcu, motor)->time_unit_ns * displacement;
  const uint64_t units = (time_ns * 256u + unit - 1u) / unit;
  return units < UINT16_MAX ? (uint16_t)units : UINT16_MAX;
}

// 0: it all but stands.
static uint16_t fine_delay(const bushd_mcu* mcu, const bushd_mcu_motor* motor) {
  const last_way way = last_way_of(motor);
  if (way.ticks > UINT8_MAX || way.displacement == 0) return 0;
  return delay_for(mcu, motor, (uint64_t)mcu->tick_ns * way.ticks, way.displacement);
}

// The delay of the running step of a stream. In the fine format the last displacement tells it. In
// the coarse one a tick of one step may be of any speed from a step in two ticks to two in one, and
// a motor that was taken for too slow a one would stop all but dead, for too fast a one go on
// accelerating: so it is the least delay that the ticks around this moment may have, as many before
// as after it, or that which is told for their end.
static uint16_t stream_delay(const bushd_mcu* mcu, uint8_t m, const rest_of_stream* rest,
                             uint32_t next) {
  const bushd_mcu_motor* motor = &mcu->motor[m];
  if (mcu->format == BUSHD_FORMAT_FINE) return fine_delay(mcu, motor);
  if (rest->goes_on && ticks_after(rest->until, next) < TICKS_AHEAD) return motor->delay;
  const int32_t steps = rest->steps + mcu->slot_buffer[0].steps[m] + mcu->slot_buffer[1].steps[m];
  const uint32_t most = (uint32_t)(steps < 0 ? -steps : steps) + 1u;
  return delay_for(mcu, motor, (uint64_t)mcu->tick_ns * (2u * TICKS_AHEAD) / most, 256);
}

// One leaves the line, and the others do not wait for it.
static void stop_on_line(bushd_mcu* mcu, uint8_t m, bushd_stop_mode mode) {
  const uint16_t delay = bushd_mcu_line_delay(mcu, m);
  bushd_mcu_leave_line(mcu, m);
  mcu->motor[m].mode = BUSHD_MCU_STREAM;
  if (mode == BUSHD_STOP_IMMEDIATE) {
    mcu->motor[m].remainder = 0;
  } else if (delay != 0) {
    bushd_mcu_ramp_down_stream(mcu, m, delay);
  }
}

void bushd_mcu_stop_motor(bushd_mcu* mcu, uint8_t m, bushd_stop_mode mode, uint32_t next) {
  bushd_mcu_motor* motor = &mcu->motor[m];
  bushd_mcu_finish_rows(mcu);
  const bool runs = in_run(motor);
  const rest_of_stream rest = rest_of(mcu, m, next);
  uint32_t rest_from;
  const bool at_rest = (mcu->stream.begun & motor_bit(m)) == 0 || !rest.moves ||
                       (start_waits(mcu, m, next, &rest_from) && ticks_after(next, rest_from) >= 0);
  const uint16_t delay = at_rest || runs ? 0 : stream_delay(mcu, m, &rest, next);
  bushd_mcu_cut_queue(mcu, m, next);
  if (runs && (mcu->line.motors & motor_bit(m)) != 0) {
    stop_on_line(mcu, m, mode);
    return;
  }
  if (mode == BUSHD_STOP_IMMEDIATE) mcu->line.motors &= (uint16_t)~motor_bit(m);
  if (mode == BUSHD_STOP_IMMEDIATE) {
    if (motor->mode != BUSHD_MCU_STREAM || !at_rest) motor->remainder = 0;
    motor->mode = BUSHD_MCU_STREAM;
  } else if (runs) {
    bushd_mcu_ramp_down_run(mcu, m);
  } else if (motor->mode != BUSHD_MCU_RAMP_DOWN && !at_rest) {
    bushd_mcu_ramp_down_stream(mcu, m, delay);
  }
}

void bushd_mcu_stop_all(bushd_mcu* mcu, bushd_stop_mode mode, uint32_t next) {
  if (mode == BUSHD_STOP_RAMP) bushd_mcu_ramp_down_line(mcu);
  for (uint8_t m = 0; m < mcu->config.motors; ++m) bushd_mcu_stop_motor(mcu, m, mode, next);
}

int8_t bushd_mcu_last_direction(const bushd_mcu* mcu, uint8_t m) {
  return mcu->direction & motor_bit(m) ? 1 : -1;
}

int8_t bushd_mcu_heading(const bushd_mcu* mcu, uint8_t m, uint32_t next) {
  const bushd_mcu_motor* motor = &mcu->motor[m];
  const bool begins = motor->mode == BUSHD_MCU_RUN_WAITS && motor->start.tick == (uint16_t)next;
  const bool runs =
      (begins || motor->mode == BUSHD_MCU_TABLE_RUN) && ticks_after(motor->made.until, next) > 0;
  if (motor->mode == BUSHD_MCU_VELOCITY) return bushd_mcu_velocity_heading(mcu, m);
  if (runs || motor->mode >= BUSHD_MCU_RAMP_DOWN) return bushd_mcu_run_direction(mcu, m);
  const int16_t queued = ticks_after(motor->known_until, next) > 0
                             ? *bushd_mcu_queue_at((bushd_mcu*)mcu, next, m)
                             : (int16_t)0;
  if (queued != 0) return queued > 0 ? 1 : -1;
  return (mcu->stream.begun & motor_bit(m)) != 0 ? bushd_mcu_last_direction(mcu, m) : (int8_t)0;
}

bushd_status bushd_mcu_emergency(bushd_mcu* mcu, const bushd_emergency* message) {
  bushd_mcu_stop_all(mcu, message->mode, bushd_mcu_first_open(mcu));
  mcu->faults |= BUSHD_FAULT_EMERGENCY;
  return BUSHD_OK;
}
