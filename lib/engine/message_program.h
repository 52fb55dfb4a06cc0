// PROGRAM_PUT, PROGRAM, PROGRAM_STATE: a program in the memory of an MCU (engine/program.h).
#ifndef BUSHD_ENGINE_MESSAGE_PROGRAM_H
#define BUSHD_ENGINE_MESSAGE_PROGRAM_H

#include <stddef.h>
#include <stdint.h>

#include "engine/frame.h"
#include "engine/message_base.h"
#include "engine/status.h"

#ifdef __cplusplus
extern "C" {
#endif

// A part of it; the one at 0 discards the program before.
typedef struct bushd_program_put {
  uint16_t offset;
  uint16_t total;  // bytes of the whole program
  uint8_t count;   // >= 1; not beyond `total`
  const uint8_t* bytes;
} bushd_program_put;
#define BUSHD_PROGRAM_PUT_HEADER 4u
#define BUSHD_PROGRAM_PUT_MAX (BUSHD_FRAME_MAX_PAYLOAD - BUSHD_PROGRAM_PUT_HEADER)

typedef enum bushd_program_action {
  BUSHD_PROGRAM_ERASE = 0,
  BUSHD_PROGRAM_COMMIT = 1,  // value: CRC-32 of all its bytes
  BUSHD_PROGRAM_RUN = 2,     // value: the first tick
  BUSHD_PROGRAM_STOP = 3,    // value: bushd_stop_mode
  BUSHD_PROGRAM_PAUSE = 4,
  BUSHD_PROGRAM_RESUME = 5
} bushd_program_action;
typedef struct bushd_program_control {
  uint8_t action;
  uint8_t number;  // of RUN: 1..255; else 0
  uint32_t value;  // of actions that have none: 0
} bushd_program_control;
#define BUSHD_PROGRAM_CONTROL_SIZE 6u

typedef enum bushd_program_stage {
  BUSHD_PROGRAM_NONE = 0,
  BUSHD_PROGRAM_LOADING = 1,  // parts have come
  BUSHD_PROGRAM_LOADED = 2,   // it is whole and good; not run yet
  BUSHD_PROGRAM_WAITS = 3,    // for its first tick
  BUSHD_PROGRAM_RUNS = 4,
  BUSHD_PROGRAM_PAUSES = 5,  // motors ramp down
  BUSHD_PROGRAM_PAUSED = 6,
  BUSHD_PROGRAM_ENDS = 7,  // motors ramp down
  BUSHD_PROGRAM_ENDED = 8
} bushd_program_stage;

typedef enum bushd_program_reason {
  BUSHD_PROGRAM_NO_REASON = 0,
  BUSHD_PROGRAM_DONE = 1,       // END was reached
  BUSHD_PROGRAM_STOPPED = 2,    // on request
  BUSHD_PROGRAM_FAULT = 3,      // emergency, overcurrent, lost step with the bus
  BUSHD_PROGRAM_SILENCE = 4,    // no master was heard
  BUSHD_PROGRAM_LIMIT = 5,      // a limit inhibits the direction of a motor
  BUSHD_PROGRAM_RANGE = 6,      // a frame leads beyond what its motor's part allows
  BUSHD_PROGRAM_NO_INPUT = 7,   // WAIT_INPUT has waited for its longest, MOVE_UNTIL has made all
  BUSHD_PROGRAM_REFUSED = 8,    // a motion that the MCU cannot make: another line is under way
  BUSHD_PROGRAM_DISABLED = 9,   // the drivers are disabled
  BUSHD_PROGRAM_LATE = 10,      // the ticks of the bus have changed before its first tick
  BUSHD_PROGRAM_TRAVELLED = 11  // a travel has failed; the report has its bushd_travel_stage
} bushd_program_reason;

// A bit of bushd_program_state.flags: a reset leaves the program as it is now, or none if there is
// none that is to be kept.
#define BUSHD_PROGRAM_STORED 0x80u

// The answer to PROGRAM_STATE, true of one tick.
typedef struct bushd_program_state {
  uint8_t stage;   // bushd_program_stage
  uint8_t reason;  // bushd_program_reason of the last run
  uint8_t number;  // of the last RUN taken; 0: none since boot
  uint8_t flags;   // of the program; BUSHD_PROGRAM_STORED
  uint16_t motors;
  uint16_t memory;      // bytes that a program may have
  uint16_t size;        // of the program, or of what has come of it
  uint32_t crc;         // of one that is whole
  uint16_t frame;       // that is carried out, or was last, from 0
  uint16_t point;       // of it, if it is a line
  uint32_t repeats;     // outermost NEXTs that have been reached
  uint32_t start_tick;  // of the last run
  uint32_t tick;        // the present one
} bushd_program_state;
#define BUSHD_PROGRAM_STATE_SIZE 30u

size_t bushd_encode_program_put(const bushd_program_put* message, uint8_t* payload);
bushd_status bushd_decode_program_put(const uint8_t* payload, size_t size,
                                      bushd_program_put* message);
size_t bushd_encode_program_control(const bushd_program_control* message, uint8_t* payload);
bushd_status bushd_decode_program_control(const uint8_t* payload, size_t size,
                                          bushd_program_control* message);
size_t bushd_encode_program_state(const bushd_program_state* message, uint8_t* payload);
bushd_status bushd_decode_program_state(const uint8_t* payload, size_t size,
                                        bushd_program_state* message);

#ifdef __cplusplus
}
#endif
#endif
