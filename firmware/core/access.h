// What modules of the core read of the whole MCU in one line.
#ifndef BUSHD_FIRMWARE_CORE_ACCESS_H
#define BUSHD_FIRMWARE_CORE_ACCESS_H

#include "firmware/core/bits.h"
#include "firmware/core/mcu_state.h"

// The first tick that can still be changed: the next one is already prepared.
static inline uint32_t bushd_mcu_first_open(const bushd_mcu* mcu) {
  return mcu->tick + 2u;
}

// All that it has.
static inline uint16_t bushd_mcu_own_motors(const bushd_mcu* mcu) {
  return (uint16_t)(motor_bit((uint8_t)(mcu->config.motors - 1u)) * 2u - 1u);
}

// What reports tell in these sections (BUSHD_TELLS_*) may have changed.
static inline void bushd_mcu_tell(bushd_mcu* mcu, uint8_t sections) {
  mcu->reports.changed |= sections;
}

// With phases a motor has BUSHD_PHASE_OUTPUTS of the outputs.
static inline uint8_t bushd_mcu_motors_with_outputs(const bushd_mcu* mcu) {
  const bool phases = mcu->emission.grid.mode == BUSHD_EMISSION_PHASES;
  return phases ? (uint8_t)(mcu->config.motors / BUSHD_PHASE_OUTPUTS) : mcu->config.motors;
}
static inline bool bushd_mcu_has_output(const bushd_mcu* mcu, uint8_t motor) {
  return motor < bushd_mcu_motors_with_outputs(mcu);
}

// +1, -1: of its last step, or the one that DIR shows already.
static inline int8_t bushd_mcu_last_direction(const bushd_mcu* mcu, uint8_t m) {
  return mcu->direction & motor_bit(m) ? 1 : -1;
}

static inline int16_t* bushd_mcu_queue_at(bushd_mcu* mcu, uint32_t tick, uint8_t motor) {
  const uint16_t row = (uint16_t)tick & (uint16_t)(mcu->config.queue_ticks - 1u);
  return &mcu->config.queue[(size_t)row * mcu->config.motors + motor];
}

static inline const bushd_table* bushd_mcu_table_of(const bushd_mcu* mcu,
                                                    const bushd_mcu_motor* motor) {
  return &mcu->tables.bank[motor->table].table;
}

// Whether it makes runs with such a delay (BUSHD_CAN_SLOW_RUNS).
static inline bool bushd_mcu_runs_so_slowly(const bushd_mcu* mcu, bushd_delay delay) {
  return bushd_delay_is_code(delay) || !mcu->config.no_slow_runs;
}

// Motors that a program has, from its RUN until it has ended.
static inline uint16_t bushd_mcu_program_motors(const bushd_mcu* mcu) {
#if BUSHD_PROGRAMS
  return mcu->config.program != NULL ? mcu->config.program->motors : (uint16_t)0;
#else
  (void)mcu;
  return 0;
#endif
}
// Those of them that go on when no master is heard.
static inline uint16_t bushd_mcu_moved_without_host(const bushd_mcu* mcu) {
#if BUSHD_PROGRAMS
  const bushd_mcu_program* p = mcu->config.program;
  const bool alone = p != NULL && (p->program.flags & BUSHD_PROGRAM_WITHOUT_HOST) != 0;
  return alone ? p->motors : (uint16_t)0;
#else
  (void)mcu;
  return 0;
#endif
}

// Whether the program has this motor travel by what is in BUSHD_SCRATCH_BANK.
static inline bool bushd_mcu_travels_by_scratch(const bushd_mcu* mcu, uint8_t m) {
#if BUSHD_PROGRAMS
  const bushd_mcu_program* p = mcu->config.program;
  return p != NULL && (p->motors & p->frame.motors & motor_bit(m)) != 0 &&
         p->frame.kind == BUSHD_PROGRAM_TRAVEL && p->frame.bank == BUSHD_SCRATCH_BANK;
#else
  (void)mcu;
  (void)m;
  return false;
#endif
}

// Whether each step keeps the slot of its own time; if not, the emission makes the masks from the
// counts.
static inline bool bushd_mcu_steps_keep_slots(const bushd_mcu* mcu) {
  return mcu->emission.grid.mode == BUSHD_EMISSION_EVEN ||
         mcu->emission.grid.mode == BUSHD_EMISSION_PHASES;
}

#endif
