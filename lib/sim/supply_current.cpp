#include "sim/supply_current.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace bushd::sim {
namespace {

// Shares of the settling time: until the drop is over, and until the overshoot is at its highest.
constexpr double kDropShare = 0.12;
constexpr double kPeakShare = 0.30;
constexpr double kFluctuationNs = 1'700'000;

}  // namespace

void SupplyCurrent::edge(const Edge& edge) {
  if (edge.signal == Signal::kEnable) enabled_ = edge.level;
  if (edge.signal != Signal::kStep || !edge.level) return;
  steps_.push_back(edge.time_ns);
  while (edge.time_ns - steps_.front() > kMemoryNs) steps_.pop_front();
}

double SupplyCurrent::response_a(TimeNs since_ns) const {
  if (since_ns < 0) return 0;
  const double u = static_cast<double>(since_ns) / static_cast<double>(rules_.settle_ns);
  if (u < kDropShare) return -rules_.drop_a * std::sin(std::numbers::pi * u / kDropShare);
  if (u < kPeakShare) {
    const double rise = (u - kDropShare) / (kPeakShare - kDropShare);
    return rules_.overshoot_a * std::sin(std::numbers::pi / 2 * rise);
  }
  return rules_.overshoot_a * std::pow(16, -(u - kPeakShare) / (1 - kPeakShare));
}

double SupplyCurrent::current_a(TimeNs time_ns) const {
  if (!enabled_) return 0;
  double deviation = 0;
  for (const TimeNs step_ns : steps_) deviation += response_a(time_ns - step_ns);
  deviation /= 1 + std::abs(deviation) / rules_.soft_a;
  const double angle = 2 * std::numbers::pi * static_cast<double>(time_ns) / kFluctuationNs;
  return rules_.drivers * rules_.rest_a + deviation + rules_.fluctuation_a * std::sin(angle);
}

std::uint16_t SupplyCurrent::reading(TimeNs time_ns) const {
  const double counts = 512 + rules_.counts_per_a * current_a(time_ns);
  return static_cast<std::uint16_t>(std::clamp(std::lround(counts), 0L, 1023L));
}

}  // namespace bushd::sim
