// The pulses of one MCU's motors, each counted in the direction that DIR shows.
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "firmware/core/mcu.h"
#include "sim/edge.h"

namespace bushd::sim {

class PulseCounter final : public EdgeSink {
 public:
  void edge(const Edge& edge) override {
    if (edge.signal == Signal::kDir) forward_[edge.index] = edge.level;
    if (edge.signal == Signal::kCommonDir) common_forward_ = edge.level;
    if (edge.signal == Signal::kEnable) {
      enabled_ = edge.level;
      if (!enabled_) fell_ns_ = edge.time_ns;
    }
    if (edge.signal != Signal::kStep || !edge.level) return;
    const bool forward = common_dir ? common_forward_ : forward_[edge.index];
    count[edge.index] += forward ? 1u : 0u - 1u;
    ++pulses;
    if (!enabled_) without_enable_ns = std::max(without_enable_ns, edge.time_ns - fell_ns_);
  }
  void settled(TimeNs) override {}

  std::array<std::uint32_t, BUSHD_MOTORS_PER_MCU> count{};  // wrap as the MCU's do
  std::uint64_t pulses = 0;
  TimeNs without_enable_ns = -1;  // the longest that EN was low when a pulse came; -1: none came
  bool common_dir = false;

 private:
  std::array<bool, BUSHD_MOTORS_PER_MCU> forward_{};
  bool common_forward_ = false;
  bool enabled_ = false;
  TimeNs fell_ns_ = 0;
};

}  // namespace bushd::sim
