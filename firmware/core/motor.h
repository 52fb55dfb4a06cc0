// What a motor does, tick by tick.
#ifndef BUSHD_FIRMWARE_CORE_MOTOR_H
#define BUSHD_FIRMWARE_CORE_MOTOR_H

#include <stdbool.h>
#include <stdint.h>

#include "engine/line_follower.h"
#include "engine/run.h"
#include "firmware/core/slot_buffer.h"

typedef struct bushd_mcu bushd_mcu;

// What it does; whose it is meanwhile, owner.h tells.
typedef enum bushd_mcu_mode {
  BUSHD_MCU_STREAM = 0,     // the queue decides
  BUSHD_MCU_RUN_WAITS = 1,  // so it does until its start, then a table run follows
  BUSHD_MCU_TABLE_RUN = 2,  // of its own table, or that of a line
  BUSHD_MCU_RAMP_DOWN = 3,
  // `run` is made, whatever its stage, until these end it:
  BUSHD_MCU_HOMING = 4,
  BUSHD_MCU_TRAVEL = 5,
  BUSHD_MCU_LOCAL = 6,    // local inputs
  BUSHD_MCU_VELOCITY = 7  // local inputs by the velocity loop (velocity.h), until it is at rest
} bushd_mcu_mode;

#define BUSHD_MCU_SELDOM 0x8000u  // of bushd_mcu_motor.displacement

// Ticks that are queued beyond a gap.
typedef struct bushd_mcu_out_of_order {
  uint32_t from;
  uint32_t until;
  uint16_t delay;  // of the running step at `until`
} bushd_mcu_out_of_order;

// A run that waits or is made.
typedef struct bushd_mcu_made {
  uint32_t until;  // the end of a table run, or where ticks replace it
  bushd_run run;   // stands at the first tick that is not prepared
} bushd_mcu_made;

// The motor's part of the line's run (bushd_mcu.line).
typedef struct bushd_mcu_on_line {
  uint32_t until;  // as of bushd_mcu_made
  bushd_line_follower follower;
  uint16_t share;  // N / L x 2^16, rounded down
  int8_t direction;
} bushd_mcu_on_line;

// The last start taken, while it is still to come. A small MCU has no room for whole tick numbers;
// such as are not far (near_tick) are told by their low bits.
typedef struct bushd_mcu_start {
  uint16_t rest_from;  // at rest from here to `tick`
  uint16_t tick;
} bushd_mcu_start;

typedef struct bushd_mcu_motor {
  int32_t position_steps;     // until the start of the present tick
  int16_t remainder;          // exact position minus steps made, 1/256 step
  int8_t table;               // table bank, -1: none
  uint8_t mode : 3;           // bushd_mcu_mode
  bool exact : 1;             // `run` is emitted exact to a slot, not by displacements
  bool has_out_of_order : 1;  // only in a stream
  uint16_t delay;             // of the running step when the queued ticks end; 0: at rest there
  // The last one that was not 0, unsigned; in the fine format only. Where it is 1 and ticks of 0
  // came before it: BUSHD_MCU_SELDOM and in how many ticks it was the first, up to 256.
  uint16_t displacement;
  uint8_t still_ticks;  // made since; saturates
  union {
    bushd_mcu_start start;  // of those in bushd_mcu.starting
    uint32_t spare_ns;      // of armed ones (bushd_mcu_make_run)
  };
  uint32_t known_until;  // first tick for which nothing is decided; always > tick + 1 once prepared
  // Memory is short: there is no out-of-order range while a run waits or is made.
  union {
    bushd_mcu_out_of_order out_of_order;
    bushd_mcu_made made;
    bushd_mcu_on_line on_line;  // of those in bushd_mcu.line.motors, in place of `made.run`
  };
} bushd_mcu_motor;

// Makes the queue_summary from this tick on, the first that is not prepared.
void bushd_mcu_summarise_queue(bushd_mcu* mcu, uint32_t tick);
// What all motors do in the tick that is prepared.
void bushd_mcu_emit(bushd_mcu* mcu, bushd_slot_buffer* slot_buffer);

// A tick's row leaves the queue: of all motors, in 1/256 step or, if all are whole, in steps. A
// small MCU may link the second of its own (BUSHD_OWN_COARSE_ROWS).
typedef struct bushd_mcu_row {
  uint16_t moves;  // motors with other than 0
  uint16_t back;   // with less than 0
} bushd_mcu_row;
void bushd_mcu_take_fine_row(int16_t* queued, int16_t* displacement, uint8_t motors,
                             bushd_mcu_row* row);
void bushd_mcu_take_coarse_row(int16_t* queued, int16_t* steps, uint8_t motors, bushd_mcu_row* row);

// Adds its steps to the counter of each motor; the counters lie `stride` bytes apart. A small MCU
// may link one of its own (BUSHD_OWN_ADD_STEPS).
void bushd_mcu_add_steps(int32_t* counter, size_t stride, const int16_t* steps, uint8_t motors);

#endif
