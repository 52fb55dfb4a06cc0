// Runs of a motor's own table: TABLE_RUN, what the trigger has armed, and what moves by itself.
#include "firmware/core/table_run.h"

#include "firmware/core/access.h"
#include "firmware/core/limits.h"
#include "firmware/core/owner.h"
#include "firmware/core/stream.h"
#include "firmware/core/tables.h"

bool bushd_mcu_ticks_of_run(const bushd_run* run, uint32_t tick_ns, uint32_t* ticks,
                            uint32_t* spare_ns) {
  const uint32_t unit_ns = run->table->time_unit_ns;
  const uint64_t units = bushd_run_units_left(run);
  if (units > (uint64_t)(INT32_MAX / 2) * tick_ns / unit_ns) return false;
  const uint64_t ns = units * unit_ns;
  *ticks = (uint32_t)((ns + tick_ns - 1u) / tick_ns);
  *spare_ns = (uint32_t)((uint64_t)*ticks * tick_ns - ns);
  return true;
}

__attribute__((noinline)) static void make_run_tick(const bushd_mcu* mcu, const bushd_table* table,
                                                    bushd_run_tick* tick) {
  *tick = bushd_run_tick_of(mcu->tick_ns, table, mcu->config.slots);
}

// Divisions: in the first tick of a run at most, and where homing changes to its slow table.
const bushd_run_tick* bushd_mcu_run_tick_of(bushd_mcu* mcu, uint8_t bank,
                                            const bushd_table* table) {
  bushd_run_tick* tick =
      bank == BUSHD_SCRATCH_BANK ? &mcu->config.scratch->run_tick : &mcu->run_tick[bank];
  if (!bushd_run_tick_fits(tick, mcu->tick_ns, table)) make_run_tick(mcu, table, tick);
  return tick;
}

static inline const bushd_run_tick* run_tick_of(bushd_mcu* mcu, const bushd_mcu_motor* motor) {
  return bushd_mcu_run_tick_of(mcu, (uint8_t)motor->table, motor->made.run.table);
}

void bushd_mcu_emit_runs(bushd_mcu* mcu, bushd_slot_buffer* slot_buffer, uint16_t exact) {
  const bool keep_slots = bushd_mcu_steps_keep_slots(mcu);
  bushd_mcu_motor* motor = mcu->motor;
  int16_t* steps = slot_buffer->steps;
  const bushd_table* table = NULL;
  const bushd_run_tick* tick = NULL;
  uint16_t forward = 0;
  uint16_t active = 0;
  uint16_t bit = 1;
  for (uint16_t left = exact; left != 0; left = (uint16_t)(left >> 1), ++motor, ++steps) {
    if ((left & 1u) != 0) {
      bushd_run* run = &motor->made.run;
      // Mostly motors share a table.
      if (run->table != table) tick = run_tick_of(mcu, motor);
      table = run->table;
      *steps = bushd_run_slots(run, tick, keep_slots ? bit : 0, slot_buffer->step);
      if (run->direction > 0) forward |= bit;
      if (*steps != 0) active |= bit;
      motor->remainder = 0;  // until ticks follow (bushd_mcu_leave_run)
      if (motor->mode == BUSHD_MCU_RAMP_DOWN && bushd_run_done(run)) {
        bushd_mcu_give_to_queue(mcu, (uint8_t)(motor - mcu->motor));
      }
    }
    bit = (uint16_t)(bit << 1);
  }
  mcu->direction = (mcu->direction & (uint16_t)~exact) | forward;
  mcu->stream.begun |= exact;
  slot_buffer->active |= active;
}

// Nobody asks for the share of the running step before. Its speed is rounded down, so that a stop
// goes by a longer delay rather than a shorter one; 31 bits hold it, since no table makes more than
// 127 steps a tick.
void bushd_mcu_leave_run(bushd_mcu* mcu, uint8_t m) {
  bushd_mcu_motor* motor = &mcu->motor[m];
  bushd_run* run = &motor->made.run;
  const bushd_delay delay = bushd_run_delay(run);
  if (delay == 0 || mcu->format != BUSHD_FORMAT_FINE) return;
  bushd_run_note_fraction(run);
  motor->remainder = (int16_t)(run->direction < 0 ? -run->fraction : run->fraction);
  const uint32_t units = run_tick_of(mcu, motor)->units;
  motor->still_ticks = 0;
#if BUSHD_SLOW_RUNS
  // Less than 1/256 step a tick: then by the time for one (note_speed).
  if (!bushd_delay_is_code(delay) && delay > (uint64_t)units * 256u) {
    const uint64_t apart = delay / (units * UINT64_C(256) + 1u) + 1u;
    const uint16_t most = (uint16_t)(BUSHD_MCU_SELDOM - 1u);
    motor->displacement = (uint16_t)(BUSHD_MCU_SELDOM + (apart < most ? (uint16_t)apart : most));
    return;
  }
#endif
  motor->displacement = (uint16_t)(units * 256u / delay);
}

void bushd_mcu_begin_run(bushd_mcu* mcu, uint8_t m, uint32_t first_tick, uint32_t ticks) {
  bushd_mcu_motor* motor = &mcu->motor[m];
  bushd_mcu_note_start(mcu, m, first_tick);
  bushd_mcu_give_motor(mcu, m, BUSHD_MCU_RUN_WAITS);
  motor->exact = true;
  motor->made.until = first_tick + ticks;
  motor->known_until = motor->made.until;
}

bool bushd_mcu_make_run(bushd_mcu* mcu, const bushd_table_run_entry* entry, uint32_t* spare_ns) {
  bushd_mcu_made* made = &mcu->motor[entry->motor].made;
  bushd_run_start(&made->run, &mcu->tables.bank[entry->bank].table, entry->steps, entry->direction,
                  entry->shortest_delay);
  return bushd_mcu_ticks_of_run(&made->run, mcu->tick_ns, &made->until, spare_ns);
}

static bushd_status check_entry(const bushd_mcu* mcu, uint32_t first_tick,
                                const bushd_table_run_entry* entry) {
  const bushd_mcu_motor* motor = &mcu->motor[entry->motor];
  if (ticks_after(first_tick, motor->known_until) < 0) return BUSHD_E_LATE;
  if (motor->table != (int8_t)entry->bank) return BUSHD_E_NO_TABLE;
  if (!bushd_mcu_runs_so_slowly(mcu, entry->shortest_delay)) return BUSHD_E_FORMAT;
  return bushd_mcu_has_no_run(motor) ? BUSHD_OK : BUSHD_E_STATE;
}

bushd_status bushd_mcu_take_table_run(bushd_mcu* mcu, const bushd_table_run* message) {
  bushd_mcu_tick_range range = {message->epoch, BUSHD_TICKS_START, message->first_tick, 1, 0};
  const uint8_t* at = message->entries;
  for (uint8_t i = 0; i < message->count; ++i) {
    range.mask |= motor_bit(bushd_next_table_run_entry(&at).motor);
  }
  const bushd_status status = bushd_mcu_check_tick_range(mcu, &range);
  if (status != BUSHD_OK) return status;
  bool barred = true;
  at = message->entries;
  for (uint8_t i = 0; i < message->count; ++i) {
    const bushd_table_run_entry entry = bushd_next_table_run_entry(&at);
    const bushd_status entry_status = check_entry(mcu, message->first_tick, &entry);
    if (entry_status != BUSHD_OK) return entry_status;
    barred = barred && (bushd_mcu_forbidden(mcu, entry.direction) & motor_bit(entry.motor)) != 0;
  }
  if (barred) return BUSHD_E_FORBIDDEN;
  // All are made before one begins: the frame is taken whole or not at all.
  at = message->entries;
  for (uint8_t i = 0; i < message->count; ++i) {
    const bushd_table_run_entry entry = bushd_next_table_run_entry(&at);
    uint32_t spare_ns;
    if (!bushd_mcu_make_run(mcu, &entry, &spare_ns)) return BUSHD_E_CAPACITY;
  }
  for (uint8_t m = 0; m < mcu->config.motors; ++m) {
    if ((range.mask & motor_bit(m)) == 0) continue;
    bushd_mcu_begin_run(mcu, m, message->first_tick, mcu->motor[m].made.until);
  }
  return BUSHD_OK;
}

#if BUSHD_PROGRAMS
// Codes as they are written say nothing of how to come to rest: by the motor's own table, from the
// share of the running step that is over.
static void take_own_table(const bushd_mcu* mcu, bushd_mcu_motor* motor) {
  bushd_run* run = &motor->made.run;
  const bushd_mcu_scratch* scratch = mcu->config.scratch;
  if (!bushd_mcu_is_written(scratch, BUSHD_SCRATCH_BANK) || run->table != &scratch->entry.table) {
    return;
  }
  const bushd_table* own = bushd_mcu_table_of(mcu, motor);
  const int8_t direction = run->direction;
  uint64_t delay = 0;
  if (!bushd_run_begins_later(run)) {
    const uint64_t ns = (uint64_t)bushd_run_delay(run) * run->table->time_unit_ns;
    delay = (ns + own->time_unit_ns - 1u) / own->time_unit_ns;
    if (delay > UINT16_MAX) delay = UINT16_MAX;
    if (delay != 0 && delay < own->cruise) delay = own->cruise;
    bushd_run_note_fraction(run);
  }
  bushd_run_start_ramp_down(run, own, (bushd_delay)delay, run->fraction, direction);
}
#endif

void bushd_mcu_ramp_down_run(bushd_mcu* mcu, uint8_t m) {
  bushd_mcu_motor* motor = &mcu->motor[m];
  // It was cut, or does so already.
  if (motor->mode == BUSHD_MCU_STREAM || motor->mode == BUSHD_MCU_RAMP_DOWN) return;
  const bool begun = (mcu->stream.begun & motor_bit(m)) != 0;
#if BUSHD_PROGRAMS
  if (begun) take_own_table(mcu, motor);
#endif
  if (begun) bushd_run_ramp_down(&motor->made.run);
  if (begun && !bushd_run_done(&motor->made.run)) {
    bushd_mcu_give_motor(mcu, m, BUSHD_MCU_RAMP_DOWN);
    return;
  }
  bushd_mcu_give_to_queue(mcu, m);
  mcu->stream.begun &= (uint16_t)~motor_bit(m);
}

uint32_t bushd_mcu_steps_counted(const bushd_mcu* mcu, uint8_t m, int direction) {
  const uint32_t at =
      (uint32_t)mcu->motor[m].position_steps + (uint32_t)mcu->slot_buffer[mcu->front].steps[m];
  if (direction > 0) return INT32_MAX - at;
  return at == (uint32_t)INT32_MIN ? 0 : INT32_MAX + at;
}

void bushd_mcu_begin_by_itself(bushd_mcu* mcu, uint8_t m, uint32_t steps, int direction,
                               bushd_delay shortest_delay, bushd_mcu_mode mode) {
  bushd_mcu_motor* motor = &mcu->motor[m];
  bushd_run_start(&motor->made.run, bushd_mcu_table_of(mcu, motor), steps, direction,
                  shortest_delay);
  bushd_mcu_give_motor(mcu, m, mode);
  motor->exact = true;
  mcu->autonomous |= motor_bit(m);
}
