// Messages that set an MCU up and tell what it is (engine/message.h).
#ifndef BUSHD_ENGINE_MESSAGE_SETUP_H
#define BUSHD_ENGINE_MESSAGE_SETUP_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "engine/message_base.h"
#include "engine/status.h"

#ifdef __cplusplus
extern "C" {
#endif

// Asks for identities; the one request that may be broadcast and is answered all the same. To keep
// apart MCUs that have the same address (or all of them, on a broadcast) each answers in one of
// `windows` reply windows, chosen by bushd_identify_window: window i begins i x window_units after
// this frame's end, in BUSHD_REPLY_UNIT_NS.
typedef struct bushd_identify {
  uint16_t salt;
  uint8_t windows;  // >= 1
  uint16_t window_units;
} bushd_identify;
// Two MCUs that share a window are apart after a few other salts.
uint8_t bushd_identify_window(const uint8_t* unique_id, uint16_t salt, uint8_t windows);

enum {
  BUSHD_CAN_COARSE = 1 << 0,
  BUSHD_CAN_FINE = 1 << 1,
  BUSHD_CAN_TABLE_TICKS = 1 << 2,
  BUSHD_CAN_TABLE_RUN = 1 << 3,
  BUSHD_CAN_HOME = 1 << 4,
  BUSHD_CAN_LOCAL = 1 << 5,
  BUSHD_CAN_TRIGGER = 1 << 6,           // has a trigger input
  BUSHD_CAN_POSITION_COMPARE = 1 << 7,  // has a position compare output
  // Emission other than even.
  BUSHD_CAN_BURST = 1 << 8,
  BUSHD_CAN_COMMON_DIR = 1 << 9,
  BUSHD_CAN_STAGGERED = 1 << 10,
  BUSHD_CAN_PHASES = 1 << 11,
  BUSHD_CAN_MOTOR_INPUTS = 1 << 12,
  BUSHD_CAN_LINE_RUN = 1 << 13,
  BUSHD_CAN_TRAVEL = 1 << 14,  // where it has a trigger input also at its edges
};
// Beyond an int of 16 bits.
#define BUSHD_CAN_CURRENTS UINT32_C(0x8000)
#define BUSHD_CAN_VELOCITY UINT32_C(0x10000)
#define BUSHD_CAN_KEYPAD UINT32_C(0x20000)
#define BUSHD_CAN_SCRATCH UINT32_C(0x40000)      // has BUSHD_SCRATCH_BANK
#define BUSHD_CAN_CLEAR_NAMED UINT32_C(0x80000)  // bushd_control.faults
#define BUSHD_CAN_OUTPUTS UINT32_C(0x100000)     // levels of its outputs may be chosen
#define BUSHD_CAN_SLOW_RUNS UINT32_C(0x200000)   // shortest delays and slow delays beyond 16 bits
#define BUSHD_CAN_PROGRAM UINT32_C(0x400000)     // carries out programs by itself
#define BUSHD_CAN_ELEMENTARY UINT32_C(0x800000)  // lines by engine/elementary.h
#define BUSHD_CAN_DISABLE UINT32_C(0x1000000)    // BUSHD_STOP_DISABLE and _EMERGENCY_INPUT_DISABLE

// Only `protocol_version` is decoded of another version, the rest is zero: enough to say which one
// it is.
typedef struct bushd_identity {
  uint8_t protocol_version;
  uint8_t motors;  // outputs 0 .. motors-1, at most BUSHD_MOTORS_PER_MCU
  uint16_t firmware_version;
  uint16_t boot_number;   // changes at every boot
  uint16_t slots;         // slots per tick
  uint16_t queue_ticks;   // depth of the tick queue
  uint16_t table_codes;   // table memory, in codes of 16 bits
  uint32_t capabilities;  // BUSHD_CAN_*
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
  // Table runs are ramped down after as many without a valid frame; >= 1.
  uint16_t comm_timeout_ticks;
} bushd_configure;

// How steps get to the pins (engine/emission.h).
typedef enum bushd_emission_mode {
  BUSHD_EMISSION_EVEN = 0,        // each step in the slot of its time
  BUSHD_EMISSION_BURST = 1,       // all motors together, each T_step
  BUSHD_EMISSION_COMMON_DIR = 2,  // one DIR for all: each T_step those to the left, then the others
  BUSHD_EMISSION_STAGGERED = 3,   // one after the other, each T_step
  BUSHD_EMISSION_PHASES = 4,      // four levels a motor instead of STEP and DIR
  // One DIR for all: each T_step those to the left one after the other, then those to the right.
  // Needs the capabilities of both modes.
  BUSHD_EMISSION_COMMON_STAGGERED = 5
} bushd_emission_mode;

static inline bool bushd_emission_has_common_dir(uint8_t mode) {
  return mode == BUSHD_EMISSION_COMMON_DIR || mode == BUSHD_EMISSION_COMMON_STAGGERED;
}

static inline bool bushd_emission_is_staggered(uint8_t mode) {
  return mode == BUSHD_EMISSION_STAGGERED || mode == BUSHD_EMISSION_COMMON_STAGGERED;
}

// The steps of a tick follow each other at intervals of T_step.
static inline bool bushd_emission_has_periods(uint8_t mode) {
  return mode != BUSHD_EMISSION_EVEN && mode != BUSHD_EMISSION_PHASES;
}

typedef enum bushd_phase_sequence {
  BUSHD_PHASES_WAVE = 0,  // 4-beat, one winding on
  BUSHD_PHASES_FULL = 1,  // 4-beat, two on
  BUSHD_PHASES_HALF = 2,  // 8-beat
  BUSHD_PHASES_THREE = 3  // three windings, 6-beat
} bushd_phase_sequence;

#define BUSHD_PHASE_OUTPUTS 4u  // motor m has the outputs 4m .. 4m+3

// Values of bushd_emission.settle_us.
#define BUSHD_SETTLE_MEASURED 0u  // the MCU measures it, by a step of a motor and its way back
#define BUSHD_SETTLE_UNKNOWN UINT16_MAX  // T_step at least: pulses are spread over all of that

typedef struct bushd_emission {
  uint8_t mode;           // bushd_emission_mode
  uint8_t sequence;       // bushd_phase_sequence, of phases
  bool hold_current;      // of phases: windings stay on at rest
  uint16_t step_us;       // T_step, where the mode has periods; >= 1 there
  uint16_t settle_us;     // dt_p, of staggered; BUSHD_SETTLE_MEASURED, BUSHD_SETTLE_UNKNOWN
  uint16_t dir_setup_us;  // DIR changes as long before a step at least
  uint16_t pulse_us;      // a STEP pulse lasts as long at least
} bushd_emission;

// A table is sent as: begin, data (accelerating side, then decelerating side unless it is the
// same), end. `bank` 0 .. BUSHD_TABLE_BANKS-1, or BUSHD_SCRATCH_BANK: a table that lines go by.
// Codes run from slow to fast on both sides.
typedef struct bushd_table_begin {
  uint8_t bank;
  uint16_t accel_count;
  uint16_t decel_count;  // 0: the decelerating side is the accelerating one
  uint16_t cruise;
  uint32_t time_unit_ns;
  uint32_t revision;  // of the table, as its file has it; told back by bushd_tables
} bushd_table_begin;

#define BUSHD_TABLE_DATA_MAX_CODES 120u
typedef struct bushd_table_data {
  uint8_t bank;
  uint16_t offset;       // of the first code, counted over both sides
  uint8_t count;         // 1 .. BUSHD_TABLE_DATA_MAX_CODES
  const uint8_t* codes;  // count little-endian 16-bit codes, unaligned
} bushd_table_data;

typedef struct bushd_table_end {
  uint8_t bank;
  uint32_t crc;  // bushd_table_crc32 (engine/table.h) of the whole table
} bushd_table_end;

// What an MCU holds over resets, by table bank.
typedef struct bushd_table_held {
  bool valid;
  uint32_t crc;
  uint32_t revision;
} bushd_table_held;
typedef struct bushd_tables {
  bushd_table_held bank[BUSHD_TABLE_BANKS];
} bushd_tables;

typedef struct bushd_assign {
  uint8_t motor;
  uint8_t bank;
} bushd_assign;

enum {
  BUSHD_CONTROL_ENABLE = 1 << 0,        // drivers on, by EN
  BUSHD_CONTROL_DISABLE = 1 << 1,       // drivers off; refused while a motor moves
  BUSHD_CONTROL_CLEAR_FAULTS = 1 << 2,  // refused while a motor moves
  BUSHD_CONTROL_FORGET_TABLES = 1 << 3  // all of them; refused while a motor moves
};
typedef struct bushd_control {
  uint8_t actions;
  uint8_t faults;  // BUSHD_FAULT_*: which ones CLEAR_FAULTS is for; 0: all
} bushd_control;

typedef struct bushd_set_position {
  uint8_t motor;  // at rest
  int32_t position_steps;
} bushd_set_position;

// What the MCU does when a limit switch or the emergency input is active.
enum {
  BUSHD_EMERGENCY_INPUT_IGNORED = 0,
  BUSHD_EMERGENCY_INPUT_RAMP = 1,
  BUSHD_EMERGENCY_INPUT_IMMEDIATE = 2,
  BUSHD_EMERGENCY_INPUT_DISABLE = 3
};
#define BUSHD_MAX_DEBOUNCE_TICKS 15u
#define BUSHD_MAX_CURRENT 1023u
typedef struct bushd_set_inputs {
  // Motors that have a limit switch at this end of their travel: the input with the motor's number,
  // unless bushd_motor_inputs says otherwise afterwards.
  uint16_t limit_positive;
  uint16_t limit_negative;
  uint16_t limit_immediate;    // motors that stop at a limit at once; the others ramp down
  uint16_t inverted;           // inputs that are active when the port calls them inactive
  uint8_t debounce_ticks;      // a limit switch counts once it has stayed for as many more ticks
  uint8_t system_inverted;     // as `inverted`, of BUSHD_INPUT_*
  uint8_t emergency;           // BUSHD_EMERGENCY_INPUT_*
  uint16_t overcurrent;        // EN falls above this reading; 0: never
  bool enable_after_watchdog;  // EN as it was before a watchdog reset; else low
} bushd_set_inputs;

// Which inputs of its MCU are a motor's switches; an MCU has as many inputs as motors. One input
// may be several of them, and a limit of several motors.
typedef struct bushd_motor_inputs {
  uint8_t motor;
  uint8_t positive;  // the limit at this end, if bushd_set_inputs says that there is one
  uint8_t negative;  // the same input: one switch for both ends
  uint8_t home;
} bushd_motor_inputs;

// Peak currents of a motor's windings, controlled by the MCU. All three are 0, or none is: then,
// and after boot, no current is controlled.
typedef enum bushd_decay { BUSHD_DECAY_SLOW = 0, BUSHD_DECAY_FAST = 1 } bushd_decay;
#define BUSHD_MAX_CURRENT_MA 5110u
typedef struct bushd_currents {
  uint8_t motor;
  uint8_t decay;  // bushd_decay: how a current falls while its winding is switched off
  uint16_t ramp_ma;
  uint16_t cruise_ma;  // at constant speed
  uint16_t hold_ma;    // at rest, if windings stay on there (bushd_emission.hold_current)
} bushd_currents;

// At which levels the drivers of an MCU do what they are to do.
enum {
  BUSHD_ENABLED_HIGH = 1,  // EN is high while the drivers are enabled
  BUSHD_ENABLED_LOW = 2
};
typedef struct bushd_set_outputs {
  uint16_t step_low;  // outputs whose STEP rests high and whose pulses are low
  // Outputs whose DIR is low in the positive direction; all: the common DIR.
  uint16_t direction_low;
  uint8_t enabled;  // BUSHD_ENABLED_*
} bushd_set_outputs;

// Local motion of a motor by the velocity loop of engine/velocity.h, in its unit of 1/64 step/s:
// BUSHD_VELOCITY_LEAST <= least <= most <= BUSHD_VELOCITY_MOST, acceleration
// 1..BUSHD_VELOCITY_MOST. All three are 0: by its table.
typedef struct bushd_set_velocity {
  uint8_t motor;
  int32_t least;         // VMIN
  int32_t most;          // V, while an input is held
  int32_t acceleration;  // A in 1/64 s: steps/s^2
} bushd_set_velocity;

typedef struct bushd_acknowledgement {
  uint8_t status;  // bushd_status
} bushd_acknowledgement;

#define BUSHD_IDENTITY_SIZE 24u
#define BUSHD_TABLES_SIZE (1u + 8u * BUSHD_TABLE_BANKS)

// Encoders return the payload's size. Preconditions are the ranges given above.
size_t bushd_encode_identify(const bushd_identify* message, uint8_t* payload);
size_t bushd_encode_identity(const bushd_identity* message, uint8_t* payload);
size_t bushd_encode_configure(const bushd_configure* message, uint8_t* payload);
size_t bushd_encode_emission(const bushd_emission* message, uint8_t* payload);
size_t bushd_encode_table_begin(const bushd_table_begin* message, uint8_t* payload);
size_t bushd_encode_table_data(uint8_t bank, uint16_t offset, uint8_t count, const uint16_t* codes,
                               uint8_t* payload);
size_t bushd_encode_table_end(const bushd_table_end* message, uint8_t* payload);
size_t bushd_encode_assign(const bushd_assign* message, uint8_t* payload);
size_t bushd_encode_control(const bushd_control* message, uint8_t* payload);
size_t bushd_encode_set_position(const bushd_set_position* message, uint8_t* payload);
size_t bushd_encode_set_address(const bushd_set_address* message, uint8_t* payload);
size_t bushd_encode_set_inputs(const bushd_set_inputs* message, uint8_t* payload);
size_t bushd_encode_set_outputs(const bushd_set_outputs* message, uint8_t* payload);
size_t bushd_encode_motor_inputs(const bushd_motor_inputs* message, uint8_t* payload);
size_t bushd_encode_currents(const bushd_currents* message, uint8_t* payload);
size_t bushd_encode_set_velocity(const bushd_set_velocity* message, uint8_t* payload);
size_t bushd_encode_tables(const bushd_tables* message, uint8_t* payload);
size_t bushd_encode_acknowledgement(const bushd_acknowledgement* message, uint8_t* payload);

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
bushd_status bushd_decode_set_outputs(const uint8_t* payload, size_t size,
                                      bushd_set_outputs* message);
bushd_status bushd_decode_motor_inputs(const uint8_t* payload, size_t size,
                                       bushd_motor_inputs* message);
bushd_status bushd_decode_currents(const uint8_t* payload, size_t size, bushd_currents* message);
bushd_status bushd_decode_set_velocity(const uint8_t* payload, size_t size,
                                       bushd_set_velocity* message);
bushd_status bushd_decode_tables(const uint8_t* payload, size_t size, bushd_tables* message);
bushd_status bushd_decode_acknowledgement(const uint8_t* payload, size_t size,
                                          bushd_acknowledgement* message);

#ifdef __cplusplus
}
#endif
#endif
