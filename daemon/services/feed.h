// The speed along the way of several motors. It is of their unit, which all of them have, or of
// steps; so the way has a length: sqrt of the sum of all squares. By the elementary law (engine/
// elementary.h) each step of the line is one step h of one motor, and the feed is v = h f.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "api/request.h"
#include "base/ids.h"
#include "base/result.h"
#include "daemon/model/installation.h"
#include "motion/way.h"

namespace bushd::daemon {

class Feed {
 public:
  // Errors: not above 0; motors of several units; by the elementary law, of several steps per unit.
  static Result<Feed> make(const Installation& installation, const std::vector<MotorId>& motors,
                           const api::Speed& feed, motion::Way::Law law);

  // How long a step of the way's runs takes at this speed, in ns. Precondition: some motor moves.
  double step_ns(const motion::Way& way) const;
  // The same of a straight part of a path, of all its steps.
  double way_ns(std::span<const std::int64_t> from, std::span<const std::int64_t> to) const;
  // Error: it is slower than any delay.
  Result<void> is_possible(double step_ns) const;
  // "12 mm/s".
  std::string text() const;

 private:
  std::vector<double> step_;  // of each motor, in the unit
  double per_s_ = 0;
  std::string unit_;
};

}  // namespace bushd::daemon
