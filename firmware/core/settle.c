// How long the supply current needs after a step (dt_p of RU 2704486, claim 4), measured before
// work by one step of a motor and its way back:
//
//     10 ticks without a step    the mean of the current, and how far it fluctuates from it
//     a step, 10 ticks           how far it goes, and when it has come back for good
//     the step back, 10 ticks
//
// T_step is a tick at most. The current has come back when it stays as near to the mean as 1/16 of
// its farthest, besides what it fluctuates anyway. If a step does not move it much farther than
// that, or it does not come back, the time stays unknown, and pulses are spread over the whole
// T_step.
//
// The motor is the first that no limit switch inhibits in either direction; if there is none, no
// step is made and the time stays unknown. If its switch is met by the step, it stays there.
//
// Meanwhile the MCU is BUSY, so that nothing else moves.
#include "firmware/core/settle.h"

#include "firmware/core/access.h"
#include "firmware/core/limits.h"

enum {
  QUIET_TICKS = 10,
  FIRST_QUIET = 3,  // a slot_buffer is emitted in the tick after that in which it is prepared
  STEP_AT = FIRST_QUIET + QUIET_TICKS - 1,
  BACK_AT = STEP_AT + QUIET_TICKS,
  OVER_AT = BACK_AT + QUIET_TICKS
};
#define BACK_SHARE 16u
#define LEAST_PEAK 4u  // times the fluctuation

// In the middle of its tick: a small MCU may have no time for samples while it prepares the next.
uint16_t bushd_mcu_settle_slot(const bushd_mcu* mcu) {
  const uint16_t middle = mcu->config.slots / 2u;
  const uint16_t setup_slots = mcu->emission.grid.setup_slots;
  const uint16_t slot = setup_slots > middle ? setup_slots : middle;
  // The step, which is measured, goes to the right: a common DIR is there in odd slots.
  return bushd_emission_has_common_dir(mcu->emission.grid.mode) ? slot | 1u : slot;
}

// With a table, and none of these.
static int8_t first_but(const bushd_mcu* mcu, uint16_t barred) {
  for (uint8_t m = 0; m < mcu->config.motors; ++m) {
    if (mcu->motor[m].table >= 0 && (barred & motor_bit(m)) == 0) return (int8_t)m;
  }
  return -1;
}

bool bushd_mcu_settle_pending(const bushd_mcu* mcu) {
  const bushd_mcu_emission* emission = &mcu->emission;
  return bushd_emission_is_staggered(emission->grid.mode) &&
         emission->settings.settle_us == BUSHD_SETTLE_MEASURED && !emission->of.settle.done &&
         first_but(mcu, 0) >= 0;
}

bool bushd_mcu_wants_samples(const bushd_mcu* mcu) {
  if (!bushd_emission_is_staggered(mcu->emission.grid.mode)) return false;
  const uint8_t ticks = mcu->emission.of.settle.ticks;
  return ticks >= FIRST_QUIET && ticks <= BACK_AT;
}

static void begin(bushd_mcu_settle* settle) {
  settle->of.quiet.sum = 0;
  settle->of.quiet.samples = 0;
  settle->of.quiet.lowest = UINT16_MAX;
  settle->of.quiet.highest = 0;
}

static void note_quiet(bushd_mcu_settle* settle, uint16_t current) {
  if (settle->of.quiet.samples == UINT16_MAX) return;
  ++settle->of.quiet.samples;
  settle->of.quiet.sum += current;
  if (current < settle->of.quiet.lowest) settle->of.quiet.lowest = current;
  if (current > settle->of.quiet.highest) settle->of.quiet.highest = current;
}

static void end_quiet(bushd_mcu_settle* settle) {
  const uint16_t samples = settle->of.quiet.samples;
  const uint16_t lowest = samples == 0 ? 0 : settle->of.quiet.lowest;
  const uint16_t highest = settle->of.quiet.highest;
  const uint16_t mean = (uint16_t)(samples == 0 ? 0 : settle->of.quiet.sum / samples);
  const uint16_t above = (uint16_t)(highest - mean);
  const uint16_t below = (uint16_t)(mean - lowest);
  settle->of.step.mean = mean;
  settle->of.step.fluctuation = (uint16_t)((above > below ? above : below) + 1u);
  settle->of.step.peak = 0;
  settle->of.step.back_ns = 0;
  settle->away = false;
}

static void note_step(bushd_mcu_settle* settle, uint32_t since_ns, uint16_t current) {
  const uint16_t mean = settle->of.step.mean;
  const uint16_t off = (uint16_t)(current > mean ? current - mean : mean - current);
  if (off > settle->of.step.peak) settle->of.step.peak = off;
  const uint32_t near = settle->of.step.peak + BACK_SHARE * (uint32_t)settle->of.step.fluctuation;
  if (BACK_SHARE * (uint32_t)off > near) {
    settle->away = true;
  } else if (settle->away) {
    settle->away = false;
    settle->of.step.back_ns = since_ns;
  }
}

void bushd_mcu_sample(bushd_mcu* mcu, uint32_t time_in_tick_ns, uint16_t current) {
  bushd_mcu_settle* settle = &mcu->emission.of.settle;
  if (!bushd_mcu_wants_samples(mcu)) return;
  if (settle->ticks <= STEP_AT) {
    note_quiet(settle, current);
    return;
  }
  const uint32_t slot_ns = mcu->tick_ns / mcu->config.slots;
  const uint32_t step_ns = slot_ns * bushd_mcu_settle_slot(mcu);
  const uint32_t now_ns = (uint32_t)(settle->ticks - STEP_AT - 1) * mcu->tick_ns + time_in_tick_ns;
  if (now_ns >= step_ns) note_step(settle, now_ns - step_ns, current);
}

static void end(bushd_mcu* mcu) {
  bushd_mcu_settle* settle = &mcu->emission.of.settle;
  settle->done = true;
  settle->ticks = 0;
  if (settle->away || settle->of.step.peak < LEAST_PEAK * (uint32_t)settle->of.step.fluctuation) {
    settle->of.step.back_ns = 0;
  }
  mcu->emission.grid.settle_slots =
      bushd_emission_settle_slots(settle->of.step.back_ns, mcu->tick_ns, mcu->config.slots);
}

static int8_t begin_step(bushd_mcu* mcu) {
  bushd_mcu_settle* settle = &mcu->emission.of.settle;
  const int8_t motor = first_but(mcu, bushd_mcu_forbidden(mcu, 1) | bushd_mcu_forbidden(mcu, -1));
  if (motor < 0) {
    end_quiet(settle);
    end(mcu);
    return 0;
  }
  settle->motor = (uint8_t)motor;
  return 1;
}

int8_t bushd_mcu_settle_step(bushd_mcu* mcu, uint8_t* motor) {
  bushd_mcu_settle* settle = &mcu->emission.of.settle;
  const uint8_t ready = BUSHD_FLAG_CONFIGURED | BUSHD_FLAG_SYNCED | BUSHD_FLAG_ENABLED;
  if (!bushd_mcu_settle_pending(mcu) || mcu->faults != 0 || (mcu->flags & ready) != ready) {
    settle->ticks = 0;
    return 0;
  }
  if (settle->ticks++ == 0) begin(settle);
  if (settle->ticks == STEP_AT + 1) end_quiet(settle);
  if (settle->ticks == OVER_AT) end(mcu);
  int8_t step = 0;
  if (settle->ticks == STEP_AT) step = begin_step(mcu);
  if (settle->ticks == BACK_AT) {
    step = (bushd_mcu_forbidden(mcu, -1) & motor_bit(settle->motor)) != 0 ? 0 : -1;
  }
  *motor = settle->motor;
  return step;
}
