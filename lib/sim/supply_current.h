// The current that the drivers of one MCU take from their supply (RU 2704486, figures 1 and 2).
// After a step a driver takes less, down to giving back for a moment what is stored in the winding,
// then more than at rest, and falls back to that:
//
//     current
//              overshoot       .-.
//                              |  `-.
//     rest     ----.           |     `-..__
//                   \         /            `''''----
//                    \_______/  drop              |
//              step: 0                          settle     (1/16 of the overshoot is left)
//
// The supply is common to all: it gives way, so four drivers at once move its current by less than
// four times as much. The document has the times and by how much staggered steps lessen the
// deviation; amplitudes and the supply's softness are ours, chosen so.
#pragma once

#include <cstdint>
#include <deque>

#include "sim/edge.h"

namespace bushd::sim {

struct SupplyRules {
  int drivers = 4;
  double rest_a = 0.35;  // of each
  double drop_a = 0.40;
  double overshoot_a = 0.40;
  TimeNs settle_ns = 518'000;
  double soft_a = 2.4;           // a deviation d is d / (1 + |d| / soft_a) in the end
  double fluctuation_a = 0.002;  // whatever the steps
  // The sensor: 0 A at half of the converter's range.
  double counts_per_a = 200;
};

class SupplyCurrent {
 public:
  explicit SupplyCurrent(const SupplyRules& rules) : rules_(rules) {}

  // An edge of the MCU; in order of time.
  void edge(const Edge& edge);

  // The current at a time. Times asked for may lie before edges that are known, but never fall by
  // more than kMemoryNs.
  double current_a(TimeNs time_ns) const;
  // The same as the converter reads it, 0..1023.
  std::uint16_t reading(TimeNs time_ns) const;

  static constexpr TimeNs kMemoryNs = 100'000'000;

 private:
  double response_a(TimeNs since_ns) const;

  SupplyRules rules_;
  bool enabled_ = false;
  std::deque<TimeNs> steps_;
};

}  // namespace bushd::sim
