// Programs: what an MCU does by itself, frame after frame (docs/protocol.md, "Programs").
//
// A program is a string of bytes: a head, a part for each of its motors, then frames until END. The
// table below is all there is to the layout of frames: the reader, the checker and the test of the
// document are made of it. Nothing here needs more memory than the bytes themselves, so the MCU
// reads them where they have been put.
#ifndef BUSHD_ENGINE_PROGRAM_H
#define BUSHD_ENGINE_PROGRAM_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "engine/message_base.h"
#include "engine/status.h"

#ifdef __cplusplus
extern "C" {
#endif

#define BUSHD_PROGRAM_FORMAT 1u      // version of this layout, the first byte of a program
#define BUSHD_PROGRAM_MOST_DEPTH 4u  // REPEATs within each other
#define BUSHD_PROGRAM_MOST_WAIT_US UINT32_C(3600000000)
#define BUSHD_PROGRAM_MOST_PULSE_US UINT32_C(1000000)
#define BUSHD_PROGRAM_INPUTS 20u        // those of motors, then those of the system, bit by bit
#define BUSHD_PROGRAM_SYSTEM_INPUT 16u  // the first of these

// Bits of bushd_program.flags.
enum {
  BUSHD_PROGRAM_WITHOUT_HOST = 1 << 0,
  BUSHD_PROGRAM_KEPT = 1 << 1,  // it outlives resets and power cuts
  // It begins by itself when the power comes. The other two are set then, it has no MOVE_TO,
  // LINE_TO and TRAVEL, since nobody knows where its motors are, and its parts' ranges count from
  // where each motor is when it begins, however that was asked for.
  BUSHD_PROGRAM_AT_POWER_ON = 1 << 2
};

#define BUSHD_PROGRAM_HEAD 4u
#define BUSHD_PROGRAM_MOTOR 9u  // bytes of each motor's part

// FRAME(NAME, code, bytes of its own fields, bytes for each of its motors). A frame with motors has
// their mask first; a line has motors' bytes for each point.
#define BUSHD_PROGRAM_FRAMES(FRAME) \
  FRAME(END, 0, 0, 0)               \
  FRAME(MOVE_TO, 1, 2, 6)           \
  FRAME(MOVE_BY, 2, 2, 6)           \
  FRAME(LINE_TO, 3, 7, 4)           \
  FRAME(LINE_BY, 4, 7, 4)           \
  FRAME(WAIT, 5, 4, 0)              \
  FRAME(WAIT_INPUT, 6, 6, 0)        \
  FRAME(PULSE, 7, 4, 0)             \
  FRAME(REPEAT, 8, 2, 0)            \
  FRAME(NEXT, 9, 0, 0)              \
  FRAME(TRAVEL, 10, 12, 4)          \
  FRAME(MOVE_UNTIL, 11, 8, 6)

#define BUSHD_PROGRAM_KIND(name, code, own, motor) BUSHD_PROGRAM_##name = (code),
typedef enum bushd_program_kind {
  BUSHD_PROGRAM_FRAMES(BUSHD_PROGRAM_KIND) BUSHD_PROGRAM_KINDS = 12
} bushd_program_kind;
#undef BUSHD_PROGRAM_KIND

// A program as it lies in memory.
typedef struct bushd_program {
  uint8_t flags;
  uint16_t motors;        // all that it moves, not 0
  const uint8_t* parts;   // of its motors, the lowest one first
  const uint8_t* frames;  // the first one
  const uint8_t* end;     // behind the last one
} bushd_program;

typedef struct bushd_program_motor {
  uint8_t bank;         // the table that the motor must have
  int32_t least_steps;  // where it may go; AT_POWER_ON: how far
  int32_t most_steps;
} bushd_program_motor;

// A frame; fields that its kind does not have are 0.
typedef struct bushd_program_frame {
  uint8_t kind;  // bushd_program_kind
  uint16_t motors;
  uint8_t motor_count;
  uint8_t bank;             // of a line, or of TRAVEL
  bool elementary;          // a line by engine/elementary.h, not by engine/line.h
  uint16_t shortest_delay;  // of a line; of moves each motor has its own
  uint16_t points;          // of a line; 1 of a move and of TRAVEL
  uint32_t after_steps;     // MOVE_UNTIL: from the input's change on
  uint32_t us;              // WAIT; the longest one of WAIT_INPUT, 0: for ever; PULSE; until the
                            // return of TRAVEL
  uint32_t delay_us;        // from the edge to the first run of TRAVEL
  uint8_t edge;             // bushd_edge of TRAVEL
  uint8_t input;
  bool level;
  uint16_t count;          // of REPEAT, 0: without end
  const uint8_t* entries;  // of motors, by bushd_program_entry
} bushd_program_frame;

typedef struct bushd_program_entry {
  int32_t steps;  // a position, or a distance; the first run of TRAVEL; MOVE_UNTIL: at most
  uint16_t shortest_delay;  // of moves
} bushd_program_entry;

// Whether the bytes are a program that an MCU with these motors can carry out: every field in its
// range, every REPEAT with its NEXT, END as the last byte. O(bytes). BUSHD_OK, BUSHD_E_LENGTH,
// BUSHD_E_FORMAT, or BUSHD_E_VERSION: another BUSHD_PROGRAM_FORMAT. What it says of tables is not
// looked at.
bushd_status bushd_program_check(const uint8_t* bytes, size_t size, uint16_t own_motors,
                                 bushd_program* program);

// What follows has the precondition that the program was checked.

// The part of the nth of its motors, from 0.
bushd_program_motor bushd_program_part(const bushd_program* program, uint8_t nth);
// The frame at *at, which moves on to the next one.
bushd_program_frame bushd_next_program_frame(const bushd_program* program, const uint8_t** at);
// What it says of its nth motor, from 0; a line at this point.
bushd_program_entry bushd_program_entry_of(const bushd_program_frame* frame, uint16_t point,
                                           uint8_t nth);

static inline bool bushd_program_is_line(uint8_t kind) {
  return kind == BUSHD_PROGRAM_LINE_TO || kind == BUSHD_PROGRAM_LINE_BY;
}
static inline bool bushd_program_is_move(uint8_t kind) {
  return kind == BUSHD_PROGRAM_MOVE_TO || kind == BUSHD_PROGRAM_MOVE_BY ||
         kind == BUSHD_PROGRAM_MOVE_UNTIL;
}
// It has an input and its level.
static inline bool bushd_program_has_input(uint8_t kind) {
  return kind == BUSHD_PROGRAM_WAIT_INPUT || kind == BUSHD_PROGRAM_MOVE_UNTIL;
}
static inline bool bushd_program_is_relative(uint8_t kind) {
  return kind == BUSHD_PROGRAM_MOVE_BY || kind == BUSHD_PROGRAM_LINE_BY ||
         kind == BUSHD_PROGRAM_MOVE_UNTIL;
}

#ifdef __cplusplus
}
#endif
#endif
