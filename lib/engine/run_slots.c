// Times are counted in whole units and a rest of ns, as everywhere in a run; only what lies within
// the tick is turned into slots. With t the time of a step in ns from the tick's start,
//
//     t x slot_count  =  slot x tick_ns + rest,   0 <= rest < tick_ns
//
// is carried from step to step by additions: on an 8-bit MCU divisions would not fit into a tick.
#include "engine/run_slots.h"

#include "engine/slots.h"

#if BUSHD_MAX_SLOTS <= 128
typedef uint32_t scaled_ns;  // 20 ms x 128 slots
#else
typedef uint64_t scaled_ns;
#endif

static void make_step(bushd_run* run) {
  ++run->steps_done;
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

static inline uint16_t whole_slots(scaled_ns* rest, uint32_t tick_ns) {
  const scaled_ns eight = (scaled_ns)tick_ns * 8u;
  uint16_t slots = 0;
  for (; *rest >= eight; *rest -= eight) slots = (uint16_t)(slots + 8u);
  for (; *rest >= tick_ns; *rest -= tick_ns) ++slots;
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
  const bushd_run_tick tick = {tick_ns, unit_ns, tick_ns / unit_ns, tick_ns % unit_ns};
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
      slot = (uint16_t)(slot + whole_slots(&rest, tick->tick_ns));
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
  run->fraction = delay == 0 ? (uint8_t)0 : share(since, share(since_ns, 0, tick->unit_ns), delay);
  return (int16_t)(steps * run->direction);
}
