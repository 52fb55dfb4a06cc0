// Runs of a motor's own table.
#ifndef BUSHD_FIRMWARE_CORE_TABLE_RUN_H
#define BUSHD_FIRMWARE_CORE_TABLE_RUN_H

#include <stdbool.h>
#include <stdint.h>

#include "engine/message.h"
#include "engine/run_slots.h"
#include "firmware/core/motor.h"
#include "firmware/core/slot_buffer.h"

typedef struct bushd_mcu bushd_mcu;

// Into the motor's own run, which nothing reads as long as it is in a stream or at rest; nor its
// end: it holds how many ticks the run takes. `spare_ns`: by how much it may begin late and still
// be over then; less than a tick. False if its end is farther than tick numbers reach.
bool bushd_mcu_make_run(bushd_mcu* mcu, const bushd_table_run_entry* entry, uint32_t* spare_ns);
// How many ticks a run takes from its beginning.
bool bushd_mcu_ticks_of_run(const bushd_run* run, uint32_t tick_ns, uint32_t* ticks,
                            uint32_t* spare_ns);
// The tick in the terms of the table in this bank, or of that which its motor has for now.
const bushd_run_tick* bushd_mcu_run_tick_of(bushd_mcu* mcu, uint8_t bank, const bushd_table* table);
// The motor's run, just started, begins in this tick and takes as many.
void bushd_mcu_begin_run(bushd_mcu* mcu, uint8_t m, uint32_t first_tick, uint32_t ticks);
// Steps that a motor may make in this direction from the end of the tick that is emitted on before
// its position is beyond +-(2^31 - 1).
uint32_t bushd_mcu_steps_counted(const bushd_mcu* mcu, uint8_t m, int direction);
// A motor at rest begins a run of its table that nothing but its own end, a stop or the caller,
// whose mode it has, ends: it is `autonomous` until it rests. `shortest_delay`: as of
// bushd_run_start. Precondition: so many steps are counted.
void bushd_mcu_begin_by_itself(bushd_mcu* mcu, uint8_t m, uint32_t steps, int direction,
                               bushd_delay shortest_delay, bushd_mcu_mode mode);
// The next tick of these motors' own runs. Sets the motors' bits in the masks of their steps, or
// none if the emission decides where they lie.
void bushd_mcu_emit_runs(bushd_mcu* mcu, bushd_slot_buffer* slot_buffer, uint16_t motors);
// Ticks take the place of the rest of a run: they go on from the share of the running step that has
// passed.
void bushd_mcu_leave_run(bushd_mcu* mcu, uint8_t m);
// Ramps a motor in a run of its own down, by the shortest way that its table allows. One that was
// stopped otherwise since stays so.
void bushd_mcu_ramp_down_run(bushd_mcu* mcu, uint8_t m);

#endif
