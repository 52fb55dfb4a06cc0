#include "motion/run_blocks.h"

#include <tuple>

namespace bushd::motion {
namespace {

auto state_of(const bushd_run& run) {
  return std::tie(run.since, run.steps_done, run.since_ns, run.cruise_left, run.cruise,
                  run.lead_delay, run.accel_at, run.accel_end, run.brake_left, run.decel_left,
                  run.fraction, run.direction, run.table);
}

}  // namespace

std::span<const std::int16_t> RunBlocks::expand(bushd_run& run, std::uint32_t tick_ns,
                                                std::size_t ticks) {
  for (std::size_t i = 0; i < blocks_.size(); ++i) {
    const Block& block = blocks_[i];
    if (block.ticks != ticks || block.tick_ns != tick_ns) continue;
    if (state_of(block.from) != state_of(run)) continue;
    last_ = i;
    run = block.to;
    return {block.made.data(), ticks};
  }
  last_ = 1 - last_;
  Block& block = blocks_[last_];
  block.from = run;
  block.tick_ns = tick_ns;
  block.ticks = ticks;
  bushd_run_expand_fine(&run, tick_ns, ticks, block.made.data(), 1);
  block.to = run;
  return {block.made.data(), ticks};
}

}  // namespace bushd::motion
