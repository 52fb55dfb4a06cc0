// The MCU program without hardware: address filter, tick queue, the pipeline displacement -> slot
// masks -> outputs, position counters, states and replies. A port (firmware/ports/*) calls it from
// its interrupts.
//
// Who calls what:
// - bushd_mcu_boot: once after reset
// - bushd_mcu_receive: for every byte on the line
// - bushd_mcu_swap: at every tick boundary; the returned plane is emitted during the tick that
//   begins
// - bushd_mcu_prepare: after every swap and before the next; computes the plane of the tick that
//   follows
// The functions are not reentrant; a port that calls `swap` from an interrupt may do so between two
// calls of the others only (or masks it). Ticks run from boot on, whether or not the host has been
// heard.
#ifndef BUSHD_FIRMWARE_CORE_MCU_H
#define BUSHD_FIRMWARE_CORE_MCU_H

#include "engine/frame.h"
#include "engine/message.h"
#include "engine/run.h"
#include "engine/slots.h"
#include "engine/table.h"
#include "firmware/core/port.h"

#ifdef __cplusplus
extern "C" {
#endif

#define BUSHD_FIRMWARE_VERSION 1u
#define BUSHD_BOOT_TICK_NS 2560000u  // tick length until the host configures one

// What is emitted during one tick.
typedef struct bushd_plane {
  uint16_t direction;                   // DIR levels, bit per motor, constant within the tick
  uint16_t step[BUSHD_MAX_SLOTS];       // STEP pulses of each slot, bit per motor
  int16_t steps[BUSHD_MOTORS_PER_MCU];  // signed steps of the tick, for the position counters
  uint16_t active;                      // motors with a step in this tick
} bushd_plane;

// Memory and identity, given by the port; all of it outlives the MCU struct.
typedef struct bushd_mcu_config {
  uint8_t address;       // 1..255
  uint8_t motors;        // 1..BUSHD_MOTORS_PER_MCU
  uint16_t slots;        // BUSHD_MIN_SLOTS..BUSHD_MAX_SLOTS
  uint16_t boot_number;  // differs from that of the boot before
  int16_t* queue;        // queue_ticks x motors displacements
  uint16_t
      queue_ticks;  // 32 .. 16384, a power of two (absolute tick numbers then wrap without a seam)
  uint16_t* codes;  // table memory
  uint16_t code_count;
} bushd_mcu_config;

typedef struct bushd_mcu_motor {
  int32_t position_steps;  // until the start of the present tick
  int16_t remainder;       // exact position minus steps made, 1/256 step
  int8_t table;            // table slot, -1: none
  bool running_down;       // `run` is a ramp-down after the queue ended early
  bool begun;              // a displacement was executed since start_tick
  uint16_t delay;          // of the running step when the queued ticks end; 0: at rest there
  uint32_t start_tick;     // of the last start taken
  uint32_t known_until;  // first tick for which nothing is queued; always > tick + 1 once prepared
  bushd_run run;
} bushd_mcu_motor;

typedef struct bushd_mcu_table {
  bool valid;
  uint16_t first;  // of its codes, in code memory
  uint16_t count;  // codes announced, both sides
  uint16_t received;
  bushd_table table;
} bushd_mcu_table;

// Read-only for ports and tests; everything in here is the core's.
typedef struct bushd_mcu {
  bushd_port port;
  bushd_mcu_config config;
  uint32_t tick;  // the tick being emitted
  uint32_t tick_ns;
  uint8_t state;  // bushd_state
  uint8_t faults;
  uint8_t flags;
  uint8_t epoch;
  bushd_format format;
  uint8_t front;      // plane[front] is being emitted
  uint8_t settling;   // ticks until the tick timer has carried out the last jump; marks are void
                      // till then
  int32_t behind_ns;  // the bus, still to be made up by the tick timer
  uint8_t mark_tag;
  uint32_t mark_tick;
  uint32_t mark_ns;
  uint16_t bad_frames;
  uint16_t rejected_frames;
  uint8_t last_rejection;
  uint16_t direction;  // DIR levels of the plane prepared last
  uint16_t codes_used;
  bushd_plane plane[2];
  bushd_mcu_motor motor[BUSHD_MOTORS_PER_MCU];
  bushd_mcu_table table[BUSHD_TABLE_SLOTS];
  bushd_receiver receiver;
  uint8_t reply[BUSHD_FRAME_MAX_WIRE + 1u];
} bushd_mcu;

// Starts in state BUSY with EN low; a control message raises it.
void bushd_mcu_boot(bushd_mcu* mcu, const bushd_port* port, const bushd_mcu_config* config);

// One byte from the line. `time_in_tick_ns` is when its stop bit ended, counted from the start of
// the present tick; only used at delimiters. O(1), O(frame) at a delimiter.
void bushd_mcu_receive(bushd_mcu* mcu, uint8_t byte, uint32_t time_in_tick_ns);

// Tick boundary: counts the steps of the tick that ended, returns the plane of the one that begins.
// O(motors).
const bushd_plane* bushd_mcu_swap(bushd_mcu* mcu);

// Computes the plane of the next tick. O(slots + steps).
void bushd_mcu_prepare(bushd_mcu* mcu);

#ifdef __cplusplus
}
#endif
#endif
