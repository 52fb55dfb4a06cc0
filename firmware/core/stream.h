// The tick queue, and frames of ticks.
#ifndef BUSHD_FIRMWARE_CORE_STREAM_H
#define BUSHD_FIRMWARE_CORE_STREAM_H

#include <stdbool.h>
#include <stdint.h>

#include "engine/message.h"

typedef struct bushd_mcu bushd_mcu;

// What the queue holds for all motors at once, so that no tick need look at each. To be made anew
// when a frame has come, or something was cut.
typedef struct bushd_mcu_queue_summary {
  bool stale;
  uint16_t rests;         // these are at rest, and will be until something is asked of them
  uint16_t plain;         // of these nothing but the queue decides, until:
  uint32_t plain_until;   // that tick
  uint16_t moves;         // these are to move on when their ticks end, the first of them at:
  uint32_t moving_until;  // that tick
  uint16_t runs;          // these are in a table run, until:
  uint32_t runs_until;    // that tick
  // Those that are plain and move on at plain_until, without an out-of-order range.
  uint16_t following;
} bushd_mcu_queue_summary;

// Rows of a frame that are still to be put into the queue. It was taken, and lies in the receiver.
typedef struct bushd_mcu_rows {
  uint8_t next;  // as many as ticks.count: none
  bushd_ticks ticks;
} bushd_mcu_rows;

typedef struct bushd_mcu_stream {
  uint8_t epoch;
  uint16_t begun;     // motors that move, as far as is known
  uint16_t starting;  // motors whose `start` is not over
  bushd_mcu_queue_summary queue_summary;
  bushd_mcu_rows rows;
} bushd_mcu_stream;

typedef struct bushd_mcu_tick_range {
  uint8_t epoch;
  uint8_t flags;
  uint32_t first_tick;
  uint16_t count;
  uint16_t mask;
} bushd_mcu_tick_range;
// What all frames that move motors must keep to. BUSHD_E_LATE: good, and holds nothing new.
bushd_status bushd_mcu_check_tick_range(bushd_mcu* mcu, const bushd_mcu_tick_range* range);
// The motor, at rest at its known_until, starts at that tick.
void bushd_mcu_note_start(bushd_mcu* mcu, uint8_t m, uint32_t tick);
// Nothing is known of this motor from `tick` on.
void bushd_mcu_cut_queue(bushd_mcu* mcu, uint8_t motor, uint32_t tick);
// A row of a frame that was taken goes into the queue; false if none is left. All that are left, at
// once; up to a tick.
bool bushd_mcu_put_next_row(bushd_mcu* mcu);
void bushd_mcu_finish_rows(bushd_mcu* mcu);
void bushd_mcu_finish_row(bushd_mcu* mcu, uint32_t tick);
void bushd_mcu_drop_out_of_order(bushd_mcu* mcu, uint8_t motor);
void bushd_mcu_clear_streams(bushd_mcu* mcu);

// A row of coarse ticks into the queue, of the motors in the mask. A small MCU may link one of its
// own (BUSHD_OWN_COARSE_ROWS).
void bushd_mcu_put_coarse_row(int16_t* queued, uint16_t mask, const uint8_t* counts);

#endif
