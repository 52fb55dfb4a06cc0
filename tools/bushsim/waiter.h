// What the simulators of this program wait for: signals, bytes, and the time.
#pragma once

#include <initializer_list>
#include <optional>
#include <utility>

#include "base/result.h"
#include "descriptor.h"
#include "sim/edge.h"

namespace bushsim {

class Waiter {
 public:
  // Blocks SIGINT, SIGTERM, SIGHUP, SIGUSR1, SIGUSR2 and SIGRTMIN for this thread and those it
  // starts later: signal() tells of them.
  static bushd::Result<Waiter> create();

  // Until one of these can be read, at most four, or a signal has come, or the time is over. A
  // negative descriptor is none. Bit i of the result: the i-th can be read, or is at its end.
  bushd::Result<unsigned> wait(std::initializer_list<int> descriptors,
                               bushd::sim::TimeNs at_most_ns) const;

  // The next of the signals that have come. nullopt: no more.
  std::optional<int> signal() const;

 private:
  explicit Waiter(Descriptor signals) : signals_(std::move(signals)) {}

  Descriptor signals_;
};

// CLOCK_MONOTONIC.
bushd::sim::TimeNs monotonic_ns();

}  // namespace bushsim
