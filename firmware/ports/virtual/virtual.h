// The virtual port: an MCU whose tick timer, pins and bus driver live in simulated time.
//
// Nothing runs by itself. The caller moves time with bushd_virtual_advance and hands over bytes;
// the port calls back with the edges of its pins and the bytes that it sends. The same calls give
// the same callbacks, always.
//
// Time is true time in ns, int64. The MCU's own clock starts at 0 at boot and runs at
// (1 + clock_ppm / 1e6) times true time; the core sees only this clock:
//
//     own(t)    = floor((t - boot) * (1e6 + ppm) / 1e6)
//     true(own) = the first t that reaches it
//
// A tick of `len` own ns with S slots makes its edges at own times  start + floor(e * len / 2S):
// e = 2s is where the STEP pulses of slot s rise, e = 2s + 1 where they fall, half a slot later.
// The common DIR changes where they fall; levels of phases at e = 2s.
#ifndef BUSHD_FIRMWARE_PORTS_VIRTUAL_VIRTUAL_H
#define BUSHD_FIRMWARE_PORTS_VIRTUAL_VIRTUAL_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "firmware/core/mcu_state.h"
#include "firmware/core/nvm.h"

#ifdef __cplusplus
extern "C" {
#endif

#define BUSHD_VIRTUAL_MAX_PPM 100000
#define BUSHD_VIRTUAL_OUTPUTS 16u
#define BUSHD_VIRTUAL_COMPARED_BYTES 1024  // of what outlives a reset, in a tick
#define BUSHD_VIRTUAL_SAMPLE_NS 20000      // from one sample of the supply current to the next

typedef enum bushd_virtual_signal {
  BUSHD_VIRTUAL_STEP = 0,
  BUSHD_VIRTUAL_DIR = 1,
  BUSHD_VIRTUAL_EN = 2,          // one per MCU, index 0
  BUSHD_VIRTUAL_COMMON_DIR = 3,  // one per MCU, index 0
  BUSHD_VIRTUAL_COMPARE = 4      // one per MCU, index 0
} bushd_virtual_signal;

typedef struct bushd_virtual_config {
  bushd_mcu_config mcu;  // identity and memory; its boot_number is that of the first boot
  int64_t boot_ns;  // the MCU comes out of reset here; before that it is deaf and its pins are low
  int32_t clock_ppm;  // rate error of its clock, > 0: fast; |clock_ppm| <= BUSHD_VIRTUAL_MAX_PPM
  uint32_t turnaround_ns;  // from the end of a request to the first bit of the reply
  // Memory for what outlives a reset (firmware/core/nvm.h), if mcu.keeps_programs; enough of it.
  uint8_t* nvm;
  size_t nvm_size;
  void* context;  // handed back in both callbacks

  // A pin changed. All pins are low at first. Times never fall from call to call. NULL if nobody
  // looks: then ticks cost no work per slot.
  void (*edge)(void* context, int64_t time_ns, bushd_virtual_signal signal, uint8_t index,
               bool level);

  // The inputs, now that the MCU reads them. NULL: they are as bushd_virtual.inputs says.
  bushd_inputs (*read_inputs)(void* context, int64_t time_ns);
  // What the current sensor reads at a time of the present tick, or now. NULL: what is set.
  uint16_t (*current)(void* context, int64_t time_ns);

  // The MCU drives the line from start_ns on; `wire` is valid during the call only.
  void (*transmit)(void* context, int64_t start_ns, const uint8_t* wire, size_t size);
} bushd_virtual_config;

// What is in its non-volatile memory.
typedef struct bushd_virtual_kept {
  uint16_t size;  // 0: nothing yet
  uint32_t crc;
} bushd_virtual_kept;

// What a motor on an ideal driver has done since the simulation began, whatever the MCU believes.
typedef struct bushd_virtual_shaft {
  int64_t position_steps;
  uint64_t travel_steps;  // pulses, whatever their direction
} bushd_virtual_shaft;

// Fields named here may be read; the ones marked "set" may be set between calls.
typedef struct bushd_virtual {
  bushd_mcu mcu;
  bushd_virtual_config config;
  bushd_virtual_shaft shaft[BUSHD_VIRTUAL_OUTPUTS];  // until the start of the present tick
  bool running;                                      // out of reset
  int64_t tick_start_ns;                             // of the present tick, true time
  bushd_inputs inputs;                               // the input pins
  uint16_t current;                                  // set: what the current sensor reads
  uint8_t failing_tests;                             // set: BUSHD_TEST_*, for the next boots
  uint16_t current_ma[BUSHD_MAX_CURRENT_MOTORS];     // of windings, as the MCU wants them; 0: none
  uint8_t reset_cause;  // set: BUSHD_RESET_* of the next boot; falls to external with each

  // Private.
  int64_t now_ns;
  int64_t next_event_ns;
  int64_t tick_start_own_ns;
  int64_t tick_length_ns;  // of the present tick, in own time
  uint32_t tick_ns;        // of later ticks
  int32_t adjust_ns;       // of the next tick, once
  const bushd_slot_buffer* slot_buffer;
  uint16_t edge_cursor;  // next edge e of the present tick, 2S: none left
  uint16_t step_levels;
  uint16_t levels_before_tick;  // of phases, when the present tick began
  uint16_t dir_levels;
  uint16_t common_dir_level;
  bushd_set_outputs rest;  // what the port was told last
  bool enable_level;
  bool enable_kept;
  uint8_t reply[BUSHD_MCU_MAX_REPLY];
  bushd_mcu_currents currents[BUSHD_MAX_CURRENT_MOTORS];
  bushd_mcu_velocity velocity[BUSHD_MAX_VELOCITY_MOTORS];
  bool compare_level;
  bushd_mcu_nvm_scan scan;
  bushd_virtual_kept kept;
  bushd_edge trigger_edge;  // awaited
  bushd_edge off_at;        // of the emergency input
  bool switched_off;        // by it
} bushd_virtual;

// Precondition: config->mcu as bushd_mcu_boot wants it, its memory outlives *v; transmit is set.
// *v must not move in memory afterwards.
void bushd_virtual_init(bushd_virtual* v, const bushd_virtual_config* config);

// When the port next has something to do by itself: boot or tick boundary. O(1).
int64_t bushd_virtual_next_event_ns(const bushd_virtual* v);

// Moves time forward to now_ns: boots and ticks on the way happen, and all edges up to now_ns
// (included) are called back. Precondition: now_ns is not before the last time given.
void bushd_virtual_advance(bushd_virtual* v, int64_t now_ns);

// A byte's stop bit ended at now_ns. Advances to that time first; lost on an MCU in reset.
void bushd_virtual_receive(bushd_virtual* v, uint8_t byte, int64_t now_ns);

// A byte of the keypad ended at now_ns, or its line broke. As above.
void bushd_virtual_keypad_byte(bushd_virtual* v, uint8_t byte, int64_t now_ns);
void bushd_virtual_keypad_break(bushd_virtual* v, int64_t now_ns);
// The next character for its display, -1: none is due now. As fast as the caller likes.
int bushd_virtual_keypad_display(bushd_virtual* v);

// The inputs from the last time given on. An edge at the trigger's is captured; one at the
// emergency input's may switch EN off. The callback, if there is one, says the same of both.
void bushd_virtual_set_inputs(bushd_virtual* v, bushd_inputs inputs);

// Pulls the MCU's reset at now_ns: DIR falls, STEP and EN are where resistors of the board hold
// them, at rest and disabled. All memory is lost but what a watchdog reset leaves, and the levels
// of outputs. It boots again at boot_ns (>= now_ns).
void bushd_virtual_reset(bushd_virtual* v, int64_t now_ns, int64_t boot_ns, uint16_t boot_number);

#ifdef __cplusplus
}
#endif
#endif
