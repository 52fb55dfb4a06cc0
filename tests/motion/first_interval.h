// From a motor's first step to its second, as its MCU makes them: evenly within each tick.
#pragma once

#include <cstdint>
#include <optional>

#include "motion/axis.h"

namespace bushd::test {

// In ns; from tick 8 on, and nothing if they do not come in a hundred ticks. Precondition: the axis
// goes forward, in fine displacements.
inline std::optional<double> first_interval_ns(motion::Axis& axis) {
  std::optional<double> first_ns;
  std::int64_t told_256 = 0;
  for (motion::Tick tick = 8; tick < 108; ++tick) {
    std::int16_t moved = 0;
    axis.render(tick, 1, &moved, 1);
    const std::int64_t next_256 = (told_256 / 256 + 1) * 256;
    told_256 += moved;
    if (told_256 < next_256) continue;
    const double after = static_cast<double>(told_256 - next_256) / moved;
    const double step_ns = (static_cast<double>(tick + 1) - after) * axis.tick_ns();
    if (first_ns) return step_ns - *first_ns;
    first_ns = step_ns;
  }
  return std::nullopt;
}

}  // namespace bushd::test
