// Runs of a motor's own table: TABLE_RUN, what the trigger has armed, and what moves by itself.
#include "firmware/core/table_run.h"

#include "firmware/core/access.h"
#include "firmware/core/limits.h"
#include "firmware/core/stream.h"
#include "firmware/core/velocity.h"

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

void bushd_mcu_begin_run(bushd_mcu* mcu, uint8_t m, uint32_t first_tick, uint32_t ticks) {
  bushd_mcu_motor* motor = &mcu->motor[m];
  bushd_mcu_note_start(mcu, m, first_tick);
  motor->mode = BUSHD_MCU_RUN_WAITS;
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
  // There is room for one run.
  return motor->mode == BUSHD_MCU_STREAM ? BUSHD_OK : BUSHD_E_STATE;
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

void bushd_mcu_ramp_down_run(bushd_mcu* mcu, uint8_t m) {
  bushd_mcu_motor* motor = &mcu->motor[m];
  // It was cut, or does so already.
  if (motor->mode == BUSHD_MCU_STREAM || motor->mode == BUSHD_MCU_RAMP_DOWN) return;
  if (motor->mode == BUSHD_MCU_VELOCITY) {
    bushd_mcu_brake(mcu, m);
    return;
  }
  mcu->stream.queue_summary.stale = true;
  const bool begun = (mcu->stream.begun & motor_bit(m)) != 0;
  if (begun) bushd_run_ramp_down(&motor->made.run);
  if (begun && !bushd_run_done(&motor->made.run)) {
    motor->mode = BUSHD_MCU_RAMP_DOWN;
    return;
  }
  motor->mode = BUSHD_MCU_STREAM;
  mcu->stream.begun &= (uint16_t)~motor_bit(m);
}

uint32_t bushd_mcu_steps_counted(const bushd_mcu* mcu, uint8_t m, int direction) {
  const uint32_t at =
      (uint32_t)mcu->motor[m].position_steps + (uint32_t)mcu->slot_buffer[mcu->front].steps[m];
  if (direction > 0) return INT32_MAX - at;
  return at == (uint32_t)INT32_MIN ? 0 : INT32_MAX + at;
}

void bushd_mcu_begin_by_itself(bushd_mcu* mcu, uint8_t m, uint32_t steps, int direction,
                               bushd_delay shortest_delay) {
  bushd_mcu_motor* motor = &mcu->motor[m];
  bushd_run_start(&motor->made.run, bushd_mcu_table_of(mcu, motor), steps, direction,
                  shortest_delay);
  motor->mode = BUSHD_MCU_AUTONOMOUS;
  motor->exact = true;
  mcu->autonomous |= motor_bit(m);
  mcu->stream.queue_summary.stale = true;
}
