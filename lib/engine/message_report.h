// POLL, and REPORT, which answers it (engine/message.h).
//
// A report tells what is new since the last one that the master has. It begins with a base, which
// every report has; then come sections, each only if something in it may be new, and motors, each
// only if it moves or has moved. The tables below are all there is to the layout: encoder, decoder,
// sizes and the test of docs/protocol.md are made of them.
#ifndef BUSHD_ENGINE_MESSAGE_REPORT_H
#define BUSHD_ENGINE_MESSAGE_REPORT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "engine/message_base.h"
#include "engine/message_motion.h"
#include "engine/status.h"

#ifdef __cplusplus
extern "C" {
#endif

// Asks `count` MCUs for reports, each in a reply window of its own: entry i (bushd_poll_entry)
// names an address and when, after this frame's end, its answer begins.
#define BUSHD_POLL_ENTRY 5u  // bytes
#define BUSHD_POLL_MAX_ENTRIES ((BUSHD_FRAME_MAX_PAYLOAD - 1u) / BUSHD_POLL_ENTRY)
typedef struct bushd_poll_entry {
  uint8_t address;
  uint16_t begin_units;  // BUSHD_REPLY_UNIT_NS
  uint8_t known;         // number of the last report that the master has; 0: none, it wants all
  uint8_t room;          // the most bytes of payload that the answer may have
} bushd_poll_entry;
typedef struct bushd_poll {
  uint8_t count;           // >= 1
  const uint8_t* entries;  // count x BUSHD_POLL_ENTRY bytes
} bushd_poll;
// The entry with this address, if there is one.
bool bushd_poll_find(const bushd_poll* poll, uint8_t address, bushd_poll_entry* entry);

// Fields in the order of the line: FIELD(type, name), with a type of 8, 16, 32 or S32 bits.
#define BUSHD_REPORT_BASE(FIELD) \
  FIELD(8, state)                \
  FIELD(8, faults)               \
  FIELD(8, flags)                \
  FIELD(8, epoch)                \
  FIELD(16, boot_number)         \
  FIELD(8, number)               \
  FIELD(8, sections)             \
  FIELD(16, motors)              \
  FIELD(16, moving)              \
  FIELD(16, current)             \
  FIELD(32, tick)                \
  FIELD(32, tick_ns)
#define BUSHD_REPORT_BOOT(FIELD) \
  FIELD(8, reset_cause)          \
  FIELD(8, failed_tests)         \
  FIELD(8, motor_count)
#define BUSHD_REPORT_SYNC(FIELD) \
  FIELD(32, sync_id)             \
  FIELD(32, sync_tick)           \
  FIELD(32, sync_ns)             \
  FIELD(S32, rate_ppb)
#define BUSHD_REPORT_INPUTS(FIELD) \
  FIELD(16, inputs)                \
  FIELD(16, forbidden_positive)    \
  FIELD(16, forbidden_negative)    \
  FIELD(8, system_inputs)
#define BUSHD_REPORT_COUNTERS(FIELD) \
  FIELD(16, bad_frames)              \
  FIELD(16, rejected_frames)         \
  FIELD(8, last_rejection)           \
  FIELD(16, ramp_downs)
#define BUSHD_REPORT_MOTION(FIELD) \
  FIELD(16, running)               \
  FIELD(16, autonomous)            \
  FIELD(16, low_water_ticks)       \
  FIELD(16, out_of_order)          \
  FIELD(16, out_of_order_from)     \
  FIELD(16, out_of_order_until)
#define BUSHD_REPORT_AUTONOMOUS(FIELD) \
  FIELD(16, homed)                     \
  FIELD(8, homing)                     \
  FIELD(16, armed)                     \
  FIELD(8, trigger_number)             \
  FIELD(8, trigger_state)              \
  FIELD(32, start_tick)                \
  FIELD(32, start_ns)
#define BUSHD_REPORT_MOTOR(FIELD) \
  FIELD(S32, position_steps)      \
  FIELD(16, known_until)
// SECTION(NAME, bit of bushd_report.sections, BUSHD_REPORT_NAME), in the order of the line.
#define BUSHD_REPORT_SECTIONS(SECTION)        \
  SECTION(BOOT, 0, BUSHD_REPORT_BOOT)         \
  SECTION(SYNC, 1, BUSHD_REPORT_SYNC)         \
  SECTION(INPUTS, 2, BUSHD_REPORT_INPUTS)     \
  SECTION(COUNTERS, 3, BUSHD_REPORT_COUNTERS) \
  SECTION(MOTION, 4, BUSHD_REPORT_MOTION)     \
  SECTION(AUTONOMOUS, 5, BUSHD_REPORT_AUTONOMOUS)

#define BUSHD_SECTION_BIT(name, bit, fields) BUSHD_TELLS_##name = 1 << (bit),
enum {  // bushd_report.sections
  BUSHD_REPORT_SECTIONS(BUSHD_SECTION_BIT) BUSHD_TELLS_ALL = 0x3F
};
#undef BUSHD_SECTION_BIT

#define BUSHD_BYTES_8 1u
#define BUSHD_BYTES_16 2u
#define BUSHD_BYTES_32 4u
#define BUSHD_BYTES_S32 4u
#define BUSHD_FIELD_BYTES(type, name) +BUSHD_BYTES_##type
#define BUSHD_SECTION_BYTES(name, bit, fields) +(0u fields(BUSHD_FIELD_BYTES))
#define BUSHD_REPORT_BASE_SIZE (0u BUSHD_REPORT_BASE(BUSHD_FIELD_BYTES))
#define BUSHD_REPORT_MOTOR_SIZE (0u BUSHD_REPORT_MOTOR(BUSHD_FIELD_BYTES))
// What may be new of an MCU that is online and whose motors move.
#define BUSHD_NEWS_IN_MOTION \
  (BUSHD_TELLS_SYNC | BUSHD_TELLS_INPUTS | BUSHD_TELLS_MOTION | BUSHD_TELLS_AUTONOMOUS)
// The size of one that tells all.
#define BUSHD_REPORT_SIZE(motors)                                             \
  (BUSHD_REPORT_BASE_SIZE + (0u BUSHD_REPORT_SECTIONS(BUSHD_SECTION_BYTES)) + \
   BUSHD_REPORT_MOTOR_SIZE * (motors))

typedef struct bushd_motor_report {
  int32_t position_steps;  // steps made until the start of `tick`
  uint16_t known_until;    // low 16 bits of the first tick for which nothing is decided; at most
                           // 32767 after `tick`
} bushd_motor_report;

// What an MCU is like, as far as its reports have told.
typedef struct bushd_report {
  uint8_t state;   // bushd_state
  uint8_t faults;  // BUSHD_FAULT_*
  uint8_t flags;   // BUSHD_FLAG_*
  uint8_t epoch;
  uint16_t boot_number;
  // 1..255, another one than the report before has; 0: what is new found no room, and this is
  // nothing but a base without a number.
  uint8_t number;
  uint8_t sections;  // BUSHD_TELLS_*, those that this report has
  uint16_t motors;   // those that it has
  uint16_t moving;   // motors not at rest
  uint16_t current;  // of the supply, 0..1023
  uint32_t tick;     // the tick being emitted
  uint32_t tick_ns;  // how far into it, when the poll's frame ended
  // BOOT
  uint8_t reset_cause;   // BUSHD_RESET_*
  uint8_t failed_tests;  // at boot, BUSHD_TEST_*
  uint8_t motor_count;   // <= BUSHD_MOTORS_PER_MCU
  // SYNC
  uint32_t sync_id;  // the last SYNC heard, and when it ended by the MCU's own clock
  uint32_t sync_tick;
  uint32_t sync_ns;
  int32_t rate_ppb;  // how much faster than its crystal the MCU counts, to follow the bus
  // INPUTS
  uint16_t inputs;              // bit per motor: active
  uint16_t forbidden_positive;  // motors that a limit keeps from moving in this direction
  uint16_t forbidden_negative;
  uint8_t system_inputs;  // active, BUSHD_INPUT_*
  // COUNTERS
  uint16_t bad_frames;       // CRC and length errors; saturates
  uint16_t rejected_frames;  // valid frames that could not be used; saturates
  uint8_t last_rejection;    // bushd_status of the last one
  uint16_t ramp_downs;       // motors that had to be ramped down since boot; saturates
  // MOTION; a report without it tells that all of it is 0, and the low water 65535.
  uint16_t running;     // of the motors that move, those in a table run
  uint16_t autonomous;  // those that move by homing, travel or local inputs
  // The fewest ticks that a moving motor had queued, since the last report that the master has;
  // 65535: none moved.
  uint16_t low_water_ticks;
  // Ticks that these motors have beyond a gap: from the tick `out_of_order_from` (low 16 bits) on,
  // until `out_of_order_until`.
  uint16_t out_of_order;
  uint16_t out_of_order_from;
  uint16_t out_of_order_until;
  // AUTONOMOUS: homing, travel and trigger
  uint16_t homed;          // motors whose last homing since boot was done
  uint8_t homing;          // bushd_homing or bushd_travel_stage, of the last of both
  uint16_t armed;          // motors that wait for the trigger
  uint8_t trigger_number;  // of the last one taken; 0: none since boot
  uint8_t trigger_state;   // bushd_trigger_state
  uint32_t start_tick;     // when it began, or will, if BUSHD_TRIGGER_STARTED
  uint32_t start_ns;       // after the beginning of start_tick
  // A report that does not have one tells that it is at rest where it was, until
  // BUSHD_REST_KNOWN_TICKS after `tick`.
  bushd_motor_report motor[BUSHD_MOTORS_PER_MCU];
} bushd_report;
#define BUSHD_REST_KNOWN_TICKS 2u

// Encoders return the payload's size.
size_t bushd_encode_poll(const bushd_poll_entry* entries, uint8_t count, uint8_t* payload);
bushd_status bushd_decode_poll(const uint8_t* payload, size_t size, bushd_poll* message);
// The sections and motors that are named in it.
size_t bushd_encode_report(const bushd_report* message, uint8_t* payload);
// The size of what the encoder makes of these.
size_t bushd_report_size(uint8_t sections, uint16_t motors);
// Motors and BUSHD_TELLS_MOTION as they are while nothing moves.
void bushd_report_rest(bushd_report* message);
// `message` holds what reports before have told, and after BUSHD_OK what this one has told too;
// after any other status it is void. Of one without a number only the base counts.
bushd_status bushd_decode_report(const uint8_t* payload, size_t size, bushd_report* message);
// It stands for itself: nothing of reports before is needed.
bool bushd_report_is_whole(const bushd_report* message);

#ifdef __cplusplus
}
#endif
#endif
