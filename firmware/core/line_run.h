// LINE_RUN: motors that follow one run along a straight line.
#ifndef BUSHD_FIRMWARE_CORE_LINE_RUN_H
#define BUSHD_FIRMWARE_CORE_LINE_RUN_H

#include <stdbool.h>
#include <stdint.h>

#include "engine/elementary.h"
#include "engine/message.h"
#include "engine/run.h"
#include "firmware/core/slot_buffer.h"

typedef struct bushd_mcu bushd_mcu;

// The run of the motors on the line: there is room for one. It stands at the first tick that is not
// prepared.
typedef struct bushd_mcu_line {
  uint16_t unplaced;  // of its motors, before it begins: their followers are still to be started
  uint16_t motors;  // on it: those whose bushd_mcu_on_line counts, as long as their mode is a run's
  uint8_t bank : 4;  // of its table
  bool waits : 1;  // for the trigger, if any motor does: it is those motors' and none is on it yet
  uint32_t longest;
  uint32_t step;  // of the line, that is under way, counted from 1
  uint32_t last;  // and where the run ends
  bushd_run run;
#if BUSHD_ELEMENTARY
  bushd_elementary elementary;  // by motors; of a line by the other law its sum is 0
#endif
} bushd_mcu_line;

// The same, but for what ticks and epochs ask of a master's frame: of a program, whose motors rest.
// `motors` are those of its entries. False: another line is under way, or it would take too long.
bool bushd_mcu_begin_line(bushd_mcu* mcu, const bushd_line_run* message, uint16_t motors);
#if BUSHD_ELEMENTARY
// Whether it makes lines by engine/elementary.h.
bool bushd_mcu_makes_elementary(const bushd_mcu* mcu);
#endif
// Whether lines can go by the table in this bank, so fast.
bushd_status bushd_mcu_check_line_table(const bushd_mcu* mcu, uint8_t bank,
                                        uint16_t shortest_delay);
// Holds a line of motors at rest for the trigger (trigger.c): all is ready but its beginning.
// Returns the motors.
bushd_status bushd_mcu_hold_line(bushd_mcu* mcu, const bushd_line_part* part, uint16_t* motors);
// It has come: these begin, `ns` after the beginning of that tick.
void bushd_mcu_begin_held_line(bushd_mcu* mcu, uint16_t motors, uint32_t first_tick, uint32_t ns);
// One of its motors that is not placed is; false if there is none. Two divisions, or three.
bool bushd_mcu_place_on_line(bushd_mcu* mcu);
// The next tick of the run, and what these motors make of it.
void bushd_mcu_emit_line(bushd_mcu* mcu, bushd_slot_buffer* slot_buffer, uint16_t motors);
// All that are on the line and have begun it ramp down along it; one that goes by codes as they are
// written, by its own table. Returns those that were to go on.
// Their queues are still to be cut.
uint16_t bushd_mcu_ramp_down_line(bushd_mcu* mcu);
// One of them leaves the line and ramps down by its own table; the others do not wait for it.
void bushd_mcu_ramp_down_from_line(bushd_mcu* mcu, uint8_t m);
// A motor leaves the line where it is, as a stream would have left it there. No division of more
// than 32 bits.
void bushd_mcu_leave_line(bushd_mcu* mcu, uint8_t m);
// The delay of its running step, in time units of its own table, rounded up; 0: it has made its
// last step.
uint16_t bushd_mcu_line_delay(const bushd_mcu* mcu, uint8_t m);
// In the first tick of its run.
void bushd_mcu_line_begins(bushd_mcu* mcu, uint32_t tick);
// If no SYNC tells the time, the line is ramped down from this tick on.
uint32_t bushd_mcu_line_deadline(const bushd_mcu* mcu);
// The direction of a motor in a run, by itself or on a line.
int8_t bushd_mcu_run_direction(const bushd_mcu* mcu, uint8_t m);

#endif
