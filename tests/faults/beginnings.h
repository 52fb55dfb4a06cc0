// No motor begins to move after an emergency stop, until faults are cleared, nor after the daemon
// was asked to end: judged by pulses alone.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "sim/edge.h"
#include "times.h"

namespace bushfaults {

class Beginnings {
 public:
  using TimeNs = bushd::sim::TimeNs;

  void emergency_stop(TimeNs now_ns) { forbid(now_ns, "an emergency stop"); }
  void daemon_ends(TimeNs now_ns) {
    forbid(now_ns, "the daemon was asked to end");
    ends_ = true;
  }
  void faults_are_cleared() {
    if (!ends_) since_ns_.reset();
  }
  // Another daemon, which knows of neither.
  void other_daemon() {
    since_ns_.reset();
    ends_ = false;
  }
  // From time to time, of each motor; one that `goes_on` whatever the daemon does may begin. Why
  // what it has done was not to be.
  std::optional<std::string> watch(TimeNs now_ns, std::size_t motor, std::int64_t steps,
                                   bool goes_on);

 private:
  // Until what an MCU had been told before is under way: an edge that came within the second in
  // which it still hears nobody, the longest delay after that (1.65 s), and some ticks.
  static constexpr TimeNs kUnderWayNs = 3 * kSecond;
  // No delay of a step is as long here.
  static constexpr TimeNs kRestsNs = kSecond;

  struct Motor {
    std::int64_t steps = 0;
    TimeNs moved_ns = 0;
  };
  void forbid(TimeNs now_ns, const std::string& because) {
    if (!since_ns_) since_ns_ = now_ns;
    because_ = because;
  }

  std::optional<TimeNs> since_ns_{};
  bool ends_ = false;
  std::string because_{};
  std::map<std::size_t, Motor> motors_;
};

}  // namespace bushfaults
