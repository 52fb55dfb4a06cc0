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
#include "firmware/core/port.h"
#include "firmware/core/program.h"
#include "firmware/core/slot_buffer.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct bushd_mcu bushd_mcu;  // mcu_state.h
typedef struct bushd_mcu_currents bushd_mcu_currents;
typedef struct bushd_mcu_velocity bushd_mcu_velocity;
typedef struct bushd_mcu_scratch bushd_mcu_scratch;
typedef struct bushd_mcu_program bushd_mcu_program;

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
  bool keeps_programs : 1;  // what nvm.h lists, a program too, outlives its resets
  bool no_slow_runs : 1;    // although the engine has them (BUSHD_SLOW_RUNS)
  bool no_elementary : 1;   // lines by that law, although the engine has it (BUSHD_ELEMENTARY)
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
#if BUSHD_PROGRAMS
  bushd_mcu_program* program;  // NULL: it carries out none
#endif
  uint16_t* codes;  // table memory
  uint16_t code_count;
  // BUSHD_MCU_MAX_REPLY bytes for answers. May be the end of the receiver's buffer, if the port
  // keeps the receiver out of it from the making of an answer until it is sent.
  uint8_t* reply;
  uint8_t unique_id[BUSHD_UNIQUE_ID_SIZE];
  // Kept from before (bushd_mcu_nvm_region_at); all 0: there are none. The core's after boot. Last:
  // an AVR reaches what lies before it faster.
  bushd_set_outputs outputs;
} bushd_mcu_config;

// Starts in state BUSY with EN low, unless it is to be high at boot; a control message raises it.
void bushd_mcu_boot(bushd_mcu* mcu, const bushd_port* port, const bushd_mcu_config* config);

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
