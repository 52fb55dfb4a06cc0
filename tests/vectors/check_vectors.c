#include "vectors/check_vectors.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#include "engine/frame.h"
#include "engine/line.h"
#include "engine/line_follower.h"
#include "engine/message.h"
#include "engine/run.h"
#include "engine/run_state.h"
#include "engine/slots.h"
#include "engine/table.h"

typedef struct move_vector {
  const bushd_table* table;
  uint32_t steps;
  int8_t direction;
  uint32_t tick_ns;
  bool fine;
  int16_t ramp_down_at_tick;  // -1: none
  uint16_t shortest_delay;    // 0: none
  const uint8_t* displacements;
  uint16_t size;
} move_vector;

typedef struct take_over_vector {
  const bushd_table* table;
  uint16_t delay;
  uint8_t fraction;
  int8_t direction;
  uint32_t tick_ns;
  bool fine;
  const uint8_t* displacements;
  uint16_t size;
} take_over_vector;

typedef struct run_state_vector {
  const bushd_table* table;
  uint32_t steps;
  int8_t direction;
  uint32_t tick_ns;
  bool fine;
  int16_t ramp_down_at_tick;  // -1: none
  uint16_t shortest_delay;    // 0: none
  uint16_t tick;              // at whose beginning it is saved
  uint16_t ticks;             // for which it is asked
  bushd_run_state state;
  const uint8_t* displacements;  // from there on; fewer than `ticks` if it ends before
  uint16_t size;
} run_state_vector;

typedef struct line_vector {
  uint32_t increment;
  uint32_t longest;
  uint32_t first;
  uint32_t last;
  const uint32_t* made;       // after the steps first .. last of the run
  const uint8_t* fractions;   // of the step after it, but for the last
  const uint64_t* positions;  // at that fraction, 1/256 step
} line_vector;

typedef struct identify_window_vector {
  uint8_t unique_id[BUSHD_UNIQUE_ID_SIZE];
  uint16_t salt;
  uint8_t windows;
  uint8_t window;
} identify_window_vector;

typedef struct slots_vector {
  uint16_t slot_count;
  int16_t crossing;
  const int16_t* displacements;
  uint16_t ticks;
  const int16_t* slots;  // of all ticks in a row; -1 ends a tick
  int16_t remainder;
} slots_vector;

typedef struct frame_vector {
  uint8_t address;
  uint8_t type;
  uint8_t sequence;
  size_t (*encode)(uint8_t* payload);
  const uint8_t* wire;
  uint16_t size;
} frame_vector;

#include "golden_vectors.h"

// Tick by tick, as an MCU does it.
static bool expands_to(bushd_run* run, uint32_t tick_ns, bool fine, int16_t ramp_down_at_tick,
                       const uint8_t* bytes, uint16_t size) {
  const uint16_t ticks = fine ? (uint16_t)(size / 2u) : size;
  for (uint16_t n = 0; n < ticks; ++n) {
    if (ramp_down_at_tick == (int16_t)n) bushd_run_ramp_down(run);
    if (fine) {
      int16_t displacement = 0;
      if (bushd_run_expand_fine(run, tick_ns, 1, &displacement, 1) != 1) return false;
      if (displacement != bushd_get_i16(bytes + 2u * n)) return false;
    } else {
      uint8_t count = 0;
      if (bushd_run_expand_coarse(run, tick_ns, 1, &count, 1) != 1) return false;
      if (count != bytes[n]) return false;
    }
  }
  return true;
}

static bool check_move(const move_vector* vector) {
  bushd_run run;
  bushd_run_start(&run, vector->table, vector->steps, vector->direction, vector->shortest_delay);
  return expands_to(&run, vector->tick_ns, vector->fine, vector->ramp_down_at_tick,
                    vector->displacements, vector->size) &&
         bushd_run_done(&run);
}

static bool check_take_over(const take_over_vector* vector) {
  bushd_run run;
  bushd_run_start_ramp_down(&run, vector->table, vector->delay, vector->fraction,
                            vector->direction);
  return expands_to(&run, vector->tick_ns, vector->fine, -1, vector->displacements, vector->size) &&
         bushd_run_done(&run);
}

static bool same_state(const bushd_run_state* a, const bushd_run_state* b) {
  if (a->direction != b->direction || a->cruises != b->cruises || a->since != b->since ||
      a->since_ns != b->since_ns || a->lead_delay != b->lead_delay || a->cruise != b->cruise) {
    return false;
  }
  return a->cruises || (a->accel_at == b->accel_at && a->accel_end == b->accel_end &&
                        a->cruise_left == b->cruise_left && a->decel_left == b->decel_left);
}

static bool check_run_state(const run_state_vector* vector) {
  bushd_run run;
  bushd_run_start(&run, vector->table, vector->steps, vector->direction, vector->shortest_delay);
  for (uint16_t n = 0; n <= vector->tick; ++n) {
    if (vector->ramp_down_at_tick == (int16_t)n) bushd_run_ramp_down(&run);
    if (n == vector->tick) break;
    int16_t displacement = 0;
    bushd_run_expand_fine(&run, vector->tick_ns, 1, &displacement, 1);
  }
  const bushd_run_state saved = bushd_run_save(&run, vector->tick_ns, vector->ticks);
  if (!same_state(&saved, &vector->state)) return false;
  return bushd_run_restore(&run, vector->table, &vector->state) &&
         expands_to(&run, vector->tick_ns, vector->fine, -1, vector->displacements, vector->size);
}

static bool check_crc(const uint32_t* crc) {
  return bushd_table_crc32(&kTables[crc - kTableCrcs]) == *crc;
}

static bool check_line(const line_vector* vector) {
  bushd_line line;
  bushd_line_start(&line, vector->increment, vector->longest);
  if (line.made != 0) return false;
  bushd_line_go_to(&line, vector->first);
  for (uint32_t s = vector->first; line.made == vector->made[s - vector->first]; ++s) {
    if (s == vector->last) return true;
    const uint32_t at = s - vector->first;
    if (bushd_line_position(&line, vector->fractions[at]) != vector->positions[at]) return false;
    bushd_line_follow(&line, 1);
  }
  return false;
}

// The same by one that is asked where its next step is due.
static bool check_line_follower(const line_vector* vector) {
  if (vector->increment == 0) return true;
  bushd_line_follower follower;
  bushd_line_follower_start(&follower, vector->increment, vector->longest, vector->first);
  uint64_t made = vector->made[0];
  for (uint32_t s = vector->first; s != vector->last; ++s) {
    const uint32_t at = s - vector->first;
    const uint8_t parts = vector->fractions[at];
    if (made != vector->made[at]) return false;
    if (bushd_line_follower_due(&follower, s + 1u, parts)) {
      bushd_line_follower_step(&follower);
      ++made;
    }
    const uint8_t fraction =
        bushd_line_follower_fraction(&follower, vector->longest, s + 1u, parts);
    if (made * 256u + fraction != vector->positions[at]) return false;
    if (bushd_line_follower_due(&follower, s + 1u, 256)) {
      bushd_line_follower_step(&follower);
      ++made;
    }
  }
  return made == vector->made[vector->last - vector->first];
}

static bool check_identify_window(const identify_window_vector* vector) {
  return bushd_identify_window(vector->unique_id, vector->salt, vector->windows) == vector->window;
}

static bool check_slots(const slots_vector* vector) {
  uint16_t masks[BUSHD_MAX_SLOTS];
  int16_t remainder = 0;
  const int16_t* expected = vector->slots;
  for (uint16_t n = 0; n < vector->ticks; ++n) {
    memset(masks, 0, sizeof masks);
    bushd_slots_add(masks, vector->slot_count, 1, vector->displacements[n], &remainder,
                    vector->crossing);
    for (uint16_t slot = 0; slot < vector->slot_count; ++slot) {
      const bool steps = *expected == (int16_t)slot;
      if (masks[slot] != (steps ? 1 : 0)) return false;
      if (steps) ++expected;
    }
    if (*expected++ != -1) return false;
  }
  return remainder == vector->remainder;
}

static bool check_frame(const frame_vector* vector) {
  uint8_t payload[BUSHD_FRAME_MAX_PAYLOAD];
  uint8_t wire[BUSHD_FRAME_MAX_WIRE];
  const size_t payload_size = vector->encode(payload);
  const size_t size = bushd_frame_encode(vector->address, vector->type, vector->sequence, payload,
                                         payload_size, wire);
  if (size != vector->size || memcmp(wire, vector->wire, size) != 0) return false;
  bushd_receiver receiver;
  memset(&receiver, 0, sizeof receiver);
  bushd_frame frame;
  for (size_t i = 0; i + 1 < size; ++i) {
    if (bushd_receive_byte(&receiver, wire[i], &frame) != BUSHD_RECEIVE_MORE) return false;
  }
  if (bushd_receive_byte(&receiver, wire[size - 1], &frame) != BUSHD_RECEIVE_FRAME) return false;
  return frame.address == vector->address && frame.type == vector->type &&
         frame.sequence == vector->sequence && frame.payload_size == payload_size &&
         memcmp(frame.payload, payload, payload_size) == 0;
}

#define CHECK_ALL(kind, vectors, check)                                   \
  for (unsigned i = 0; i < sizeof(vectors) / sizeof((vectors)[0]); ++i) { \
    ++*checked;                                                           \
    if (check(&(vectors)[i])) continue;                                   \
    ++failed;                                                             \
    if (report != NULL) report(kind, i);                                  \
  }

unsigned bushd_check_vectors(unsigned* checked, void (*report)(const char* kind, unsigned index)) {
  unsigned failed = 0;
  *checked = 0;
  CHECK_ALL("move", kMoves, check_move)
  CHECK_ALL("take-over", kTakeOvers, check_take_over)
  CHECK_ALL("run state", kRunStates, check_run_state)
  CHECK_ALL("table", kTableCrcs, check_crc)
  CHECK_ALL("line", kLines, check_line)
  CHECK_ALL("line_follower", kLines, check_line_follower)
  CHECK_ALL("identify window", kIdentifyWindows, check_identify_window)
  CHECK_ALL("slots", kSlots, check_slots)
  CHECK_ALL("frame", kFrames, check_frame)
  return failed;
}
