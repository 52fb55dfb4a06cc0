// What outlives a reset, if the port keeps it: tables, who runs which, and settings.
#include "firmware/core/nvm.h"

#include "firmware/core/access.h"
#include "firmware/core/assertion.h"
#include "firmware/core/emission.h"
#include "firmware/core/inputs.h"

#define QUIET_TICKS 512u

static bushd_mcu_nvm_region piece_of(void* at, size_t size) {
  const bushd_mcu_nvm_region piece = {at, (uint16_t)size};
  return piece;
}

static bushd_mcu_nvm_region program_piece(bushd_mcu* mcu, uint8_t index) {
#if BUSHD_PROGRAMS
  bushd_mcu_program* const program = mcu->config.program;
  if (program != NULL && mcu->config.keeps_programs) {
    if (index == 0) return piece_of(&program->kept_bytes, sizeof program->kept_bytes);
    const bool fits = program->kept_bytes <= program->memory;
    if (index == 1) return piece_of(program->bytes, fits ? program->kept_bytes : 0);
  }
#else
  (void)mcu;
  (void)index;
#endif
  return piece_of(NULL, 0);
}

// Behind all else: what only some motors have, and the program.
static bushd_mcu_nvm_region setting_of_motor(bushd_mcu* mcu, uint8_t index) {
  if (index < mcu->config.current_motors) {
    bushd_currents* const its = &mcu->config.currents[index].settings;
    return piece_of(its, sizeof *its);
  }
  index = (uint8_t)(index - mcu->config.current_motors);
  if (index < mcu->config.velocity_motors) {
    bushd_mcu_velocity_settings* const its = &mcu->config.velocity[index].settings;
    return piece_of(its, sizeof *its);
  }
  return program_piece(mcu, (uint8_t)(index - mcu->config.velocity_motors));
}

bushd_mcu_nvm_region bushd_mcu_nvm_region_at(bushd_mcu* mcu, uint8_t index) {
  enum {
    OUTPUTS,
    TICK,
    FORMAT,
    INPUTS,
    SWITCHES,
    EMISSION,
    LOCAL,
    TABLES,
    VALID_TABLES,
    CODES_USED,
    CODES,
    MOTORS
  };
  switch (index) {
    case OUTPUTS:
      return piece_of(&mcu->config.outputs, sizeof mcu->config.outputs);
    case TICK:
      return piece_of(&mcu->tick_ns, sizeof mcu->tick_ns);
    case FORMAT:
      return piece_of(&mcu->format, sizeof mcu->format);
    case INPUTS:
      return piece_of(&mcu->inputs, sizeof mcu->inputs);
    case SWITCHES:
      return piece_of(mcu->switches, sizeof mcu->switches);
    case EMISSION:
      return piece_of(&mcu->emission.settings, sizeof mcu->emission.settings);
    case LOCAL:
      return piece_of(&mcu->local.settings, sizeof mcu->local.settings);
    case TABLES:
      return piece_of(mcu->tables.bank, sizeof mcu->tables.bank);
    case VALID_TABLES:
      return piece_of(&mcu->tables.valid, sizeof mcu->tables.valid);
    case CODES_USED:
      return piece_of(&mcu->tables.codes_used, sizeof mcu->tables.codes_used);
    case CODES:
      return piece_of(mcu->config.codes, mcu->tables.codes_used * sizeof mcu->config.codes[0]);
    default: {
      uint8_t motor = (uint8_t)(index - MOTORS);
      if (motor >= mcu->config.motors) {
        return setting_of_motor(mcu, (uint8_t)(motor - mcu->config.motors));
      }
      return piece_of(&mcu->motor[motor].table, sizeof mcu->motor[motor].table);
    }
  }
}

void bushd_mcu_nvm_restored(bushd_mcu* mcu) {
  bushd_mcu_begin_inputs(mcu);
  bushd_mcu_restore_emission(mcu);
  mcu->port.set_tick(mcu->port.context, mcu->tick_ns);
#if BUSHD_PROGRAMS
  bushd_mcu_restore_program(mcu);
#endif
}

void bushd_mcu_nvm_compared(bushd_mcu* mcu, bool same) {
#if BUSHD_PROGRAMS
  bushd_mcu_program_compared(mcu, same);
#else
  (void)mcu;
  (void)same;
#endif
}

static inline size_t most_bytes(const bushd_mcu* mcu) {
  size_t bytes = BUSHD_MCU_NVM_MAX_BYTES(mcu->config.code_count);
#if BUSHD_PROGRAMS
  const bushd_mcu_program* const program = mcu->config.program;
  if (program != NULL) bytes += BUSHD_MCU_NVM_PROGRAM_BYTES(program->memory);
#endif
  return bytes;
}

void bushd_mcu_nvm_begin_scan(bushd_mcu_nvm_scan* scan) {
  scan->index = 0;
  scan->offset = scan->size = 0;
  scan->crc = BUSHD_CRC32_START;
}

bushd_mcu_nvm_region bushd_mcu_nvm_scan_next(bushd_mcu* mcu, bushd_mcu_nvm_scan* scan,
                                             uint16_t most) {
  bushd_mcu_nvm_region piece = bushd_mcu_nvm_region_at(mcu, scan->index);
  while (piece.at != NULL && scan->offset >= piece.size) {
    piece = bushd_mcu_nvm_region_at(mcu, ++scan->index);
    scan->offset = 0;
  }
  if (piece.at == NULL) return piece;
  BUSHD_ASSERT(scan->offset < piece.size);
  BUSHD_ASSERT(scan->size < most_bytes(mcu));
  const uint16_t left = (uint16_t)(piece.size - scan->offset);
  const bushd_mcu_nvm_region bytes = {(uint8_t*)piece.at + scan->offset, left < most ? left : most};
  scan->offset = (uint16_t)(scan->offset + bytes.size);
  scan->size = (uint16_t)(scan->size + bytes.size);
  scan->crc = bushd_crc32(scan->crc, bytes.at, bytes.size);
  return bytes;
}

bool bushd_mcu_nvm_is_quiet(const bushd_mcu* mcu, bushd_mcu_nvm_scan* scan) {
  if (scan->crc != scan->crc_before) scan->same_uptime = (uint16_t)mcu->uptime;
  scan->crc_before = scan->crc;
  if (mcu->local.configuring) return false;
  return (uint16_t)((uint16_t)mcu->uptime - scan->same_uptime) >= QUIET_TICKS;
}
