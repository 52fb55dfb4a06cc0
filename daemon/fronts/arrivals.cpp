#include "daemon/fronts/arrivals.h"

namespace bushd::daemon {

void Arrivals::stopped(const Arrival& arrival, std::uint64_t number, std::int64_t now_us) {
  stops_.push_back({arrival, number, now_us});
  if (stops_.size() <= kMost) return;
  const std::uint64_t oldest = stops_.front().number;
  stops_.pop_front();
  stops_.front().number = oldest;
}

std::uint64_t Arrivals::after_stops(const Arrival& arrival, std::uint64_t stops,
                                    std::int64_t now_us) const {
  for (const Stop& stop : stops_) {
    const bool same_stream = arrival.stream != 0 && arrival.stream == stop.arrival.stream;
    const bool came_before = arrival.earliest_ns < stop.arrival.latest_ns;
    const bool may_have_waited = now_us - stop.read_us <= kMostUnreadUs;
    if (!same_stream && came_before && may_have_waited) return stop.number - 1;
  }
  return stops;
}

}  // namespace bushd::daemon
