#include "daemon/arrivals.h"

namespace bushd::daemon {

void Arrivals::stopped(const Arrival& arrival, std::uint64_t number) {
  stops_.push_back({arrival, number});
  if (stops_.size() <= kMost) return;
  const std::uint64_t oldest = stops_.front().number;
  stops_.pop_front();
  stops_.front().number = oldest;
}

std::uint64_t Arrivals::after_stops(const Arrival& arrival, std::uint64_t stops) const {
  for (const Stop& stop : stops_) {
    const bool same_stream = arrival.stream != 0 && arrival.stream == stop.arrival.stream;
    const std::int64_t before_ns = stop.arrival.latest_ns - arrival.earliest_ns;
    if (!same_stream && before_ns > 0 && before_ns <= kMostUnreadNs) return stop.number - 1;
  }
  return stops;
}

}  // namespace bushd::daemon
