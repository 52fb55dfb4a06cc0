#include "bus/rs485/bus_clock.h"

#include <algorithm>

namespace bushd::link {

Tick BusClock::unwrap(std::uint32_t tick, std::int64_t now_us) const {
  if (!valid()) return tick;
  const Tick expected = tick_at(now_us);
  return expected + static_cast<std::int32_t>(tick - static_cast<std::uint32_t>(expected));
}

void BusClock::sample(Tick tick, std::int64_t ns_in_tick, std::int64_t now_us) {
  offset_ns_[samples_ % kWindow] = now_us * 1000 - (tick * tick_ns_ + ns_in_tick);
  ++samples_;
  const auto filled = static_cast<std::ptrdiff_t>(std::min(samples_, kWindow));
  best_ns_ = *std::min_element(offset_ns_.begin(), offset_ns_.begin() + filled);
}

Tick BusClock::tick_at(std::int64_t now_us) const {
  const std::int64_t bus_ns = now_us * 1000 - best_ns_;
  return bus_ns >= 0 ? bus_ns / tick_ns_ : -((tick_ns_ - 1 - bus_ns) / tick_ns_);
}

std::int64_t BusClock::begin_us(Tick tick) const {
  const std::int64_t host_ns = tick * tick_ns_ + best_ns_;
  return host_ns >= 0 ? (host_ns + 999) / 1000 : -(-host_ns / 1000);
}

}  // namespace bushd::link
