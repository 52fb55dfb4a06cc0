// The host's idea of bus time, from reports.
//
// A report says at which bus time it was made; its last byte reaches the host a known line time and
// an unknown latency later. Latency is never negative, so the smallest difference "host minus bus"
// of the last reports is the best: the estimate lags true bus time by the smallest latency seen,
// never leads it.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "bus/rs485/tick.h"

namespace bushd::link {

class BusClock {
 public:
  explicit BusClock(std::int64_t tick_ns) : tick_ns_(tick_ns) {}

  void reset() { *this = BusClock(tick_ns_); }
  bool valid() const { return samples_ > 0; }

  // The tick counter of a report, next to what this clock expects; the first one is taken as it is.
  Tick unwrap(std::uint32_t tick, std::int64_t now_us) const;
  // Bus time (tick, ns into it) at host time `now_us`, the latency already taken off as far as it
  // is known.
  void sample(Tick tick, std::int64_t ns_in_tick, std::int64_t now_us);
  // The tick that the bus is in; precondition: valid().
  Tick tick_at(std::int64_t now_us) const;
  // When the bus comes to this tick: the first time of which tick_at tells it. Precondition:
  // valid().
  std::int64_t begin_us(Tick tick) const;
  // Rounded up; needs no sample.
  Tick ticks_in(std::int64_t us) const { return (us * 1000 + tick_ns_ - 1) / tick_ns_; }

 private:
  // At one report per 50 ms, or more: under two seconds, in which crystals drift by less than 0.2
  // ms.
  static constexpr std::size_t kWindow = 32;

  std::int64_t tick_ns_;
  std::array<std::int64_t, kWindow> offset_ns_{};  // host minus bus
  std::size_t samples_ = 0;
  std::int64_t best_ns_ = 0;
};

}  // namespace bushd::link
