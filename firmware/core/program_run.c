// Programs. The interpreter looks at the present frame once a tick, before that tick is prepared,
// and makes no step itself: a motion is table runs, or the run of a line, that begin with this tick
// and are made as if a master had asked for them. So each way to stop a motor is as it always is;
// the program sees that a run did not come to its end, ramps its other motors down, and ends.
//
// A frame that is over in tick t is followed by the next one in the same tick. What ends a motion
// is known beforehand, in ticks; a wait counts ticks since boot. So two MCUs that begin a program
// in one tick stay together, whoever is heard meanwhile.
#include "firmware/core/program_run.h"

#include <string.h>

#include "firmware/core/access.h"
#include "firmware/core/limits.h"
#include "firmware/core/line_run.h"
#include "firmware/core/owner.h"
#include "firmware/core/position_compare.h"
#include "firmware/core/state.h"
#include "firmware/core/table_run.h"
#include "firmware/core/tables.h"
#include "firmware/core/travel.h"

#if BUSHD_PROGRAMS

int32_t bushd_mcu_position_at_rest(const bushd_mcu* mcu, uint8_t m) {
  return (int32_t)((uint32_t)mcu->motor[m].position_steps +
                   (uint32_t)mcu->slot_buffer[mcu->front].steps[m]);
}

bushd_program_motor bushd_mcu_program_part_of(const bushd_mcu_program* p, uint8_t m) {
  uint8_t nth = 0;
  for (uint8_t i = 0; i < m; ++i) nth = (uint8_t)(nth + ((p->program.motors & motor_bit(i)) != 0));
  return bushd_program_part(&p->program, nth);
}

void bushd_mcu_stop_program_motors(bushd_mcu* mcu, bushd_stop_mode mode, uint32_t next) {
  bushd_mcu_program* p = mcu->config.program;
  if (mode == BUSHD_STOP_RAMP && (mcu->line.motors & p->motors) != 0) bushd_mcu_ramp_down_line(mcu);
  for (uint8_t m = 0; m < mcu->config.motors; ++m) {
    if ((p->motors & motor_bit(m)) != 0) bushd_mcu_stop_motor(mcu, m, mode, next);
  }
  if ((p->motors & motor_bit(mcu->travel.motor)) != 0) bushd_mcu_give_up_travel(mcu);
  p->moving = 0;
}

void bushd_mcu_end_program(bushd_mcu* mcu, bushd_program_reason why, bushd_stop_mode mode,
                           uint32_t next) {
  bushd_mcu_program* p = mcu->config.program;
  bushd_mcu_stop_program_motors(mcu, mode, next);
  if (p->stage == BUSHD_PROGRAM_ENDS) return;  // it has a reason
  p->reason = (uint8_t)why;
  p->stage = BUSHD_PROGRAM_ENDS;
}

// In the tick that is prepared.
static void end_now(bushd_mcu* mcu, bushd_program_reason why) {
  bushd_mcu_end_program(mcu, why, BUSHD_STOP_RAMP, mcu->tick + 1u);
}

// Motions.

static uint16_t in_direction(uint16_t motors, const bushd_mcu* mcu, int8_t direction) {
  return motors & bushd_mcu_forbidden(mcu, direction);
}

// How far each motor of the frame is from its target; false: the program ends.
static bool find_ways(bushd_mcu* mcu, int32_t* way) {
  const bushd_mcu_program* p = mcu->config.program;
  uint16_t forward = 0;
  uint16_t back = 0;
  for (uint8_t m = 0; m < mcu->config.motors; ++m) {
    way[m] = 0;
    if ((p->frame.motors & motor_bit(m)) == 0) continue;
    const int64_t steps = (int64_t)p->target_steps[m] - bushd_mcu_position_at_rest(mcu, m);
    if (steps > INT32_MAX || steps < -INT32_MAX) {
      end_now(mcu, BUSHD_PROGRAM_RANGE);
      return false;
    }
    way[m] = (int32_t)steps;
    if (steps > 0) forward |= motor_bit(m);
    if (steps < 0) back |= motor_bit(m);
  }
  if ((in_direction(forward, mcu, 1) | in_direction(back, mcu, -1)) == 0) return true;
  end_now(mcu, BUSHD_PROGRAM_LIMIT);
  return false;
}

static uint32_t length_of(int32_t way) {
  return way < 0 ? 0u - (uint32_t)way : (uint32_t)way;
}

static bool begin_runs(bushd_mcu* mcu, const int32_t* way) {
  bushd_mcu_program* p = mcu->config.program;
  uint16_t moving = 0;
  uint8_t nth = 0;
  for (uint8_t m = 0; m < mcu->config.motors; ++m) {
    if ((p->frame.motors & motor_bit(m)) == 0) continue;
    const bushd_program_entry entry = bushd_program_entry_of(&p->frame, 0, nth++);
    if (way[m] == 0) continue;
    const bushd_table_run_entry run = {m, (uint8_t)mcu->motor[m].table, way[m] < 0 ? -1 : 1,
                                       length_of(way[m]), entry.shortest_delay};
    uint32_t spare_ns;
    if (!bushd_mcu_make_run(mcu, &run, &spare_ns)) return false;
    moving |= motor_bit(m);
  }
  for (uint8_t m = 0; m < mcu->config.motors; ++m) {
    if ((moving & motor_bit(m)) == 0) continue;
    bushd_mcu_begin_run(mcu, m, mcu->tick + 1u, mcu->motor[m].made.until);
  }
  p->moving = moving;
  return true;
}

static bool begin_line(bushd_mcu* mcu, const int32_t* way) {
  bushd_mcu_program* p = mcu->config.program;
  bushd_line_run line;
  memset(&line, 0, sizeof line);
  line.line.bank = p->frame.bank;
  line.line.shortest_delay = p->frame.shortest_delay;
  bushd_line_entry entries[BUSHD_MOTORS_PER_MCU];
  uint64_t sum = 0;
  uint8_t count = 0;
  uint16_t moving = 0;
  for (uint8_t m = 0; m < mcu->config.motors; ++m) {
    if (way[m] == 0) continue;
    const bushd_line_entry entry = {m, way[m] < 0 ? -1 : 1, length_of(way[m])};
    if (entry.increment > line.line.longest) line.line.longest = entry.increment;
    sum += entry.increment;
    entries[count++] = entry;
    moving |= motor_bit(m);
  }
  if (count == 0) return true;
  line.line.elementary = p->frame.elementary;
  if (line.line.elementary) {
    if (sum > INT32_MAX) return false;
    line.line.longest = (uint32_t)sum;
  }
  line.line.steps = line.line.longest;
  line.first_tick = mcu->tick + 1u;
  uint8_t payload[BUSHD_LINE_RUN_HEADER + BUSHD_MOTORS_PER_MCU * BUSHD_LINE_RUN_ENTRY];
  bushd_encode_line_run(&line, entries, count, payload);
  line.line.count = count;
  line.line.entries = payload + BUSHD_LINE_RUN_HEADER;
  if (!bushd_mcu_begin_line(mcu, &line, moving)) return false;
  p->moving = moving;
  return true;
}

static void begin_motion(bushd_mcu* mcu) {
  const bushd_mcu_program* p = mcu->config.program;
  int32_t way[BUSHD_MOTORS_PER_MCU];
  if (!find_ways(mcu, way)) return;
  const bool made =
      bushd_program_is_line(p->frame.kind) ? begin_line(mcu, way) : begin_runs(mcu, way);
  if (!made) end_now(mcu, BUSHD_PROGRAM_REFUSED);
}

static void begin_travel(bushd_mcu* mcu) {
  bushd_mcu_program* p = mcu->config.program;
  const int32_t steps = bushd_program_entry_of(&p->frame, 0, 0).steps;
  bushd_travel travel = {.kind = BUSHD_TRAVEL_LIMITS,
                         .direction = steps < 0 ? -1 : 1,
                         .edge = (bushd_edge)p->frame.edge,
                         .steps = length_of(steps),
                         .delay_us = p->frame.delay_us,
                         .wait_us = p->frame.us};
  while ((p->frame.motors & motor_bit(travel.motor)) == 0) ++travel.motor;
  const bushd_program_motor part = bushd_mcu_program_part_of(p, travel.motor);
  const int64_t target = (int64_t)bushd_mcu_position_at_rest(mcu, travel.motor) + steps;
  if (target < part.least_steps || target > part.most_steps) {
    end_now(mcu, BUSHD_PROGRAM_RANGE);
    return;
  }
  const bushd_status status = bushd_mcu_begin_travel(mcu, &travel);
  if (status == BUSHD_OK) return;
  end_now(mcu, status == BUSHD_E_FORBIDDEN ? BUSHD_PROGRAM_LIMIT : BUSHD_PROGRAM_REFUSED);
}

// Whether it is, as it should; otherwise the program ends.
static bool has_travelled(bushd_mcu* mcu) {
  if (bushd_mcu_travels(&mcu->travel)) return false;
  if (mcu->travel.stage == BUSHD_TRAVEL_DONE) return true;
  const bool met = mcu->travel.stage == BUSHD_TRAVEL_EARLY;
  end_now(mcu, met ? BUSHD_PROGRAM_LIMIT : BUSHD_PROGRAM_TRAVELLED);
  return false;
}

// Where the frame, or this point of it, leads; false: farther than the motor may go.
static bool set_targets(bushd_mcu* mcu) {
  bushd_mcu_program* p = mcu->config.program;
  const bool relative = bushd_program_is_relative(p->frame.kind);
  uint8_t nth = 0;
  for (uint8_t m = 0; m < mcu->config.motors; ++m) {
    if ((p->frame.motors & motor_bit(m)) == 0) continue;
    const int32_t steps = bushd_program_entry_of(&p->frame, p->point, nth++).steps;
    const int64_t target = relative ? (int64_t)bushd_mcu_position_at_rest(mcu, m) + steps : steps;
    const bushd_program_motor part = bushd_mcu_program_part_of(p, m);
    const int64_t from = p->origin_steps[m];
    if (target - from < part.least_steps || target - from > part.most_steps) return false;
    if (target < INT32_MIN || target > INT32_MAX) return false;
    p->target_steps[m] = (int32_t)target;
  }
  return true;
}

static void begin_point(bushd_mcu* mcu) {
  if (set_targets(mcu)) {
    begin_motion(mcu);
  } else {
    end_now(mcu, BUSHD_PROGRAM_RANGE);
  }
}

// Those whose run is over are at rest from this tick on. A run that was cut short has led its motor
// out of it before.
static void look_after_runs(bushd_mcu* mcu) {
  bushd_mcu_program* p = mcu->config.program;
  const uint32_t tick = mcu->tick + 1u;
  uint16_t over = 0;
  for (uint8_t m = 0; m < mcu->config.motors; ++m) {
    if ((p->moving & motor_bit(m)) == 0) continue;
    const bushd_mcu_motor* motor = &mcu->motor[m];
    // It waits if it has begun for this tick.
    if (motor->mode != BUSHD_MCU_TABLE_RUN && motor->mode != BUSHD_MCU_RUN_WAITS) {
      end_now(mcu, BUSHD_PROGRAM_LIMIT);
      return;
    }
    if (ticks_after(tick, motor->made.until) >= 0) over |= motor_bit(m);
  }
  for (uint8_t m = 0; m < mcu->config.motors; ++m) {
    if ((over & motor_bit(m)) == 0) continue;
    if ((mcu->line.motors & motor_bit(m)) != 0) bushd_mcu_leave_line(mcu, m);
    bushd_mcu_give_to_queue(mcu, m);
  }
  mcu->stream.begun &= (uint16_t)~over;
  p->moving &= (uint16_t)~over;
}

// Waits.

uint32_t bushd_mcu_program_ticks(const bushd_mcu* mcu, uint32_t us) {
  return (uint32_t)(((uint64_t)us * 1000u + mcu->tick_ns - 1u) / mcu->tick_ns);
}

static bool time_is_over(const bushd_mcu* mcu) {
  return ticks_after(mcu->uptime, mcu->config.program->until) >= 0;
}

static bool shows_level(const bushd_mcu* mcu) {
  const bushd_program_frame* frame = &mcu->config.program->frame;
  const bushd_inputs pins = mcu->port.read_inputs(mcu->port.context);
  const uint16_t motors = pins.motors ^ mcu->inputs.inverted;
  const uint8_t system = pins.system ^ mcu->inputs.system_inverted;
  const bool active = frame->input < BUSHD_PROGRAM_SYSTEM_INPUT
                          ? (motors & motor_bit(frame->input)) != 0
                          : (system >> (frame->input - BUSHD_PROGRAM_SYSTEM_INPUT) & 1u) != 0;
  return active == frame->level;
}

// Moves until an input.

// The running step is the first of those that are made after it. Fewer than a ramp-down takes are
// not made up for; those that lie beyond the frame's way are not made.
static void shorten_run(bushd_mcu* mcu, uint8_t m) {
  const bushd_mcu_program* p = mcu->config.program;
  bushd_mcu_motor* motor = &mcu->motor[m];
  bushd_run* run = &motor->made.run;
  const uint32_t left = bushd_run_steps_left(run);
  const uint32_t after = p->frame.after_steps;
  if (after >= left) return;
  const bushd_program_entry entry = bushd_program_entry_of(&p->frame, 0, 0);
  const bool ends_there = after != 0 && bushd_run_retarget(run, after - 1u, entry.shortest_delay);
  if (!ends_there) bushd_run_ramp_down(run);
  uint32_t ticks = 0;
  uint32_t spare_ns;
  // It is no longer than it was.
  (void)bushd_mcu_ticks_of_run(run, mcu->tick_ns, &ticks, &spare_ns);
  motor->made.until = motor->known_until = mcu->tick + 1u + ticks;
}

// A run that has only been made is not yet one that could be shortened: the next tick looks again.
static bool waits_to_begin(const bushd_mcu* mcu) {
  const bushd_mcu_program* p = mcu->config.program;
  for (uint8_t m = 0; m < mcu->config.motors; ++m) {
    const bool waits = mcu->motor[m].mode == BUSHD_MCU_RUN_WAITS;
    if ((p->moving & motor_bit(m)) != 0 && waits) return true;
  }
  return false;
}

static void look_at_input(bushd_mcu* mcu) {
  bushd_mcu_program* p = mcu->config.program;
  if (p->met || waits_to_begin(mcu) || !shows_level(mcu)) return;
  p->met = true;
  for (uint8_t m = 0; m < mcu->config.motors; ++m) {
    if ((p->moving & motor_bit(m)) != 0 && mcu->motor[m].mode == BUSHD_MCU_TABLE_RUN) {
      shorten_run(mcu, m);
    }
  }
}

static bool has_moved_until(bushd_mcu* mcu) {
  bushd_mcu_program* p = mcu->config.program;
  look_at_input(mcu);
  look_after_runs(mcu);
  if (p->moving != 0) return false;
  if (!p->met) end_now(mcu, BUSHD_PROGRAM_NO_INPUT);
  return p->met;
}

// Frames.

// Whether the present frame, or this point of it, is over; it may end the program instead.
static bool is_over(bushd_mcu* mcu) {
  bushd_mcu_program* p = mcu->config.program;
  switch (p->frame.kind) {
    case BUSHD_PROGRAM_WAIT:
      return time_is_over(mcu);
    case BUSHD_PROGRAM_WAIT_INPUT:
      if (shows_level(mcu)) return true;
      if (p->frame.us != 0 && time_is_over(mcu)) end_now(mcu, BUSHD_PROGRAM_NO_INPUT);
      return false;
    case BUSHD_PROGRAM_TRAVEL:
      return has_travelled(mcu);
    case BUSHD_PROGRAM_MOVE_UNTIL:
      return has_moved_until(mcu);
    case BUSHD_PROGRAM_PULSE:
      if (!p->pulsed) p->pulsed = bushd_mcu_pulse_now(mcu, p->frame.us);
      return p->pulsed;
    default:
      look_after_runs(mcu);
      return p->moving == 0;
  }
}

static void begin_pass(bushd_mcu_program* p) {
  bushd_mcu_repeat* repeat = &p->repeat[p->depth++];
  repeat->at = p->at;
  repeat->next_frame = p->next_frame;
  repeat->left = p->frame.count;
}

static void end_pass(bushd_mcu_program* p) {
  bushd_mcu_repeat* repeat = &p->repeat[p->depth - 1u];
  if (p->depth == 1) ++p->repeats;
  if (repeat->left == 1) {
    --p->depth;
    return;
  }
  if (repeat->left != 0) --repeat->left;
  p->at = repeat->at;
  p->next_frame = repeat->next_frame;
}

static void begin_frame(bushd_mcu* mcu) {
  bushd_mcu_program* p = mcu->config.program;
  p->frame = bushd_next_program_frame(&p->program, &p->at);
  ++p->next_frame;
  p->point = 0;
  p->pulsed = p->met = false;
  p->has_frame = true;
  switch (p->frame.kind) {
    case BUSHD_PROGRAM_END:
      p->reason = BUSHD_PROGRAM_DONE;
      p->stage = BUSHD_PROGRAM_ENDED;
      p->motors = 0;
      break;
    case BUSHD_PROGRAM_REPEAT:
      begin_pass(p);
      p->has_frame = false;
      break;
    case BUSHD_PROGRAM_NEXT:
      end_pass(p);
      p->has_frame = false;
      break;
    case BUSHD_PROGRAM_WAIT:
    case BUSHD_PROGRAM_WAIT_INPUT:
      p->until = mcu->uptime + bushd_mcu_program_ticks(mcu, p->frame.us);
      break;
    case BUSHD_PROGRAM_PULSE:
      break;
    case BUSHD_PROGRAM_TRAVEL:
      begin_travel(mcu);
      break;
    case BUSHD_PROGRAM_MOVE_UNTIL:
      // No step where the input shows its level already.
      p->met = shows_level(mcu);
      if (!p->met) begin_point(mcu);
      break;
    default:
      begin_point(mcu);
  }
}

// Goes on as far as this tick lets it.
static void go_on(bushd_mcu* mcu) {
  bushd_mcu_program* p = mcu->config.program;
  for (uint8_t begun = 0;; ++begun) {
    if (p->has_frame && !is_over(mcu)) return;
    if (p->stage != BUSHD_PROGRAM_RUNS || begun == BUSHD_MCU_PROGRAM_BEGINS) return;
    if (p->has_frame && p->point + 1u < p->frame.points) {
      ++p->point;
      begin_point(mcu);
    } else {
      begin_frame(mcu);
    }
    if (p->stage != BUSHD_PROGRAM_RUNS) return;
  }
}

static bushd_program_reason hindrance(const bushd_mcu* mcu) {
  const bushd_mcu_program* p = mcu->config.program;
  if ((mcu->faults & BUSHD_MCU_PROGRAM_ENDING_FAULTS) != 0) return BUSHD_PROGRAM_FAULT;
  if ((mcu->flags & BUSHD_FLAG_ENABLED) == 0) return BUSHD_PROGRAM_DISABLED;
  if ((p->program.flags & BUSHD_PROGRAM_WITHOUT_HOST) != 0) return BUSHD_PROGRAM_NO_REASON;
  if ((mcu->faults & BUSHD_FAULT_LINK) != 0) return BUSHD_PROGRAM_SILENCE;
  return mcu->faults != 0 ? BUSHD_PROGRAM_FAULT : BUSHD_PROGRAM_NO_REASON;
}

static void await_start(bushd_mcu* mcu) {
  bushd_mcu_program* p = mcu->config.program;
  const int32_t ticks = ticks_after(p->start_tick, mcu->tick + 1u);
  if (ticks < 0 || ticks > BUSHD_MCU_PROGRAM_FARTHEST_START) {
    end_now(mcu, BUSHD_PROGRAM_LATE);
  } else if (ticks == 0) {
    p->stage = BUSHD_PROGRAM_RUNS;
  }
}

static void come_to_rest(bushd_mcu* mcu) {
  bushd_mcu_program* p = mcu->config.program;
  if ((bushd_mcu_moving(mcu) & p->motors) != 0) return;
  if (p->stage == BUSHD_PROGRAM_PAUSES) {
    p->stage = BUSHD_PROGRAM_PAUSED;
  } else {
    p->stage = BUSHD_PROGRAM_ENDED;
    p->motors = 0;
  }
}

void bushd_mcu_go_on_with_program(bushd_mcu* mcu) {
  bushd_mcu_program* p = mcu->config.program;
  if (p->stage != BUSHD_PROGRAM_ENDS) {
    const bushd_program_reason why = hindrance(mcu);
    if (why != BUSHD_PROGRAM_NO_REASON) end_now(mcu, why);
  }
  if (p->stage == BUSHD_PROGRAM_WAITS) await_start(mcu);
  if (p->stage == BUSHD_PROGRAM_RUNS) {
    const bool motion = p->has_frame && p->frame.points != 0;
    if (p->resumes && motion) begin_motion(mcu);
    p->resumes = false;
    if (p->stage == BUSHD_PROGRAM_RUNS) go_on(mcu);
  } else if (p->stage == BUSHD_PROGRAM_PAUSES || p->stage == BUSHD_PROGRAM_ENDS) {
    come_to_rest(mcu);
  }
}

#endif
