#include "engine/program.h"

#include "engine/cursor.h"
#include "engine/message_motion.h"

#define BANK_ELEMENTARY 0x80u  // as in LINE_RUN

static uint8_t count_of(uint16_t motors) {
  uint8_t count = 0;
  for (; motors != 0; motors = (uint16_t)(motors >> 1)) count = (uint8_t)(count + (motors & 1u));
  return count;
}

// Bytes for each motor of a frame; 0 where it has none.
static uint8_t entry_size(uint8_t kind) {
  switch (kind) {
#define SIZE(name, code, own, motor) \
  case BUSHD_PROGRAM_##name:         \
    return (motor);
    BUSHD_PROGRAM_FRAMES(SIZE)
#undef SIZE
    default:
      return 0;
  }
}

static void get_line(reader* r, bushd_program_frame* frame) {
  const uint8_t bank = get8(r);
  frame->bank = (uint8_t)(bank & ~BANK_ELEMENTARY);
  frame->elementary = (bank & BANK_ELEMENTARY) != 0;
  frame->shortest_delay = get16(r);
  frame->points = get16(r);
}

static void get_travel(reader* r, bushd_program_frame* frame) {
  frame->bank = get8(r);
  frame->edge = get8(r);
  frame->delay_us = get32(r);
  frame->us = get32(r);
}

// Its fields as they come; `entries` are skipped.
static bushd_program_frame get_frame(reader* r) {
  bushd_program_frame frame = {.kind = get8(r)};
  const uint8_t size = entry_size(frame.kind);
  if (size != 0) {
    frame.motors = get16(r);
    frame.motor_count = count_of(frame.motors);
    frame.points = 1;
  }
  switch (frame.kind) {
    case BUSHD_PROGRAM_LINE_TO:
    case BUSHD_PROGRAM_LINE_BY:
      get_line(r, &frame);
      break;
    case BUSHD_PROGRAM_TRAVEL:
      get_travel(r, &frame);
      break;
    case BUSHD_PROGRAM_MOVE_UNTIL:
      frame.input = get8(r);
      frame.level = get8(r) != 0;
      frame.after_steps = get32(r);
      break;
    case BUSHD_PROGRAM_WAIT:
    case BUSHD_PROGRAM_PULSE:
      frame.us = get32(r);
      break;
    case BUSHD_PROGRAM_WAIT_INPUT:
      frame.input = get8(r);
      frame.level = get8(r) != 0;
      frame.us = get32(r);
      break;
    case BUSHD_PROGRAM_REPEAT:
      frame.count = get16(r);
      break;
    default:
      break;
  }
  frame.entries = take(r, (size_t)frame.points * frame.motor_count * size);
  return frame;
}

// As of TRAVEL, the message.
static bool travel_in_range(const bushd_program_frame* frame) {
  const bool at_edges = frame->edge != BUSHD_EDGE_NONE;
  const uint32_t least_us = at_edges ? BUSHD_TRIGGER_MIN_DELAY_US : 0;
  const uint32_t most_us = at_edges ? BUSHD_TRIGGER_MAX_DELAY_US : 0;
  if (frame->motor_count != 1) return false;
  const int32_t steps = bushd_program_entry_of(frame, 0, 0).steps;
  return steps != 0 && steps != INT32_MIN && frame->bank <= BUSHD_SCRATCH_BANK &&
         frame->edge <= BUSHD_EDGE_FALLING && frame->delay_us >= least_us &&
         frame->delay_us <= most_us && frame->us >= BUSHD_TRAVEL_MIN_WAIT_US &&
         frame->us <= BUSHD_TRAVEL_MAX_WAIT_US;
}

// Levels are in the byte behind the input's.
static bool input_in_range(const bushd_program_frame* frame, uint8_t level) {
  return frame->input < BUSHD_PROGRAM_INPUTS && level <= 1;
}

// `at`: where it begins. A level of 2 is the same as 1 to who reads it, and is refused here.
static bool in_range(const bushd_program_frame* frame, const uint8_t* at, uint16_t motors) {
  switch (frame->kind) {
    case BUSHD_PROGRAM_MOVE_TO:
    case BUSHD_PROGRAM_MOVE_BY:
      return frame->motors != 0 && (frame->motors & ~motors) == 0;
    case BUSHD_PROGRAM_MOVE_UNTIL:
      return (frame->motors & ~motors) == 0 && frame->motor_count == 1 &&
             frame->after_steps <= INT32_MAX && input_in_range(frame, at[4]);
    case BUSHD_PROGRAM_LINE_TO:
    case BUSHD_PROGRAM_LINE_BY:
      return frame->motors != 0 && (frame->motors & ~motors) == 0 &&
             frame->bank <= BUSHD_SCRATCH_BANK && frame->points != 0;
    case BUSHD_PROGRAM_TRAVEL:
      return (frame->motors & ~motors) == 0 && travel_in_range(frame);
    case BUSHD_PROGRAM_WAIT:
      return frame->us >= 1 && frame->us <= BUSHD_PROGRAM_MOST_WAIT_US;
    case BUSHD_PROGRAM_WAIT_INPUT:
      return input_in_range(frame, at[2]) && frame->us <= BUSHD_PROGRAM_MOST_WAIT_US;
    case BUSHD_PROGRAM_PULSE:
      return frame->us >= 1 && frame->us <= BUSHD_PROGRAM_MOST_PULSE_US;
    default:
      return frame->kind < BUSHD_PROGRAM_KINDS;
  }
}

// It leads to a place, so that it wants a motor whose position is known.
static bool needs_position(uint8_t kind) {
  return kind == BUSHD_PROGRAM_MOVE_TO || kind == BUSHD_PROGRAM_LINE_TO ||
         kind == BUSHD_PROGRAM_TRAVEL;
}

static bool flags_fit(uint8_t flags) {
  const uint8_t alone = BUSHD_PROGRAM_WITHOUT_HOST | BUSHD_PROGRAM_KEPT;
  if ((flags & BUSHD_PROGRAM_AT_POWER_ON) == 0) return (flags & ~alone) == 0;
  return flags == (alone | BUSHD_PROGRAM_AT_POWER_ON);
}

static bushd_status check_frames(reader* r, const bushd_program* program) {
  const bool by_distances = (program->flags & BUSHD_PROGRAM_AT_POWER_ON) != 0;
  uint8_t depth = 0;
  for (;;) {
    const uint8_t* const at = r->at;
    const bushd_program_frame frame = get_frame(r);
    if (r->short_of_bytes) return BUSHD_E_LENGTH;
    if (!in_range(&frame, at, program->motors)) return BUSHD_E_FORMAT;
    if (by_distances && needs_position(frame.kind)) return BUSHD_E_FORMAT;
    if (frame.kind == BUSHD_PROGRAM_REPEAT && ++depth > BUSHD_PROGRAM_MOST_DEPTH) {
      return BUSHD_E_FORMAT;
    }
    if (frame.kind == BUSHD_PROGRAM_NEXT && depth-- == 0) return BUSHD_E_FORMAT;
    if (frame.kind == BUSHD_PROGRAM_END) return finish(r, depth == 0);
  }
}

static bushd_program_motor get_part(reader* r) {
  bushd_program_motor part;
  part.bank = get8(r);
  part.least_steps = (int32_t)get32(r);
  part.most_steps = (int32_t)get32(r);
  return part;
}

bushd_status bushd_program_check(const uint8_t* bytes, size_t size, uint16_t own_motors,
                                 bushd_program* program) {
  reader r = read_from(bytes, size);
  const uint8_t format = get8(&r);
  if (!r.short_of_bytes && format != BUSHD_PROGRAM_FORMAT) return BUSHD_E_VERSION;
  program->flags = get8(&r);
  program->motors = get16(&r);
  program->parts = r.at;
  program->end = r.end;
  if (r.short_of_bytes) return BUSHD_E_LENGTH;
  if (!flags_fit(program->flags) || program->motors == 0 || (program->motors & ~own_motors) != 0) {
    return BUSHD_E_FORMAT;
  }
  for (uint8_t left = count_of(program->motors); left > 0; --left) {
    const bushd_program_motor part = get_part(&r);
    if (r.short_of_bytes) return BUSHD_E_LENGTH;
    if (part.bank >= BUSHD_TABLE_BANKS || part.least_steps > part.most_steps) return BUSHD_E_FORMAT;
  }
  program->frames = r.at;
  return check_frames(&r, program);
}

bushd_program_motor bushd_program_part(const bushd_program* program, uint8_t nth) {
  reader r = read_from(program->parts + (size_t)nth * BUSHD_PROGRAM_MOTOR, BUSHD_PROGRAM_MOTOR);
  return get_part(&r);
}

bushd_program_frame bushd_next_program_frame(const bushd_program* program, const uint8_t** at) {
  reader r = read_from(*at, (size_t)(program->end - *at));
  const bushd_program_frame frame = get_frame(&r);
  *at = r.at;
  return frame;
}

bushd_program_entry bushd_program_entry_of(const bushd_program_frame* frame, uint16_t point,
                                           uint8_t nth) {
  const uint8_t size = entry_size(frame->kind);
  const size_t before = (size_t)point * frame->motor_count + nth;
  reader r = read_from(frame->entries + before * size, size);
  bushd_program_entry entry;
  entry.steps = (int32_t)get32(&r);
  entry.shortest_delay = bushd_program_is_move(frame->kind) ? get16(&r) : 0;
  return entry;
}
