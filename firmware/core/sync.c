// The tick counter against the bus's. A SYNC frame's end is a mark that all MCUs hear at once; the
// next SYNC tells when, in bus time, the mark before was. The difference to the own time of that
// mark is the error.
//
// Not yet in step: the counter jumps, and the rest of the difference is made up by lengthening one
// tick (a timer can always wait longer, but not go back). In step: the next ticks are made longer
// or shorter until the error is made up, each by at most 1/64, so that no step shifts by more.
//
// The error is known one mark late. So the present mark is noted as the clock will show it once the
// correction is done: else the same error would be found in it again, corrected twice, and the
// clock would swing around the bus's without end.
#include "firmware/core/internal.h"

#define MAX_ERROR_DIVISOR 2
#define MAX_SLEW_DIVISOR 64
#define REPEATED_WITHIN_NS 100000000u

static void adopt(bushd_mcu* mcu, const bushd_sync* sync) {
  const int32_t tick_ns = (int32_t)mcu->tick_ns;
  int32_t behind_ns = (int32_t)sync->mark_ns - (int32_t)mcu->mark_ns;
  mcu->tick += sync->mark_tick - mcu->mark_tick;
  if (behind_ns > 0) {
    behind_ns -= tick_ns;
    ++mcu->tick;
  }
  mcu->port.adjust_tick(mcu->port.context, -behind_ns);
  bushd_mcu_clear_streams(mcu);
  mcu->behind_ns = 0;
  mcu->settling = 3;
  mcu->flags = (uint8_t)((mcu->flags | BUSHD_FLAG_SYNCED) & ~BUSHD_FLAG_MARK);
}

static void correct(bushd_mcu* mcu, const bushd_sync* sync) {
  const int32_t tick_ns = (int32_t)mcu->tick_ns;
  const int32_t ticks = ticks_after(sync->mark_tick, mcu->mark_tick);
  if (ticks >= -1 && ticks <= 1) {
    const int32_t behind_ns = ticks * tick_ns + (int32_t)sync->mark_ns - (int32_t)mcu->mark_ns;
    if (behind_ns <= tick_ns / MAX_ERROR_DIVISOR && behind_ns >= -tick_ns / MAX_ERROR_DIVISOR) {
      mcu->behind_ns += behind_ns;
      return;
    }
  }
  if (bushd_mcu_moving(mcu) != 0) {
    mcu->faults |= BUSHD_FAULT_SYNC;
  } else {
    adopt(mcu, sync);
  }
}

void bushd_mcu_sync(bushd_mcu* mcu, uint8_t tag, const bushd_sync* sync, uint32_t time_in_tick_ns) {
  if ((mcu->flags & BUSHD_FLAG_CONFIGURED) == 0) return;
  const bool known = sync->follows && (mcu->flags & BUSHD_FLAG_MARK) != 0 &&
                     mcu->mark_tag == sync->mark_tag && sync->mark_ns < mcu->tick_ns;
  if (known && (mcu->flags & BUSHD_FLAG_SYNCED) != 0) {
    correct(mcu, sync);
  } else if (known && bushd_mcu_moving(mcu) == 0) {
    adopt(mcu, sync);
  }
  if (mcu->settling != 0) return;
  // A frame that comes twice is one mark, and the first time is the one that the others heard.
  // Later the name may be another mark's, of a master that has just started.
  const uint32_t since_mark = mcu->tick - mcu->mark_tick;
  if ((mcu->flags & BUSHD_FLAG_MARK) != 0 && mcu->mark_tag == tag &&
      since_mark < REPEATED_WITHIN_NS / mcu->tick_ns) {
    return;
  }
  int32_t mark_ns = (int32_t)time_in_tick_ns + mcu->behind_ns;
  mcu->mark_tick = mcu->tick;
  if (mark_ns < 0) {
    mark_ns += (int32_t)mcu->tick_ns;
    --mcu->mark_tick;
  } else if (mark_ns >= (int32_t)mcu->tick_ns) {
    mark_ns -= (int32_t)mcu->tick_ns;
    ++mcu->mark_tick;
  }
  mcu->flags |= BUSHD_FLAG_MARK;
  mcu->mark_tag = tag;
  mcu->mark_ns = (uint32_t)mark_ns;
}

void bushd_mcu_slew(bushd_mcu* mcu) {
  if (mcu->settling != 0) --mcu->settling;
  if (mcu->behind_ns == 0) return;
  const int32_t slew = (int32_t)(mcu->tick_ns / MAX_SLEW_DIVISOR);
  const int32_t step = mcu->behind_ns > slew    ? slew
                       : mcu->behind_ns < -slew ? -slew
                                                : mcu->behind_ns;
  mcu->behind_ns -= step;
  mcu->port.adjust_tick(mcu->port.context, -step);
  // The next tick is the one that changes, so the clock shows it from the one after on.
  mcu->settling = 2;
}
