// Table memory.
#ifndef BUSHD_FIRMWARE_CORE_TABLES_H
#define BUSHD_FIRMWARE_CORE_TABLES_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "engine/message.h"
#include "engine/run_slots.h"
#include "engine/table.h"
#include "firmware/core/program.h"

typedef struct bushd_mcu bushd_mcu;

typedef struct bushd_mcu_table {
  uint32_t revision;
  union {
    uint32_t crc;       // of those in bushd_mcu.valid_tables
    uint16_t received;  // of others: codes of both sides that have come
  };
  bushd_table table;  // as announced; no codes: none
} bushd_mcu_table;

typedef struct bushd_mcu_table_memory {
  bushd_mcu_table bank[BUSHD_TABLE_BANKS];
  uint8_t valid;        // banks whose table has come whole, and is good
  uint16_t codes_used;  // of the port's table memory
} bushd_mcu_table_memory;

// The table in BUSHD_SCRATCH_BANK, by which no motor ramps down and lines may go; or codes as they
// are written (engine/table.h), by which one motor goes and ramps down by its own table. They lie
// behind those of all others, and are no part of what a port keeps over resets. Any TABLE_BEGIN
// discards them.
typedef struct bushd_mcu_scratch {
  bushd_mcu_table entry;
  bool valid;               // it has come whole, and is good
  bool written;             // it is codes as they are written
  bushd_run_tick run_tick;  // in its terms
} bushd_mcu_scratch;

// The one in this bank; NULL if none has come whole. Precondition: bank <= BUSHD_SCRATCH_BANK.
const bushd_table* bushd_mcu_checked_table(const bushd_mcu* mcu, uint8_t bank);
// Whether those in this bank are codes as they are written.
static inline bool bushd_mcu_is_written(const bushd_mcu_scratch* scratch, uint8_t bank) {
#if BUSHD_PROGRAMS
  return bank == BUSHD_SCRATCH_BANK && scratch != NULL && scratch->valid && scratch->written;
#else
  (void)scratch;
  (void)bank;
  return false;
#endif
}
bushd_tables bushd_mcu_tables(const bushd_mcu* mcu);
void bushd_mcu_forget_tables(bushd_mcu* mcu);

#endif
