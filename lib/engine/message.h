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
#include "engine/status.h"

#ifdef __cplusplus
extern "C" {
#endif

#define BUSHD_PROTOCOL_VERSION 1u
#define BUSHD_MOTORS_PER_MCU 16u
#define BUSHD_TABLE_SLOTS 8u
#define BUSHD_MIN_TICK_NS 200000u
#define BUSHD_MAX_TICK_NS 20000000u

typedef enum bushd_type {
  BUSHD_MSG_IDENTIFY = 0x01,      // empty -> reply: bushd_identity
  BUSHD_MSG_CONFIGURE = 0x02,     // bushd_configure -> acknowledgement
  BUSHD_MSG_TABLE_BEGIN = 0x03,   // bushd_table_begin -> acknowledgement
  BUSHD_MSG_TABLE_DATA = 0x04,    // bushd_table_data -> acknowledgement
  BUSHD_MSG_TABLE_END = 0x05,     // bushd_table_end -> acknowledgement
  BUSHD_MSG_ASSIGN = 0x06,        // bushd_assign -> acknowledgement
  BUSHD_MSG_CONTROL = 0x07,       // bushd_control -> acknowledgement
  BUSHD_MSG_SET_POSITION = 0x08,  // bushd_set_position -> acknowledgement
  BUSHD_MSG_POLL = 0x09,          // empty -> reply: bushd_report
  BUSHD_MSG_SYNC = 0x0A,          // bushd_sync, broadcast, no reply; the frame's end is a time mark
  BUSHD_MSG_TICKS = 0x0B          // bushd_ticks, no reply: its effect shows in the next report
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
  BUSHD_FAULT_SYNC = 1 << 2        // the tick counter differs from the bus by more than it may
};

enum {
  BUSHD_FLAG_ENABLED = 1 << 0,     // EN is high
  BUSHD_FLAG_SYNCED = 1 << 1,      // the tick counter is the bus's
  BUSHD_FLAG_CONFIGURED = 1 << 2,  // tick and format are set
  BUSHD_FLAG_MARK = 1 << 3         // mark_* of the report are valid
};

typedef enum bushd_format { BUSHD_FORMAT_COARSE = 0, BUSHD_FORMAT_FINE = 1 } bushd_format;

typedef struct bushd_identity {
  uint8_t protocol_version;
  uint8_t motors;  // outputs 0 .. motors-1, at most BUSHD_MOTORS_PER_MCU
  uint16_t firmware_version;
  uint16_t boot_number;  // changes at every boot
  uint16_t slots;        // slots per tick
  uint16_t queue_ticks;  // depth of the tick queue
  uint16_t table_codes;  // table memory, in codes of 16 bits
} bushd_identity;

typedef struct bushd_configure {
  uint32_t tick_ns;  // BUSHD_MIN_TICK_NS .. BUSHD_MAX_TICK_NS
  bushd_format format;
} bushd_configure;

// A table is sent as: begin, data (accelerating side, then decelerating side unless it is the
// same), end. `slot` 0 .. BUSHD_TABLE_SLOTS-1. Codes run from slow to fast on both sides.
typedef struct bushd_table_begin {
  uint8_t slot;
  uint16_t accel_count;
  uint16_t decel_count;  // 0: the decelerating side is the accelerating one
  uint16_t cruise;
  uint32_t time_unit_ns;
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
  uint16_t crc;  // CRC-16 over all codes as sent (little-endian)
} bushd_table_end;

typedef struct bushd_assign {
  uint8_t motor;
  uint8_t slot;
} bushd_assign;

enum {
  BUSHD_CONTROL_ENABLE = 1 << 0,       // EN high
  BUSHD_CONTROL_DISABLE = 1 << 1,      // EN low; refused while a motor moves
  BUSHD_CONTROL_CLEAR_FAULTS = 1 << 2  // refused while a motor moves
};
typedef struct bushd_control {
  uint8_t actions;
} bushd_control;

typedef struct bushd_set_position {
  uint8_t motor;  // at rest
  int32_t position_steps;
} bushd_set_position;

// Two-step time reference. The end of this frame is a mark named by the frame's tag. If `follows`,
// the mark named `mark_tag` lay at (mark_tick, mark_ns into that tick) of bus time.
typedef struct bushd_sync {
  bool follows;
  uint8_t mark_tag;
  uint32_t mark_tick;
  uint32_t mark_ns;
} bushd_sync;

enum {
  BUSHD_TICKS_FINE = 1 << 0,     // int16 displacements, else coarse bytes
  BUSHD_TICKS_DELAYS = 1 << 1,   // running delays at the end of the frame follow (else unchanged)
  BUSHD_TICKS_REPLACE = 1 << 2,  // instead of all that its motors have queued from first_tick on
  BUSHD_TICKS_START = 1 << 3     // its motors start from rest here; without it they must be moving
};

// Displacements of `count` ticks for the motors in `mask`. Only these motors are touched.
typedef struct bushd_ticks {
  uint8_t epoch;  // stream epoch; a replacement carries a later one than the MCU's: it opens it
  uint8_t flags;
  uint32_t first_tick;
  uint8_t count;                 // >= 1
  uint16_t mask;                 // != 0
  uint8_t motors;                // bits set in mask
  const uint8_t* delays;         // motors x 16 bit, running at the end, 0: at rest; or NULL
  const uint8_t* displacements;  // count x motors, tick by tick, motors in rising order
} bushd_ticks;

// Bytes of a ticks payload before the arrays.
#define BUSHD_TICKS_HEADER 9u
// The most ticks of `motors` (1 .. BUSHD_MOTORS_PER_MCU) motors that one frame can carry.
uint8_t bushd_ticks_capacity(uint8_t motors, bool fine, bool delays);

typedef struct bushd_motor_report {
  int32_t position_steps;  // steps made until the start of `tick`
  uint16_t known_until;    // low 16 bits of the first tick for which nothing is queued
} bushd_motor_report;

typedef struct bushd_report {
  uint8_t state;   // bushd_state
  uint8_t faults;  // BUSHD_FAULT_*
  uint8_t flags;   // BUSHD_FLAG_*
  uint8_t epoch;
  uint16_t boot_number;
  uint32_t tick;     // the tick being emitted
  uint32_t tick_ns;  // how far into it, when the report was made
  uint8_t mark_tag;  // the last mark heard, and when it was by the MCU's own clock
  uint32_t mark_tick;
  uint32_t mark_ns;
  uint16_t moving;           // motors not at rest
  uint16_t inputs;           // bit per motor
  uint16_t bad_frames;       // CRC and length errors; saturates
  uint16_t rejected_frames;  // good frames that could not be used; saturates
  uint8_t last_rejection;    // bushd_status of the last one
  uint8_t motor_count;       // <= BUSHD_MOTORS_PER_MCU
  bushd_motor_report motor[BUSHD_MOTORS_PER_MCU];
} bushd_report;

#define BUSHD_REPORT_SIZE(motors) (33u + 6u * (motors))

typedef struct bushd_acknowledgement {
  uint8_t status;  // bushd_status
} bushd_acknowledgement;

// Encoders return the payload's size. Preconditions are the ranges given above.
size_t bushd_encode_identity(const bushd_identity* message, uint8_t* payload);
size_t bushd_encode_configure(const bushd_configure* message, uint8_t* payload);
size_t bushd_encode_table_begin(const bushd_table_begin* message, uint8_t* payload);
size_t bushd_encode_table_data(uint8_t slot, uint16_t offset, uint8_t count, const uint16_t* codes,
                               uint8_t* payload);
size_t bushd_encode_table_end(const bushd_table_end* message, uint8_t* payload);
size_t bushd_encode_assign(const bushd_assign* message, uint8_t* payload);
size_t bushd_encode_control(const bushd_control* message, uint8_t* payload);
size_t bushd_encode_set_position(const bushd_set_position* message, uint8_t* payload);
size_t bushd_encode_sync(const bushd_sync* message, uint8_t* payload);
size_t bushd_encode_report(const bushd_report* message, uint8_t* payload);
size_t bushd_encode_acknowledgement(const bushd_acknowledgement* message, uint8_t* payload);

// Writes header and delays of a ticks payload and returns where the displacements go; the caller
// writes count x motors of them there (bushd_put_i16 or plain bytes). `delays` has an entry per
// motor of the mask, or is NULL. The payload's size is that offset plus the displacements.
size_t bushd_encode_ticks_head(uint8_t epoch, uint8_t flags, uint32_t first_tick, uint8_t count,
                               uint16_t mask, const uint16_t* delays, uint8_t* payload);

// Decoders return BUSHD_OK, BUSHD_E_LENGTH or BUSHD_E_FORMAT.
bushd_status bushd_decode_identity(const uint8_t* payload, size_t size, bushd_identity* message);
bushd_status bushd_decode_configure(const uint8_t* payload, size_t size, bushd_configure* message);
bushd_status bushd_decode_table_begin(const uint8_t* payload, size_t size,
                                      bushd_table_begin* message);
bushd_status bushd_decode_table_data(const uint8_t* payload, size_t size,
                                     bushd_table_data* message);
bushd_status bushd_decode_table_end(const uint8_t* payload, size_t size, bushd_table_end* message);
bushd_status bushd_decode_assign(const uint8_t* payload, size_t size, bushd_assign* message);
bushd_status bushd_decode_control(const uint8_t* payload, size_t size, bushd_control* message);
bushd_status bushd_decode_set_position(const uint8_t* payload, size_t size,
                                       bushd_set_position* message);
bushd_status bushd_decode_sync(const uint8_t* payload, size_t size, bushd_sync* message);
bushd_status bushd_decode_ticks(const uint8_t* payload, size_t size, bushd_ticks* message);
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
