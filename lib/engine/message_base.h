// What all messages of the bus share: version, types, states, flags and the order of bytes.
#ifndef BUSHD_ENGINE_MESSAGE_BASE_H
#define BUSHD_ENGINE_MESSAGE_BASE_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define BUSHD_PROTOCOL_VERSION 6u
#define BUSHD_MOTORS_PER_MCU 16u
#define BUSHD_TABLE_BANKS 8u
#define BUSHD_SCRATCH_BANK 8u  // volatile: its table is lost at a reset (BUSHD_CAN_SCRATCH)
#define BUSHD_MIN_TICK_NS 200000u
#define BUSHD_MAX_TICK_NS 20000000u
#define BUSHD_UNIQUE_ID_SIZE 8u
#define BUSHD_REPLY_UNIT_NS 10000u  // of times at which an answer shall begin

typedef enum bushd_type {
  BUSHD_MSG_IDENTIFY = 0x01,      // bushd_identify -> reply: bushd_identity, in a reply window
  BUSHD_MSG_CONFIGURE = 0x02,     // bushd_configure -> acknowledgement
  BUSHD_MSG_TABLE_BEGIN = 0x03,   // bushd_table_begin -> acknowledgement
  BUSHD_MSG_TABLE_DATA = 0x04,    // bushd_table_data -> acknowledgement
  BUSHD_MSG_TABLE_END = 0x05,     // bushd_table_end -> acknowledgement
  BUSHD_MSG_ASSIGN = 0x06,        // bushd_assign -> acknowledgement
  BUSHD_MSG_CONTROL = 0x07,       // bushd_control -> acknowledgement
  BUSHD_MSG_SET_POSITION = 0x08,  // bushd_set_position -> acknowledgement
  BUSHD_MSG_POLL = 0x09,          // bushd_poll, broadcast -> a bushd_report of each MCU it names
  BUSHD_MSG_SYNC = 0x0A,   // bushd_sync, broadcast, no reply; its time is the end of the frame
  BUSHD_MSG_TICKS = 0x0B,  // bushd_ticks, no reply: its effect shows in the next report
  BUSHD_MSG_TABLE_TICKS = 0x0C,  // bushd_table_ticks, no reply
  BUSHD_MSG_TABLE_RUN = 0x0D,    // bushd_table_run, no reply
  BUSHD_MSG_EMERGENCY = 0x0E,    // bushd_emergency, no reply
  BUSHD_MSG_SET_ADDRESS = 0x0F,  // bushd_set_address, broadcast -> acknowledgement of the one MCU
  BUSHD_MSG_TABLES = 0x10,       // empty -> reply: bushd_tables
  BUSHD_MSG_INPUTS = 0x11,       // bushd_set_inputs -> acknowledgement
  BUSHD_MSG_EMISSION = 0x12,     // bushd_emission -> acknowledgement
  BUSHD_MSG_HOME = 0x13,         // bushd_home -> acknowledgement; how it goes is told by reports
  BUSHD_MSG_LOCAL = 0x14,        // bushd_local -> acknowledgement
  BUSHD_MSG_TRIGGER = 0x15,      // bushd_trigger -> acknowledgement
  BUSHD_MSG_POSITION_COMPARE = 0x16,  // bushd_position_compare -> acknowledgement
  BUSHD_MSG_MOTOR_INPUTS = 0x17,      // bushd_motor_inputs -> acknowledgement
  BUSHD_MSG_LINE_RUN = 0x18,          // bushd_line_run, no reply
  BUSHD_MSG_TRAVEL = 0x19,        // bushd_travel -> acknowledgement; how it goes is told by reports
  BUSHD_MSG_CURRENTS = 0x1A,      // bushd_currents -> acknowledgement
  BUSHD_MSG_LINE_TRIGGER = 0x1B,  // bushd_line_trigger -> acknowledgement
  BUSHD_MSG_VELOCITY = 0x1C,      // bushd_set_velocity -> acknowledgement
  BUSHD_MSG_OUTPUTS = 0x1D,       // bushd_set_outputs -> acknowledgement
  BUSHD_MSG_PROGRAM_PUT = 0x1E,   // bushd_program_put -> acknowledgement
  BUSHD_MSG_PROGRAM = 0x1F,       // bushd_program_control -> acknowledgement
  BUSHD_MSG_PROGRAM_STATE = 0x20  // empty -> reply: bushd_program_state
} bushd_type;
// A reply has the request's type with BUSHD_TYPE_REPLY set, its sequence and the MCU's address.

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
  BUSHD_FAULT_EEPROM = 1 << 6,   // what it keeps was unreadable at boot: defaults are in use
  BUSHD_FAULT_DISABLED = 1 << 7  // an emergency stop or the emergency input has switched EN off
};

enum {
  BUSHD_FLAG_ENABLED = 1 << 0,     // EN is high
  BUSHD_FLAG_SYNCED = 1 << 1,      // the tick counter is the bus's
  BUSHD_FLAG_CONFIGURED = 1 << 2,  // tick and format are set
  BUSHD_FLAG_SYNC_HEARD = 1 << 3,  // sync_id_* of the report are valid
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
