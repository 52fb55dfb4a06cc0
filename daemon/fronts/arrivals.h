// Which stop a message came before, though it is read after it: stops are read before all others.
// No clock of its own: messages bring the times at which the kernel got them, and who reads them
// the time at which that is done.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>

namespace bushd::daemon {

// When a message came to this machine, by its clock, and by what it came.
struct Arrival {
  std::int64_t earliest_ns;
  std::int64_t latest_ns;
  // Messages of one stream (not 0) are read in the order in which they were sent, or numbered.
  std::int64_t stream = 0;
};

class Arrivals {
 public:
  // What had arrived when a stop is read is read by then: what comes later has come after the stop,
  // even if the kernel's clock was set back meanwhile. How long both had waited does not matter.
  static constexpr std::int64_t kMostUnreadUs = 60'000'000;
  static constexpr std::size_t kMost = 64;

  // A request that ends motion is read, at this time of a clock that nobody sets; it has this
  // number (StopCount::count).
  void stopped(const Arrival& arrival, std::uint64_t number, std::int64_t now_us);
  // Another request is read, and so many stops have been: after how many it has arrived. Where the
  // times do not tell, it came before.
  std::uint64_t after_stops(const Arrival& arrival, std::uint64_t stops, std::int64_t now_us) const;

 private:
  struct Stop {
    Arrival arrival;
    std::uint64_t number;  // the first of those that it stands for
    std::int64_t read_us;
  };
  std::deque<Stop> stops_;  // as read, the newest last
};

}  // namespace bushd::daemon
