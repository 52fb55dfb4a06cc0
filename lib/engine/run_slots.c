#include "engine/run_slots.h"

static void make_step(bushd_run* run) {
  ++run->steps_done;
  if (run->lead_steps != 0) {
    run->lead_steps = 0;
  } else if (run->accel_at < run->accel_end) {
    ++run->accel_at;
  } else if (run->cruise_left != 0) {
    --run->cruise_left;
  } else {
    --run->decel_left;
  }
}

int16_t bushd_run_slots(bushd_run* run, uint32_t tick_ns, uint16_t slot_count, uint16_t bit,
                        uint16_t* masks) {
  if (bushd_run_done(run)) return 0;
  const uint64_t unit_ns = run->table->time_unit_ns;
  // All times are counted from the step before the tick.
  const uint64_t begin_ns = run->since * unit_ns + run->since_ns;
  const uint64_t end_ns = begin_ns + tick_ns;
  uint64_t last_ns = 0;
  uint64_t delay_ns = bushd_run_delay(run) * unit_ns;
  int16_t steps = 0;
  while (delay_ns != 0 && last_ns + delay_ns <= end_ns) {
    last_ns += delay_ns;
    const uint64_t slot = (last_ns - begin_ns) * slot_count / tick_ns;
    masks[slot < slot_count ? slot : slot_count - 1u] |= bit;
    ++steps;
    make_step(run);
    delay_ns = bushd_run_delay(run) * unit_ns;
  }
  const uint64_t since_ns = end_ns - last_ns;
  run->since = (uint32_t)(since_ns / unit_ns);
  run->since_ns = (uint32_t)(since_ns % unit_ns);
  run->fraction = (uint8_t)(delay_ns == 0 ? 0u : since_ns * 256u / delay_ns);
  return (int16_t)(steps * run->direction);
}
