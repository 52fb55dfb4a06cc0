// A report tells what has changed since the last one that the master has.
//
// The master says in the POLL which one that is. If it is the last one that was made, it needs only
// what has changed since: sections that were marked (bushd_mcu_tell), inputs that are not as told,
// motors that move or have moved. If it is any other one, a report was lost, or another master
// asks, or one of both has begun anew: then it gets all, and whatever was lost is in it. So any
// loss is repaired by the next report, and the MCU keeps nothing of reports before the last.
//
// A report is whole or not at all: what the MCU tells is true of one tick. If what is new has no
// room, the answer says only that, and the MCU remains as if it had not been asked.
#include "firmware/core/report.h"

#include "firmware/core/access.h"
#include "firmware/core/inputs.h"
#include "firmware/core/owner.h"
#include "firmware/core/state.h"

// What it says of each motor; report->motors are those that are not at rest where they were. One
// out-of-order range has room in a report: that of the lowest motor, and who else has the same one.
static inline void report_motors(const bushd_mcu* mcu, bushd_report* report) {
  const bushd_mcu_out_of_order* told = NULL;
  const bushd_mcu_motor* motor = mcu->motor;
  bushd_motor_report* to = report->motor;
  const uint16_t at_rest = (uint16_t)(mcu->tick + BUSHD_REST_KNOWN_TICKS);
  uint16_t running = 0;
  uint16_t bit = 1;
  report->out_of_order = 0;
  for (uint8_t left = mcu->config.motors; left > 0; --left, ++motor, ++to) {
    if (motor->mode != BUSHD_MCU_STREAM && motor->exact) running |= bit;
    if (motor->has_out_of_order) {
      if (told == NULL) told = &motor->out_of_order;
      if (motor->out_of_order.from == told->from && motor->out_of_order.until == told->until) {
        report->out_of_order |= bit;
      }
    }
    to->position_steps = motor->position_steps;
    const bool far = ticks_after(motor->known_until, mcu->tick) > INT16_MAX;
    to->known_until = (uint16_t)(far ? mcu->tick + INT16_MAX : motor->known_until);
    if (to->known_until != at_rest) report->motors |= bit;
    bit = (uint16_t)(bit << 1);
  }
  report->motor_count = mcu->config.motors;
  // What people move by local inputs is not for a master to end.
  report->running = (uint16_t)(running & ~(mcu->autonomous & ~bushd_mcu_moved_by_request(mcu)));
  report->out_of_order_from = told != NULL ? (uint16_t)told->from : (uint16_t)0;
  report->out_of_order_until = told != NULL ? (uint16_t)told->until : (uint16_t)0;
}

static inline void report_all(bushd_mcu* mcu, bushd_report* report) {
  report->state = mcu->state;
  report->faults = mcu->faults;
  report->flags = mcu->flags;
  report->epoch = mcu->stream.epoch;
  report->boot_number = mcu->config.boot_number;
  report->moving = bushd_mcu_moving(mcu) | bushd_mcu_program_motors(mcu);
  report->tick = mcu->tick;
  report->tick_ns = mcu->port.time_in_tick_ns(mcu->port.context);
  report->reset_cause = mcu->config.reset_cause;
  report->failed_tests = mcu->failed_tests;
  report->sync_id = mcu->clock.sync_id;
  report->sync_tick = mcu->clock.sync_tick;
  report->sync_ns = mcu->clock.sync_ns;
  report->rate_ppb = mcu->clock.rate_ppb;
  bushd_mcu_report_inputs(mcu, report);
  report->bad_frames = mcu->reception.bad_frames;
  report->rejected_frames = mcu->reception.rejected_frames;
  report->last_rejection = mcu->reception.last_rejection;
  report->ramp_downs = mcu->ramp_downs;
  report->autonomous = mcu->autonomous | bushd_mcu_program_motors(mcu);
  report->low_water_ticks = mcu->low_water_ticks;
  report->homed = mcu->homed;
  report->homing = mcu->homing.stage;
  report->armed = mcu->trigger.armed;
  report->trigger_number = mcu->trigger.number;
  report->trigger_state = mcu->trigger.state;
  report->start_tick = mcu->trigger.start_tick;
  report->start_ns = mcu->trigger.start_ns;
  report->motors = report->moving | mcu->reports.moved;
  report_motors(mcu, report);
}

static uint8_t changed_sections(const bushd_mcu* mcu, const bushd_report* report) {
  uint8_t sections = mcu->reports.changed;
  if (report->inputs != mcu->reports.inputs ||
      report->system_inputs != mcu->reports.system_inputs) {
    sections |= BUSHD_TELLS_INPUTS;
  }
  // Left out, it tells that nothing moves; a range goes with its motors.
  const uint16_t moves = report->running | report->autonomous | report->out_of_order;
  if (moves != 0 || report->low_water_ticks != UINT16_MAX) sections |= BUSHD_TELLS_MOTION;
  return sections;
}

// As the next one needs it.
static void note_told(bushd_mcu* mcu, const bushd_report* report) {
  bushd_mcu_reports* reports = &mcu->reports;
  reports->number = report->number;
  reports->changed = 0;
  reports->moved = 0;
  reports->inputs = report->inputs;
  reports->system_inputs = report->system_inputs;
  reports->low_water_ticks = report->low_water_ticks;
  mcu->low_water_ticks = UINT16_MAX;
}

// Neither 0 nor the one that this master has.
static uint8_t next_number(const bushd_mcu* mcu, uint8_t known) {
  uint8_t number = mcu->reports.number;
  do {
    ++number;
  } while (number == 0 || number == known);
  return number;
}

// Large on the stack: not a part of the frame of who calls it, below which streams are taken.
__attribute__((noinline)) size_t bushd_mcu_encode_report(bushd_mcu* mcu,
                                                         const bushd_poll_entry* entry,
                                                         uint8_t* payload) {
  bushd_mcu_update_state(mcu);
  bushd_report report;
  report_all(mcu, &report);
  report.number = next_number(mcu, entry->known);
  if (entry->known != 0 && entry->known == mcu->reports.number) {
    report.sections = changed_sections(mcu, &report);
  } else {
    report.sections = BUSHD_TELLS_ALL;
    report.motors = bushd_mcu_own_motors(mcu);
    // What was lost may have told of less.
    if (mcu->reports.low_water_ticks < report.low_water_ticks) {
      report.low_water_ticks = mcu->reports.low_water_ticks;
    }
  }
  if (bushd_report_size(report.sections, report.motors) <= entry->room) {
    note_told(mcu, &report);
  } else {
    report.number = 0;
    report.sections = 0;
    report.motors = 0;
  }
  return bushd_encode_report(&report, payload);
}
