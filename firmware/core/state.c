// What the MCU as a whole is doing: the state that it reports, and which of its motors move.
#include "firmware/core/state.h"

#include "firmware/core/access.h"
#include "firmware/core/settle.h"

uint16_t bushd_mcu_moving(const bushd_mcu* mcu) {
  uint16_t moving = mcu->slot_buffer[0].active | mcu->slot_buffer[1].active;
  const uint32_t open = bushd_mcu_first_open(mcu);
  uint16_t left = bushd_mcu_own_motors(mcu);
  if (!mcu->stream.queue_summary.stale) left &= (uint16_t)~mcu->stream.queue_summary.rests;
  uint16_t bit = 1;
  for (const bushd_mcu_motor* motor = mcu->motor; left != 0; ++motor) {
    if ((left & 1u) != 0 && (motor->mode != BUSHD_MCU_STREAM || motor->delay != 0 ||
                             ticks_after(motor->known_until, open) > 0)) {
      moving |= bit;
    }
    left = (uint16_t)(left >> 1);
    bit = (uint16_t)(bit << 1);
  }
  return moving;
}

uint16_t bushd_mcu_engaged(const bushd_mcu* mcu) {
  return (uint16_t)(bushd_mcu_moving(mcu) | mcu->trigger.armed | bushd_mcu_program_motors(mcu));
}

static bool is_moving(const bushd_mcu* mcu) {
  return (mcu->slot_buffer[0].active | mcu->slot_buffer[1].active) != 0 ||
         (bushd_mcu_moving(mcu) | bushd_mcu_program_motors(mcu)) != 0;
}

void bushd_mcu_update_state(bushd_mcu* mcu) {
  const uint8_t ready = BUSHD_FLAG_CONFIGURED | BUSHD_FLAG_SYNCED | BUSHD_FLAG_ENABLED;
  if (mcu->faults != 0) {
    mcu->state = BUSHD_STATE_FAULT;
  } else if ((mcu->flags & ready) != ready || bushd_mcu_settle_pending(mcu)) {
    mcu->state = BUSHD_STATE_BUSY;
  } else {
    mcu->state = is_moving(mcu) ? BUSHD_STATE_RUN : BUSHD_STATE_READY;
  }
}

void bushd_mcu_reject(bushd_mcu* mcu, bushd_status status) {
  bushd_mcu_tell(mcu, BUSHD_TELLS_COUNTERS);
  mcu->reception.rejected_frames = saturating_increment(mcu->reception.rejected_frames);
  mcu->reception.last_rejection = (uint8_t)status;
}

void bushd_mcu_count_ramp_down(bushd_mcu* mcu) {
  mcu->ramp_downs = saturating_increment(mcu->ramp_downs);
  bushd_mcu_tell(mcu, BUSHD_TELLS_COUNTERS);
}
