// Times are counted in whole units and a rest of ns, as everywhere in a run; only what lies within
// the tick is turned into slots. With t the time of a step in ns from the tick's start,
//
//     t x slot_count  =  slot x tick_ns + rest,   0 <= rest < tick_ns
//
// is carried from step to step by additions, and the slot is estimated by the tick's reciprocal: on
// an 8-bit MCU divisions would not fit into a tick.
#include "engine/run_slots.h"

#include "engine/slots.h"

#if BUSHD_MAX_SLOTS <= 128
typedef uint32_t scaled_ns;    // 20 ms x 128 slots
typedef uint16_t scaled_high;  // without the low 16 bits
#else
typedef uint64_t scaled_ns;
typedef uint32_t scaled_high;
#endif

static void make_step(bushd_run* run) {
  bushd_run_count(run, 1);
  if (run->lead_delay != 0) {
    run->lead_delay = 0;
  } else if (run->accel_at < run->accel_end) {
    ++run->accel_at;
  } else if (run->cruise_left != 0) {
    --run->cruise_left;
  } else {
    --run->decel_left;
  }
}

// What is cut off makes the estimate too small: by at most two, unless the reciprocal is clipped.
static inline uint16_t whole_slots(scaled_ns* rest, const bushd_run_tick* tick) {
  const uint32_t high = (scaled_high)(*rest >> 16);
  uint16_t slots = (uint16_t)(high * tick->reciprocal >> 16);
  *rest -= (scaled_ns)tick->tick_ns * slots;
  for (; *rest >= tick->tick_ns; *rest -= tick->tick_ns) ++slots;
  return slots;
}

// 256 numerator / divisor with the bits of `low` behind the numerator's, rounded down.
// Precondition: numerator < divisor.
static uint8_t share(uint32_t numerator, uint8_t low, uint32_t divisor) {
  uint8_t quotient = 0;
  for (uint8_t bit = 0x80; bit != 0; bit = (uint8_t)(bit >> 1)) {
    const bool carry = numerator >> 31 != 0;
    numerator = numerator << 1 | ((low & bit) != 0);
    if (carry || numerator >= divisor) {
      numerator -= divisor;
      quotient |= bit;
    }
  }
  return quotient;
}

bushd_run_tick bushd_run_tick_of(uint32_t tick_ns, uint32_t unit_ns) {
  const uint32_t reciprocal = UINT32_MAX / tick_ns;
  const bushd_run_tick tick = {tick_ns, unit_ns, tick_ns / unit_ns, tick_ns % unit_ns,
                               reciprocal < UINT16_MAX ? (uint16_t)reciprocal : UINT16_MAX};
  return tick;
}

int16_t bushd_run_slots(bushd_run* run, const bushd_run_tick* tick, uint16_t slot_count,
                        uint16_t bit, uint16_t* masks) {
  uint16_t delay = bushd_run_delay(run);
  if (delay == 0) return 0;
  uint32_t since = run->since + tick->units;
  uint32_t since_ns = run->since_ns + tick->rest_ns;
  if (since_ns < tick->rest_ns || since_ns >= tick->unit_ns) {
    since_ns -= tick->unit_ns;
    ++since;
  }
  int16_t steps = 0;
  if (since >= delay) {
    const scaled_ns unit_slots = (scaled_ns)tick->unit_ns * slot_count;
    scaled_ns rest = (scaled_ns)((delay - run->since) * tick->unit_ns - run->since_ns) * slot_count;
    uint16_t slot = 0;
    while (true) {
      slot = (uint16_t)(slot + whole_slots(&rest, tick));
      masks[slot < slot_count ? slot : slot_count - 1u] |= bit;
      ++steps;
      make_step(run);
      since -= delay;
      delay = bushd_run_delay(run);
      if (delay == 0 || since < delay) break;
      rest += (scaled_ns)delay * unit_slots;
    }
  }
  run->since = since;
  run->since_ns = since_ns;
  return (int16_t)(steps * run->direction);
}

void bushd_run_note_fraction(bushd_run* run) {
  const uint16_t delay = bushd_run_delay(run);
  const uint32_t unit_ns = run->table->time_unit_ns;
  run->fraction =
      delay == 0 ? (uint8_t)0 : share(run->since, share(run->since_ns, 0, unit_ns), delay);
}
