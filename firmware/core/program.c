// The program in the memory of the MCU, and what is asked of it. How it is carried out:
// program_run.c.
#include "firmware/core/program.h"

#include <string.h>

#include "firmware/core/access.h"
#include "firmware/core/drivers.h"
#include "firmware/core/line_run.h"
#include "firmware/core/program_run.h"
#include "firmware/core/state.h"
#include "firmware/core/tables.h"

#if BUSHD_PROGRAMS

static bool is_whole(const bushd_mcu_program* p) {
  return p->stage >= BUSHD_PROGRAM_LOADED;
}

static bool has_motors(const bushd_mcu_program* p) {
  return p->motors != 0;
}

// A scan that has begun may have passed by it: the next whole one tells whether it is stored.
static void keep(bushd_mcu_program* p, uint16_t bytes) {
  p->kept_bytes = bytes;
  p->stored = false;
  p->scans_before = 2;
}

static void forget(bushd_mcu_program* p) {
  p->stage = BUSHD_PROGRAM_NONE;
  p->size = p->received = 0;
  keep(p, 0);
  p->crc = 0;
  memset(&p->program, 0, sizeof p->program);
}

void bushd_mcu_boot_program(bushd_mcu* mcu) {
  bushd_mcu_program* p = mcu->config.program;
  if (p == NULL) return;
  uint8_t* const bytes = p->bytes;
  const uint16_t memory = p->memory;
  memset(p, 0, sizeof *p);
  p->bytes = bytes;
  p->memory = memory;
  keep(p, 0);
}

void bushd_mcu_program_compared(bushd_mcu* mcu, bool same) {
  bushd_mcu_program* p = mcu->config.program;
  if (p == NULL) return;
  if (p->scans_before != 0) --p->scans_before;
  p->stored = same && p->scans_before == 0;
}

bushd_status bushd_mcu_take_program_put(bushd_mcu* mcu, const bushd_program_put* message) {
  bushd_mcu_program* p = mcu->config.program;
  if (has_motors(p)) return BUSHD_E_STATE;
  if (message->total > p->memory) return BUSHD_E_CAPACITY;
  if (message->offset == 0) {
    forget(p);
    p->stage = BUSHD_PROGRAM_LOADING;
    p->size = message->total;
  }
  // In order; one may come again.
  if (p->stage != BUSHD_PROGRAM_LOADING || message->offset > p->received ||
      message->total != p->size) {
    return BUSHD_E_STATE;
  }
  memcpy(p->bytes + message->offset, message->bytes, message->count);
  const uint16_t end = (uint16_t)(message->offset + message->count);
  if (end > p->received) p->received = end;
  return BUSHD_OK;
}

// What its frames need of the MCU but tables, which may come later.
static bushd_status check_kinds(const bushd_mcu* mcu, const bushd_program* program) {
  const uint16_t disabled = mcu->config.disabled_capabilities;
  for (const uint8_t* at = program->frames; at != program->end;) {
    const bushd_program_frame frame = bushd_next_program_frame(program, &at);
    const bool line = bushd_program_is_line(frame.kind);
    if (line && (disabled & BUSHD_CAN_LINE_RUN) != 0) return BUSHD_E_UNKNOWN_MESSAGE;
    if (frame.elementary && !bushd_mcu_makes_elementary(mcu)) return BUSHD_E_FORMAT;
    const bool travel = frame.kind == BUSHD_PROGRAM_TRAVEL;
    if (travel && (disabled & BUSHD_CAN_TRAVEL) != 0) return BUSHD_E_UNKNOWN_MESSAGE;
    const bool pulse = frame.kind == BUSHD_PROGRAM_PULSE;
    if (pulse && (disabled & BUSHD_CAN_POSITION_COMPARE) != 0) return BUSHD_E_UNKNOWN_MESSAGE;
    const bool waits = bushd_program_has_input(frame.kind);
    const bool of_motor = frame.input < BUSHD_PROGRAM_SYSTEM_INPUT;
    if (waits && of_motor && frame.input >= mcu->config.motors) return BUSHD_E_FORMAT;
  }
  return BUSHD_OK;
}

static bushd_status commit(bushd_mcu* mcu, uint32_t crc) {
  bushd_mcu_program* p = mcu->config.program;
  if (is_whole(p)) return crc == p->crc ? BUSHD_OK : BUSHD_E_CRC;  // its answer was lost
  if (p->stage != BUSHD_PROGRAM_LOADING || p->received != p->size) return BUSHD_E_STATE;
  if (~bushd_crc32(BUSHD_CRC32_START, p->bytes, p->size) != crc) return BUSHD_E_CRC;
  bushd_program program;
  bushd_status status = bushd_program_check(p->bytes, p->size, bushd_mcu_own_motors(mcu), &program);
  if (status == BUSHD_OK) status = check_kinds(mcu, &program);
  if (status != BUSHD_OK) return status;
  const bool kept = (program.flags & BUSHD_PROGRAM_KEPT) != 0;
  if (kept && !mcu->config.keeps_programs) return BUSHD_E_CAPACITY;
  keep(p, kept ? p->size : 0);
  p->program = program;
  p->crc = crc;
  p->reason = BUSHD_PROGRAM_NO_REASON;
  p->stage = BUSHD_PROGRAM_LOADED;
  return BUSHD_OK;
}

// Codes as they are written are all codes of a run.
static bushd_status check_written(const bushd_mcu* mcu, const bushd_program_frame* travel) {
  if (!bushd_mcu_is_written(mcu->config.scratch, travel->bank)) return BUSHD_OK;
  const bushd_table* table = bushd_mcu_checked_table(mcu, travel->bank);
  const int64_t steps = bushd_program_entry_of(travel, 0, 0).steps;
  const int64_t codes = (int64_t)table->accel.count + table->decel.count;
  return (steps < 0 ? -steps : steps) < codes ? BUSHD_E_FORMAT : BUSHD_OK;
}

static bushd_status check_tables(const bushd_mcu* mcu, const bushd_program* program) {
  for (const uint8_t* at = program->frames; at != program->end;) {
    const bushd_program_frame frame = bushd_next_program_frame(program, &at);
    const bool travel = frame.kind == BUSHD_PROGRAM_TRAVEL;
    if (travel && frame.bank != BUSHD_SCRATCH_BANK) continue;  // its motor's own
    if (!travel && !bushd_program_is_line(frame.kind)) continue;
    bushd_status status = bushd_mcu_check_line_table(mcu, frame.bank, frame.shortest_delay);
    if (status == BUSHD_OK && travel) status = check_written(mcu, &frame);
    if (status != BUSHD_OK) return status;
  }
  return BUSHD_OK;
}

static bool counts_from_start(const bushd_mcu_program* p) {
  return (p->program.flags & BUSHD_PROGRAM_AT_POWER_ON) != 0;
}

static bushd_status check_motors(const bushd_mcu* mcu, const bushd_mcu_program* p) {
  for (uint8_t m = 0; m < mcu->config.motors; ++m) {
    if ((p->program.motors & motor_bit(m)) == 0) continue;
    const bushd_program_motor part = bushd_mcu_program_part_of(p, m);
    if (mcu->motor[m].table != (int8_t)part.bank) return BUSHD_E_NO_TABLE;
    const int32_t at = counts_from_start(p) ? 0 : bushd_mcu_position_at_rest(mcu, m);
    if (at < part.least_steps || at > part.most_steps) return BUSHD_E_FORMAT;
  }
  return check_tables(mcu, &p->program);
}

// From its first frame. Its stage says when.
static void begin(bushd_mcu* mcu, uint8_t number) {
  bushd_mcu_program* p = mcu->config.program;
  p->number = number;
  p->motors = p->program.motors;
  p->at = p->program.frames;
  p->next_frame = p->point = 0;
  p->depth = 0;
  p->repeats = 0;
  p->moving = 0;
  p->has_frame = p->resumes = false;
  p->frame = (bushd_program_frame){0};
  p->reason = BUSHD_PROGRAM_NO_REASON;
  for (uint8_t m = 0; m < mcu->config.motors; ++m) {
    p->origin_steps[m] = counts_from_start(p) ? bushd_mcu_position_at_rest(mcu, m) : 0;
  }
  mcu->local.held &= (uint16_t)~p->motors;
}

static bushd_status run(bushd_mcu* mcu, uint8_t number, uint32_t first_tick) {
  bushd_mcu_program* p = mcu->config.program;
  if (is_whole(p) && number == p->number) return BUSHD_OK;  // its answer was lost
  if (!is_whole(p) || has_motors(p)) return BUSHD_E_STATE;
  bushd_mcu_update_state(mcu);
  if (mcu->state != BUSHD_STATE_READY && mcu->state != BUSHD_STATE_RUN) return BUSHD_E_STATE;
  if (bushd_mcu_engaged(mcu) & p->program.motors) return BUSHD_E_STATE;
  if (ticks_after(first_tick, bushd_mcu_first_open(mcu)) < 0) return BUSHD_E_LATE;
  if (ticks_after(first_tick, mcu->tick) > BUSHD_MCU_PROGRAM_FARTHEST_START)
    return BUSHD_E_CAPACITY;
  const bushd_status status = check_motors(mcu, p);
  if (status != BUSHD_OK) return status;
  begin(mcu, number);
  p->start_tick = first_tick;
  p->stage = BUSHD_PROGRAM_WAITS;
  return BUSHD_OK;
}

// With a wait before its first frame. Where something is in its way it says so, and does not begin
// before the power comes anew.
static void begin_at_power_on(bushd_mcu* mcu) {
  bushd_mcu_program* p = mcu->config.program;
  const bool fault = (mcu->faults & BUSHD_MCU_PROGRAM_ENDING_FAULTS) != 0;
  if (fault || check_motors(mcu, p) != BUSHD_OK) {
    p->reason = fault ? BUSHD_PROGRAM_FAULT : BUSHD_PROGRAM_REFUSED;
    p->stage = BUSHD_PROGRAM_ENDED;
    return;
  }
  begin(mcu, 0);
  p->frame.kind = BUSHD_PROGRAM_WAIT;
  p->has_frame = true;
  p->until = mcu->uptime + bushd_mcu_program_ticks(mcu, BUSHD_MCU_PROGRAM_POWER_ON_US);
  p->stage = BUSHD_PROGRAM_RUNS;
  // With what it was configured with before; a host that comes with the same goes on with it.
  mcu->flags |= BUSHD_FLAG_CONFIGURED;
  bushd_mcu_set_enable(mcu, true);
}

static bool power_was_off(const bushd_mcu* mcu) {
  return mcu->config.reset_cause == BUSHD_RESET_POWER_ON ||
         mcu->config.reset_cause == BUSHD_RESET_BROWN_OUT;
}

void bushd_mcu_restore_program(bushd_mcu* mcu) {
  bushd_mcu_program* p = mcu->config.program;
  if (p == NULL) return;
  if (p->kept_bytes != 0) {
    p->stage = BUSHD_PROGRAM_LOADING;
    p->size = p->received = p->kept_bytes;
    if (commit(mcu, ~bushd_crc32(BUSHD_CRC32_START, p->bytes, p->size)) != BUSHD_OK) {
      forget(p);
      return;
    }
  }
  p->stored = true;
  p->scans_before = 0;
  if (counts_from_start(p) && power_was_off(mcu)) begin_at_power_on(mcu);
}

static bool is_waiting(const bushd_mcu_program* p) {
  return p->has_frame &&
         (p->frame.kind == BUSHD_PROGRAM_WAIT || p->frame.kind == BUSHD_PROGRAM_WAIT_INPUT);
}

// From where it was: not a travel, nor codes that are to be made as they are written, nor what an
// input ends.
static bool can_go_on(const bushd_mcu* mcu, const bushd_program_frame* frame) {
  if (frame->kind == BUSHD_PROGRAM_TRAVEL || frame->kind == BUSHD_PROGRAM_MOVE_UNTIL) return false;
  return !bushd_program_is_line(frame->kind) ||
         !bushd_mcu_is_written(mcu->config.scratch, frame->bank);
}

static bushd_status pause(bushd_mcu* mcu) {
  bushd_mcu_program* p = mcu->config.program;
  if (p->stage == BUSHD_PROGRAM_PAUSES || p->stage == BUSHD_PROGRAM_PAUSED) return BUSHD_OK;
  if (p->stage != BUSHD_PROGRAM_RUNS) return BUSHD_E_STATE;
  if (p->has_frame && !can_go_on(mcu, &p->frame)) return BUSHD_E_STATE;
  if (is_waiting(p)) p->until -= mcu->uptime;
  bushd_mcu_stop_program_motors(mcu, BUSHD_STOP_RAMP, bushd_mcu_first_open(mcu));
  p->stage = BUSHD_PROGRAM_PAUSES;
  return BUSHD_OK;
}

static bushd_status resume(bushd_mcu* mcu) {
  bushd_mcu_program* p = mcu->config.program;
  if (p->stage == BUSHD_PROGRAM_RUNS) return BUSHD_OK;
  if (p->stage != BUSHD_PROGRAM_PAUSED) return BUSHD_E_STATE;
  if (is_waiting(p)) p->until += mcu->uptime;
  p->resumes = true;
  p->stage = BUSHD_PROGRAM_RUNS;
  return BUSHD_OK;
}

bushd_status bushd_mcu_take_program_control(bushd_mcu* mcu, const bushd_program_control* message) {
  bushd_mcu_program* p = mcu->config.program;
  switch (message->action) {
    case BUSHD_PROGRAM_COMMIT:
      return commit(mcu, message->value);
    case BUSHD_PROGRAM_RUN:
      return run(mcu, message->number, message->value);
    case BUSHD_PROGRAM_STOP:
      if (has_motors(p)) {
        bushd_mcu_end_program(mcu, BUSHD_PROGRAM_STOPPED, (bushd_stop_mode)message->value,
                              bushd_mcu_first_open(mcu));
      }
      return BUSHD_OK;
    case BUSHD_PROGRAM_PAUSE:
      return pause(mcu);
    case BUSHD_PROGRAM_RESUME:
      return resume(mcu);
    default:
      if (has_motors(p)) return BUSHD_E_STATE;
      forget(p);
      return BUSHD_OK;
  }
}

bushd_program_state bushd_mcu_state_of_program(const bushd_mcu* mcu) {
  const bushd_mcu_program* p = mcu->config.program;
  const bushd_program_state state = {
      .stage = p->stage,
      .reason = p->reason,
      .number = p->number,
      .flags = (uint8_t)(p->program.flags | (p->stored ? BUSHD_PROGRAM_STORED : 0)),
      .motors = p->program.motors,
      .memory = p->memory,
      .size = is_whole(p) ? p->size : p->received,
      .crc = p->crc,
      .frame = p->next_frame == 0 ? (uint16_t)0 : (uint16_t)(p->next_frame - 1u),
      .point = p->point,
      .repeats = p->repeats,
      .start_tick = p->start_tick,
      .tick = mcu->tick,
  };
  return state;
}

#endif
