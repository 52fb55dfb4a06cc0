// A switch that a motor's carriage runs into: it closes when the motor comes to a position, opens a
// few steps before it, and bounces both times. A lever that the carriage passes opens beyond it
// too.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>

#include "sim/edge.h"
#include "sim/random.h"

namespace bushd::sim {

struct SwitchOptions {
  std::int64_t at_steps = 0;
  bool positive_end = false;          // closed there and beyond, in this direction
  std::int64_t hysteresis_steps = 0;  // until it opens again
  TimeNs bounce_ns = 0;               // for so long it says now this, now that
  std::uint64_t seed = 0;
  std::int64_t width_steps = std::numeric_limits<std::int64_t>::max();  // closed over so many
  bool opens = false;                                                   // where others close
  std::int64_t period_steps = 0;  // above 0: closed at every so many steps, and nowhere else
  std::optional<std::uint8_t> input = {};  // of the MCU; without: that with the output's number
};

class Switch {
 public:
  explicit Switch(const SwitchOptions& options) : options_(options), random_(options.seed, 0) {}

  // What it says, with the motor at this position. Times do not fall from call to call.
  bool read(TimeNs now_ns, std::int64_t position_steps) {
    const std::int64_t beyond = options_.positive_end ? position_steps - options_.at_steps
                                                      : options_.at_steps - position_steps;
    const std::int64_t slack = closed_ ? options_.hysteresis_steps : 0;
    const bool closed = options_.period_steps > 0
                            ? position_steps % options_.period_steps == 0
                            : beyond >= -slack && beyond - slack < options_.width_steps;
    if (closed != closed_) quiet_ns_ = now_ns + options_.bounce_ns;
    closed_ = closed;
    return now_ns < quiet_ns_ ? random_.below(2) == 0 : closed_ != options_.opens;
  }

 private:
  SwitchOptions options_;
  Random random_;
  bool closed_ = false;
  TimeNs quiet_ns_ = 0;
};

}  // namespace bushd::sim
