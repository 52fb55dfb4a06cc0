// The MCU program without hardware: address filter, tick queue, the pipeline displacement -> slot
// masks -> outputs, position counters, states and replies. A port (firmware/ports/*) calls it from
// its interrupts.
//
// Who calls what:
// - bushd_mcu_boot: once after reset
// - bushd_mcu_receive: for every byte on the bus
// - bushd_mcu_swap: at every tick boundary; the slot buffer that it returns is emitted during the
//   tick that begins
// - bushd_mcu_prepare: after every swap and before the next one; computes the slot buffer of the
//   tick that follows
// The functions are not reentrant; a port that calls `swap` from an interrupt may do so between two
// calls of the others only (or masks it). Ticks run from boot on, whether or not the host has been
// heard.
#ifndef BUSHD_FIRMWARE_CORE_MCU_H
#define BUSHD_FIRMWARE_CORE_MCU_H

#include "engine/frame.h"
#include "engine/message.h"
#include "engine/run.h"
#include "engine/run_slots.h"
#include "engine/table.h"

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
#include "firmware/core/port.h"
#include "firmware/core/position_compare.h"
#include "firmware/core/requests.h"
#include "firmware/core/slot_buffer.h"
#include "firmware/core/stream.h"
#include "firmware/core/sync.h"
#include "firmware/core/tables.h"
#include "firmware/core/travel.h"
#include "firmware/core/trigger.h"
#include "firmware/core/velocity.h"
#ifdef __cplusplus
}
#endif

#ifdef __cplusplus
extern "C" {
#endif

#define BUSHD_FIRMWARE_VERSION 2u
#define BUSHD_BOOT_TICK_NS 2560000u  // tick length until the host configures one

// The longest reply is a report; a delimiter stands in front.
#define BUSHD_MCU_MAX_REPLY (1u + BUSHD_REPORT_SIZE(BUSHD_MOTORS_PER_MCU) + BUSHD_FRAME_OVERHEAD)

// Memory and identity, given by the port; all of it outlives the MCU struct.
typedef struct bushd_mcu_config {
  uint8_t address;          // 1..255
  uint8_t motors;           // 1..BUSHD_MOTORS_PER_MCU
  uint16_t slots;           // BUSHD_MIN_SLOTS..BUSHD_MAX_SLOTS
  uint16_t boot_number;     // differs from that of the boot before
  uint8_t reset_cause;      // BUSHD_RESET_*
  bool enable_at_boot : 1;  // what keep_enable was told last, after a watchdog reset; else false
  bool in_pieces : 1;       // answers are left to bushd_mcu_work; else they are sent at once
  bool keypad : 1;          // it has a line for one (keypad.h)
  bool no_slow_runs : 1;    // although the engine has them (BUSHD_SLOW_RUNS)
  int16_t* queue;           // queue_ticks x motors displacements
  // 32 .. 16384, a power of two: then absolute tick numbers wrap without a seam.
  uint16_t queue_ticks;
  uint32_t min_tick_ns;  // shorter ones are refused
  int32_t pulse_ns;  // how long STEP pulses last; 0: half a slot; less: so much shorter than that
  uint16_t disabled_capabilities;  // BUSHD_CAN_* below 1 << 16 that it does not have: not in
                                   // the identity, and refused
  // For motors 0 .. current_motors-1, whose windings' currents the port controls; all zero.
  bushd_mcu_currents* currents;
  uint8_t current_motors;  // at most BUSHD_MAX_CURRENT_MOTORS
  // For motors 0 .. velocity_motors-1, that may move locally by the velocity loop; all zero.
  bushd_mcu_velocity* velocity;
  uint8_t velocity_motors;     // at most BUSHD_MAX_VELOCITY_MOTORS
  bushd_mcu_scratch* scratch;  // NULL: it has no BUSHD_SCRATCH_BANK
  uint16_t* codes;             // table memory
  uint16_t code_count;
  // BUSHD_MCU_MAX_REPLY bytes for answers. May be the end of the receiver's buffer, if the port
  // keeps the receiver out of it from the making of an answer until it is sent.
  uint8_t* reply;
  uint8_t unique_id[BUSHD_UNIQUE_ID_SIZE];
  // Kept from before (bushd_mcu_nvm_region_at); all 0: there are none. The core's after boot. Last:
  // an AVR reaches what lies before it faster.
  bushd_set_outputs outputs;
} bushd_mcu_config;

// Read-only for ports and tests; everything in here is the core's, and each part its module's.
typedef struct bushd_mcu {
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
} bushd_mcu;

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

// Starts in state BUSY with EN low, unless it is to be high at boot; a control message raises it.
void bushd_mcu_boot(bushd_mcu* mcu, const bushd_port* port, const bushd_mcu_config* config);

// What a port may keep over resets: pieces of memory, from index 0 on until one is empty. Later
// ones may be as long as earlier ones say. The first one is bushd_mcu_config.outputs, which a port
// reads before bushd_mcu_boot too. They hold addresses: only the same program may get them
// back, between bushd_mcu_boot and the first tick, the earlier ones first, and then
// bushd_mcu_nvm_restored.
typedef struct bushd_mcu_nvm_region {
  void* at;
  uint16_t size;
} bushd_mcu_nvm_region;
bushd_mcu_nvm_region bushd_mcu_nvm_region_at(bushd_mcu* mcu, uint8_t index);
// Bytes of all pieces together, with this much table memory and all motors.
#define BUSHD_MCU_NVM_MAX_BYTES(code_count)                                                     \
  (sizeof(bushd_set_outputs) + sizeof(uint32_t) + sizeof(bushd_format) +                        \
   sizeof(bushd_set_inputs) + BUSHD_MOTORS_PER_MCU * sizeof(bushd_mcu_switches) +               \
   sizeof(bushd_emission) + sizeof(bushd_local) + BUSHD_TABLE_BANKS * sizeof(bushd_mcu_table) + \
   sizeof(uint8_t) + sizeof(uint16_t) + (code_count) * sizeof(uint16_t) +                       \
   BUSHD_MOTORS_PER_MCU * sizeof(int8_t) + BUSHD_MAX_CURRENT_MOTORS * sizeof(bushd_currents) +  \
   BUSHD_MAX_VELOCITY_MOTORS * sizeof(bushd_mcu_velocity_settings))
void bushd_mcu_nvm_restored(bushd_mcu* mcu);

// For a port that goes through all pieces a little at a time, again and again.
typedef struct bushd_mcu_nvm_scan {
  uint8_t index;  // of the piece
  uint16_t offset;
  uint16_t size;         // of all bytes so far
  uint32_t crc;          // register after them
  uint32_t crc_before;   // of the scan before
  uint16_t same_uptime;  // since when it is the same
} bushd_mcu_nvm_scan;
void bushd_mcu_nvm_begin_scan(bushd_mcu_nvm_scan* scan);
// The next bytes, up to `most` (>= 1); empty at the end. Pieces may change between two calls: of
// one that has become shorter than the scan has come, nothing is left. Never more bytes in all than
// BUSHD_MCU_NVM_MAX_BYTES.
bushd_mcu_nvm_region bushd_mcu_nvm_scan_next(bushd_mcu* mcu, bushd_mcu_nvm_scan* scan,
                                             uint16_t most);
// At the end of a scan: whether what is kept has stayed the same for so long that it may be
// written. A master that begins changes one thing after the other.
bool bushd_mcu_nvm_is_quiet(const bushd_mcu* mcu, bushd_mcu_nvm_scan* scan);

// One byte from the line. `time_in_tick_ns` is when its stop bit ended, counted from the start of
// the present tick (negative: in one before); only used at delimiters. O(1), O(frame) at a
// delimiter.
void bushd_mcu_receive(bushd_mcu* mcu, uint8_t byte, int32_t time_in_tick_ns);

// What a frame of many ticks asks for is done in pieces if the port wants it so, and so are answers
// (bushd_mcu_config.in_pieces): while this returns true, something was left to do, and no byte is
// to be given to the receiver. The other functions do first what they need. O(motors), or O(bytes
// of an answer).
bool bushd_mcu_work(bushd_mcu* mcu);

// Tick boundary: counts the steps of the tick that ended, returns the slot_buffer of the one that
// begins. O(motors).
const bushd_slot_buffer* bushd_mcu_swap(bushd_mcu* mcu);

// The edge that was asked for (bushd_port.set_trigger) came at this time, counted from the start of
// the present tick: negative if that was before it. To be called between swaps as all others, at
// the latest in the tick after the edge: noticed later, what was armed is given up. O(motors).
void bushd_mcu_trigger(bushd_mcu* mcu, int32_t time_in_tick_ns);

// Computes the slot_buffer of the next tick. O(slots + steps).
void bushd_mcu_prepare(bushd_mcu* mcu);

// Whether samples of the supply current are wanted in the present tick, as many as the port can
// take.
bool bushd_mcu_wants_samples(const bushd_mcu* mcu);
// One that was taken so long after the tick's beginning. In order of time. O(1).
void bushd_mcu_sample(bushd_mcu* mcu, uint32_t time_in_tick_ns, uint16_t current);

#ifdef __cplusplus
}
#endif
#endif
