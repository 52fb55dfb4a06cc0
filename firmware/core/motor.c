// What a motor does in the tick that is prepared: a displacement of its queue, a tick of its table
// run, or of a ramp-down.
#include "firmware/core/motor.h"

#include "firmware/core/access.h"
#include "firmware/core/emission.h"
#include "firmware/core/line_run.h"
#include "firmware/core/owner.h"
#include "firmware/core/position_compare.h"
#include "firmware/core/state.h"
#include "firmware/core/stream.h"
#include "firmware/core/stream_stop.h"
#include "firmware/core/table_run.h"

static void queue_ended(bushd_mcu* mcu, uint8_t m) {
  bushd_mcu_motor* motor = &mcu->motor[m];
  const uint16_t delay = motor->delay;
  bushd_mcu_drop_out_of_order(mcu, m);
  motor->delay = 0;
  mcu->faults |= BUSHD_FAULT_LINK;
  // DIR then still shows the move before: where this one was to go is not known. It has not left
  // rest, so it may stay.
  if ((mcu->stream.begun & motor_bit(m)) == 0) return;
  bushd_mcu_count_ramp_down(mcu);
  bushd_mcu_ramp_down_stream(mcu, m, delay);
}

static int16_t ramp_down_displacement(bushd_mcu* mcu, uint8_t m) {
  bushd_mcu_motor* motor = &mcu->motor[m];
  int16_t displacement = 0;
  if (mcu->format == BUSHD_FORMAT_FINE) {
    bushd_run_expand_fine(&motor->made.run, mcu->tick_ns, 1, &displacement, 1);
  } else {
    uint8_t counts = 0;
    bushd_run_expand_coarse(&motor->made.run, mcu->tick_ns, 1, &counts, 1);
    displacement = bushd_coarse_to_fine(counts);
  }
  if (bushd_run_done(&motor->made.run)) bushd_mcu_give_to_queue(mcu, m);
  return displacement;
}

// By which stream_delay goes, in the fine format only.
static inline void note_speed(bushd_mcu_motor* motor, int16_t displacement) {
  if (displacement == 0) {
    if (motor->still_ticks < UINT8_MAX) ++motor->still_ticks;
    return;
  }
  const uint8_t before = motor->still_ticks;
  motor->displacement = (uint16_t)(displacement < 0 ? -displacement : displacement);
  if (before == 0) return;
  motor->still_ticks = 0;
  if (motor->displacement == 1) motor->displacement = (uint16_t)(BUSHD_MCU_SELDOM + before + 1u);
}

static inline bool in_run_at(bushd_mcu* mcu, uint8_t m, uint32_t tick) {
  bushd_mcu_motor* motor = &mcu->motor[m];
  const bool begins = motor->mode == BUSHD_MCU_RUN_WAITS && motor->start.tick == (uint16_t)tick;
  if (begins) {
    bushd_mcu_give_motor(mcu, m, BUSHD_MCU_TABLE_RUN);
    if (bushd_mcu_owner_of_motor(mcu, m) == BUSHD_MCU_OWNER_LINE) bushd_mcu_line_begins(mcu, tick);
  }
  if (motor->mode != BUSHD_MCU_TABLE_RUN) return false;
  if (ticks_after(tick, motor->made.until) < 0) return true;
  if (bushd_mcu_owner_of_motor(mcu, m) == BUSHD_MCU_OWNER_LINE) {
    bushd_mcu_leave_line(mcu, m);
  } else if (!begins) {
    bushd_mcu_leave_run(mcu, m);
  }
  bushd_mcu_give_to_queue(mcu, m);
  return false;
}

void bushd_mcu_summarise_queue(bushd_mcu* mcu, uint32_t tick) {
  bushd_mcu_queue_summary* queue_summary = &mcu->stream.queue_summary;
  uint16_t rests = 0;
  uint16_t plain = 0;
  uint16_t following = 0;
  uint16_t moves = 0;
  uint16_t runs = 0;
  int32_t plain_ticks = INT32_MAX;
  int32_t moving_ticks = INT32_MAX;
  int32_t run_ticks = INT32_MAX;
  uint16_t bit = 1;
  for (uint8_t m = 0; m < mcu->config.motors; ++m, bit = (uint16_t)(bit << 1)) {
    const bushd_mcu_motor* motor = &mcu->motor[m];
    const int32_t known_ticks = ticks_after(motor->known_until, tick);
    if (motor->mode == BUSHD_MCU_TABLE_RUN) {
      const int32_t ticks = ticks_after(motor->made.until, tick);
      if (ticks > 0) runs |= bit;
      if (ticks > 0 && ticks < run_ticks) run_ticks = ticks;
    }
    if (known_ticks <= 0) {
      if (motor->mode == BUSHD_MCU_STREAM && motor->delay == 0) rests |= bit;
      continue;
    }
    if (motor->delay != 0) {
      moves |= bit;
      if (known_ticks < moving_ticks) moving_ticks = known_ticks;
    }
    if (motor->mode != BUSHD_MCU_STREAM) continue;
    plain |= bit;
    if (known_ticks > plain_ticks) continue;
    if (known_ticks < plain_ticks) following = 0;
    plain_ticks = known_ticks;
    if (motor->delay != 0 && !motor->has_out_of_order) following |= bit;
  }
  queue_summary->stale = false;
  queue_summary->rests = rests;
  queue_summary->plain = plain;
  queue_summary->following = following;
  queue_summary->plain_until = tick + (uint32_t)plain_ticks;
  queue_summary->moves = moves;
  queue_summary->moving_until = tick + (uint32_t)moving_ticks;
  queue_summary->runs = runs;
  queue_summary->runs_until = tick + (uint32_t)run_ticks;
}

// The low water of motors that are to move on when their queued ticks end.
static void watch_low_water(bushd_mcu* mcu) {
  if (mcu->stream.queue_summary.moves == 0) return;
  const int32_t queued =
      ticks_after(mcu->stream.queue_summary.moving_until, bushd_mcu_first_open(mcu));
  if (queued < mcu->low_water_ticks) mcu->low_water_ticks = queued > 0 ? (uint16_t)queued : 0;
}

#ifndef BUSHD_OWN_COARSE_ROWS
void bushd_mcu_take_coarse_row(int16_t* queued, int16_t* steps, uint8_t motors,
                               bushd_mcu_row* row) {
  bushd_mcu_take_fine_row(queued, steps, motors, row);
  for (uint8_t m = 0; m < motors; ++m) steps[m] = (int16_t)(steps[m] >> 8);
}
#endif

void bushd_mcu_take_fine_row(int16_t* queued, int16_t* displacement, uint8_t motors,
                             bushd_mcu_row* row) {
  row->moves = row->back = 0;
  uint16_t bit = 1;
  for (uint8_t m = 0; m < motors; ++m, bit = (uint16_t)(bit << 1)) {
    displacement[m] = *queued;
    if (*queued != 0) row->moves |= bit;
    if (*queued < 0) row->back |= bit;
    *queued++ = 0;
  }
}

// A motor that begins, or stands still until a start that waits.
static void follow_begun(bushd_mcu* mcu, uint16_t plain, uint16_t moves, uint32_t tick) {
  mcu->stream.begun |= plain & moves;
  uint16_t still = mcu->stream.begun & mcu->stream.starting & plain & (uint16_t)~moves;
  for (uint8_t m = 0; still != 0; ++m, still = (uint16_t)(still >> 1)) {
    if ((still & 1u) != 0 && (int16_t)((uint16_t)tick - mcu->motor[m].start.rest_from) >= 0) {
      mcu->stream.begun &= (uint16_t)~motor_bit(m);
    }
  }
}

// Starts that are over, before their low bits look like those of one to come.
__attribute__((noinline)) static void forget_starts(bushd_mcu* mcu, uint32_t tick) {
  uint16_t starting = mcu->stream.starting;
  for (uint8_t m = 0; starting != 0; ++m, starting = (uint16_t)(starting >> 1)) {
    if ((starting & 1u) != 0 && (int16_t)((uint16_t)tick - mcu->motor[m].start.tick) > 0) {
      mcu->stream.starting &= (uint16_t)~motor_bit(m);
    }
  }
}

// The displacement of a motor whose steps the queue alone does not decide; false if they are those
// of a run, exact to a slot.
static bool displacement_of(bushd_mcu* mcu, uint8_t m, uint32_t tick, int16_t* displacement) {
  bushd_mcu_motor* motor = &mcu->motor[m];
  if (in_run_at(mcu, m, tick)) return false;
  if (ticks_after(motor->known_until, tick) > 0) {
    follow_begun(mcu, motor_bit(m), *displacement != 0 ? motor_bit(m) : (uint16_t)0, tick);
    return true;
  }
  motor->known_until = tick + 1u;
  if (motor->delay != 0) queue_ended(mcu, m);
  *displacement = 0;
  if (motor->mode < BUSHD_MCU_RAMP_DOWN) {
    mcu->stream.begun &= (uint16_t)~motor_bit(m);
    return true;
  }
  if (motor->exact) return false;
  *displacement = ramp_down_displacement(mcu, m);
  return true;
}

// Changes what motors do whose steps the queue alone does not decide. Not inlined, like what else
// few ticks need: in one function with what all do it would cost those their registers.
__attribute__((noinline)) static uint16_t find_others(bushd_mcu* mcu, uint16_t others,
                                                      int16_t* values, bushd_mcu_row* row) {
  const uint32_t tick = mcu->tick + 1u;
  const bool fine = mcu->format == BUSHD_FORMAT_FINE;
  uint16_t exact = 0;
  for (uint8_t m = 0; others != 0; ++m, others = (uint16_t)(others >> 1)) {
    if ((others & 1u) == 0) continue;
    const uint16_t bit = motor_bit(m);
    int16_t displacement = fine ? values[m] : (int16_t)(values[m] * 256);
    if (!displacement_of(mcu, m, tick, &displacement)) {
      displacement = 0;
      exact |= bit;
    }
    values[m] = fine ? displacement : (int16_t)(displacement >> 8);
    row->moves &= (uint16_t)~bit;
    row->back &= (uint16_t)~bit;
    if (displacement != 0) row->moves |= bit;
    if (displacement < 0) row->back |= bit;
  }
  return exact;
}

__attribute__((noinline)) static void stay_at_rest(bushd_mcu* mcu, uint16_t motors, uint32_t tick) {
  mcu->stream.begun &= (uint16_t)~motors;
  for (bushd_mcu_motor* motor = mcu->motor; motors != 0;
       ++motor, motors = (uint16_t)(motors >> 1)) {
    if (motors & 1u) motor->known_until = tick + 1u;
  }
}

// What motors do in this tick, in steps if it is a coarse one, else in 1/256 step. Returns those
// whose steps are those of a run.
static uint16_t find_row(bushd_mcu* mcu, int16_t* values, bushd_mcu_row* row) {
  const uint32_t tick = mcu->tick + 1u;
  bushd_mcu_queue_summary* queue_summary = &mcu->stream.queue_summary;
  if (mcu->stream.starting != 0) forget_starts(mcu, tick);
  if (queue_summary->stale || ticks_after(tick, queue_summary->plain_until) >= 0 ||
      (queue_summary->runs != 0 && ticks_after(tick, queue_summary->runs_until) >= 0)) {
    bushd_mcu_summarise_queue(mcu, tick);
  }
  int16_t* const queued = bushd_mcu_queue_at(mcu, tick, 0);
  if (mcu->format == BUSHD_FORMAT_FINE) {
    bushd_mcu_take_fine_row(queued, values, mcu->config.motors, row);
  } else {
    bushd_mcu_take_coarse_row(queued, values, mcu->config.motors, row);
  }
  follow_begun(mcu, queue_summary->plain, row->moves, tick);
  if (queue_summary->rests != 0) stay_at_rest(mcu, queue_summary->rests, tick);
  uint16_t exact = queue_summary->runs & (uint16_t)~row->moves;
  const uint16_t known = queue_summary->plain | queue_summary->rests | exact;
  const uint16_t others = bushd_mcu_own_motors(mcu) & (uint16_t)~known;
  if (others != 0) exact |= find_others(mcu, others, values, row);
  watch_low_water(mcu);
  return exact;
}

__attribute__((noinline)) static void plan_fine(bushd_mcu* mcu, bushd_slot_buffer* slot_buffer,
                                                const int16_t* displacement, uint16_t exact,
                                                bool fills) {
  bushd_slots plans[BUSHD_MOTORS_PER_MCU];
  uint16_t bit = 1;
  for (uint8_t m = 0; m < mcu->config.motors; ++m, bit = (uint16_t)(bit << 1)) {
    bushd_mcu_motor* motor = &mcu->motor[m];
    if ((exact & bit) == 0) note_speed(motor, displacement[m]);
    const int16_t steps =
        bushd_slots_plan(displacement[m], &motor->remainder, BUSHD_CROSSING_FINE, &plans[m]);
    slot_buffer->steps[m] = steps;
    if (steps == 0) slot_buffer->active &= (uint16_t)~bit;
  }
  if (!fills) return;
  bushd_slots_fill(slot_buffer->step, mcu->config.slots, plans, mcu->config.motors);
}

// Where nothing moves but what is in a run.
__attribute__((noinline)) static void rest_fine(bushd_mcu* mcu, int16_t* steps, uint16_t exact) {
  bushd_mcu_motor* motor = mcu->motor;
  for (uint8_t m = mcu->config.motors; m > 0; --m, ++motor, exact = (uint16_t)(exact >> 1)) {
    if ((exact & 1u) == 0) note_speed(motor, 0);
    *steps++ = 0;
  }
}

// Returns the motors whose steps are those of a run, and still to be made.
static uint16_t plan(bushd_mcu* mcu, bushd_slot_buffer* slot_buffer) {
  const bool fine = mcu->format == BUSHD_FORMAT_FINE;
  int16_t displacement[BUSHD_MOTORS_PER_MCU];
  bushd_mcu_row row;
  const uint16_t exact = find_row(mcu, fine ? displacement : slot_buffer->steps, &row);
  mcu->direction = (mcu->direction & (uint16_t)~row.moves) | (row.moves & (uint16_t)~row.back);
  // The masks of a slot_buffer without steps are 0 already.
  const bool has_masks = slot_buffer->active != 0 || slot_buffer->outputs == BUSHD_OUTPUTS_LEVELS;
  const bool keep_slots = bushd_mcu_steps_keep_slots(mcu);
  const bool fills = keep_slots && row.moves != 0;
  if (keep_slots && has_masks && !fills) {
    bushd_slots_clear(slot_buffer->step, mcu->config.slots);
  }
  slot_buffer->active = row.moves;
  if (fine && row.moves == 0) {
    rest_fine(mcu, slot_buffer->steps, exact);
  } else if (fine) {
    plan_fine(mcu, slot_buffer, displacement, exact, fills);
  } else if (fills) {
    bushd_slots_fill_evenly(slot_buffer->step, mcu->config.slots, slot_buffer->steps,
                            mcu->config.motors);
  }
  return exact;
}

void bushd_mcu_emit(bushd_mcu* mcu, bushd_slot_buffer* slot_buffer) {
  const uint16_t exact = plan(mcu, slot_buffer);
  if (exact != 0) bushd_mcu_make_steps(mcu, slot_buffer, exact);
  slot_buffer->direction = mcu->direction ^ mcu->config.outputs.direction_low;
  slot_buffer->outputs = BUSHD_OUTPUTS_PULSES;
  slot_buffer->compare_rise = slot_buffer->compare_fall = 0;
  const bushd_emission_grid* grid = &mcu->emission.grid;
  const bool compares = (mcu->position_compare.arrivals | mcu->position_compare.pulse) != 0;
  // Masks that have become levels do not show steps any more.
  const bool levels = grid->mode == BUSHD_EMISSION_PHASES;
  if (compares && levels) bushd_mcu_emit_position_compare(mcu, slot_buffer);
  if (grid->mode != BUSHD_EMISSION_EVEN || grid->setup_slots != 0)
    bushd_mcu_shape(mcu, slot_buffer);
  if (compares && !levels) bushd_mcu_emit_position_compare(mcu, slot_buffer);
}
