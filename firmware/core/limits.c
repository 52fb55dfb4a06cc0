// A limit switch inhibits motion in its direction
// - while it is active, if it is at one end
// - from when a motor has been stopped by it until that motor has moved away and it is inactive: so
//   one that was overrun, or stands at both ends' switch, still inhibits it
#include "firmware/core/limits.h"

#include "firmware/core/access.h"

#define DEBOUNCE_BITS (sizeof((bushd_mcu_limits*)0)->bounces / sizeof(uint16_t))

static uint16_t limits_towards(const bushd_mcu* mcu, int8_t direction) {
  return direction > 0 ? mcu->inputs.limit_positive : mcu->inputs.limit_negative;
}

static uint16_t at_limit(const bushd_mcu* mcu, int8_t direction) {
  return direction > 0 ? mcu->limits.at_positive : mcu->limits.at_negative;
}

static uint16_t* hit_towards(bushd_mcu* mcu, int8_t direction) {
  return direction > 0 ? &mcu->limits.hit_positive : &mcu->limits.hit_negative;
}

static void set_hit(bushd_mcu* mcu, int8_t direction, uint16_t bit) {
  *hit_towards(mcu, direction) |= bit;
  bushd_mcu_tell(mcu, BUSHD_TELLS_INPUTS);
}

// Asked every tick of a motor that moves: only a change is news.
static void clear_hit(bushd_mcu* mcu, int8_t direction, uint16_t bit) {
  uint16_t* const hit = hit_towards(mcu, direction);
  if ((*hit & bit) == 0) return;
  *hit &= (uint16_t)~bit;
  bushd_mcu_tell(mcu, BUSHD_TELLS_INPUTS);
}

// From the inputs as debounced.
static void find_motors(bushd_mcu* mcu) {
  bushd_mcu_limits* limits = &mcu->limits;
  bushd_mcu_tell(mcu, BUSHD_TELLS_INPUTS);
  limits->at_positive = limits->at_negative = 0;
  if (limits->active == 0) return;
  for (uint8_t m = 0; m < mcu->config.motors; ++m) {
    const bushd_mcu_switches* switches = &mcu->switches[m];
    if (limits->active & motor_bit(switches->positive)) limits->at_positive |= motor_bit(m);
    if (limits->active & motor_bit(switches->negative)) limits->at_negative |= motor_bit(m);
  }
  limits->at_positive &= mcu->inputs.limit_positive;
  limits->at_negative &= mcu->inputs.limit_negative;
}

void bushd_mcu_default_switches(bushd_mcu* mcu) {
  for (uint8_t m = 0; m < BUSHD_MOTORS_PER_MCU; ++m) {
    bushd_mcu_switches* switches = &mcu->switches[m];
    switches->positive = switches->negative = switches->home = m & 0xFu;
  }
}

void bushd_mcu_begin_limits(bushd_mcu* mcu, uint16_t active_inputs) {
  bushd_mcu_limits* limits = &mcu->limits;
  limits->watched = limits->both_ends = 0;
  for (uint8_t m = 0; m < mcu->config.motors; ++m) {
    const bushd_mcu_switches* switches = &mcu->switches[m];
    const bool positive = (mcu->inputs.limit_positive & motor_bit(m)) != 0;
    const bool negative = (mcu->inputs.limit_negative & motor_bit(m)) != 0;
    if (positive) limits->watched |= motor_bit(switches->positive);
    if (negative) limits->watched |= motor_bit(switches->negative);
    if (positive && negative && switches->positive == switches->negative) {
      limits->both_ends |= motor_bit(m);
    }
  }
  limits->hit_positive &= mcu->inputs.limit_positive;
  limits->hit_negative &= mcu->inputs.limit_negative;
  limits->active = active_inputs & limits->watched;
  limits->unsettled = 0;
  find_motors(mcu);
}

uint16_t bushd_mcu_forbidden(const bushd_mcu* mcu, int8_t direction) {
  const uint16_t hit = direction > 0 ? mcu->limits.hit_positive : mcu->limits.hit_negative;
  return hit | (at_limit(mcu, direction) & (uint16_t)~mcu->limits.both_ends);
}

bool bushd_mcu_homes_at_limit(const bushd_mcu* mcu, uint8_t m, int8_t direction) {
  const bushd_mcu_switches* switches = &mcu->switches[m];
  const uint8_t limit = direction > 0 ? switches->positive : switches->negative;
  return switches->home == limit && (limits_towards(mcu, direction) & motor_bit(m)) != 0;
}

static int8_t first_direction(const bushd_ticks* ticks, uint8_t column) {
  const bool fine = (ticks->flags & BUSHD_TICKS_FINE) != 0;
  for (uint8_t row = 0; row < ticks->count; ++row) {
    const uint16_t at = (uint16_t)((uint16_t)row * ticks->motors + column);
    const int16_t displacement = fine ? bushd_get_i16(ticks->displacements + 2u * at)
                                      : bushd_coarse_to_fine(ticks->displacements[at]);
    if (displacement != 0) return displacement > 0 ? 1 : -1;
  }
  return 0;
}

bool bushd_mcu_starts_into_limit(const bushd_mcu* mcu, const bushd_ticks* ticks) {
  const uint16_t positive = bushd_mcu_forbidden(mcu, 1);
  const uint16_t negative = bushd_mcu_forbidden(mcu, -1);
  if ((ticks->flags & BUSHD_TICKS_START) == 0 || ((positive | negative) & ticks->mask) == 0) {
    return false;
  }
  uint8_t column = 0;
  for (uint8_t m = 0; m < mcu->config.motors; ++m) {
    if ((ticks->mask & motor_bit(m)) == 0) continue;
    const int8_t direction = first_direction(ticks, column++);
    if (direction == 0 || ((direction > 0 ? positive : negative) & motor_bit(m)) == 0) return false;
  }
  return true;
}

// How long each input has differed from what it counts as is counted for all of them at once: bit k
// of input n's counter is bit n of bounces[k].
uint16_t bushd_mcu_debounce_limits(bushd_mcu* mcu, uint16_t pins) {
  const uint16_t positive = mcu->limits.at_positive;
  const uint16_t negative = mcu->limits.at_negative;
  const uint16_t differs = pins ^ mcu->limits.active;
  const uint16_t fresh = differs & (uint16_t)~mcu->limits.unsettled;
  uint16_t settled = differs;
  uint16_t carry = differs;
  for (uint8_t k = 0; k < DEBOUNCE_BITS; ++k) {
    const uint16_t counter = mcu->limits.bounces[k] & (uint16_t)~fresh;
    settled &= (mcu->inputs.debounce_ticks >> k & 1) != 0 ? counter : (uint16_t)~counter;
    mcu->limits.bounces[k] = counter ^ carry;
    carry &= counter;
  }
  mcu->limits.unsettled = differs & (uint16_t)~settled;
  if (settled == 0) return 0;
  mcu->limits.active ^= settled;
  find_motors(mcu);
  return (mcu->limits.at_positive ^ positive) | (mcu->limits.at_negative ^ negative);
}

uint16_t bushd_mcu_at_limits(const bushd_mcu* mcu) {
  return mcu->limits.at_positive | mcu->limits.at_negative;
}

static void leave(bushd_mcu* mcu, uint8_t m, int8_t heading) {
  const int8_t back = (int8_t)-heading;
  const uint16_t bit = motor_bit(m);
  if ((at_limit(mcu, back) & bit) == 0) clear_hit(mcu, back, bit);
}

void bushd_mcu_stands_off_limit(bushd_mcu* mcu, uint8_t m, int8_t last_direction) {
  if ((mcu->limits.both_ends & motor_bit(m)) == 0) leave(mcu, m, last_direction);
}

bool bushd_mcu_limit_stops(bushd_mcu* mcu, uint8_t m, int8_t heading, bool now_active, bool homes) {
  const uint16_t bit = motor_bit(m);
  const int8_t back = (int8_t)-heading;
  if (!homes || !bushd_mcu_homes_at_limit(mcu, m, heading)) {
    const bool both_ends = (mcu->limits.both_ends & bit) != 0;
    if (both_ends && now_active && (*hit_towards(mcu, back) & bit) == 0) {
      set_hit(mcu, heading, bit);
    }
    if ((bushd_mcu_forbidden(mcu, heading) & bit) != 0) {
      set_hit(mcu, heading, bit);
      return true;
    }
  }
  const bool its_own = homes && bushd_mcu_homes_at_limit(mcu, m, back);
  if (!its_own) leave(mcu, m, heading);
  return false;
}

void bushd_mcu_stands_at_switch(bushd_mcu* mcu, uint8_t m, int8_t direction) {
  if (bushd_mcu_homes_at_limit(mcu, m, direction)) set_hit(mcu, direction, motor_bit(m));
}

void bushd_mcu_has_left_switch(bushd_mcu* mcu, uint8_t m, int8_t direction) {
  if (bushd_mcu_homes_at_limit(mcu, m, direction)) clear_hit(mcu, direction, motor_bit(m));
}
