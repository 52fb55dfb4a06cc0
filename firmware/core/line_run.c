// LINE_RUN and LINE_TRIGGER. One run for all motors of the line, made step by step; every motor is
// asked which of its own steps fall into these (engine/line_follower.h), or each step of the run is
// that of one motor (engine/elementary.h). All MCUs of the line have the same run, begun at the
// same tick, and changed at the same ticks by the same rules: so the motors of all of them are on
// the line without a word between them.
//
// The silence after which the run is ramped down is counted from a time that all MCUs know alike:
// that which the last SYNC frame has told, in ticks of the bus, or the run's first tick.
#include "firmware/core/line_run.h"

#include "engine/run_plan.h"
#include "firmware/core/access.h"
#include "firmware/core/limits.h"
#include "firmware/core/owner.h"
#include "firmware/core/state.h"
#include "firmware/core/stream.h"
#include "firmware/core/stream_stop.h"
#include "firmware/core/table_run.h"
#include "firmware/core/tables.h"

static inline bool is_on_line(const bushd_mcu* mcu, uint8_t m) {
  return (mcu->line.motors & motor_bit(m)) != 0;
}

bushd_status bushd_mcu_check_line_table(const bushd_mcu* mcu, uint8_t bank,
                                        uint16_t shortest_delay) {
  const bushd_table* table = bushd_mcu_checked_table(mcu, bank);
  if (table == NULL) return BUSHD_E_NO_TABLE;
  const bool slow_only = (mcu->config.disabled_capabilities & BUSHD_CAN_TABLE_TICKS) != 0;
  if (slow_only &&
      !bushd_run_is_slow(table, shortest_delay, mcu->tick_ns, BUSHD_SLOW_LINE_DELAY_NS)) {
    return BUSHD_E_CAPACITY;
  }
  const uint32_t most = bushd_mcu_is_written(mcu->config.scratch, bank)
                            ? bushd_written_max_steps_per_tick(table, mcu->tick_ns)
                            : bushd_table_max_steps_per_tick(table, mcu->tick_ns);
  return most > mcu->emission.grid.max_steps ? BUSHD_E_CAPACITY : BUSHD_OK;
}

// `barred`: a limit forbids the direction of each.
static bushd_status check_entries(const bushd_mcu* mcu, const bushd_line_run* message,
                                  bool* barred) {
  const uint8_t* at = message->line.entries;
  *barred = true;
  for (uint8_t i = 0; i < message->line.count; ++i) {
    const bushd_line_entry entry = bushd_next_line_entry(&at);
    const bushd_mcu_motor* motor = &mcu->motor[entry.motor];
    if (ticks_after(message->first_tick, motor->known_until) < 0) return BUSHD_E_LATE;
    if (!bushd_mcu_has_no_run(motor)) return BUSHD_E_STATE;
    if ((bushd_mcu_forbidden(mcu, entry.direction) & motor_bit(entry.motor)) == 0) *barred = false;
  }
  return BUSHD_OK;
}

static uint16_t motors_of(const bushd_line_part* part) {
  uint16_t mask = 0;
  const uint8_t* at = part->entries;
  for (uint8_t i = 0; i < part->count; ++i) mask |= motor_bit(bushd_next_line_entry(&at).motor);
  return mask;
}

static bool is_taken(const bushd_mcu* mcu) {
  return mcu->line.motors != 0 || (mcu->line.waits && mcu->trigger.armed != 0);
}

#if BUSHD_ELEMENTARY
bool bushd_mcu_makes_elementary(const bushd_mcu* mcu) {
  const uint16_t disabled = mcu->config.disabled_capabilities;
  return !mcu->config.no_elementary && (disabled & BUSHD_CAN_LINE_RUN) == 0;
}

static bool is_elementary(const bushd_mcu* mcu) {
  return mcu->line.elementary.sum != 0;
}
#endif

bool bushd_mcu_place_on_line(bushd_mcu* mcu) {
  uint16_t* const unplaced = &mcu->line.unplaced;
  // The place of one that has left it is another's.
  *unplaced &= mcu->line.motors;
  for (uint8_t m = 0; m < mcu->config.motors && *unplaced != 0; ++m) {
    if ((*unplaced & motor_bit(m)) == 0) continue;
    bushd_mcu_on_line* on_line = &mcu->motor[m].on_line;
    const uint32_t increment = on_line->follower.increment;
    on_line->share = bushd_line_share(increment, mcu->line.longest);
    bushd_line_follower_start(&on_line->follower, increment, mcu->line.longest,
                              mcu->line.step - 1u);
    *unplaced &= (uint16_t)~motor_bit(m);
    return true;
  }
  return false;
}

static void place_all(bushd_mcu* mcu) {
  while (bushd_mcu_place_on_line(mcu)) {
  }
}

// Codes as they are written are the whole run of one motor.
static bool start(bushd_mcu* mcu, const bushd_line_part* part) {
  const bushd_table* table = bushd_mcu_checked_table(mcu, part->bank);
  if (!bushd_mcu_is_written(mcu->config.scratch, part->bank)) {
    bushd_run_start(&mcu->line.run, table, part->steps, 1, part->shortest_delay);
    return true;
  }
  const uint32_t codes = (uint32_t)table->accel.count + table->decel.count;
  if (part->count != 1 || part->from != 0 || part->steps != part->longest || part->steps < codes ||
      part->shortest_delay != 0) {
    return false;
  }
  bushd_run_start_as_written(&mcu->line.run, table, part->steps, 1);
  return true;
}

#if BUSHD_ELEMENTARY
static void lay_elementary(bushd_mcu* mcu, const bushd_line_part* part) {
  bushd_elementary* line = &mcu->line.elementary;
  bushd_elementary_clear(line);
  if (!part->elementary) return;
  const uint8_t* at = part->entries;
  for (uint8_t i = 0; i < part->count; ++i) {
    const bushd_line_entry entry = bushd_next_line_entry(&at);
    bushd_elementary_add(line, entry.motor, entry.increment);
  }
}
#endif

// The run, what its motors are told of it, and how many ticks it takes (bushd_mcu_ticks_of_run).
static bool make(bushd_mcu* mcu, const bushd_line_part* part, uint32_t* ticks, uint32_t* spare_ns) {
  if (!start(mcu, part)) return false;
  if (!bushd_mcu_ticks_of_run(&mcu->line.run, mcu->tick_ns, ticks, spare_ns)) return false;
  mcu->line.bank = part->bank & 0xFu;
  mcu->line.longest = part->longest;
  mcu->line.step = part->from + 1u;
  mcu->line.last = part->from + part->steps;
#if BUSHD_ELEMENTARY
  lay_elementary(mcu, part);
#endif
  const uint8_t* at = part->entries;
  for (uint8_t i = 0; i < part->count; ++i) {
    const bushd_line_entry entry = bushd_next_line_entry(&at);
    bushd_mcu_on_line* on_line = &mcu->motor[entry.motor].on_line;
    on_line->direction = entry.direction;
    on_line->follower.increment = entry.increment;
  }
  return true;
}

static void begin(bushd_mcu* mcu, uint16_t motors, uint32_t first_tick, uint32_t ticks) {
  mcu->line.waits = false;
  mcu->line.motors = mcu->line.unplaced = motors;
  for (uint8_t m = 0; motors != 0; ++m, motors = (uint16_t)(motors >> 1)) {
    if (motors & 1u) bushd_mcu_begin_run(mcu, m, first_tick, ticks);
  }
  if (!mcu->config.in_pieces) place_all(mcu);
}

bushd_status bushd_mcu_take_line_run(bushd_mcu* mcu, const bushd_line_run* message) {
  const bushd_line_part* part = &message->line;
  const bushd_mcu_tick_range range = {message->epoch, BUSHD_TICKS_START, message->first_tick, 1,
                                      motors_of(part)};
  bushd_status status = bushd_mcu_check_tick_range(mcu, &range);
  if (status != BUSHD_OK) return status;
#if BUSHD_ELEMENTARY
  if (part->elementary && !bushd_mcu_makes_elementary(mcu)) return BUSHD_E_FORMAT;
#endif
  bool barred;
  status = check_entries(mcu, message, &barred);
  if (status == BUSHD_OK)
    status = bushd_mcu_check_line_table(mcu, part->bank, part->shortest_delay);
  if (status != BUSHD_OK) return status;
  if (barred) return BUSHD_E_FORBIDDEN;
  if (is_taken(mcu)) return BUSHD_E_STATE;
  uint32_t ticks;
  uint32_t spare_ns;
  if (!make(mcu, part, &ticks, &spare_ns)) return BUSHD_E_CAPACITY;
  begin(mcu, range.mask, message->first_tick, ticks);
  return BUSHD_OK;
}

bool bushd_mcu_begin_line(bushd_mcu* mcu, const bushd_line_run* message, uint16_t motors) {
  uint32_t ticks;
  uint32_t spare_ns;
  if (is_taken(mcu) || !make(mcu, &message->line, &ticks, &spare_ns)) return false;
  begin(mcu, motors, message->first_tick, ticks);
  return true;
}

static bushd_status check_waiting(const bushd_mcu* mcu, const bushd_line_part* part) {
#if BUSHD_ELEMENTARY
  if (part->elementary && !bushd_mcu_makes_elementary(mcu)) return BUSHD_E_FORMAT;
#endif
  const uint8_t* at = part->entries;
  for (uint8_t i = 0; i < part->count; ++i) {
    const bushd_line_entry entry = bushd_next_line_entry(&at);
    if (entry.motor >= mcu->config.motors) return BUSHD_E_FORMAT;
    if (mcu->motor[entry.motor].table < 0) return BUSHD_E_NO_TABLE;
    const uint16_t forbidden = bushd_mcu_forbidden(mcu, entry.direction);
    if ((forbidden & motor_bit(entry.motor)) != 0) return BUSHD_E_FORBIDDEN;
  }
  return bushd_mcu_check_line_table(mcu, part->bank, part->shortest_delay);
}

bushd_status bushd_mcu_hold_line(bushd_mcu* mcu, const bushd_line_part* part, uint16_t* motors) {
  const bushd_status status = check_waiting(mcu, part);
  if (status != BUSHD_OK) return status;
  *motors = motors_of(part);
  if (is_taken(mcu) || (bushd_mcu_engaged(mcu) & *motors) != 0) return BUSHD_E_STATE;
  uint32_t ticks;
  uint32_t spare_ns;
  if (!make(mcu, part, &ticks, &spare_ns)) return BUSHD_E_CAPACITY;
  mcu->stream.starting &= (uint16_t)~*motors;
  for (uint8_t m = 0; m < mcu->config.motors; ++m) {
    if ((*motors & motor_bit(m)) == 0) continue;
    mcu->motor[m].on_line.until = ticks;
    mcu->motor[m].spare_ns = spare_ns;
  }
  mcu->line.waits = true;
  return BUSHD_OK;
}

void bushd_mcu_begin_held_line(bushd_mcu* mcu, uint16_t motors, uint32_t first_tick, uint32_t ns) {
  uint8_t m = 0;
  while ((motors & motor_bit(m)) == 0) ++m;
  const bushd_mcu_motor* motor = &mcu->motor[m];  // they all know it
  const uint32_t ticks = motor->on_line.until + (ns > motor->spare_ns);
  bushd_run_begin_late(&mcu->line.run, ns);
  begin(mcu, motors, first_tick, ticks);
}

// What the motors make of these steps of the run. Not inlined, as emit_tick: with the spans in its
// frame it would be slow on an 8-bit MCU.
__attribute__((noinline)) static void follow(bushd_mcu* mcu, bushd_slot_buffer* slot_buffer,
                                             uint16_t motors, const bushd_run_spans* spans) {
  const uint16_t keep_slots = bushd_mcu_steps_keep_slots(mcu) ? UINT16_MAX : 0;
  bushd_mcu_motor* motor = mcu->motor;
  int16_t* steps = slot_buffer->steps;
  uint16_t active = 0;
  uint16_t bit = 1;
  for (; motors != 0; motors = (uint16_t)(motors >> 1), ++motor, ++steps) {
    if ((motors & 1u) != 0) {
      const uint8_t made =
          bushd_line_follower_make(&motor->on_line.follower, spans, bit & keep_slots);
      if (made != 0) {
        active |= bit;
        *steps = (int16_t)(motor->on_line.direction < 0 ? *steps - made : *steps + made);
      }
    }
    bit = (uint16_t)(bit << 1);
  }
  slot_buffer->active |= active;
}

#if BUSHD_ELEMENTARY
// The same, where each step of the run that ends is a step of one motor. One that has left the line
// makes none of those that are its own.
static void follow_elementary(bushd_mcu* mcu, bushd_slot_buffer* slot_buffer, uint16_t motors,
                              const bushd_run_spans* spans) {
  const uint16_t keep_slots = bushd_mcu_steps_keep_slots(mcu) ? UINT16_MAX : 0;
  const uint8_t ended = (uint8_t)(spans->count - (spans->parts < 256u ? 1u : 0u));
  for (uint8_t i = 0; i < ended; ++i) {
    const uint8_t m = bushd_elementary_step(&mcu->line.elementary);
    const uint16_t bit = motor_bit(m) & motors;
    if (bit == 0) continue;
    spans->masks[bushd_run_span_slot(spans, i, UINT8_MAX)] |= bit & keep_slots;
    slot_buffer->active |= bit;
    const int16_t steps = slot_buffer->steps[m];
    slot_buffer->steps[m] = (int16_t)(mcu->motor[m].on_line.direction < 0 ? steps - 1 : steps + 1);
  }
}
#endif

static void follow_by_law(bushd_mcu* mcu, bushd_slot_buffer* slot_buffer, uint16_t motors,
                          const bushd_run_spans* spans) {
#if BUSHD_ELEMENTARY
  if (is_elementary(mcu)) {
    follow_elementary(mcu, slot_buffer, motors, spans);
    return;
  }
#endif
  follow(mcu, slot_buffer, motors, spans);
}

// Before its first step in the tick. Returns those that go forward.
static uint16_t begin_tick(bushd_mcu_motor* motor, int16_t* steps, uint16_t motors) {
  uint16_t forward = 0;
  uint16_t bit = 1;
  for (; motors != 0; motors = (uint16_t)(motors >> 1), ++motor, ++steps) {
    if ((motors & 1u) != 0) {
      *steps = 0;
      motor->remainder = 0;  // until ticks follow (bushd_mcu_leave_line)
      if (motor->on_line.direction > 0) forward |= bit;
    }
    bit = (uint16_t)(bit << 1);
  }
  return forward;
}

// Ends a ramp-down; the end of another run is known beforehand.
static void end_ramp_down(bushd_mcu* mcu, uint16_t motors) {
  for (uint8_t m = 0; motors != 0; ++m, motors = (uint16_t)(motors >> 1)) {
    if ((motors & 1u) == 0 || mcu->motor[m].mode != BUSHD_MCU_RAMP_DOWN) continue;
    bushd_mcu_give_to_queue(mcu, m);
  }
}

// Apart from what it needs first: a tick in the terms of a table may have to be made, by divisions.
__attribute__((noinline)) static void emit_tick(bushd_mcu* mcu, bushd_slot_buffer* slot_buffer,
                                                uint16_t motors, const bushd_run_tick* tick) {
  bushd_run* run = &mcu->line.run;
  bushd_run_walk walk;
  bushd_run_spans spans;
  bushd_run_walk_begin(&walk, run, tick, &spans, mcu->line.step, slot_buffer->step);
  while (bushd_run_walk_next(&walk, run, &spans)) follow_by_law(mcu, slot_buffer, motors, &spans);
  mcu->line.step = spans.step;
}

void bushd_mcu_emit_line(bushd_mcu* mcu, bushd_slot_buffer* slot_buffer, uint16_t motors) {
  const bushd_run* run = &mcu->line.run;
  place_all(mcu);
  const uint16_t forward = begin_tick(mcu->motor, slot_buffer->steps, motors);
  emit_tick(mcu, slot_buffer, motors, bushd_mcu_run_tick_of(mcu, mcu->line.bank, run->table));
  mcu->direction = (mcu->direction & (uint16_t)~motors) | forward;
  mcu->stream.begun |= motors;
  if (bushd_run_done(run)) end_ramp_down(mcu, motors);
}

uint16_t bushd_mcu_ramp_down_line(bushd_mcu* mcu) {
  uint16_t concerned = 0;
  if (mcu->line.motors == 0 || bushd_run_done(&mcu->line.run)) return 0;
  for (uint8_t m = 0; m < mcu->config.motors; ++m) {
    if (!is_on_line(mcu, m) || mcu->motor[m].mode != BUSHD_MCU_TABLE_RUN) continue;
    bushd_mcu_give_motor(mcu, m, BUSHD_MCU_RAMP_DOWN);
    concerned |= motor_bit(m);
  }
  if (concerned == 0) return 0;
#if BUSHD_PROGRAMS
  if (bushd_mcu_is_written(mcu->config.scratch, mcu->line.bank)) {
    for (uint8_t m = 0; m < mcu->config.motors; ++m) {
      if ((concerned & motor_bit(m)) != 0) bushd_mcu_ramp_down_from_line(mcu, m);
    }
    return concerned;
  }
#endif
  bushd_run_ramp_down_once(&mcu->line.run);
  mcu->line.last = mcu->line.step - 1u + bushd_run_steps_left(&mcu->line.run);
  return concerned;
}

static uint32_t due_step(const bushd_mcu* mcu, uint8_t m) {
#if BUSHD_ELEMENTARY
  const bushd_elementary* line = &mcu->line.elementary;
  if (is_elementary(mcu)) {
    if (line->coordinate[m].made == line->coordinate[m].increment) return UINT32_MAX;
    return bushd_elementary_due(line, m);
  }
#endif
  return mcu->motor[m].on_line.follower.due_step;
}

static bool has_steps_left(const bushd_mcu* mcu, uint8_t m) {
  return !bushd_run_done(&mcu->line.run) && due_step(mcu, m) <= mcu->line.last;
}

uint16_t bushd_mcu_line_delay(const bushd_mcu* mcu, uint8_t m) {
  if (!has_steps_left(mcu, m)) return 0;
  const bushd_mcu_motor* motor = &mcu->motor[m];
  const uint32_t own_unit_ns = bushd_mcu_table_of(mcu, motor)->time_unit_ns;
  const uint64_t ns = (uint64_t)bushd_run_delay(&mcu->line.run) * mcu->line.run.table->time_unit_ns;
  // In units first: the product with L may need more than 64 bits.
  const uint64_t units = (ns + own_unit_ns - 1u) / own_unit_ns;
  if (units > UINT16_MAX) return UINT16_MAX;
  const uint32_t increment = motor->on_line.follower.increment;
  const uint64_t own = (units * mcu->line.longest + increment - 1u) / increment;
  return own < UINT16_MAX ? (uint16_t)own : UINT16_MAX;
}

// Its displacement tells its speed to a stop (stream_delay): rounded down, so that this goes by a
// longer delay rather than a shorter one.
static void note_speed(bushd_mcu* mcu, bushd_mcu_motor* motor) {
  const bushd_run* run = &mcu->line.run;
  const uint32_t units = bushd_mcu_run_tick_of(mcu, mcu->line.bank, run->table)->units;
  const uint32_t of_run = units * 256u / (uint16_t)bushd_run_delay(run);  // 15 bits
  motor->displacement = (uint16_t)(of_run * motor->on_line.share >> 16);
  motor->still_ticks = 0;
}

static uint8_t fraction_of(const bushd_mcu* mcu, uint8_t m) {
  const uint8_t parts = mcu->line.run.fraction;
#if BUSHD_ELEMENTARY
  if (is_elementary(mcu)) return bushd_elementary_fraction(&mcu->line.elementary, m, parts);
#endif
  return bushd_line_follower_fraction(&mcu->motor[m].on_line.follower, mcu->line.longest,
                                      mcu->line.step, parts);
}

void bushd_mcu_leave_line(bushd_mcu* mcu, uint8_t m) {
  bushd_mcu_motor* motor = &mcu->motor[m];
  mcu->line.motors &= (uint16_t)~motor_bit(m);
  motor->remainder = 0;
  // It comes to rest on a whole step.
  if (mcu->format != BUSHD_FORMAT_FINE || !has_steps_left(mcu, m)) return;
  const uint8_t fraction = fraction_of(mcu, m);
  motor->remainder = motor->on_line.direction < 0 ? (int16_t)-fraction : (int16_t)fraction;
  note_speed(mcu, motor);
}

void bushd_mcu_ramp_down_from_line(bushd_mcu* mcu, uint8_t m) {
  const uint16_t delay = bushd_mcu_line_delay(mcu, m);
  bushd_mcu_leave_line(mcu, m);
  bushd_mcu_give_to_queue(mcu, m);
  if (delay != 0) bushd_mcu_ramp_down_stream(mcu, m, delay);
}

void bushd_mcu_line_begins(bushd_mcu* mcu, uint32_t tick) {
  uint32_t* told_tick = &mcu->clock.told_tick;
  if (ticks_after(tick, *told_tick) > 0) *told_tick = tick;
}

uint32_t bushd_mcu_line_deadline(const bushd_mcu* mcu) {
  return mcu->clock.told_tick + mcu->reception.comm_timeout_ticks;
}

int8_t bushd_mcu_run_direction(const bushd_mcu* mcu, uint8_t m) {
  const bushd_mcu_motor* motor = &mcu->motor[m];
  return is_on_line(mcu, m) ? motor->on_line.direction : motor->made.run.direction;
}
