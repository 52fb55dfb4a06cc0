// Messages of motion: time, ticks, table runs, homing (engine/message.h).
#ifndef BUSHD_ENGINE_MESSAGE_MOTION_H
#define BUSHD_ENGINE_MESSAGE_MOTION_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "engine/frame.h"
#include "engine/message_base.h"
#include "engine/run_state.h"
#include "engine/status.h"

#ifdef __cplusplus
extern "C" {
#endif

// The motor finds its switch by itself: fast by its table until the switch is active, slowly back
// until it is released, slowly towards it until it is active again; there it stands at
// `position_steps`. If it comes to a limit before, it looks for the switch on the other side, and
// still approaches it in `direction`. With `most_steps` 0: it gives that up, and ramps down.
#define BUSHD_HOME_UNIT_NS 10000u
typedef struct bushd_home {
  uint8_t motor;
  int8_t direction;            // towards the switch: +1, -1
  uint32_t most_steps;         // of the fast approach, below 2^31
  bushd_delay shortest_delay;  // no delay of it is shorter, units of the motor's table; 0: none
  uint32_t slow_steps;         // at most as many in each of the slow stages; 1 .. 2^31 - 1
  bushd_delay slow_delay;      // of a slow step, BUSHD_HOME_UNIT_NS; >= 1
  int32_t position_steps;
} bushd_home;

// What the MCU does for its last HOME, or what came of it.
typedef enum bushd_homing {
  BUSHD_HOMING_NONE = 0,  // since boot
  BUSHD_HOMING_FAST = 1,
  BUSHD_HOMING_RAMP_DOWN = 2,
  BUSHD_HOMING_BACK_OFF = 3,
  BUSHD_HOMING_APPROACH = 4,
  BUSHD_HOMING_DONE = 5,
  BUSHD_HOMING_NOT_FOUND = 6,  // by the fast approach
  BUSHD_HOMING_STUCK = 7,      // the switch was not released
  BUSHD_HOMING_LOST = 8,       // not found again by the slow approach
  BUSHD_HOMING_STOPPED = 9,    // by a fault, by silence, or because it was given up
  BUSHD_HOMING_LIMIT = 10      // by a limit that is not the switch, in a slow stage
} bushd_homing;

// Motors that people move at the MCU, by their tables: while its FORWARD or REVERSE input is
// active, or by its keypad. A key counts for `keypad_ticks` after it was heard last; 0: until the
// next one.
typedef struct bushd_local {
  uint16_t motors;
  uint16_t keypad;
  uint16_t keypad_ticks;
} bushd_local;

// Two-step synchronisation. `sync_id` identifies this SYNC; its time is the end of its frame. If
// `follows`, the time of `follow_up_id` was (sync_tick, sync_ns into that tick) of bus time.
typedef struct bushd_sync {
  uint16_t master;   // who sends this: two masters on one line have different ones
  uint32_t sync_id;  // never that of another SYNC of this master
  bool follows;
  uint32_t follow_up_id;
  uint32_t sync_tick;
  uint32_t sync_ns;
} bushd_sync;

enum {
  BUSHD_TICKS_FINE = 1 << 0,     // int16 displacements, else coarse bytes
  BUSHD_TICKS_REPLACE = 1 << 1,  // instead of all that its motors have queued from first_tick on
  BUSHD_TICKS_START = 1 << 2,    // its motors start from rest here; without it they must be moving
  BUSHD_TICKS_CRUISE = 1 << 3    // TABLE_TICKS: entries tell cruise delays (set by its encoder)
};

// Displacements of `count` ticks for the motors in `mask`. Only these motors are touched.
typedef struct bushd_ticks {
  uint8_t epoch;  // stream epoch; a replacement carries a later one than the MCU's: it opens it
  uint8_t flags;
  uint32_t first_tick;
  uint8_t count;                 // >= 1
  uint16_t mask;                 // != 0
  uint8_t motors;                // bits set in mask
  const uint8_t* delays;         // motors x 16 bit: running at the end, 0: at rest
  const uint8_t* displacements;  // count x motors, tick by tick, motors in rising order
} bushd_ticks;

// Bytes of a ticks payload before the arrays.
#define BUSHD_TICKS_HEADER 9u
// The most ticks of `motors` (1 .. BUSHD_MOTORS_PER_MCU) motors that one frame can carry.
uint8_t bushd_ticks_capacity(uint8_t motors, bool fine);

// The same displacements without sending them: for each motor the state of its run at the beginning
// of first_tick. The MCU expands `count` ticks of it by its own table, in the configured format,
// and has the displacements that the master's run gives.
typedef struct bushd_table_ticks {
  uint8_t epoch;
  uint8_t flags;  // BUSHD_TICKS_*, without BUSHD_TICKS_FINE
  uint32_t first_tick;
  uint16_t count;  // >= 1
  uint16_t mask;   // of the motors, in rising order; != 0
  const uint8_t* entries;
  uint16_t entries_size;
} bushd_table_ticks;
#define BUSHD_TABLE_TICKS_HEADER 8u
#define BUSHD_TABLE_TICKS_MAX_ENTRY 21u

// An entry of it. A motor that cruises throughout is told so in three bytes.
typedef struct bushd_table_ticks_entry {
  uint8_t motor;
  bushd_run_state state;
} bushd_table_ticks_entry;

// The whole move at once: from rest, at the beginning of first_tick, by the motor's own table.
// Steps fall exact to a slot.
typedef struct bushd_table_run {
  uint8_t epoch;
  uint32_t first_tick;
  uint8_t count;           // of entries, >= 1
  const uint8_t* entries;  // 5 bytes each, or 7 with a shortest delay, or 13
} bushd_table_run;
#define BUSHD_TABLE_RUN_HEADER 5u
#define BUSHD_TABLE_RUN_MAX_ENTRY 13u
typedef struct bushd_table_run_entry {
  uint8_t motor;
  uint8_t bank;                // of the table; must be the one assigned to the motor
  int8_t direction;            // +1, -1
  uint32_t steps;              // 1 .. 2^31 - 1
  bushd_delay shortest_delay;  // no delay is shorter, time units of the table; 0: none
} bushd_table_run_entry;

// The entry of a table run's or a trigger's at *at, which moves on to the next one.
bushd_table_run_entry bushd_next_table_run_entry(const uint8_t** at);

typedef enum bushd_edge {
  BUSHD_EDGE_NONE = 0,
  BUSHD_EDGE_RISING = 1,  // the input becomes active
  BUSHD_EDGE_FALLING = 2
} bushd_edge;

// Table runs from rest that an edge at the trigger input starts, all in the same slot: it begins
// BUSHD_TRIGGER_FIXED_TICKS ticks and delay_us after the edge. BUSHD_EDGE_NONE: none waits for it
// any more.
#define BUSHD_TRIGGER_FIXED_TICKS 3u
#define BUSHD_TRIGGER_MIN_DELAY_US 50u
#define BUSHD_TRIGGER_MAX_DELAY_US 1650000u
typedef struct bushd_trigger {
  uint8_t number;  // chosen by the master, 1..255: the same one again is the same frame again; 0:
                   // of BUSHD_EDGE_NONE
  bushd_edge edge;
  uint32_t delay_us;
  uint8_t count;           // of entries, >= 1; 0: of BUSHD_EDGE_NONE
  const uint8_t* entries;  // as in bushd_table_run
} bushd_trigger;

// What became of the last one.
typedef enum bushd_trigger_state {
  BUSHD_TRIGGER_NONE = 0,      // none since boot
  BUSHD_TRIGGER_ARMED = 1,     // waits for the edge
  BUSHD_TRIGGER_STARTED = 2,   // the edge came: the start is known
  BUSHD_TRIGGER_DISARMED = 3,  // on request
  BUSHD_TRIGGER_LATE = 4,      // the edge came, but was noticed too late to start in time
  BUSHD_TRIGGER_FAULT = 5,     // a fault was latched before the edge came
  BUSHD_TRIGGER_FORBIDDEN = 6  // the edge came, but a limit forbids the direction of one of them
} bushd_trigger_state;

// The motor goes from one of its limits to the other and back, by its table: at once, or whenever
// an edge at the trigger input has come, until it is given up. Or it makes one step, and its sensor
// has to become active.
typedef enum bushd_travel_kind {
  BUSHD_TRAVEL_NONE = 0,  // the motor is to give up; nothing else is told
  BUSHD_TRAVEL_STEP = 1,
  BUSHD_TRAVEL_LIMITS = 2
} bushd_travel_kind;
typedef struct bushd_travel {
  uint8_t number;  // as of bushd_trigger; 0: of BUSHD_TRAVEL_NONE
  bushd_travel_kind kind;
  uint8_t motor;
  int8_t direction;  // of the first run or the step: +1, -1
  bushd_edge edge;   // of BUSHD_TRAVEL_LIMITS; none: at once
  uint8_t sensor;    // input of BUSHD_TRAVEL_STEP, 0..15
  uint32_t steps;    // of either run, 1 .. 2^31 - 1; of BUSHD_TRAVEL_STEP 1
  // From the edge to the beginning of the first run; at least BUSHD_TRIGGER_FIXED_TICKS + 1 ticks.
  uint32_t delay_us;  // without an edge 0
  // From the edge, or without one from the last step of the first run, to the beginning of the
  // return, if the limit has been reached by then. Of a step: its sensor has so long.
  uint32_t wait_us;
} bushd_travel;
#define BUSHD_TRAVEL_MIN_WAIT_US 50u
#define BUSHD_TRAVEL_MAX_WAIT_US 1650000u

// What the MCU does for its last TRAVEL, or what came of it: in a report in place of bushd_homing.
typedef enum bushd_travel_stage {
  BUSHD_TRAVEL_STEPS = 16,         // makes its one step, or waits for the sensor
  BUSHD_TRAVEL_ARMED = 17,         // waits for the edge
  BUSHD_TRAVEL_DELAY = 18,         // the first run is to begin
  BUSHD_TRAVEL_RUN = 19,           // until its limit is active
  BUSHD_TRAVEL_RETURN_DELAY = 20,  // stands there
  BUSHD_TRAVEL_RETURN = 21,        // back, until its limit is active
  BUSHD_TRAVEL_DONE = 22,
  BUSHD_TRAVEL_NOT_SEEN = 23,     // by the sensor in time
  BUSHD_TRAVEL_EARLY = 24,        // its limit was active before the last step
  BUSHD_TRAVEL_NOT_REACHED = 25,  // its limit was not active after the last step
  BUSHD_TRAVEL_NOT_LEFT = 26,     // the other limit still was
  BUSHD_TRAVEL_STOPPED = 27       // by a fault, by silence, by a limit, or because it was given up
} bushd_travel_stage;

enum { BUSHD_ARRIVES_POSITIVE = 1 << 0, BUSHD_ARRIVES_NEGATIVE = 1 << 1 };

// A pulse at the position compare output, delay_us after the step with which the motor's counter
// arrives at the position.
#define BUSHD_POSITION_COMPARE_MAX_DELAY_US 1500000u
#define BUSHD_POSITION_COMPARE_MAX_WIDTH_US 1000000u
typedef struct bushd_position_compare {
  uint8_t motor;
  uint8_t arrivals;  // BUSHD_ARRIVES_*; 0: no pulses
  int32_t position_steps;
  uint32_t delay_us;
  uint32_t width_us;  // >= 1
} bushd_position_compare;

typedef enum bushd_stop_mode {
  BUSHD_STOP_RAMP = 0,
  BUSHD_STOP_IMMEDIATE = 1,
  BUSHD_STOP_DISABLE = 2  // immediately, and EN falls at once; of emergencies only
} bushd_stop_mode;
// All motors stop, within two ticks: by their tables' ramps, or without another step.
typedef struct bushd_emergency {
  bushd_stop_mode mode;
} bushd_emergency;

// Encoders return the payload's size. Preconditions are the ranges given above.
size_t bushd_encode_home(const bushd_home* message, uint8_t* payload);
size_t bushd_encode_local(const bushd_local* message, uint8_t* payload);
size_t bushd_encode_travel(const bushd_travel* message, uint8_t* payload);
size_t bushd_encode_sync(const bushd_sync* message, uint8_t* payload);
size_t bushd_encode_emergency(const bushd_emergency* message, uint8_t* payload);

// Writes header and delays of a ticks payload and returns where the displacements go; the caller
// writes count x motors of them there (bushd_put_i16 or plain bytes). `delays` has an entry per
// motor of the mask. The payload's size is that offset plus the displacements.
size_t bushd_encode_ticks_head(uint8_t epoch, uint8_t flags, uint32_t first_tick, uint8_t count,
                               uint16_t mask, const uint16_t* delays, uint8_t* payload);
// `entries` by rising motor. Precondition: they fit one frame
// (BUSHD_TABLE_TICKS_MAX_ENTRY bytes each at most).
size_t bushd_encode_table_ticks(uint8_t epoch, uint8_t flags, uint32_t first_tick, uint16_t count,
                                const bushd_table_ticks_entry* entries, uint8_t motors,
                                uint8_t* payload);
size_t bushd_encode_table_run(uint8_t epoch, uint32_t first_tick,
                              const bushd_table_run_entry* entries, uint8_t count,
                              uint8_t* payload);
size_t bushd_encode_trigger(uint8_t number, bushd_edge edge, uint32_t delay_us,
                            const bushd_table_run_entry* entries, uint8_t count, uint8_t* payload);
size_t bushd_encode_position_compare(const bushd_position_compare* message, uint8_t* payload);

// Decoders return BUSHD_OK, BUSHD_E_LENGTH or BUSHD_E_FORMAT.
bushd_status bushd_decode_home(const uint8_t* payload, size_t size, bushd_home* message);
bushd_status bushd_decode_local(const uint8_t* payload, size_t size, bushd_local* message);
bushd_status bushd_decode_travel(const uint8_t* payload, size_t size, bushd_travel* message);
bushd_status bushd_decode_emergency(const uint8_t* payload, size_t size, bushd_emergency* message);
bushd_status bushd_decode_sync(const uint8_t* payload, size_t size, bushd_sync* message);
bushd_status bushd_decode_ticks(const uint8_t* payload, size_t size, bushd_ticks* message);
bushd_status bushd_decode_table_ticks(const uint8_t* payload, size_t size,
                                      bushd_table_ticks* message);
// The next entry of a decoded message: moves `at` (0 at first) past it and returns true, or false
// behind the last one.
bool bushd_next_table_ticks_entry(const bushd_table_ticks* message, uint16_t* at,
                                  bushd_table_ticks_entry* entry);
bushd_status bushd_decode_table_run(const uint8_t* payload, size_t size, bushd_table_run* message);
bushd_status bushd_decode_trigger(const uint8_t* payload, size_t size, bushd_trigger* message);
bushd_status bushd_decode_position_compare(const uint8_t* payload, size_t size,
                                           bushd_position_compare* message);

#ifdef __cplusplus
}
#endif
#endif
