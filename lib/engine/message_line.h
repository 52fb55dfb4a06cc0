// LINE_RUN, LINE_TRIGGER: motors that follow one run along a straight line, by the law of
// engine/line.h or of engine/elementary.h (engine/message.h).
#ifndef BUSHD_ENGINE_MESSAGE_LINE_H
#define BUSHD_ENGINE_MESSAGE_LINE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "engine/elementary.h"
#include "engine/message_motion.h"
#include "engine/status.h"

#ifdef __cplusplus
extern "C" {
#endif

// A run of a table, and the motors of one MCU that follow it. The others of the line are told the
// same, but for their own entries.
typedef struct bushd_line_part {
  uint8_t bank;  // of the run's table, whosever it is, or BUSHD_SCRATCH_BANK
#if BUSHD_ELEMENTARY
  bool elementary;  // by engine/elementary.h: L is the sum of all increments, which are all here,
                    // and `from` is 0
#endif
  uint16_t shortest_delay;  // no delay of the run is shorter, time units of that table; 0: none
  uint32_t longest;         // L, below 2^31
  uint32_t from;            // steps of the line that are over when the run begins
  uint32_t steps;           // of the run, >= 1, not beyond L
  uint8_t count;            // of entries, >= 1
  const uint8_t* entries;
} bushd_line_part;
#define BUSHD_LINE_RUN_HEADER 20u
#define BUSHD_LINE_RUN_ENTRY 5u
typedef struct bushd_line_entry {
  uint8_t motor;
  int8_t direction;    // +1, -1
  uint32_t increment;  // |N|, 1 .. L
} bushd_line_entry;

// From rest, at the beginning of first_tick. Steps fall exact to a slot.
typedef struct bushd_line_run {
  uint8_t epoch;
  uint32_t first_tick;
  bushd_line_part line;
} bushd_line_run;

// The same, begun by an edge at the trigger input, BUSHD_TRIGGER_FIXED_TICKS ticks and delay_us
// after it: as of bushd_trigger, which disarms it, too.
typedef struct bushd_line_trigger {
  uint8_t number;   // 1..255
  bushd_edge edge;  // not BUSHD_EDGE_NONE
  uint32_t delay_us;
  bushd_line_part line;
} bushd_line_trigger;
#define BUSHD_LINE_TRIGGER_HEADER 21u

// The entry at *at, which moves on to the next one.
bushd_line_entry bushd_next_line_entry(const uint8_t** at);

// Returns the payload's size. Preconditions are the ranges given above; motors rise. The part's own
// count and entries are not read.
size_t bushd_encode_line_run(const bushd_line_run* message, const bushd_line_entry* entries,
                             uint8_t count, uint8_t* payload);
// Returns BUSHD_OK, BUSHD_E_LENGTH or BUSHD_E_FORMAT.
bushd_status bushd_decode_line_run(const uint8_t* payload, size_t size, bushd_line_run* message);
size_t bushd_encode_line_trigger(const bushd_line_trigger* message, const bushd_line_entry* entries,
                                 uint8_t count, uint8_t* payload);
bushd_status bushd_decode_line_trigger(const uint8_t* payload, size_t size,
                                       bushd_line_trigger* message);

#ifdef __cplusplus
}
#endif
#endif
