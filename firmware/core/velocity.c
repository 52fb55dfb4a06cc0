#include "firmware/core/velocity.h"

#include "firmware/core/access.h"
#include "firmware/core/owner.h"
#include "firmware/core/state.h"

// 1/64 step/s that the port keeps up with, unless its build says less.
#ifndef BUSHD_MOST_VELOCITY
#define BUSHD_MOST_VELOCITY BUSHD_VELOCITY_MOST
#endif

static bushd_velocity* loop_of(const bushd_mcu* mcu, uint8_t m) {
  return &mcu->config.velocity[m].loop;
}

static int8_t sign_of(int32_t speed) {
  return (int8_t)((speed > 0) - (speed < 0));
}

bool bushd_mcu_has_velocity(const bushd_mcu* mcu, uint8_t m) {
  return m < mcu->config.velocity_motors && mcu->config.velocity[m].settings.most != 0;
}

uint16_t bushd_mcu_moved_by_velocity(const bushd_mcu* mcu) {
  uint16_t moved = 0;
  for (uint8_t m = 0; m < mcu->config.velocity_motors; ++m) {
    if (mcu->motor[m].mode == BUSHD_MCU_VELOCITY) moved |= motor_bit(m);
  }
  return moved;
}

// Steps are a period apart, so a tick holds one more than whole periods at most.
static bool has_room(const bushd_mcu* mcu, int32_t most) {
  if (most > BUSHD_MOST_VELOCITY) return false;
  const uint32_t period_ns = bushd_velocity_period(most, most) * BUSHD_VELOCITY_INTERVAL_NS;
  return mcu->tick_ns / period_ns + 1u <= mcu->emission.grid.max_steps;
}

bushd_status bushd_mcu_take_set_velocity(bushd_mcu* mcu, const bushd_set_velocity* message) {
  const uint8_t m = message->motor;
  if (!bushd_mcu_has_output(mcu, m)) return BUSHD_E_FORMAT;
  if (m >= mcu->config.velocity_motors) return message->most == 0 ? BUSHD_OK : BUSHD_E_FORMAT;
  bushd_mcu_velocity_settings* its = &mcu->config.velocity[m].settings;
  if (its->least == message->least && its->most == message->most &&
      its->acceleration == message->acceleration) {
    return BUSHD_OK;
  }
  if ((mcu->flags & BUSHD_FLAG_CONFIGURED) == 0) return BUSHD_E_STATE;
  if ((bushd_mcu_engaged(mcu) & motor_bit(m)) != 0) return BUSHD_E_STATE;
  if (message->most != 0 && !has_room(mcu, message->most)) return BUSHD_E_CAPACITY;
  its->least = message->least;
  its->most = message->most;
  its->acceleration = message->acceleration;
  // An input that is held was pressed for what was set before.
  mcu->local.held &= (uint16_t)~motor_bit(m);
  return BUSHD_OK;
}

void bushd_mcu_forget_velocities(bushd_mcu* mcu) {
  for (uint8_t m = 0; m < mcu->config.velocity_motors; ++m) {
    bushd_mcu_velocity_settings* its = &mcu->config.velocity[m].settings;
    its->least = its->most = its->acceleration = 0;
  }
}

void bushd_mcu_steer(bushd_mcu* mcu, uint8_t m, int8_t direction, int32_t most) {
  bushd_mcu_velocity* its = &mcu->config.velocity[m];
  bushd_mcu_motor* motor = &mcu->motor[m];
  if (motor->mode != BUSHD_MCU_VELOCITY) {
    bushd_velocity_init(&its->loop, its->settings.acceleration, its->settings.least);
    its->since_ns = 0;
    bushd_mcu_give_motor(mcu, m, BUSHD_MCU_VELOCITY);
    motor->exact = true;
    mcu->autonomous |= motor_bit(m);
  }
  const int32_t speed = its->settings.most < most ? its->settings.most : most;
  its->loop.wanted = direction > 0 ? speed : -speed;
}

void bushd_mcu_brake(bushd_mcu* mcu, uint8_t m) {
  loop_of(mcu, m)->wanted = 0;
}

int8_t bushd_mcu_velocity_heading(const bushd_mcu* mcu, uint8_t m) {
  const bushd_velocity* loop = loop_of(mcu, m);
  return sign_of(loop->now != 0 ? loop->now : loop->wanted);
}

bool bushd_mcu_is_braking(const bushd_mcu* mcu, uint8_t m) {
  const bushd_velocity* loop = loop_of(mcu, m);
  return sign_of(loop->wanted) != bushd_mcu_velocity_heading(mcu, m);
}

uint16_t bushd_mcu_velocity_period(const bushd_mcu* mcu, uint8_t m) {
  return loop_of(mcu, m)->period;
}

// The interval that runs ends with a step against those that this tick has already.
static inline bool turns(const bushd_velocity* loop, int16_t steps) {
  return loop->step_left == 1 && steps != 0 && loop->now != 0 && (loop->now > 0) != (steps > 0);
}

// Slots x ns.
#if BUSHD_MAX_SLOTS <= 128
typedef uint32_t slots_ns;  // 128 of the longest tick fit
#else
typedef uint64_t slots_ns;
#endif

// Where a step lies: in which slot, and what is over of it, in ns / slots.
typedef struct place {
  uint16_t slot;
  uint32_t rest;
} place;

static place place_of(const bushd_mcu* mcu, uint32_t ns) {
  const slots_ns all = (slots_ns)ns * mcu->config.slots;
  const place found = {(uint16_t)(all / mcu->tick_ns), (uint32_t)(all % mcu->tick_ns)};
  return found;
}

static void move_place(const bushd_mcu* mcu, place* at, const place* by) {
  at->slot = (uint16_t)(at->slot + by->slot);
  at->rest += by->rest;
  if (at->rest < mcu->tick_ns) return;
  at->rest -= mcu->tick_ns;
  ++at->slot;
}

// The steps of a tick. Only the first is placed by a division, and one after another interval.
typedef struct placing {
  uint16_t intervals;  // from the tick's first to the last step
  uint16_t apart;      // intervals between the last two
  place at;            // of the last one
  place by;            // of `apart`
} placing;

static uint16_t next_slot(const bushd_mcu* mcu, placing* steps, uint32_t first_ns,
                          uint16_t intervals, bool is_first) {
  if (is_first) {
    steps->at = place_of(mcu, first_ns + intervals * BUSHD_VELOCITY_INTERVAL_NS);
    steps->apart = 0;
  } else {
    const uint16_t apart = (uint16_t)(intervals - steps->intervals);
    if (apart != steps->apart) steps->by = place_of(mcu, apart * BUSHD_VELOCITY_INTERVAL_NS);
    steps->apart = apart;
    move_place(mcu, &steps->at, &steps->by);
  }
  steps->intervals = intervals;
  const uint16_t last = (uint16_t)(mcu->config.slots - 1u);
  return steps->at.slot < last ? steps->at.slot : last;
}

// Signed steps of the next tick, whose slots get the bit. A step at just the tick's end falls into
// its last slot.
static int16_t make_tick(const bushd_mcu* mcu, bushd_mcu_velocity* its, uint16_t bit,
                         uint16_t* masks) {
  bushd_velocity* loop = &its->loop;
  const uint32_t tick_ns = mcu->tick_ns;
  const uint32_t first_ns = BUSHD_VELOCITY_INTERVAL_NS - its->since_ns;  // the running one ends
  const uint16_t count = (uint16_t)((tick_ns - first_ns) / BUSHD_VELOCITY_INTERVAL_NS + 1u);
  placing placed = {0, 0, {0, 0}, {0, 0}};
  int16_t steps = 0;
  for (uint16_t i = 0; i < count; ++i) {
    const uint16_t idle = bushd_velocity_idle(loop);
    if (idle >= count - i) {
      bushd_velocity_skip(loop, (uint16_t)(count - i));
      break;
    }
    bushd_velocity_skip(loop, idle);
    i = (uint16_t)(i + idle);
    if (turns(loop, steps)) {
      its->since_ns = 0;
      return steps;
    }
    const int8_t step = bushd_velocity_interval(loop);
    if (step == 0) continue;
    masks[next_slot(mcu, &placed, first_ns, i, steps == 0)] |= bit;
    steps = (int16_t)(steps + step);
  }
  its->since_ns = (uint16_t)(tick_ns - first_ns - (count - 1u) * BUSHD_VELOCITY_INTERVAL_NS);
  return steps;
}

static void emit(bushd_mcu* mcu, uint8_t m, bushd_slot_buffer* slot_buffer) {
  bushd_mcu_velocity* its = &mcu->config.velocity[m];
  bushd_mcu_motor* motor = &mcu->motor[m];
  const uint16_t bit = motor_bit(m);
  const int16_t steps =
      make_tick(mcu, its, bushd_mcu_steps_keep_slots(mcu) ? bit : (uint16_t)0, slot_buffer->step);
  slot_buffer->steps[m] = steps;
  if (steps != 0) slot_buffer->active |= bit;
  // DIR is ready before the first step that needs it.
  const int8_t heading = sign_of(steps != 0 ? steps : its->loop.now);
  if (heading > 0) mcu->direction |= bit;
  if (heading < 0) mcu->direction &= (uint16_t)~bit;
  motor->remainder = 0;
  mcu->stream.begun |= bit;
  if (its->loop.now != 0 || its->loop.wanted != 0) return;
  bushd_mcu_give_to_queue(mcu, m);
}

uint16_t bushd_mcu_emit_velocity(bushd_mcu* mcu, bushd_slot_buffer* slot_buffer, uint16_t exact) {
  const uint16_t moved = mcu->config.velocity_motors == 0 || exact == 0
                             ? (uint16_t)0
                             : exact & bushd_mcu_moved_by_velocity(mcu);
  for (uint8_t m = 0; moved >> m != 0; ++m) {
    if ((moved & motor_bit(m)) != 0) emit(mcu, m, slot_buffer);
  }
  return moved;
}
