// The tick queue. Per motor, everything before `known_until` is decided: queued, or known to be
// rest. A frame is taken whole or not at all:
// - a start is of the MCU's epoch; its motors are at rest at known_until and start there or later
// - a continuation is of the MCU's epoch; its motors move at known_until and it joins there
// - a replacement opens a later epoch; from its first tick on it stands instead of what was queued
// Ticks before known_until that are not replaced are duplicates and left alone. That a start says
// so is what tells a lost start from a motor that need not move yet.
#include <string.h>

#include "firmware/core/internal.h"

void bushd_mcu_clear_streams(bushd_mcu* mcu) {
  memset(mcu->config.queue, 0,
         (size_t)mcu->config.queue_ticks * mcu->config.motors * sizeof mcu->config.queue[0]);
  for (uint8_t m = 0; m < mcu->config.motors; ++m) {
    mcu->motor[m].known_until = FIRST_OPEN(mcu);
    mcu->motor[m].delay = 0;
    mcu->motor[m].running_down = false;
  }
}

// `news`: the frame holds something for this motor that is not known yet.
static bushd_status check_motor(const bushd_mcu* mcu, uint8_t m, const bushd_ticks* ticks,
                                bool* news) {
  if (m >= mcu->config.motors) return BUSHD_E_FORMAT;
  const bushd_mcu_motor* motor = &mcu->motor[m];
  if (motor->table < 0) return BUSHD_E_NO_TABLE;
  const int32_t first = ticks_after(ticks->first_tick, motor->known_until);
  const bool moves_on = motor->delay != 0;  // at known_until
  if (ticks->flags & BUSHD_TICKS_REPLACE) {
    // Something must be queued to be replaced: if the start was lost, there is nothing to go on
    // from.
    if (moves_on ? first > 0 : first >= 0) return BUSHD_E_GAP;
    *news = true;
    return ticks_after(ticks->first_tick, FIRST_OPEN(mcu)) < 0 ? BUSHD_E_LATE : BUSHD_OK;
  }
  if (first + ticks->count <= 0) return BUSHD_OK;
  *news = true;
  if (ticks->flags & BUSHD_TICKS_START) {
    if (moves_on) return BUSHD_E_STATE;
    return first < 0 ? BUSHD_E_LATE : BUSHD_OK;
  }
  return moves_on && first <= 0 ? BUSHD_OK : BUSHD_E_GAP;
}

static bool in_range(const bushd_ticks* ticks) {
  const uint16_t size = (uint16_t)(ticks->motors * ticks->count);
  for (uint16_t i = 0; i < size; ++i) {
    const int16_t displacement = bushd_get_i16(ticks->displacements + 2u * i);
    // More would put two steps into one slot.
    const int16_t limit = BUSHD_MAX_STEPS_PER_TICK * 256;
    if (displacement > limit || displacement < -limit) return false;
  }
  return true;
}

static bushd_status check_ticks(const bushd_mcu* mcu, const bushd_ticks* ticks) {
  const bool replace = (ticks->flags & BUSHD_TICKS_REPLACE) != 0;
  const bool fine = (ticks->flags & BUSHD_TICKS_FINE) != 0;
  if (mcu->state != BUSHD_STATE_READY && mcu->state != BUSHD_STATE_RUN) return BUSHD_E_STATE;
  if (fine != (mcu->format == BUSHD_FORMAT_FINE)) return BUSHD_E_FORMAT;
  if (replace && ticks->delays == NULL) return BUSHD_E_FORMAT;
  const uint8_t ahead = (uint8_t)(ticks->epoch - mcu->epoch);
  if (replace ? ahead == 0 || ahead > INT8_MAX : ahead != 0) return BUSHD_E_EPOCH;
  // The queue holds the ticks after the one prepared. All sums of tick numbers below are small once
  // both ends are checked; a frame so old that it holds nothing but past ticks is done with here.
  const int32_t first = ticks_after(ticks->first_tick, mcu->tick);
  if (first > (int32_t)mcu->config.queue_ticks + 1 - ticks->count) return BUSHD_E_CAPACITY;
  if (first <= -(int32_t)UINT8_MAX) return BUSHD_E_LATE;
  if (fine && !in_range(ticks)) return BUSHD_E_FORMAT;
  bool news = false;
  for (uint8_t m = 0; m < BUSHD_MOTORS_PER_MCU; ++m) {
    if ((ticks->mask & motor_bit(m)) == 0) continue;
    const bushd_status status = check_motor(mcu, m, ticks, &news);
    if (status != BUSHD_OK) return status;
  }
  return news ? BUSHD_OK : BUSHD_E_LATE;
}

static int16_t displacement_at(const bushd_ticks* ticks, uint8_t row, uint8_t column) {
  const uint16_t index = (uint16_t)(row * ticks->motors + column);
  if (ticks->flags & BUSHD_TICKS_FINE) return bushd_get_i16(ticks->displacements + 2u * index);
  return bushd_coarse_to_fine(ticks->displacements[index]);
}

bushd_status bushd_mcu_take_ticks(bushd_mcu* mcu, const bushd_ticks* ticks) {
  // What came since the last tick counts: without EN no step must be made, nor counted.
  bushd_mcu_update_state(mcu);
  const bushd_status status = check_ticks(mcu, ticks);
  if (status != BUSHD_OK) return status;
  const uint32_t end = ticks->first_tick + ticks->count;
  uint8_t column = 0;
  for (uint8_t m = 0; m < mcu->config.motors; ++m) {
    if ((ticks->mask & motor_bit(m)) == 0) continue;
    bushd_mcu_motor* motor = &mcu->motor[m];
    if (ticks->flags & BUSHD_TICKS_REPLACE) {
      while (ticks_after(motor->known_until, ticks->first_tick) > 0) {
        *queue_at(mcu, --motor->known_until, m) = 0;
      }
    }
    if (ticks_after(end, motor->known_until) > 0) {
      if (ticks->flags & BUSHD_TICKS_START) motor->start_tick = ticks->first_tick;
      for (uint8_t row = 0; row < ticks->count; ++row) {
        const uint32_t tick = ticks->first_tick + row;
        if (ticks_after(tick, motor->known_until) >= 0) {
          *queue_at(mcu, tick, m) = displacement_at(ticks, row, column);
        }
      }
      motor->known_until = end;
      if (ticks->delays != NULL) motor->delay = bushd_get_u16(ticks->delays + 2u * column);
    }
    ++column;
  }
  if (ticks->flags & BUSHD_TICKS_REPLACE) mcu->epoch = ticks->epoch;
  return BUSHD_OK;
}

static void start_running_down(bushd_mcu* mcu, uint8_t m) {
  bushd_mcu_motor* motor = &mcu->motor[m];
  const bushd_table* table = &mcu->table[motor->table].table;
  // A delay below cruise cannot be running; the ramp must not reach codes that no move uses.
  const uint16_t delay = motor->delay < table->cruise ? table->cruise : motor->delay;
  motor->delay = 0;
  mcu->faults |= BUSHD_FAULT_LINK;
  // DIR then still shows the move before: where this one was to go is not known. It has not left
  // rest, so it may stay.
  if (!motor->begun) return;
  const int direction = mcu->direction & motor_bit(m) ? 1 : -1;
  // In the fine format the remainder is the elapsed share of the running delay; in the coarse one
  // that share is unknown, and taking it as 0 makes the next step late rather than early.
  const int32_t progress = (int32_t)motor->remainder * direction;
  const uint8_t fraction = progress > 0 && progress < 256 ? (uint8_t)progress : 0;
  bushd_run_start_ramp_down(&motor->run, table, delay, fraction, direction);
  motor->running_down = true;
}

static int16_t run_down(bushd_mcu* mcu, bushd_mcu_motor* motor) {
  int16_t displacement = 0;
  if (mcu->format == BUSHD_FORMAT_FINE) {
    bushd_run_expand_fine(&motor->run, mcu->tick_ns, 1, &displacement, 1);
  } else {
    uint8_t counts = 0;
    bushd_run_expand_coarse(&motor->run, mcu->tick_ns, 1, &counts, 1);
    displacement = bushd_coarse_to_fine(counts);
  }
  motor->running_down = !bushd_run_done(&motor->run);
  return displacement;
}

int16_t bushd_mcu_next_displacement(bushd_mcu* mcu, uint8_t m, uint32_t tick) {
  bushd_mcu_motor* motor = &mcu->motor[m];
  if (ticks_after(motor->known_until, tick) > 0) {
    int16_t* const queued = queue_at(mcu, tick, m);
    const int16_t displacement = *queued;
    *queued = 0;
    if (tick == motor->start_tick) motor->begun = false;
    if (displacement != 0) motor->begun = true;
    return displacement;
  }
  motor->known_until = tick + 1u;
  if (motor->delay != 0) start_running_down(mcu, m);
  return motor->running_down ? run_down(mcu, motor) : 0;
}
