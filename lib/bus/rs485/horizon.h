// How far ahead of the present ticks are planned and sent. The one place that says which tick can
// still be changed.
#pragma once

#include <algorithm>
#include <cstdint>

#include "bus/rs485/bus_clock.h"
#include "bus/rs485/health.h"
#include "bus/rs485/tick.h"

namespace bushd::link {

// What an adapter holds back is late on the bus, and its answer is later still: queues are deeper
// by that, and changes are planned further ahead.
class Horizon {
 public:
  // Both outlive it. Precondition of what follows: clock.valid(), unless it gives microseconds.
  Horizon(const BusClock& clock, const Latency& latency) : clock_(clock), latency_(latency) {}

  // Earliest tick at which a move can start and all its first frames still arrive well before.
  Tick earliest_start(std::int64_t now_us) const {
    return clock_.tick_at(now_us) + clock_.ticks_in(kStartLeadUs + 4 * held_back_us());
  }
  // The same if one frame is enough, which the bus will have carried by `carried_us`, and this
  // program and the driver take up to `margin_us` meanwhile. This clock lags by a part of a tick,
  // and by what the adapter holds back of each answer; of what is sent it holds back nothing.
  Tick earliest_at_once(std::int64_t carried_us, std::int64_t margin_us) const {
    return first_changeable(clock_.tick_at(carried_us + margin_us + held_back_us()) + 1);
  }
  // Earliest tick from which a replacement can take effect that the bus will have carried by
  // `carried_us`. This clock lags by a part of a tick.
  Tick earliest_replace(std::int64_t now_us, std::int64_t carried_us) const {
    const std::int64_t lead_us = kReplaceLeadUs + carried_us - now_us + 2 * held_back_us();
    return first_changeable(clock_.tick_at(now_us) + 1) + clock_.ticks_in(lead_us);
  }

  // How long the adapter may hold an answer back.
  std::int64_t held_back_us() const { return std::min(latency_.recent_us, kMaxHeldBackUs); }

  // Queues are kept this full.
  std::int64_t queue_target_us() const { return kQueueTargetUs + 4 * held_back_us(); }
  // Below this, ticks go before everything routine. `silence_us`: see queue_enough_us.
  std::int64_t queue_urgent_us(std::int64_t silence_us) const {
    return std::max(kQueueUrgentUs + 4 * held_back_us(), queue_enough_us(silence_us));
  }
  // With this, none runs empty while nothing is sent for `silence_us` and it is then its turn.
  std::int64_t queue_enough_us(std::int64_t silence_us) const {
    return kReplaceLeadUs + silence_us + 2 * held_back_us();
  }

 private:
  static constexpr std::int64_t kQueueTargetUs = 300'000;
  static constexpr std::int64_t kQueueUrgentUs = 120'000;
  // Two polls: one lost first frame can still be repaired.
  static constexpr std::int64_t kStartLeadUs = 100'000;
  // What program and driver may take until a frame is on the bus; what the bus itself takes, and
  // the adapter's latency, come on top.
  static constexpr std::int64_t kReplaceLeadUs = 10'000;
  // More than any adapter holds back. An answer that was read later still waited for this program,
  // which had been stopped: moves and stops must not be put off by seconds for that.
  static constexpr std::int64_t kMaxHeldBackUs = 40'000;

  const BusClock& clock_;
  const Latency& latency_;
};

}  // namespace bushd::link
