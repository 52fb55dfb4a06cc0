// What the run of a line makes in blocks of ticks, made once for all its motors, which go through
// the same ticks one after the other.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "engine/run.h"

namespace bushd::motion {

class RunBlocks {
 public:
  static constexpr std::size_t kMostTicks = 64;

  // As bushd_run_expand_fine: advances the run and returns its displacements, in 1/256 step, which
  // stay valid until the next call. Precondition: ticks <= kMostTicks.
  std::span<const std::int16_t> expand(bushd_run& run, std::uint32_t tick_ns, std::size_t ticks);

 private:
  struct Block {
    bushd_run from{};
    bushd_run to{};
    std::uint32_t tick_ns = 0;  // 0: none
    std::size_t ticks = 0;
    std::array<std::int16_t, kMostTicks> made{};
  };
  // One of the ticks that are sent, one of those that are known to be over.
  std::array<Block, 2> blocks_;
  std::size_t last_ = 0;
};

}  // namespace bushd::motion
