#include "heritage/commutator/planned_steps.h"

#include <algorithm>

namespace bushd::commutator {
namespace {

constexpr std::int64_t kBlockNs = 1'000'000'000;

}  // namespace

PlannedSteps::PlannedSteps(link::TickSource& source, link::McuIndex mcu, std::uint8_t motor,
                           std::uint32_t tick_ns, link::Tick start)
    : source_(source),
      mcu_(mcu),
      motor_(motor),
      tick_ns_(tick_ns),
      start_(start),
      tick_(start),
      last_ns_(start * tick_ns) {}

std::optional<PlannedSteps::Step> PlannedSteps::take() {
  while (true) {
    if (!known_) {
      const auto plan = source_.plan_at(mcu_, motor_, tick_);
      if (!plan) return std::nullopt;
      run_ = *plan;
      run_ns_ = tick_ * tick_ns_;
      known_ = true;
    }
    const std::uint64_t delay_ns = std::uint64_t{bushd_run_delay(&run_)} *
                                   (run_.table != nullptr ? run_.table->time_unit_ns : 0);
    if (delay_ns == 0) return std::nullopt;
    const std::int64_t at_ns = last_ns_ + static_cast<std::int64_t>(delay_ns);
    const link::Tick tick_of_step = (at_ns - 1) / tick_ns_;
    if (left_ || tick_of_step <= tick_) return made(delay_ns, at_ns);
    // The running step goes on, whatever changes by then.
    tick_ = tick_of_step;
    known_ = false;
  }
}

std::optional<PlannedSteps::Step> PlannedSteps::made(std::uint64_t delay_ns, std::int64_t at_ns) {
  const int direction = run_.direction;
  // In blocks: a tick of the engine has 32 bits of ns.
  while (run_ns_ < at_ns) {
    const std::int64_t block = std::min(at_ns - run_ns_, kBlockNs);
    std::uint8_t unused = 0;
    bushd_run_expand_coarse(&run_, static_cast<std::uint32_t>(block), 1, &unused, 1);
    run_ns_ += block;
  }
  last_ns_ = at_ns;
  return Step{.direction = direction, .delay_ns = delay_ns, .at_ns = at_ns};
}

link::Tick PlannedSteps::committed() const {
  return (last_ns_ + tick_ns_ - 1) / tick_ns_;
}

void PlannedSteps::leave_plan() {
  left_ = true;
  if (!known_) return;
  bushd_run_ramp_down(&run_);
}

}  // namespace bushd::commutator
