// The messages of the bus: what the payloads of frames mean. docs/protocol.md is the normative
// text. All numbers are little-endian. Every decode checks length and ranges of what it reads, so
// that a decoded struct can be used without further checks; encoders need BUSHD_FRAME_MAX_PAYLOAD
// bytes.
#ifndef BUSHD_ENGINE_MESSAGE_H
#define BUSHD_ENGINE_MESSAGE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "engine/frame.h"
#include "engine/run_state.h"
#include "engine/status.h"

#ifdef __cplusplus
extern "C" {
#endif

#define BUSHD_PROTOCOL_VERSION 3u
#define BUSHD_MOTORS_PER_MCU 16u
#define BUSHD_TABLE_SLOTS 8u
#define BUSHD_MIN_TICK_NS 200000u
#define BUSHD_MAX_TICK_NS 20000000u
#define BUSHD_UNIQUE_ID_SIZE 8u
#define BUSHD_REPLY_UNIT_NS 10000u  // of times at which an answer shall begin

typedef enum bushd_type {
  BUSHD_MSG_IDENTIFY = 0x01,      // bushd_identify -> reply: bushd_identity, in a slot
  BUSHD_MSG_CONFIGURE = 0x02,     // bushd_configure -> acknowledgement
  BUSHD_MSG_TABLE_BEGIN = 0x03,   // bushd_table_begin -> acknowledgement
  BUSHD_MSG_TABLE_DATA = 0x04,    // bushd_table_data -> acknowledgement
  BUSHD_MSG_TABLE_END = 0x05,     // bushd_table_end -> acknowledgement
  BUSHD_MSG_ASSIGN = 0x06,        // bushd_assign -> acknowledgement
  BUSHD_MSG_CONTROL = 0x07,       // bushd_control -> acknowledgement
  BUSHD_MSG_SET_POSITION = 0x08,  // bushd_set_position -> acknowledgement
  BUSHD_MSG_POLL = 0x09,          // bushd_poll, broadcast -> a bushd_report of each MCU it names
  BUSHD_MSG_SYNC = 0x0A,          // bushd_sync, broadcast, no reply; the frame's end is a time mark
  BUSHD_MSG_TICKS = 0x0B,         // bushd_ticks, no reply: its effect shows in the next report
  BUSHD_MSG_TABLE_TICKS = 0x0C,   // bushd_table_ticks, no reply
  BUSHD_MSG_TABLE_RUN = 0x0D,     // bushd_table_run, no reply
  BUSHD_MSG_EMERGENCY = 0x0E,     // bushd_emergency, no reply
  BUSHD_MSG_SET_ADDRESS = 0x0F,   // bushd_set_address, broadcast -> acknowledgement of the one MCU
  BUSHD_MSG_TABLES = 0x10,        // empty -> reply: bushd_tables
  BUSHD_MSG_INPUTS = 0x11,        // bushd_set_inputs -> acknowledgement
  BUSHD_MSG_EMISSION = 0x12,      // bushd_emission -> acknowledgement
  BUSHD_MSG_HOME = 0x13,          // bushd_home -> acknowledgement; how it goes is told by reports
  BUSHD_MSG_LOCAL = 0x14,         // bushd_local -> acknowledgement
  BUSHD_MSG_TRIGGER = 0x15,       // bushd_trigger -> acknowledgement
  BUSHD_MSG_REFERENCE = 0x16      // bushd_reference -> acknowledgement
} bushd_type;
// A reply has the request's type with BUSHD_TYPE_REPLY set, its tag and the MCU's address.

typedef enum bushd_state {
  // Takes no moves yet: not configured, not in step with the bus, or EN is low.
  BUSHD_STATE_BUSY = 0,
  BUSHD_STATE_READY = 1,  // all motors at rest
  BUSHD_STATE_RUN = 2,    // a motor moves
  BUSHD_STATE_FAULT = 3   // a fault is latched
} bushd_state;

enum {
  BUSHD_FAULT_SELF_TEST = 1 << 0,  // boot self-test failed; only a reboot clears it
  BUSHD_FAULT_LINK = 1 << 1,       // the queue ended while a motor moved; it ran down its own table
  BUSHD_FAULT_SYNC = 1 << 2,       // the tick counter differs from the bus by more than it may
  BUSHD_FAULT_EMERGENCY = 1 << 3,  // an emergency stop was commanded
  BUSHD_FAULT_EMERGENCY_INPUT = 1 << 4,  // the emergency input was active
  BUSHD_FAULT_OVERCURRENT = 1 << 5,      // the supply current was above its threshold; EN is low
  BUSHD_FAULT_EEPROM = 1 << 6  // what it keeps was unreadable at boot: defaults are in use
};

enum {
  BUSHD_FLAG_ENABLED = 1 << 0,     // EN is high
  BUSHD_FLAG_SYNCED = 1 << 1,      // the tick counter is the bus's
  BUSHD_FLAG_CONFIGURED = 1 << 2,  // tick and format are set
  BUSHD_FLAG_MARK = 1 << 3,        // mark_* of the report are valid
  BUSHD_FLAG_TWO_MASTERS = 1 << 4  // SYNC frames of two masters come by turns
};

// Inputs that are not a motor's.
enum {
  BUSHD_INPUT_EMERGENCY = 1 << 0,
  BUSHD_INPUT_FORWARD = 1 << 1,
  BUSHD_INPUT_REVERSE = 1 << 2,
  BUSHD_INPUT_TRIGGER = 1 << 3
};
#define BUSHD_SYSTEM_INPUTS 0x0Fu  // all of them

// Why an MCU booted.
typedef enum bushd_reset_cause {
  BUSHD_RESET_UNKNOWN = 0,
  BUSHD_RESET_POWER_ON = 1,
  BUSHD_RESET_EXTERNAL = 2,
  BUSHD_RESET_BROWN_OUT = 3,
  BUSHD_RESET_WATCHDOG = 4
} bushd_reset_cause;

// What a self-test at boot found wrong.
enum {
  BUSHD_TEST_RAM = 1 << 0,
  BUSHD_TEST_FLASH = 1 << 1,   // CRC of the program
  BUSHD_TEST_EEPROM = 1 << 2,  // CRC of what it keeps
  BUSHD_TEST_INPUTS = 1 << 3,  // pins that do not follow their pull-ups
  BUSHD_TEST_ENGINE = 1 << 4   // answers that are known
};

typedef enum bushd_format { BUSHD_FORMAT_COARSE = 0, BUSHD_FORMAT_FINE = 1 } bushd_format;

// Asks for identities; the one request that may be broadcast and is answered all the same. To keep
// apart MCUs that have the same address (or all of them, on a broadcast) each answers in one of
// `slots` reply slots, chosen by bushd_identify_slot: slot i begins i x slot_units after this
// frame's end, in BUSHD_REPLY_UNIT_NS.
typedef struct bushd_identify {
  uint16_t salt;
  uint8_t slots;  // >= 1
  uint16_t slot_units;
} bushd_identify;
// Two MCUs that share a slot are apart after a few other salts.
uint8_t bushd_identify_slot(const uint8_t* unique_id, uint16_t salt, uint8_t slots);

enum {
  BUSHD_CAN_COARSE = 1 << 0,
  BUSHD_CAN_FINE = 1 << 1,
  BUSHD_CAN_TABLE_TICKS = 1 << 2,
  BUSHD_CAN_TABLE_RUN = 1 << 3,
  BUSHD_CAN_HOME = 1 << 4,
  BUSHD_CAN_LOCAL = 1 << 5,
  BUSHD_CAN_TRIGGER = 1 << 6,    // has a trigger input
  BUSHD_CAN_REFERENCE = 1 << 7,  // has a reference output
  // Emission other than even.
  BUSHD_CAN_BURST = 1 << 8,
  BUSHD_CAN_COMMON_DIR = 1 << 9,
  BUSHD_CAN_STAGGERED = 1 << 10,
  BUSHD_CAN_PHASES = 1 << 11
};

// Of another protocol version only `protocol_version` is decoded, the rest is zero: enough to say
// which one it is.
typedef struct bushd_identity {
  uint8_t protocol_version;
  uint8_t motors;  // outputs 0 .. motors-1, at most BUSHD_MOTORS_PER_MCU
  uint16_t firmware_version;
  uint16_t boot_number;   // changes at every boot
  uint16_t slots;         // slots per tick
  uint16_t queue_ticks;   // depth of the tick queue
  uint16_t table_codes;   // table memory, in codes of 16 bits
  uint16_t capabilities;  // BUSHD_CAN_*
  uint8_t unique_id[BUSHD_UNIQUE_ID_SIZE];
} bushd_identity;

// The MCU with this unique id answers to `address` from now on, and after its next boots.
typedef struct bushd_set_address {
  uint8_t unique_id[BUSHD_UNIQUE_ID_SIZE];
  uint8_t address;  // 1..255
} bushd_set_address;

typedef struct bushd_configure {
  uint32_t tick_ns;  // BUSHD_MIN_TICK_NS .. BUSHD_MAX_TICK_NS
  bushd_format format;
  uint16_t silence_ticks;  // >= 1: table runs are run down after as many without a good frame
} bushd_configure;

// How steps get to the pins (engine/emission.h).
typedef enum bushd_emission_mode {
  BUSHD_EMISSION_EVEN = 0,        // each step in the slot of its time
  BUSHD_EMISSION_BURST = 1,       // all motors together, each T_step
  BUSHD_EMISSION_COMMON_DIR = 2,  // one DIR for all: each T_step those to the left, then the others
  BUSHD_EMISSION_STAGGERED = 3,   // one after the other, each T_step
  BUSHD_EMISSION_PHASES = 4       // four levels a motor instead of STEP and DIR
} bushd_emission_mode;

typedef enum bushd_phase_sequence {
  BUSHD_PHASES_WAVE = 0,  // 4-beat, one winding on
  BUSHD_PHASES_FULL = 1,  // 4-beat, two on
  BUSHD_PHASES_HALF = 2,  // 8-beat
  BUSHD_PHASES_THREE = 3  // three windings, 6-beat
} bushd_phase_sequence;

#define BUSHD_PHASE_OUTPUTS 4u  // motor m has the outputs 4m .. 4m+3

typedef struct bushd_emission {
  uint8_t mode;           // bushd_emission_mode
  uint8_t sequence;       // bushd_phase_sequence, of phases
  bool hold_current;      // of phases: windings stay on at rest
  uint16_t step_us;       // T_step, of burst, common-dir and staggered; >= 1 there
  uint16_t settle_us;     // dt_p, of staggered; 0: the MCU measures it
  uint16_t dir_setup_us;  // DIR changes as long before a step at least
  uint16_t pulse_us;      // a STEP pulse lasts as long at least
} bushd_emission;

// A table is sent as: begin, data (accelerating side, then decelerating side unless it is the
// same), end. `slot` 0 .. BUSHD_TABLE_SLOTS-1. Codes run from slow to fast on both sides.
typedef struct bushd_table_begin {
  uint8_t slot;
  uint16_t accel_count;
  uint16_t decel_count;  // 0: the decelerating side is the accelerating one
  uint16_t cruise;
  uint32_t time_unit_ns;
  uint32_t revision;  // of the table, as its file has it; told back by bushd_tables
} bushd_table_begin;

#define BUSHD_TABLE_DATA_MAX_CODES 120u
typedef struct bushd_table_data {
  uint8_t slot;
  uint16_t offset;       // of the first code, counted over both sides
  uint8_t count;         // 1 .. BUSHD_TABLE_DATA_MAX_CODES
  const uint8_t* codes;  // count little-endian 16-bit codes, unaligned
} bushd_table_data;

typedef struct bushd_table_end {
  uint8_t slot;
  uint32_t crc;  // bushd_table_crc32 (engine/table.h) of the whole table
} bushd_table_end;

// What an MCU holds, by table slot.
typedef struct bushd_table_held {
  bool valid;
  uint32_t crc;
  uint32_t revision;
} bushd_table_held;
typedef struct bushd_tables {
  bushd_table_held slot[BUSHD_TABLE_SLOTS];
} bushd_tables;

typedef struct bushd_assign {
  uint8_t motor;
  uint8_t slot;
} bushd_assign;

enum {
  BUSHD_CONTROL_ENABLE = 1 << 0,        // EN high
  BUSHD_CONTROL_DISABLE = 1 << 1,       // EN low; refused while a motor moves
  BUSHD_CONTROL_CLEAR_FAULTS = 1 << 2,  // refused while a motor moves
  BUSHD_CONTROL_FORGET_TABLES = 1 << 3  // all of them; refused while a motor moves
};
typedef struct bushd_control {
  uint8_t actions;
} bushd_control;

typedef struct bushd_set_position {
  uint8_t motor;  // at rest
  int32_t position_steps;
} bushd_set_position;

// What the MCU does when a limit switch or the emergency input is active.
enum {
  BUSHD_EMERGENCY_INPUT_IGNORED = 0,
  BUSHD_EMERGENCY_INPUT_RAMPS = 1,
  BUSHD_EMERGENCY_INPUT_CUTS = 2
};
#define BUSHD_MAX_DEBOUNCE_TICKS 15u
#define BUSHD_MAX_CURRENT 1023u
typedef struct bushd_set_inputs {
  // Motors whose input is a limit switch at this end of their travel. In both masks: one input for
  // both ends.
  uint16_t limit_positive;
  uint16_t limit_negative;
  uint16_t limit_cuts;     // motors that stop at a limit without another step; the others ramp down
  uint16_t inverted;       // motors whose input is active when the port calls it inactive
  uint8_t debounce_ticks;  // a motor's input counts once it has stayed for as many more ticks
  uint8_t system_inverted;     // as `inverted`, of BUSHD_INPUT_*
  uint8_t emergency;           // BUSHD_EMERGENCY_INPUT_*
  uint16_t overcurrent;        // EN falls above this reading; 0: never
  bool enable_after_watchdog;  // EN as it was before a watchdog reset; else low
} bushd_set_inputs;

// The motor finds its switch by itself: fast by its table until the switch is active, slowly back
// until it is released, slowly towards it until it is active again; there it stands at
// `position_steps`. With `most_steps` 0: it gives that up, and ramps down.
#define BUSHD_HOME_UNIT_NS 10000u
typedef struct bushd_home {
  uint8_t motor;
  int8_t direction;     // towards the switch: +1, -1
  uint32_t most_steps;  // of the fast approach, below 2^31
  uint32_t slow_steps;  // at most as many in each of the slow stages; 1 .. 2^31 - 1
  uint16_t slow_delay;  // of a slow step, BUSHD_HOME_UNIT_NS; >= 1
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
  BUSHD_HOMING_STOPPED = 9     // by a fault, by silence, or because it was given up
} bushd_homing;

// Motors that the MCU's FORWARD and REVERSE inputs move, by their tables, while one of them is
// active.
typedef struct bushd_local {
  uint16_t motors;
} bushd_local;

// Asks `count` MCUs for reports, each in a reply slot of its own: entry i (bushd_poll_entry) names
// an address and when, after this frame's end, its answer begins.
#define BUSHD_POLL_MAX_ENTRIES ((BUSHD_FRAME_MAX_PAYLOAD - 1u) / 3u)
typedef struct bushd_poll_entry {
  uint8_t address;
  uint16_t begin_units;  // BUSHD_REPLY_UNIT_NS
} bushd_poll_entry;
typedef struct bushd_poll {
  uint8_t count;           // >= 1
  const uint8_t* entries;  // count x 3 bytes
} bushd_poll;
// The entry with this address, if there is one.
bool bushd_poll_find(const bushd_poll* poll, uint8_t address, bushd_poll_entry* entry);

// Two-step time reference. The end of this frame is a mark named `mark`. If `follows`, the mark
// named `known_mark` lay at (mark_tick, mark_ns into that tick) of bus time.
typedef struct bushd_sync {
  uint16_t master;  // who sends this: two masters on one line have different ones
  uint32_t mark;    // never the name of another mark of this master
  bool follows;
  uint32_t known_mark;
  uint32_t mark_tick;
  uint32_t mark_ns;
} bushd_sync;

enum {
  BUSHD_TICKS_FINE = 1 << 0,     // int16 displacements, else coarse bytes
  BUSHD_TICKS_REPLACE = 1 << 1,  // instead of all that its motors have queued from first_tick on
  BUSHD_TICKS_START = 1 << 2     // its motors start from rest here; without it they must be moving
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
  uint8_t flags;  // as in bushd_ticks, without BUSHD_TICKS_FINE
  uint32_t first_tick;
  uint16_t count;  // >= 1
  uint16_t mask;   // of the motors, in rising order; != 0
  const uint8_t* entries;
  uint16_t entries_size;
} bushd_table_ticks;
#define BUSHD_TABLE_TICKS_HEADER 8u
#define BUSHD_TABLE_TICKS_MAX_ENTRY 19u

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
  const uint8_t* entries;  // count x 5 bytes
} bushd_table_run;
#define BUSHD_TABLE_RUN_HEADER 5u
#define BUSHD_TABLE_RUN_ENTRY 5u
typedef struct bushd_table_run_entry {
  uint8_t motor;
  uint8_t slot;      // of the table; must be the one assigned to the motor
  int8_t direction;  // +1, -1
  uint32_t steps;    // >= 1
} bushd_table_run_entry;

// Entry `index` of a table run's or a trigger's.
bushd_table_run_entry bushd_get_table_run_entry(const uint8_t* entries, uint8_t index);

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
#define BUSHD_TRIGGER_MAX_DELAY_US 1500000u
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

enum { BUSHD_ARRIVES_POSITIVE = 1 << 0, BUSHD_ARRIVES_NEGATIVE = 1 << 1 };

// A pulse at the reference output, delay_us after the step with which the motor's counter arrives
// at the position.
#define BUSHD_REFERENCE_MAX_DELAY_US 1500000u
#define BUSHD_REFERENCE_MAX_WIDTH_US 1000000u
typedef struct bushd_reference {
  uint8_t motor;
  uint8_t arrivals;  // BUSHD_ARRIVES_*; 0: no pulses
  int32_t position_steps;
  uint32_t delay_us;
  uint32_t width_us;  // >= 1
} bushd_reference;

typedef enum bushd_how { BUSHD_RAMP_DOWN = 0, BUSHD_CUT = 1 } bushd_how;
// All motors stop, within two ticks: by their tables' ramps, or without another step.
typedef struct bushd_emergency {
  bushd_how how;
} bushd_emergency;

typedef struct bushd_motor_report {
  int32_t position_steps;  // steps made until the start of `tick`
  uint16_t known_until;    // low 16 bits of the first tick for which nothing is decided; at most
                           // 32767 after `tick`
} bushd_motor_report;

typedef struct bushd_report {
  uint8_t state;   // bushd_state
  uint8_t faults;  // BUSHD_FAULT_*
  uint8_t flags;   // BUSHD_FLAG_*
  uint8_t epoch;
  uint16_t boot_number;
  uint32_t tick;     // the tick being emitted
  uint32_t tick_ns;  // how far into it, when the poll's frame ended
  uint32_t mark;     // the last mark heard, and when it was by the MCU's own clock
  uint32_t mark_tick;
  uint32_t mark_ns;
  int32_t rate_ppb;          // how much faster than its crystal the MCU counts, to follow the bus
  uint16_t moving;           // motors not at rest
  uint16_t running;          // of them, those in a table run
  uint16_t inputs;           // bit per motor: active
  uint16_t bad_frames;       // CRC and length errors; saturates
  uint16_t rejected_frames;  // good frames that could not be used; saturates
  uint8_t last_rejection;    // bushd_status of the last one
  uint16_t run_downs;        // motors that had to be run down since boot; saturates
  uint16_t low_water_ticks;  // the fewest ticks that a moving motor had queued, since the report
                             // before; 65535: none moved
  // Ticks that these motors have beyond a gap: from the tick `island_from` (low 16 bits) on, until
  // `island_until`.
  uint16_t islands;
  uint16_t island_from;
  uint16_t island_until;
  uint16_t forbidden_positive;  // motors that a limit keeps from moving in this direction
  uint16_t forbidden_negative;
  uint8_t system_inputs;   // active, BUSHD_INPUT_*
  uint16_t current;        // of the supply, 0..1023
  uint8_t reset_cause;     // BUSHD_RESET_*
  uint8_t failed_tests;    // at boot, BUSHD_TEST_*
  uint16_t autonomous;     // motors that move by homing or by local inputs
  uint16_t homed;          // motors whose last homing since boot was done
  uint8_t homing;          // bushd_homing
  uint16_t armed;          // motors that wait for the trigger
  uint8_t trigger_number;  // of the last one taken; 0: none since boot
  uint8_t trigger_state;   // bushd_trigger_state
  uint32_t start_tick;     // when it began, or will, if BUSHD_TRIGGER_STARTED
  uint32_t start_ns;       // after the beginning of start_tick
  uint8_t motor_count;     // <= BUSHD_MOTORS_PER_MCU
  bushd_motor_report motor[BUSHD_MOTORS_PER_MCU];
} bushd_report;

#define BUSHD_REPORT_SIZE(motors) (78u + 6u * (motors))
#define BUSHD_IDENTITY_SIZE 22u
#define BUSHD_TABLES_SIZE (1u + 8u * BUSHD_TABLE_SLOTS)

typedef struct bushd_acknowledgement {
  uint8_t status;  // bushd_status
} bushd_acknowledgement;

// Encoders return the payload's size. Preconditions are the ranges given above.
size_t bushd_encode_identify(const bushd_identify* message, uint8_t* payload);
size_t bushd_encode_identity(const bushd_identity* message, uint8_t* payload);
size_t bushd_encode_configure(const bushd_configure* message, uint8_t* payload);
size_t bushd_encode_emission(const bushd_emission* message, uint8_t* payload);
size_t bushd_encode_table_begin(const bushd_table_begin* message, uint8_t* payload);
size_t bushd_encode_table_data(uint8_t slot, uint16_t offset, uint8_t count, const uint16_t* codes,
                               uint8_t* payload);
size_t bushd_encode_table_end(const bushd_table_end* message, uint8_t* payload);
size_t bushd_encode_assign(const bushd_assign* message, uint8_t* payload);
size_t bushd_encode_control(const bushd_control* message, uint8_t* payload);
size_t bushd_encode_set_position(const bushd_set_position* message, uint8_t* payload);
size_t bushd_encode_set_address(const bushd_set_address* message, uint8_t* payload);
size_t bushd_encode_set_inputs(const bushd_set_inputs* message, uint8_t* payload);
size_t bushd_encode_home(const bushd_home* message, uint8_t* payload);
size_t bushd_encode_local(const bushd_local* message, uint8_t* payload);
size_t bushd_encode_tables(const bushd_tables* message, uint8_t* payload);
size_t bushd_encode_poll(const bushd_poll_entry* entries, uint8_t count, uint8_t* payload);
size_t bushd_encode_sync(const bushd_sync* message, uint8_t* payload);
size_t bushd_encode_emergency(const bushd_emergency* message, uint8_t* payload);
size_t bushd_encode_report(const bushd_report* message, uint8_t* payload);
size_t bushd_encode_acknowledgement(const bushd_acknowledgement* message, uint8_t* payload);

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
size_t bushd_encode_reference(const bushd_reference* message, uint8_t* payload);

// Decoders return BUSHD_OK, BUSHD_E_LENGTH or BUSHD_E_FORMAT.
bushd_status bushd_decode_identify(const uint8_t* payload, size_t size, bushd_identify* message);
bushd_status bushd_decode_identity(const uint8_t* payload, size_t size, bushd_identity* message);
bushd_status bushd_decode_configure(const uint8_t* payload, size_t size, bushd_configure* message);
bushd_status bushd_decode_emission(const uint8_t* payload, size_t size, bushd_emission* message);
bushd_status bushd_decode_table_begin(const uint8_t* payload, size_t size,
                                      bushd_table_begin* message);
bushd_status bushd_decode_table_data(const uint8_t* payload, size_t size,
                                     bushd_table_data* message);
bushd_status bushd_decode_table_end(const uint8_t* payload, size_t size, bushd_table_end* message);
bushd_status bushd_decode_assign(const uint8_t* payload, size_t size, bushd_assign* message);
bushd_status bushd_decode_control(const uint8_t* payload, size_t size, bushd_control* message);
bushd_status bushd_decode_set_position(const uint8_t* payload, size_t size,
                                       bushd_set_position* message);
bushd_status bushd_decode_set_address(const uint8_t* payload, size_t size,
                                      bushd_set_address* message);
bushd_status bushd_decode_set_inputs(const uint8_t* payload, size_t size,
                                     bushd_set_inputs* message);
bushd_status bushd_decode_home(const uint8_t* payload, size_t size, bushd_home* message);
bushd_status bushd_decode_local(const uint8_t* payload, size_t size, bushd_local* message);
bushd_status bushd_decode_tables(const uint8_t* payload, size_t size, bushd_tables* message);
bushd_status bushd_decode_poll(const uint8_t* payload, size_t size, bushd_poll* message);
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
bushd_status bushd_decode_reference(const uint8_t* payload, size_t size, bushd_reference* message);
bushd_status bushd_decode_report(const uint8_t* payload, size_t size, bushd_report* message);
bushd_status bushd_decode_acknowledgement(const uint8_t* payload, size_t size,
                                          bushd_acknowledgement* message);

// The cast before the shift keeps it defined where int has 16 bits.
static inline uint16_t bushd_get_u16(const uint8_t* p) {
  return (uint16_t)(p[0] | (uint16_t)p[1] << 8);
}
static inline int16_t bushd_get_i16(const uint8_t* p) {
  return (int16_t)bushd_get_u16(p);
}
static inline uint32_t bushd_get_u32(const uint8_t* p) {
  return (uint32_t)bushd_get_u16(p) | (uint32_t)bushd_get_u16(p + 2) << 16;
}
static inline void bushd_put_u16(uint8_t* p, uint16_t value) {
  p[0] = (uint8_t)value;
  p[1] = (uint8_t)(value >> 8);
}
static inline void bushd_put_i16(uint8_t* p, int16_t value) {
  bushd_put_u16(p, (uint16_t)value);
}
static inline void bushd_put_u32(uint8_t* p, uint32_t value) {
  bushd_put_u16(p, (uint16_t)value);
  bushd_put_u16(p + 2, (uint16_t)(value >> 16));
}

#ifdef __cplusplus
}
#endif
#endif
