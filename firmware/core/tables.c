// Table memory: the tables' codes lie one behind the other; a table that is sent anew first gives
// its place back. Behind all that are kept over resets lies the one that is not: so what a port
// keeps does not know of it.
#include "firmware/core/tables.h"

#include <string.h>

#include "firmware/core/access.h"
#include "firmware/core/emission.h"
#include "firmware/core/state.h"

// Codes in memory, of both sides.
static uint16_t count_of(const bushd_table* table) {
  const bool symmetric = table->decel.code == table->accel.code;
  return (uint16_t)(table->accel.count + (symmetric ? 0u : table->decel.count));
}

static uint16_t* codes_of(const bushd_mcu* mcu, const bushd_table* table) {
  return mcu->config.codes + (table->accel.code - mcu->config.codes);
}

static inline uint8_t bank_bit(uint8_t bank) {
  return (uint8_t)(1u << bank);
}

static bool has_bank(const bushd_mcu* mcu, uint8_t bank) {
  return bank != BUSHD_SCRATCH_BANK || mcu->config.scratch != NULL;
}

// Precondition for these: the MCU has the bank.
static bool is_valid(const bushd_mcu* mcu, uint8_t bank) {
  if (bank == BUSHD_SCRATCH_BANK) return mcu->config.scratch->valid;
  return (mcu->tables.valid & bank_bit(bank)) != 0;
}

static bushd_mcu_table* entry_of(bushd_mcu* mcu, uint8_t bank) {
  return bank == BUSHD_SCRATCH_BANK ? &mcu->config.scratch->entry : &mcu->tables.bank[bank];
}

static void forget_scratch(bushd_mcu* mcu) {
  if (mcu->config.scratch != NULL) memset(mcu->config.scratch, 0, sizeof *mcu->config.scratch);
}

static void give_back(bushd_mcu* mcu, bushd_mcu_table* entry) {
  const uint16_t count = count_of(&entry->table);
  uint16_t* const codes = codes_of(mcu, &entry->table);
  const uint16_t* const end = codes + count;
  memmove(codes, end, (size_t)(mcu->config.codes + mcu->tables.codes_used - end) * sizeof *codes);
  mcu->tables.codes_used = (uint16_t)(mcu->tables.codes_used - count);
  for (uint8_t i = 0; i < BUSHD_TABLE_BANKS; ++i) {
    bushd_table* other = &mcu->tables.bank[i].table;
    if (other->accel.count == 0 || other->accel.code < end) continue;
    other->accel.code -= count;
    other->decel.code -= count;
  }
  memset(entry, 0, sizeof *entry);
}

static void forget_table(bushd_mcu* mcu, uint8_t bank) {
  bushd_mcu_table* entry = &mcu->tables.bank[bank];
  if (entry->table.accel.count != 0) give_back(mcu, entry);
  mcu->tables.valid &= (uint8_t)~bank_bit(bank);
  for (uint8_t m = 0; m < mcu->config.motors; ++m) {
    if (mcu->motor[m].table == (int8_t)bank) mcu->motor[m].table = -1;
  }
}

bushd_status bushd_mcu_take_table_begin(bushd_mcu* mcu, const bushd_table_begin* message) {
  if (!has_bank(mcu, message->bank)) return BUSHD_E_FORMAT;
  if (bushd_mcu_engaged(mcu) != 0) return BUSHD_E_STATE;
  forget_scratch(mcu);
  const bool kept = message->bank != BUSHD_SCRATCH_BANK;
  if (kept) forget_table(mcu, message->bank);
  bushd_mcu_table* entry = entry_of(mcu, message->bank);
  const uint32_t count = (uint32_t)message->accel_count + message->decel_count;
  if (count > (uint32_t)(mcu->config.code_count - mcu->tables.codes_used)) return BUSHD_E_CAPACITY;
  const bool symmetric = message->decel_count == 0;
  entry->table.accel.count = message->accel_count;
  entry->table.decel.count = symmetric ? message->accel_count : message->decel_count;
  entry->table.accel.code = mcu->config.codes + mcu->tables.codes_used;
  entry->table.decel.code = entry->table.accel.code + (symmetric ? 0 : message->accel_count);
  entry->table.cruise = message->cruise;
  entry->table.time_unit_ns = message->time_unit_ns;
  entry->revision = message->revision;
  entry->received = 0;
  if (kept) mcu->tables.codes_used = (uint16_t)(mcu->tables.codes_used + count);
  return BUSHD_OK;
}

bushd_status bushd_mcu_take_table_data(bushd_mcu* mcu, const bushd_table_data* message) {
  if (!has_bank(mcu, message->bank)) return BUSHD_E_FORMAT;
  bushd_mcu_table* entry = entry_of(mcu, message->bank);
  const uint32_t end = (uint32_t)message->offset + message->count;
  const bushd_table* table = &entry->table;
  // Pieces come in order; one that was sent again because its acknowledgement was lost is written
  // again.
  if (is_valid(mcu, message->bank) || end > count_of(table) || message->offset > entry->received) {
    return BUSHD_E_STATE;
  }
  uint16_t* to = codes_of(mcu, table) + message->offset;
  for (uint8_t i = 0; i < message->count; ++i) *to++ = bushd_get_u16(message->codes + 2u * i);
  if (end > entry->received) entry->received = (uint16_t)end;
  return BUSHD_OK;
}

bushd_status bushd_mcu_take_table_end(bushd_mcu* mcu, const bushd_table_end* message) {
  if (!has_bank(mcu, message->bank)) return BUSHD_E_FORMAT;
  bushd_mcu_table* entry = entry_of(mcu, message->bank);
  const uint16_t count = count_of(&entry->table);
  // Its acknowledgement was lost.
  if (is_valid(mcu, message->bank)) return entry->crc == message->crc ? BUSHD_OK : BUSHD_E_CRC;
  if (count == 0 || entry->received != count) return BUSHD_E_STATE;
  // The checks may take longer than a tick, and people may have moved a motor since TABLE_BEGIN.
  if (bushd_mcu_engaged(mcu) != 0) return BUSHD_E_STATE;
  const uint32_t crc = bushd_table_crc32(&entry->table);
  if (crc != message->crc) return BUSHD_E_CRC;
  bushd_status status = bushd_table_check(&entry->table, NULL, NULL);
#if BUSHD_PROGRAMS
  const bool unsorted = status == BUSHD_E_TABLE_UNSORTED;
  if (unsorted && message->bank == BUSHD_SCRATCH_BANK) {
    status = bushd_table_check_written(&entry->table);
    mcu->config.scratch->written = true;
  }
#endif
  if (status != BUSHD_OK) return status;
  entry->crc = crc;
  if (message->bank == BUSHD_SCRATCH_BANK) {
    mcu->config.scratch->valid = true;
  } else {
    mcu->tables.valid |= bank_bit(message->bank);
  }
  return BUSHD_OK;
}

const bushd_table* bushd_mcu_checked_table(const bushd_mcu* mcu, uint8_t bank) {
  if (!has_bank(mcu, bank) || !is_valid(mcu, bank)) return NULL;
  return bank == BUSHD_SCRATCH_BANK ? &mcu->config.scratch->entry.table
                                    : &mcu->tables.bank[bank].table;
}

bushd_status bushd_mcu_take_assign(bushd_mcu* mcu, const bushd_assign* message) {
  if (!bushd_mcu_has_output(mcu, message->motor)) return BUSHD_E_FORMAT;
  if (bushd_mcu_engaged(mcu) & motor_bit(message->motor)) return BUSHD_E_STATE;
  const bushd_mcu_table* entry = &mcu->tables.bank[message->bank];
  const bool configured = (mcu->flags & BUSHD_FLAG_CONFIGURED) != 0;
  if (!is_valid(mcu, message->bank) || !configured) return BUSHD_E_STATE;
  if (bushd_table_max_steps_per_tick(&entry->table, mcu->tick_ns) > mcu->emission.grid.max_steps) {
    return BUSHD_E_CAPACITY;
  }
  mcu->motor[message->motor].table = (int8_t)message->bank;
  return BUSHD_OK;
}

bushd_tables bushd_mcu_tables(const bushd_mcu* mcu) {
  bushd_tables tables;
  memset(&tables, 0, sizeof tables);
  for (uint8_t i = 0; i < BUSHD_TABLE_BANKS; ++i) {
    const bushd_mcu_table* entry = &mcu->tables.bank[i];
    if (!is_valid(mcu, i)) continue;
    tables.bank[i].valid = true;
    tables.bank[i].crc = entry->crc;
    tables.bank[i].revision = entry->revision;
  }
  return tables;
}

void bushd_mcu_forget_tables(bushd_mcu* mcu) {
  forget_scratch(mcu);
  memset(mcu->tables.bank, 0, sizeof mcu->tables.bank);
  mcu->tables.codes_used = 0;
  mcu->tables.valid = 0;
  for (uint8_t m = 0; m < mcu->config.motors; ++m) mcu->motor[m].table = -1;
}
