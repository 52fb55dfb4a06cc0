// How a motor stops whose steps the queue decides: by the ramp of its own table, from the speed
// that its ticks tell.
#include "firmware/core/stream_stop.h"

#include "firmware/core/access.h"
#include "firmware/core/owner.h"

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
    bushd_mcu_give_motor(mcu, m, BUSHD_MCU_RAMP_DOWN);
    return;
  }
  bushd_mcu_give_to_queue(mcu, m);
  motor->remainder = 0;
  mcu->stream.begun &= (uint16_t)~motor_bit(m);
}

bool bushd_mcu_start_waits(const bushd_mcu* mcu, uint8_t m, uint32_t next, uint32_t* rest_from) {
  if ((mcu->stream.starting & motor_bit(m)) == 0) return false;
  const bushd_mcu_start* start = &mcu->motor[m].start;
  *rest_from = near_tick(start->rest_from, next);
  return ticks_after(next, near_tick(start->tick, next)) <= 0;
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
  if (bushd_mcu_start_waits(mcu, m, next, &rest_from) && ticks_after(rest_from, next) > 0) {
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

bushd_mcu_stream_motion bushd_mcu_stream_motion_at(const bushd_mcu* mcu, uint8_t m, uint32_t next) {
  bushd_mcu_stream_motion motion = {false, 0};
  const rest_of_stream rest = rest_of(mcu, m, next);
  uint32_t rest_from;
  if ((mcu->stream.begun & motor_bit(m)) == 0 || !rest.moves) return motion;
  if (bushd_mcu_start_waits(mcu, m, next, &rest_from) && ticks_after(next, rest_from) >= 0) {
    return motion;
  }
  motion.moves = true;
  motion.delay = stream_delay(mcu, m, &rest, next);
  return motion;
}
