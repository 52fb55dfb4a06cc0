// All that an MCU knows from one tick to the next. A port gives it its memory, and looks into it by
// name only (firmware/ports/memory_names.h).
#ifndef BUSHD_FIRMWARE_CORE_MCU_STATE_H
#define BUSHD_FIRMWARE_CORE_MCU_STATE_H

#include "engine/frame.h"
#include "engine/message.h"
#include "engine/run_slots.h"
#include "firmware/core/mcu.h"

#ifdef __cplusplus
extern "C" {
#endif
#include "firmware/core/currents.h"
#include "firmware/core/emission.h"
#include "firmware/core/homing.h"
#include "firmware/core/limits.h"
#include "firmware/core/line_run.h"
#include "firmware/core/local.h"
#include "firmware/core/motor.h"
#include "firmware/core/position_compare.h"
#include "firmware/core/program.h"
#include "firmware/core/report.h"
#include "firmware/core/requests.h"
#include "firmware/core/slot_buffer.h"
#include "firmware/core/stream.h"
#include "firmware/core/sync.h"
#include "firmware/core/tables.h"
#include "firmware/core/travel.h"
#include "firmware/core/trigger.h"
#include "firmware/core/velocity.h"

// Read-only for ports and tests; everything in here is the core's, and each part its module's.
struct bushd_mcu {
  bushd_port port;
  bushd_mcu_config config;
  uint32_t tick;  // the tick being emitted
  uint32_t tick_ns;
  uint32_t uptime;  // ticks since boot, whatever their numbers
  uint8_t state;    // bushd_state
  uint8_t faults;
  uint8_t flags;
  uint8_t failed_tests;  // BUSHD_TEST_*
  bushd_format format;
  uint8_t front;  // slot_buffer[front] is being emitted
  uint16_t ramp_downs;
  uint16_t low_water_ticks;
  uint16_t direction;   // of the slot_buffer prepared last; 1: positive
  uint16_t autonomous;  // motors that move by homing, travel or local inputs
  uint16_t homed;
  bushd_run_tick run_tick[BUSHD_TABLE_BANKS];         // in the terms of each table
  bushd_set_inputs inputs;                            // settings
  bushd_mcu_switches switches[BUSHD_MOTORS_PER_MCU];  // settings
  bushd_mcu_stream stream;
  bushd_mcu_line line;
  bushd_mcu_reception reception;
  bushd_mcu_reports reports;
  bushd_mcu_limits limits;
  union {  // one of both at a time; the stage tells which
    bushd_mcu_homing homing;
    bushd_mcu_travel travel;
  };
  bushd_mcu_local local;
  bushd_mcu_clock clock;
  bushd_mcu_emission emission;
  bushd_mcu_trigger_input trigger;
  bushd_mcu_position_compare position_compare;
  bushd_slot_buffer slot_buffer[2];
  bushd_mcu_motor motor[BUSHD_MOTORS_PER_MCU];
  bushd_mcu_table_memory tables;
  bushd_receiver receiver;
  bushd_mcu_answer answer;
};

// Who may use the receiver's buffer. Nobody else writes to it until the owner is another one: rows
// of a frame that was taken are read from it, and an answer may be made at its end
// (bushd_mcu_config.reply). What a port does with an answer that it was handed is its own.
typedef enum bushd_mcu_buffer_owner {
  BUSHD_MCU_BUFFER_RECEIVER = 0,
  BUSHD_MCU_BUFFER_ROWS = 1,
  BUSHD_MCU_BUFFER_ANSWER = 2
} bushd_mcu_buffer_owner;
static inline bushd_mcu_buffer_owner bushd_mcu_owner_of_buffer(const bushd_mcu* mcu) {
  if (mcu->stream.rows.next < mcu->stream.rows.ticks.count) return BUSHD_MCU_BUFFER_ROWS;
  return mcu->answer.size != 0 ? BUSHD_MCU_BUFFER_ANSWER : BUSHD_MCU_BUFFER_RECEIVER;
}

#ifdef __cplusplus
}
#endif
#endif
