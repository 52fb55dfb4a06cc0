// The pulses of one MCU's motors, each counted in the direction that DIR shows.
#pragma once

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
    if (edge.signal == Signal::kEnable) enabled = edge.level;
    if (edge.signal != Signal::kStep || !edge.level) return;
    const bool forward = common_dir ? common_forward_ : forward_[edge.index];
    count[edge.index] += forward ? 1u : 0u - 1u;
    ++pulses;
    if (!enabled) ++pulses_without_enable;
  }
  void settled(TimeNs) override {}

  std::array<std::uint32_t, BUSHD_MOTORS_PER_MCU> count{};  // wrap as the MCU's do
  std::uint64_t pulses = 0;
  std::uint64_t pulses_without_enable = 0;
  bool enabled = false;
  bool common_dir = false;

 private:
  std::array<bool, BUSHD_MOTORS_PER_MCU> forward_{};
  bool common_forward_ = false;
};

}  // namespace bushd::sim
