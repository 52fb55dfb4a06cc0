// How motors stop, each by its own table. They do when
// - their queue ends while they move
// - no master is heard for too long while they are in a table run, or no SYNC while on a line
// - an emergency stop is commanded, or an input asks for one
// - they come to a limit switch
#include "firmware/core/stop.h"

#include "firmware/core/access.h"
#include "firmware/core/drivers.h"
#include "firmware/core/line_run.h"
#include "firmware/core/owner.h"
#include "firmware/core/state.h"
#include "firmware/core/stream.h"
#include "firmware/core/stream_stop.h"
#include "firmware/core/table_run.h"

// Ends a run that goes on without `next`, or one that waits.
static void end_in_silence(bushd_mcu* mcu, uint8_t m, bool runs, uint32_t next) {
  uint32_t from = next;
  uint32_t rest_from;
  if (runs) {
    bushd_mcu_count_ramp_down(mcu);
  } else if (bushd_mcu_start_waits(mcu, m, next, &rest_from) && ticks_after(rest_from, next) > 0) {
    from = rest_from;  // ticks before it are still made
  }
  bushd_mcu_cut_queue(mcu, m, from);
  mcu->faults |= BUSHD_FAULT_LINK;
}

static void watch_line(bushd_mcu* mcu, uint32_t next) {
  if (mcu->line.motors == 0 || ticks_after(next, bushd_mcu_line_deadline(mcu)) < 0) return;
  if ((mcu->line.motors & bushd_mcu_moved_without_host(mcu)) != 0) return;
  uint16_t concerned = bushd_mcu_ramp_down_line(mcu);
  for (uint8_t m = 0; concerned != 0; ++m, concerned = (uint16_t)(concerned >> 1)) {
    if (concerned & 1u) end_in_silence(mcu, m, true, next);
  }
}

void bushd_mcu_watch_comm_timeout(bushd_mcu* mcu) {
  const uint32_t next = mcu->tick + 1u;
  watch_line(mcu, next);
  if (mcu->reception.silent_ticks < mcu->reception.comm_timeout_ticks) return;
  const uint16_t alone = bushd_mcu_moved_without_host(mcu);
  const uint16_t wait = mcu->trigger.armed | (bushd_mcu_program_motors(mcu) & (uint16_t)~alone);
  if (wait != 0) mcu->faults |= BUSHD_FAULT_LINK;
  for (uint8_t m = 0; m < mcu->config.motors; ++m) {
    bushd_mcu_motor* motor = &mcu->motor[m];
    const bool runs = motor->mode == BUSHD_MCU_TABLE_RUN;
    if (!runs && motor->mode != BUSHD_MCU_RUN_WAITS) continue;
    if ((alone & motor_bit(m)) != 0) continue;
    const bool on_line = bushd_mcu_owner_of_motor(mcu, m) == BUSHD_MCU_OWNER_LINE;
    if (on_line ? runs : bushd_run_done(&motor->made.run)) continue;
    if (runs) bushd_mcu_ramp_down_run(mcu, m);
    end_in_silence(mcu, m, runs, next);
  }
}

void bushd_mcu_stop_all(bushd_mcu* mcu, bushd_stop_mode mode, uint32_t next) {
  // Before all else, since it takes effect at once.
  if (mode == BUSHD_STOP_DISABLE) bushd_mcu_set_enable(mcu, false);
  if (mode == BUSHD_STOP_RAMP) bushd_mcu_ramp_down_line(mcu);
  for (uint8_t m = 0; m < mcu->config.motors; ++m) bushd_mcu_stop_motor(mcu, m, mode, next);
}

bushd_status bushd_mcu_take_emergency(bushd_mcu* mcu, const bushd_emergency* message) {
  const bool disables = message->mode == BUSHD_STOP_DISABLE;
  const uint8_t faults = BUSHD_FAULT_EMERGENCY | (disables ? BUSHD_FAULT_DISABLED : 0);
  bushd_mcu_stop_all(mcu, message->mode, bushd_mcu_first_open(mcu));
  mcu->faults |= faults;
  return BUSHD_OK;
}
