// The tick counter against the bus's. All MCUs hear the end of a SYNC frame at once; a later SYNC
// tells when, in bus time, that was. The difference to the own time of it is the error.
//
// Not yet in step: the counter jumps, and the rest of the difference is made up by lengthening one
// tick (a timer can always wait longer, but not go back). In step: the next ticks are made longer
// or shorter until the error is made up, each by at most 1/64, so that no step shifts by more.
//
// The time of a SYNC is noted as the corrected clock shows it: with the corrections that are known
// but not yet carried out. So its error is what the clock has drifted since the last SYNC whose
// error was corrected, and
//
//     rate += gain x error / (time between the two)
//
// The time is noted to some microseconds only. An error within these may be nothing else, so a
// quarter of it is taken; all of a larger one: that is drift, of a rate not yet known or of another
// reference. Of the first one all is taken too.
//
// The rate's share of each tick is added up in 1/4096 ns and given out in whole ns. With the rate
// changes what the clock has drifted from the SYNC until now: that is made up at once too.
#include "firmware/core/sync.h"

#include "firmware/core/access.h"
#include "firmware/core/state.h"
#include "firmware/core/stream.h"

#define MAX_ERROR_DIVISOR 2
#define SYNC_NOISE_NS 5000
#define NOISE_GAIN_DIVISOR 4
#define MAX_RATE_PPB 500000
#define MAX_INTERVAL_NS INT64_C(60000000000)
#define BILLION INT64_C(1000000000)
#define TWO_MASTERS_NS 2000000000u
#define FRACTION 4096

static int64_t span_ns(const bushd_mcu* mcu, uint32_t from_tick, uint32_t from_ns, uint32_t tick,
                       int64_t ns) {
  return (int64_t)ticks_after(tick, from_tick) * mcu->tick_ns + ns - from_ns;
}

// The time in the present tick, as the corrected clock shows it; may lie outside of the tick.
static int64_t corrected_ns(const bushd_mcu* mcu, int32_t time_in_tick_ns) {
  const bushd_mcu_clock* clock = &mcu->clock;
  const int64_t by_rate = (int64_t)clock->rate_now_ns * time_in_tick_ns / mcu->tick_ns;
  return (int64_t)time_in_tick_ns - by_rate + clock->behind_ns - clock->slew_now_ns -
         clock->slew_next_ns;
}

static void note_correction(bushd_mcu_clock* clock, const bushd_sync* sync) {
  clock->corrected = true;
  clock->corrected_tick = sync->sync_tick;
  clock->corrected_ns = sync->sync_ns;
}

static void adopt(bushd_mcu* mcu, const bushd_sync* sync) {
  bushd_mcu_clock* clock = &mcu->clock;
  const int32_t tick_ns = (int32_t)mcu->tick_ns;
  // Takes the place of what was given to the port for the next tick, but for the rate's share.
  const int32_t behind_ns = (int32_t)sync->sync_ns - (int32_t)clock->sync_ns + clock->behind_ns;
  int32_t longer_ns = clock->slew_next_ns + clock->rate_next_ns - behind_ns;
  mcu->tick += sync->sync_tick - clock->sync_tick;
  for (; longer_ns < 0; longer_ns += tick_ns) ++mcu->tick;
  for (; longer_ns >= tick_ns; longer_ns -= tick_ns) --mcu->tick;
  clock->slew_next_ns = longer_ns - clock->rate_next_ns;
  clock->behind_ns = 0;
  mcu->port.adjust_tick(mcu->port.context, longer_ns);
  bushd_mcu_clear_streams(mcu);
  clock->rate_known = false;
  note_correction(clock, sync);
  mcu->flags |= BUSHD_FLAG_SYNCED;
}

static void set_rate(bushd_mcu* mcu, int32_t rate_ppb) {
  mcu->clock.rate_ppb = rate_ppb;
  mcu->clock.rate_step = (int32_t)((int64_t)rate_ppb * mcu->tick_ns * FRACTION / BILLION);
}

// Returns by how much the rate was changed, in ppb.
static int32_t correct_rate(bushd_mcu* mcu, const bushd_sync* sync, int32_t error_ns,
                            int32_t time_in_tick_ns) {
  bushd_mcu_clock* clock = &mcu->clock;
  if (!clock->corrected) return 0;
  const int64_t interval_ns =
      span_ns(mcu, clock->corrected_tick, clock->corrected_ns, sync->sync_tick, sync->sync_ns);
  if (interval_ns <= 0 || interval_ns > MAX_INTERVAL_NS) return 0;
  const int64_t error_ppb = error_ns * BILLION / interval_ns;
  if (error_ppb > MAX_RATE_PPB || error_ppb < -MAX_RATE_PPB) return 0;
  const int32_t old_ppb = clock->rate_ppb;
  const int32_t old_step = clock->rate_step;
  // The first estimate is better than none, however short the time that it was made in. An error of
  // 0 is no estimate: it is what the reference hears, which is told its own times.
  const bool drift = !clock->rate_known || error_ns > SYNC_NOISE_NS || error_ns < -SYNC_NOISE_NS;
  clock->rate_known = clock->rate_known || error_ns != 0;
  int32_t rate_ppb = old_ppb + (int32_t)(drift ? error_ppb : error_ppb / NOISE_GAIN_DIVISOR);
  if (rate_ppb > MAX_RATE_PPB) rate_ppb = MAX_RATE_PPB;
  if (rate_ppb < -MAX_RATE_PPB) rate_ppb = -MAX_RATE_PPB;
  set_rate(mcu, rate_ppb);
  // The present tick and the next one still go by the old rate.
  const int64_t change = clock->rate_step - old_step;
  const int64_t old_ns = 2 * (int64_t)mcu->tick_ns - time_in_tick_ns;
  clock->rate_fraction += (int32_t)(change * old_ns / mcu->tick_ns);
  return rate_ppb - old_ppb;
}

static void correct(bushd_mcu* mcu, const bushd_sync* sync, int32_t time_in_tick_ns) {
  bushd_mcu_clock* clock = &mcu->clock;
  const int32_t limit_ns = (int32_t)(mcu->tick_ns / MAX_ERROR_DIVISOR);
  const int32_t ticks = ticks_after(sync->sync_tick, clock->sync_tick);
  if (ticks >= -1 && ticks <= 1) {
    const int32_t error_ns =
        (int32_t)span_ns(mcu, clock->sync_tick, clock->sync_ns, sync->sync_tick, sync->sync_ns);
    if (error_ns <= limit_ns && error_ns >= -limit_ns) {
      int64_t since_ns = span_ns(mcu, clock->sync_tick, clock->sync_ns, mcu->tick,
                                 corrected_ns(mcu, time_in_tick_ns));
      if (since_ns > MAX_INTERVAL_NS) since_ns = MAX_INTERVAL_NS;
      const int32_t change_ppb = correct_rate(mcu, sync, error_ns, time_in_tick_ns);
      clock->behind_ns += error_ns + (int32_t)(change_ppb * since_ns / BILLION);
      note_correction(clock, sync);
      return;
    }
  }
  const uint16_t moving = bushd_mcu_moving(mcu);
  if ((moving & ~bushd_mcu_moved_without_host(mcu)) != 0) {
    mcu->faults |= BUSHD_FAULT_SYNC;
  } else if (moving != 0) {
    // Its clock was its own for long. It comes into step as soon as the program lets all rest.
    mcu->flags &= (uint8_t)~BUSHD_FLAG_SYNCED;
  } else {
    adopt(mcu, sync);
  }
}

// Two masters that have each started at some time are no trouble; two that talk by turns are.
static void watch_masters(bushd_mcu* mcu, uint16_t master) {
  bushd_mcu_clock* clock = &mcu->clock;
  if (clock->heard && master != clock->master) {
    const uint32_t window_ticks = TWO_MASTERS_NS / mcu->tick_ns;
    const bool again = clock->other_heard && master == clock->other_master &&
                       mcu->uptime - clock->other_uptime <= window_ticks;
    if (again) {
      mcu->flags |= BUSHD_FLAG_TWO_MASTERS;
      clock->two_masters_ticks = (uint16_t)window_ticks;
    }
    clock->other_heard = true;
    clock->other_master = clock->master;
    clock->other_uptime = clock->master_uptime;
  }
  clock->master_uptime = mcu->uptime;
}

static void note_mark(bushd_mcu* mcu, int32_t time_in_tick_ns) {
  bushd_mcu_clock* clock = &mcu->clock;
  const int32_t tick_ns = (int32_t)mcu->tick_ns;
  int32_t ns = (int32_t)corrected_ns(mcu, time_in_tick_ns);
  clock->sync_tick = mcu->tick;
  for (; ns < 0; ns += tick_ns) --clock->sync_tick;
  for (; ns >= tick_ns; ns -= tick_ns) ++clock->sync_tick;
  clock->sync_ns = (uint32_t)ns;
  mcu->flags |= BUSHD_FLAG_SYNC_HEARD;
}

void bushd_mcu_sync(bushd_mcu* mcu, const bushd_sync* sync, int32_t time_in_tick_ns) {
  bushd_mcu_clock* clock = &mcu->clock;
  watch_masters(mcu, sync->master);
  const bool same_master = clock->heard && clock->master == sync->master;
  // A frame that comes twice is one SYNC, and the first time is the one that the others heard.
  if (same_master && clock->sync_id == sync->sync_id) return;
  bushd_mcu_tell(mcu, BUSHD_TELLS_SYNC);
  const bool known = same_master && sync->follows && (mcu->flags & BUSHD_FLAG_SYNC_HEARD) != 0 &&
                     clock->sync_id == sync->follow_up_id && sync->sync_ns < mcu->tick_ns;
  if (known && (mcu->flags & BUSHD_FLAG_SYNCED) != 0) {
    correct(mcu, sync, time_in_tick_ns);
  } else if (known && bushd_mcu_moving(mcu) == 0) {
    adopt(mcu, sync);
  }
  // A late copy of another one does not take it back.
  const bool later = ticks_after(sync->sync_tick, clock->told_tick) > 0;
  if (sync->follows && (later || mcu->line.motors == 0)) clock->told_tick = sync->sync_tick;
  clock->heard = true;
  clock->master = sync->master;
  clock->sync_id = sync->sync_id;
  mcu->flags &= (uint8_t)~BUSHD_FLAG_SYNC_HEARD;
  if (clock->settling == 0 && (mcu->flags & BUSHD_FLAG_CONFIGURED) != 0) {
    note_mark(mcu, time_in_tick_ns);
  }
}

// What the rate adds to the next tick, in whole ns; the rest waits.
static int32_t rate_share_ns(bushd_mcu_clock* clock) {
  clock->rate_fraction += clock->rate_step;
  const int32_t whole_ns = clock->rate_fraction / FRACTION;
  clock->rate_fraction -= whole_ns * FRACTION;
  return -whole_ns;
}

// Gives the next tick its share of what is known.
__attribute__((noinline)) static void adjust_next(bushd_mcu* mcu) {
  bushd_mcu_clock* clock = &mcu->clock;
  clock->rate_next_ns = rate_share_ns(clock);
  int32_t step_ns = clock->behind_ns;
  if (step_ns != 0) {
    const int32_t rate_ns = clock->rate_next_ns < 0 ? -clock->rate_next_ns : clock->rate_next_ns;
    const int32_t limit_ns = (int32_t)(mcu->tick_ns / BUSHD_TICK_SLEW_DIVISOR) - rate_ns;
    if (step_ns > limit_ns) step_ns = limit_ns;
    if (step_ns < -limit_ns) step_ns = -limit_ns;
    clock->behind_ns -= step_ns;
  }
  clock->slew_next_ns = -step_ns;
  const int32_t longer_ns = clock->slew_next_ns + clock->rate_next_ns;
  if (longer_ns != 0) mcu->port.adjust_tick(mcu->port.context, longer_ns);
}

void bushd_mcu_slew(bushd_mcu* mcu) {
  bushd_mcu_clock* clock = &mcu->clock;
  if (clock->settling != 0) --clock->settling;
  if (clock->two_masters_ticks != 0 && --clock->two_masters_ticks == 0) {
    mcu->flags &= (uint8_t)~BUSHD_FLAG_TWO_MASTERS;
  }
  clock->slew_now_ns = clock->slew_next_ns;
  clock->rate_now_ns = clock->rate_next_ns;
  const int32_t any = clock->slew_next_ns | clock->rate_next_ns | clock->behind_ns |
                      clock->rate_step | clock->rate_fraction;
  if (any != 0) adjust_next(mcu);
}

void bushd_mcu_new_tick_length(bushd_mcu* mcu) {
  bushd_mcu_clock* clock = &mcu->clock;
  clock->settling = 2;
  clock->behind_ns = 0;
  clock->corrected = false;
  clock->rate_fraction = 0;
  set_rate(mcu, clock->rate_ppb);
}
