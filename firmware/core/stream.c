// The tick queue. Per motor, everything before `known_until` is decided: queued, in a table run, or
// known to be rest. A frame is taken whole or not at all:
// - a start is of the MCU's epoch; its motors are at rest at known_until and start there or later
// - a continuation is of the MCU's epoch; its motors move at known_until. It joins there; or else
//   it is kept beyond the gap as an out-of-order range, one per motor that is in no run, until the
//   lost frame has come again
// - a replacement opens a later epoch; from its first tick on it stands instead of what was queued
// Ticks that are known and not replaced are duplicates and left alone. That a start says so is what
// tells a lost start from a motor that need not move yet.
#include "firmware/core/stream.h"

#include <string.h>

#include "engine/slots.h"
#include "firmware/core/access.h"
#include "firmware/core/assertion.h"
#include "firmware/core/limits.h"
#include "firmware/core/owner.h"
#include "firmware/core/state.h"

void bushd_mcu_give_to_queue(bushd_mcu* mcu, uint8_t m) {
  bushd_mcu_give_motor(mcu, m, BUSHD_MCU_STREAM);
  mcu->line.motors &= (uint16_t)~motor_bit(m);
}

void bushd_mcu_clear_streams(bushd_mcu* mcu) {
  mcu->stream.rows.next = mcu->stream.rows.ticks.count;
  mcu->stream.queue_summary.stale = true;
  mcu->stream.begun = mcu->stream.starting = 0;
  mcu->line.motors = 0;
  memset(mcu->config.queue, 0,
         (size_t)mcu->config.queue_ticks * mcu->config.motors * sizeof mcu->config.queue[0]);
  for (uint8_t m = 0; m < mcu->config.motors; ++m) {
    bushd_mcu_motor* motor = &mcu->motor[m];
    motor->known_until = bushd_mcu_first_open(mcu);
    motor->delay = 0;
    bushd_mcu_give_motor(mcu, m, BUSHD_MCU_STREAM);
    motor->has_out_of_order = false;
  }
}

static inline int16_t* next_row(const bushd_mcu* mcu, int16_t* queued) {
  queued += mcu->config.motors;
  const int16_t* const end =
      mcu->config.queue + (size_t)mcu->config.queue_ticks * mcu->config.motors;
  return queued < end ? queued : queued - (size_t)mcu->config.queue_ticks * mcu->config.motors;
}

// A table run is known for longer than the queue is deep: beyond its end lie the rows of ticks that
// are still to be made.
static void clear_rows(bushd_mcu* mcu, uint8_t m, uint32_t from, uint32_t until) {
  const uint32_t end = mcu->tick + 1u + mcu->config.queue_ticks;
  if (ticks_after(until, end) > 0) until = end;
  if (ticks_after(until, from) <= 0) return;
  int16_t* queued = bushd_mcu_queue_at(mcu, from, m);
  for (uint16_t rows = (uint16_t)(until - from); rows > 0; --rows, queued = next_row(mcu, queued)) {
    *queued = 0;
  }
}

void bushd_mcu_drop_out_of_order(bushd_mcu* mcu, uint8_t m) {
  bushd_mcu_motor* motor = &mcu->motor[m];
  if (!motor->has_out_of_order) return;
  clear_rows(mcu, m, motor->out_of_order.from, motor->out_of_order.until);
  motor->has_out_of_order = false;
}

// One that was to come from that tick on does not; the rest before it may last until then.
static void cut_start(bushd_mcu* mcu, uint8_t m, uint32_t tick) {
  bushd_mcu_motor* motor = &mcu->motor[m];
  if ((mcu->stream.starting & motor_bit(m)) == 0) return;
  if (ticks_after(near_tick(motor->start.tick, tick), tick) < 0) return;
  if (motor->mode == BUSHD_MCU_RUN_WAITS) bushd_mcu_give_to_queue(mcu, m);
  motor->start.tick = (uint16_t)tick;
  if (ticks_after(near_tick(motor->start.rest_from, tick), tick) >= 0) {
    mcu->stream.starting &= (uint16_t)~motor_bit(m);
  }
}

void bushd_mcu_cut_queue(bushd_mcu* mcu, uint8_t m, uint32_t tick) {
  bushd_mcu_motor* motor = &mcu->motor[m];
  bushd_mcu_finish_rows(mcu);
  mcu->stream.queue_summary.stale = true;
  bushd_mcu_drop_out_of_order(mcu, m);
  if (ticks_after(motor->known_until, tick) > 0) {
    clear_rows(mcu, m, tick, motor->known_until);
    motor->known_until = tick;
  }
  motor->delay = 0;
  cut_start(mcu, m, tick);
  const bool runs = motor->mode == BUSHD_MCU_RUN_WAITS || motor->mode == BUSHD_MCU_TABLE_RUN;
  if (runs && ticks_after(motor->made.until, tick) > 0) motor->made.until = tick;
}

void bushd_mcu_note_start(bushd_mcu* mcu, uint8_t m, uint32_t tick) {
  bushd_mcu_motor* motor = &mcu->motor[m];
  motor->start.rest_from = (uint16_t)motor->known_until;
  motor->start.tick = (uint16_t)tick;
  mcu->stream.starting |= motor_bit(m);
}

// `news`: the frame holds something for this motor that is not known yet.
static bushd_status check_motor(const bushd_mcu* mcu, uint8_t m, const bushd_mcu_tick_range* range,
                                bool* news) {
  if (m >= mcu->config.motors) return BUSHD_E_FORMAT;
  const bushd_mcu_motor* motor = &mcu->motor[m];
  if (motor->table < 0) return BUSHD_E_NO_TABLE;
  const int32_t first = ticks_after(range->first_tick, motor->known_until);
  const int32_t end = first + range->count;
  const bool moves_on = motor->delay != 0;  // at known_until
  if (range->flags & BUSHD_TICKS_REPLACE) {
    // Something must be queued to be replaced: if the start was lost, there is nothing to go on
    // from.
    if (moves_on ? first > 0 : first >= 0) return BUSHD_E_GAP;
    *news = true;
    return ticks_after(range->first_tick, bushd_mcu_first_open(mcu)) < 0 ? BUSHD_E_LATE : BUSHD_OK;
  }
  if (end <= 0) return BUSHD_OK;
  if (range->flags & BUSHD_TICKS_START) {
    *news = true;
    if (moves_on || !bushd_mcu_may_be_followed(motor)) return BUSHD_E_STATE;
    return first < 0 ? BUSHD_E_LATE : BUSHD_OK;
  }
  if (!moves_on) return BUSHD_E_GAP;
  // Its run stands where its out-of-order range would be kept.
  if (first > 0 && !bushd_mcu_has_no_run(motor)) return BUSHD_E_GAP;
  if (first > 0 && motor->has_out_of_order) {
    const int32_t from = ticks_after(motor->out_of_order.from, motor->known_until);
    const int32_t until = ticks_after(motor->out_of_order.until, motor->known_until);
    if (first > until || end < from) return BUSHD_E_GAP;
    if (first >= from && end <= until) return BUSHD_OK;
  }
  *news = true;
  return BUSHD_OK;
}

static bushd_status check_head(bushd_mcu* mcu, const bushd_mcu_tick_range* range) {
  // What came since the last tick counts: without EN no step must be made, nor counted.
  bushd_mcu_update_state(mcu);
  const bool replace = (range->flags & BUSHD_TICKS_REPLACE) != 0;
  if (mcu->state != BUSHD_STATE_READY && mcu->state != BUSHD_STATE_RUN) return BUSHD_E_STATE;
  if (range->mask & bushd_mcu_not_for_ticks(mcu)) return BUSHD_E_STATE;
  const uint8_t ahead = (uint8_t)(range->epoch - mcu->stream.epoch);
  if (replace ? ahead == 0 || ahead > INT8_MAX : ahead != 0) return BUSHD_E_EPOCH;
  // The queue holds the ticks after the one prepared. All sums of tick numbers below are small once
  // both ends are checked; a frame so old that it holds nothing but past ticks is done with here.
  const int32_t first = ticks_after(range->first_tick, mcu->tick);
  if (first > (int32_t)mcu->config.queue_ticks + 1 - (int32_t)range->count) {
    return BUSHD_E_CAPACITY;
  }
  return first <= -(int32_t)UINT16_MAX ? BUSHD_E_LATE : BUSHD_OK;
}

bushd_status bushd_mcu_check_tick_range(bushd_mcu* mcu, const bushd_mcu_tick_range* range) {
  const bushd_status head = check_head(mcu, range);
  if (head != BUSHD_OK) return head;
  bool news = false;
  for (uint8_t m = 0; m < BUSHD_MOTORS_PER_MCU; ++m) {
    if ((range->mask & motor_bit(m)) == 0) continue;
    const bushd_status status = check_motor(mcu, m, range, &news);
    if (status != BUSHD_OK) return status;
  }
  return news ? BUSHD_OK : BUSHD_E_LATE;
}

// Before its displacements: makes room for a motor's part of a range that was found good.
static void open_motor(bushd_mcu* mcu, uint8_t m, const bushd_mcu_tick_range* range) {
  bushd_mcu_motor* motor = &mcu->motor[m];
  if (range->flags & BUSHD_TICKS_REPLACE) {
    bushd_mcu_cut_queue(mcu, m, range->first_tick);
  }
  const bool known = ticks_after(range->first_tick + range->count, motor->known_until) <= 0;
  if ((range->flags & BUSHD_TICKS_START) == 0 || known) return;
  bushd_mcu_note_start(mcu, m, range->first_tick);
}

// The gap in a range of ticks, as offsets from its first: those from `begin` on are not known yet,
// but for the out-of-order range's.
typedef struct gap {
  uint16_t begin;
  uint16_t out_of_order_begin;
  uint16_t out_of_order_end;
} gap;

static uint16_t offset_of(const bushd_mcu_tick_range* range, uint32_t tick) {
  const int32_t offset = ticks_after(tick, range->first_tick);
  if (offset <= 0) return 0;
  return offset < range->count ? (uint16_t)offset : range->count;
}

static gap gap_in(const bushd_mcu* mcu, uint8_t m, const bushd_mcu_tick_range* range) {
  const bushd_mcu_motor* motor = &mcu->motor[m];
  gap found = {offset_of(range, motor->known_until), range->count, range->count};
  if (motor->has_out_of_order) {
    found.out_of_order_begin = offset_of(range, motor->out_of_order.from);
    found.out_of_order_end = offset_of(range, motor->out_of_order.until);
  }
  return found;
}

static inline bool in_gap(const gap* g, uint16_t offset) {
  return offset >= g->begin && (offset < g->out_of_order_begin || offset >= g->out_of_order_end);
}

static void grow_out_of_order(bushd_mcu_motor* motor, uint32_t from, uint32_t until,
                              uint16_t delay) {
  bushd_mcu_out_of_order* ahead = &motor->out_of_order;
  if (!motor->has_out_of_order) {
    motor->has_out_of_order = true;
    ahead->from = ahead->until = from;
  }
  if (ticks_after(ahead->from, from) > 0) ahead->from = from;
  if (ticks_after(until, ahead->until) <= 0) return;
  ahead->until = until;
  ahead->delay = delay;
}

// After them: they are known now, and what lies behind a gap that they have filled.
static void close_motor(bushd_mcu* mcu, uint8_t m, const bushd_mcu_tick_range* range,
                        uint16_t delay) {
  bushd_mcu_motor* motor = &mcu->motor[m];
  const uint32_t end = range->first_tick + range->count;
  const bool start = (range->flags & BUSHD_TICKS_START) != 0;
  if (!start && ticks_after(range->first_tick, motor->known_until) > 0) {
    grow_out_of_order(motor, range->first_tick, end, delay);
    return;
  }
  if (ticks_after(end, motor->known_until) <= 0) return;
  motor->known_until = end;
  motor->delay = delay;
  if (!motor->has_out_of_order) return;
  if (ticks_after(end, motor->out_of_order.from) < 0) {
    if (delay == 0) bushd_mcu_drop_out_of_order(mcu, m);
    return;
  }
  if (ticks_after(motor->out_of_order.until, end) > 0) {
    motor->known_until = motor->out_of_order.until;
    motor->delay = motor->out_of_order.delay;
  }
  motor->has_out_of_order = false;
}

static void close_tick_range(bushd_mcu* mcu, const bushd_mcu_tick_range* range) {
  if (range->flags & BUSHD_TICKS_REPLACE) mcu->stream.epoch = range->epoch;
}

// More steps would not find room in a tick: |displacement| > most x 256.
static bool in_range(const bushd_mcu* mcu, const bushd_ticks* ticks) {
  const uint8_t most = mcu->emission.grid.max_steps;
  const uint8_t* at = ticks->displacements;
  uint16_t left = (uint16_t)(ticks->motors * ticks->count);
  if ((ticks->flags & BUSHD_TICKS_FINE) == 0) {
    if (most == BUSHD_MAX_STEPS_PER_TICK) return true;
    for (; left > 0; --left, ++at) {
      if ((*at & 0x7F) > most) return false;
    }
    return true;
  }
  const int8_t highest = (int8_t)most;
  const int8_t lowest = (int8_t)-highest;
  for (; left > 0; --left, at += 2) {
    const int8_t whole = (int8_t)at[1];  // rounded down
    if (whole < lowest || whole > highest || (whole == highest && at[0] != 0)) return false;
  }
  return true;
}

// Rows begin .. end - 1 of a motor's column into the queue.
static void put_rows(bushd_mcu* mcu, uint8_t m, const bushd_ticks* ticks, uint8_t column,
                     uint8_t begin, uint8_t end) {
  if (begin >= end) return;
  const bool fine = (ticks->flags & BUSHD_TICKS_FINE) != 0;
  const uint8_t size = fine ? 2 : 1;
  const uint8_t stride = (uint8_t)(size * ticks->motors);
  const uint8_t* at = ticks->displacements + begin * stride + size * column;
  int16_t* queued = bushd_mcu_queue_at(mcu, ticks->first_tick + begin, m);
  for (uint8_t rows = (uint8_t)(end - begin); rows > 0; --rows, at += stride) {
    *queued = fine ? bushd_get_i16(at) : bushd_coarse_to_fine(*at);
    queued = next_row(mcu, queued);
  }
}

static void put_column(bushd_mcu* mcu, uint8_t m, const bushd_mcu_tick_range* range,
                       const bushd_ticks* ticks, uint8_t column) {
  const gap unknown = gap_in(mcu, m, range);
  const uint8_t begin = (uint8_t)unknown.begin;
  const uint8_t out_of_order_begin = (uint8_t)unknown.out_of_order_begin;
  const uint8_t out_of_order_end = (uint8_t)unknown.out_of_order_end;
  put_rows(mcu, m, ticks, column, begin, out_of_order_begin);
  put_rows(mcu, m, ticks, column, begin > out_of_order_end ? begin : out_of_order_end,
           ticks->count);
}

// What frames do to most motors: their ticks follow what is known, and nothing waits beyond.
static bool all_follow(const bushd_mcu* mcu, const bushd_ticks* ticks) {
  const bushd_mcu_queue_summary* queue_summary = &mcu->stream.queue_summary;
  return (ticks->flags & (BUSHD_TICKS_START | BUSHD_TICKS_REPLACE)) == 0 && !queue_summary->stale &&
         ticks->first_tick == queue_summary->plain_until &&
         (ticks->mask & (uint16_t)~queue_summary->following) == 0;
}

#ifndef BUSHD_OWN_COARSE_ROWS
void bushd_mcu_put_coarse_row(int16_t* queued, uint16_t mask, const uint8_t* counts) {
  for (; mask != 0; mask = (uint16_t)(mask >> 1), ++queued) {
    if ((mask & 1u) != 0) *queued = bushd_coarse_to_fine(*counts++);
  }
}
#endif

static void put_row(bushd_mcu* mcu) {
  const bushd_ticks* const ticks = &mcu->stream.rows.ticks;
  BUSHD_ASSERT(bushd_mcu_owner_of_buffer(mcu) == BUSHD_MCU_BUFFER_ROWS);
  const uint8_t row = mcu->stream.rows.next++;
  int16_t* queued = bushd_mcu_queue_at(mcu, ticks->first_tick + row, 0);
  uint16_t mask = ticks->mask;
  const uint8_t* at = ticks->displacements + (uint16_t)(row * ticks->motors);
  if ((ticks->flags & BUSHD_TICKS_FINE) == 0) {
    bushd_mcu_put_coarse_row(queued, mask, at);
    return;
  }
  at += (uint16_t)(row * ticks->motors);
  for (; mask != 0; mask = (uint16_t)(mask >> 1), ++queued) {
    if ((mask & 1u) == 0) continue;
    *queued = bushd_get_i16(at);
    at += 2;
  }
}

bool bushd_mcu_put_next_row(bushd_mcu* mcu) {
  if (mcu->stream.rows.next >= mcu->stream.rows.ticks.count) return false;
  put_row(mcu);
  return true;
}

void bushd_mcu_finish_rows(bushd_mcu* mcu) {
  while (mcu->stream.rows.next < mcu->stream.rows.ticks.count) put_row(mcu);
}

void bushd_mcu_finish_row(bushd_mcu* mcu, uint32_t tick) {
  while (mcu->stream.rows.next < mcu->stream.rows.ticks.count &&
         ticks_after(mcu->stream.rows.ticks.first_tick + mcu->stream.rows.next, tick) <= 0) {
    put_row(mcu);
  }
}

static void put_rows_later(bushd_mcu* mcu, const bushd_ticks* ticks) {
  BUSHD_ASSERT(bushd_mcu_owner_of_buffer(mcu) == BUSHD_MCU_BUFFER_RECEIVER);
  mcu->stream.rows.ticks = *ticks;
  mcu->stream.rows.next = 0;
}

// And to others: their motors start from rest.
static bool all_rest(const bushd_mcu* mcu, const bushd_ticks* ticks) {
  const uint8_t kind = ticks->flags & (BUSHD_TICKS_START | BUSHD_TICKS_REPLACE);
  if (kind != BUSHD_TICKS_START || mcu->stream.queue_summary.stale ||
      (ticks->mask & (uint16_t)~mcu->stream.queue_summary.rests) != 0 ||
      ticks_after(ticks->first_tick, bushd_mcu_first_open(mcu)) < 0) {
    return false;
  }
  const bushd_mcu_motor* motor = mcu->motor;
  for (uint16_t mask = ticks->mask; mask != 0; mask = (uint16_t)(mask >> 1), ++motor) {
    if ((mask & 1u) != 0 && motor->table < 0) return false;
  }
  return true;
}

static void note_starts(bushd_mcu* mcu, uint16_t mask, uint32_t tick) {
  for (uint8_t m = 0; mask != 0; ++m, mask = (uint16_t)(mask >> 1)) {
    if (mask & 1u) bushd_mcu_note_start(mcu, m, tick);
  }
}

// All in the mask go on to the frame's end.
static void follow(bushd_mcu* mcu, const bushd_ticks* ticks) {
  const uint32_t end = ticks->first_tick + ticks->count;
  const uint8_t* delay = ticks->delays;
  bushd_mcu_motor* motor = mcu->motor;
  uint16_t moves = 0;
  uint16_t bit = 1;
  for (uint16_t mask = ticks->mask; mask != 0; mask = (uint16_t)(mask >> 1), ++motor) {
    if ((mask & 1u) != 0) {
      motor->known_until = end;
      motor->delay = bushd_get_u16(delay);
      if (motor->delay != 0) moves |= bit;
      delay += 2;
    }
    bit = (uint16_t)(bit << 1);
  }
  put_rows_later(mcu, ticks);
  bushd_mcu_queue_summary* queue_summary = &mcu->stream.queue_summary;
  // Mostly these are all that there are.
  queue_summary->stale =
      ((queue_summary->plain | queue_summary->moves) & (uint16_t)~ticks->mask) != 0;
  queue_summary->plain_until = queue_summary->moving_until = end;
  queue_summary->moves = queue_summary->following = moves;
}

// True if all rows are new to all motors of the mask.
static bool open_motors(bushd_mcu* mcu, const bushd_mcu_tick_range* range) {
  const bool start = (range->flags & BUSHD_TICKS_START) != 0;
  bool all_new = true;
  for (uint8_t m = 0; m < mcu->config.motors; ++m) {
    if ((range->mask & motor_bit(m)) == 0) continue;
    open_motor(mcu, m, range);
    const int32_t first = ticks_after(range->first_tick, mcu->motor[m].known_until);
    if (mcu->motor[m].has_out_of_order || (start ? first < 0 : first != 0)) all_new = false;
  }
  return all_new;
}

bushd_status bushd_mcu_take_ticks(bushd_mcu* mcu, const bushd_ticks* ticks) {
  const bushd_mcu_tick_range range = {ticks->epoch, ticks->flags, ticks->first_tick, ticks->count,
                                      ticks->mask};
  const bool fine = (ticks->flags & BUSHD_TICKS_FINE) != 0;
  const bool starts = all_rest(mcu, ticks);
  const bool plain = starts || all_follow(mcu, ticks);
  const bushd_status status =
      plain ? check_head(mcu, &range) : bushd_mcu_check_tick_range(mcu, &range);
  if (status != BUSHD_OK) return status;
  if (fine != (mcu->format == BUSHD_FORMAT_FINE) || !in_range(mcu, ticks)) return BUSHD_E_FORMAT;
  if (bushd_mcu_starts_into_limit(mcu, ticks)) return BUSHD_E_FORBIDDEN;
  if (starts) note_starts(mcu, ticks->mask, ticks->first_tick);
  if (plain) {
    follow(mcu, ticks);
    mcu->stream.queue_summary.stale |= starts;
    return BUSHD_OK;
  }
  mcu->stream.queue_summary.stale = true;
  const bool all_new = open_motors(mcu, &range);
  uint8_t column = 0;
  for (uint8_t m = 0; m < mcu->config.motors; ++m) {
    if ((ticks->mask & motor_bit(m)) == 0) continue;
    if (!all_new) put_column(mcu, m, &range, ticks, column);
    close_motor(mcu, m, &range, bushd_get_u16(ticks->delays + 2u * column));
    ++column;
  }
  if (all_new) put_rows_later(mcu, ticks);
  close_tick_range(mcu, &range);
  return BUSHD_OK;
}

// The run of an entry: what its motor's table makes of it.
static bool restore(const bushd_mcu* mcu, const bushd_table_ticks_entry* entry, bushd_run* run) {
  const int8_t bank = mcu->motor[entry->motor].table;
  return bushd_run_restore(run, &mcu->tables.bank[bank].table, &entry->state);
}

static void put_run(bushd_mcu* mcu, uint8_t m, const bushd_mcu_tick_range* range, bushd_run* run) {
  enum { CHUNK = 8 };  // stack is short
  const gap unknown = gap_in(mcu, m, range);
  union {
    int16_t fine[CHUNK];
    uint8_t coarse[CHUNK];
  } made;
  for (uint16_t at = 0; at < range->count; at = (uint16_t)(at + CHUNK)) {
    const uint16_t left = (uint16_t)(range->count - at);
    const uint16_t count = left < CHUNK ? left : CHUNK;
    const bool in_fine = mcu->format == BUSHD_FORMAT_FINE;
    if (in_fine) {
      bushd_run_expand_fine(run, mcu->tick_ns, count, made.fine, 1);
    } else {
      bushd_run_expand_coarse(run, mcu->tick_ns, count, made.coarse, 1);
    }
    for (uint16_t i = 0; i < count; ++i) {
      if (!in_gap(&unknown, (uint16_t)(at + i))) continue;
      *bushd_mcu_queue_at(mcu, range->first_tick + at + i, m) =
          in_fine ? made.fine[i] : bushd_coarse_to_fine(made.coarse[i]);
    }
  }
}

bushd_status bushd_mcu_take_table_ticks(bushd_mcu* mcu, const bushd_table_ticks* ticks) {
  const bushd_mcu_tick_range range = {ticks->epoch, ticks->flags, ticks->first_tick, ticks->count,
                                      ticks->mask};
  const bushd_status status = bushd_mcu_check_tick_range(mcu, &range);
  if (status != BUSHD_OK) return status;
  bushd_table_ticks_entry entry;
  bushd_run run;
  bool barred = (ticks->flags & BUSHD_TICKS_START) != 0;
  for (uint16_t at = 0; bushd_next_table_ticks_entry(ticks, &at, &entry);) {
    if (!restore(mcu, &entry, &run)) return BUSHD_E_FORMAT;
    barred = barred && (bushd_mcu_forbidden(mcu, run.direction) & motor_bit(entry.motor)) != 0;
  }
  if (barred) return BUSHD_E_FORBIDDEN;
  for (uint16_t at = 0; bushd_next_table_ticks_entry(ticks, &at, &entry);) {
    restore(mcu, &entry, &run);
    open_motor(mcu, entry.motor, &range);
    put_run(mcu, entry.motor, &range, &run);
    close_motor(mcu, entry.motor, &range, (uint16_t)bushd_run_delay(&run));
  }
  close_tick_range(mcu, &range);
  return BUSHD_OK;
}
