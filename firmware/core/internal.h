// Shared by the files of the core only.
#ifndef BUSHD_FIRMWARE_CORE_INTERNAL_H
#define BUSHD_FIRMWARE_CORE_INTERNAL_H

#include "firmware/core/mcu.h"

// The first tick that can still be changed: the next one is already prepared.
#define FIRST_OPEN(mcu) ((mcu)->tick + 2u)

// Tick numbers wrap (at 2.56 ms after 127 days); differences do not, as long as they are below
// 2^31.
static inline int32_t ticks_after(uint32_t tick, uint32_t reference) {
  return (int32_t)(tick - reference);
}

static inline uint16_t motor_bit(uint8_t motor) {
  return (uint16_t)(1u << motor);
}

static inline int16_t* queue_at(bushd_mcu* mcu, uint32_t tick, uint8_t motor) {
  const uint32_t row = tick & (uint32_t)(mcu->config.queue_ticks - 1u);
  return &mcu->config.queue[row * mcu->config.motors + motor];
}

// mcu.c
uint16_t bushd_mcu_moving(const bushd_mcu* mcu);
void bushd_mcu_update_state(bushd_mcu* mcu);

// stream.c: TICKS frames into the queue, and a motor's next displacement out of it.
bushd_status bushd_mcu_take_ticks(bushd_mcu* mcu, const bushd_ticks* ticks);
int16_t bushd_mcu_next_displacement(bushd_mcu* mcu, uint8_t motor, uint32_t tick);
void bushd_mcu_clear_streams(bushd_mcu* mcu);

// tables.c: table memory.
bushd_status bushd_mcu_table_begin(bushd_mcu* mcu, const bushd_table_begin* message);
bushd_status bushd_mcu_table_data(bushd_mcu* mcu, const bushd_table_data* message);
bushd_status bushd_mcu_table_end(bushd_mcu* mcu, const bushd_table_end* message);
bushd_status bushd_mcu_assign(bushd_mcu* mcu, const bushd_assign* message);

// sync.c: the tick counter against the bus's.
void bushd_mcu_sync(bushd_mcu* mcu, uint8_t tag, const bushd_sync* sync, uint32_t time_in_tick_ns);
void bushd_mcu_slew(bushd_mcu* mcu);  // at every tick boundary

#endif
