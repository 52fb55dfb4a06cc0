// Whether the MCUs' ticks begin together, in true time.
//
// The promise: two MCUs that have both been in step, and known to the daemon, for 3 s differ by at
// most 20 us, also through 10 s without a SYNC that says when the mark before was. So by then an
// MCU's rate is right to 20 us / 10 s = 2 ppm, and each second of silence beyond 10 s allows 2 us
// more, until a mark has been corrected again. An MCU that has heard fewer than three such marks
// cannot know its rate yet: crystals of +-50 ppm allow 100 us a second.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "config/config.h"
#include "engine/message.h"
#include "sim/bus.h"
#include "witness.h"

namespace bushfaults {

class Skew {
 public:
  using TimeNs = bushd::sim::TimeNs;

  // All of them outlive it.
  Skew(const bushd::config::Config& config, const bushd::sim::Bus& bus, const Witness& witness);

  void heard(TimeNs now_ns, std::size_t mcu, const bushd_sync& sync);
  // From time to time; the bus has come to now_ns. What is wrong, if something is.
  std::optional<std::string> check(TimeNs now_ns);

  // The largest difference of two that were bound to the 20 us alone.
  TimeNs worst_ns() const { return worst_ns_; }

 private:
  struct Mcu {
    std::uint16_t boot_number = 0;
    bool online = false;  // as a daemon has said last
    std::optional<TimeNs> in_step_since_ns;
    std::optional<bushd_sync> last;  // heard
    unsigned corrections = 0;        // since the last one came in step
    TimeNs corrected_ns = 0;
    TimeNs corrected_before_ns = 0;
  };
  void follow(TimeNs now_ns, std::size_t mcu);
  bool bound(TimeNs now_ns, std::size_t mcu) const;
  // How far it may have drifted beyond what all may differ.
  TimeNs drift_ns(TimeNs now_ns, std::size_t mcu) const;
  TimeNs difference_ns(std::size_t a, std::size_t b) const;

  const bushd::config::Config& config_;
  const bushd::sim::Bus& bus_;
  const Witness& witness_;
  const TimeNs tick_ns_;
  std::vector<Mcu> mcus_;
  TimeNs worst_ns_ = 0;
};

}  // namespace bushfaults
