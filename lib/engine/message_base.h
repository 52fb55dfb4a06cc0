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

// All messages that a master sends: MESSAGE(TYPE, number, kind, needs). Its type is
// BUSHD_MSG_<TYPE>, its payload a bushd_<kind>. To an MCU without one of the capabilities `needs`
// (engine/message_setup.h) it is an unknown message. (TRIGGER needs none: the MCU refuses it
// itself; and every MCU takes OUTPUTS.) The next free number is 0x21.
//
// One MCU does what these say, or refuses it, and acknowledges (bushd_acknowledgement); a list
// for each purpose. How HOME and TRAVEL go on is told by reports.
#define BUSHD_SETUP_REQUESTS(MESSAGE)                               \
  MESSAGE(CONFIGURE, 0x02, configure, 0)                            \
  MESSAGE(TABLE_BEGIN, 0x03, table_begin, 0)                        \
  MESSAGE(TABLE_DATA, 0x04, table_data, 0)                          \
  MESSAGE(TABLE_END, 0x05, table_end, 0)                            \
  MESSAGE(ASSIGN, 0x06, assign, 0)                                  \
  MESSAGE(CONTROL, 0x07, control, 0)                                \
  MESSAGE(INPUTS, 0x11, set_inputs, 0)                              \
  MESSAGE(EMISSION, 0x12, emission, 0)                              \
  MESSAGE(LOCAL, 0x14, local, BUSHD_CAN_LOCAL)                      \
  MESSAGE(MOTOR_INPUTS, 0x17, motor_inputs, BUSHD_CAN_MOTOR_INPUTS) \
  MESSAGE(CURRENTS, 0x1A, currents, BUSHD_CAN_CURRENTS)             \
  MESSAGE(VELOCITY, 0x1C, set_velocity, BUSHD_CAN_VELOCITY)         \
  MESSAGE(OUTPUTS, 0x1D, set_outputs, 0)
#define BUSHD_MOTION_REQUESTS(MESSAGE)                                          \
  MESSAGE(SET_POSITION, 0x08, set_position, 0)                                  \
  MESSAGE(HOME, 0x13, home, BUSHD_CAN_HOME)                                     \
  MESSAGE(TRIGGER, 0x15, trigger, 0)                                            \
  MESSAGE(POSITION_COMPARE, 0x16, position_compare, BUSHD_CAN_POSITION_COMPARE) \
  MESSAGE(TRAVEL, 0x19, travel, BUSHD_CAN_TRAVEL)                               \
  MESSAGE(LINE_TRIGGER, 0x1B, line_trigger, BUSHD_CAN_LINE_RUN | BUSHD_CAN_TRIGGER)
// Apart, since not every firmware has them (BUSHD_PROGRAMS).
#define BUSHD_PROGRAM_REQUESTS(MESSAGE)                      \
  MESSAGE(PROGRAM_PUT, 0x1E, program_put, BUSHD_CAN_PROGRAM) \
  MESSAGE(PROGRAM, 0x1F, program_control, BUSHD_CAN_PROGRAM)
// Motion for one MCU. Nobody answers: what comes of it is told by the next reports.
#define BUSHD_STREAMED(MESSAGE)                                  \
  MESSAGE(TICKS, 0x0B, ticks, 0)                                 \
  MESSAGE(TABLE_TICKS, 0x0C, table_ticks, BUSHD_CAN_TABLE_TICKS) \
  MESSAGE(TABLE_RUN, 0x0D, table_run, BUSHD_CAN_TABLE_RUN)       \
  MESSAGE(LINE_RUN, 0x18, line_run, BUSHD_CAN_LINE_RUN)
// Handled one by one:
// SYNC           broadcast; its time is the end of the frame; nobody answers
// EMERGENCY      to one or to all; nobody answers
// IDENTIFY       -> bushd_identity, in a reply window
// POLL           broadcast -> a bushd_report of each MCU that it names
// SET_ADDRESS    broadcast -> acknowledgement of the one MCU
// TABLES         without payload -> bushd_tables
// PROGRAM_STATE  without payload -> bushd_program_state
#define BUSHD_SPECIAL(MESSAGE)               \
  MESSAGE(SYNC, 0x0A, sync, 0)               \
  MESSAGE(EMERGENCY, 0x0E, emergency, 0)     \
  MESSAGE(IDENTIFY, 0x01, identify, 0)       \
  MESSAGE(POLL, 0x09, poll, 0)               \
  MESSAGE(SET_ADDRESS, 0x0F, set_address, 0) \
  MESSAGE(TABLES, 0x10, get_tables, 0)       \
  MESSAGE(PROGRAM_STATE, 0x20, get_program_state, BUSHD_CAN_PROGRAM)
#define BUSHD_MESSAGES(MESSAGE)   \
  BUSHD_SETUP_REQUESTS(MESSAGE)   \
  BUSHD_MOTION_REQUESTS(MESSAGE)  \
  BUSHD_PROGRAM_REQUESTS(MESSAGE) \
  BUSHD_STREAMED(MESSAGE)         \
  BUSHD_SPECIAL(MESSAGE)

// A reply has the request's type with BUSHD_TYPE_REPLY set, its sequence and the MCU's address.
#define BUSHD_TYPE_OF(type, number, kind, needs) BUSHD_MSG_##type = (number),
typedef enum bushd_type { BUSHD_MESSAGES(BUSHD_TYPE_OF) } bushd_type;
#undef BUSHD_TYPE_OF
// For a switch by type: BUSHD_STREAMED(BUSHD_CASE) is a case for each of a list.
#define BUSHD_CASE(type, number, kind, needs) case BUSHD_MSG_##type:

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
