// The steps of a motor's plan, one by one, each with its delay and its time in the plan. A tick
// source tells plans by ticks; a board takes delays.
//
// A step exactly at the end of a tick belongs to that tick (engine/run.h). What the source plans
// anew counts from the first tick that begins at or after the last step taken: committed().
#pragma once

#include <cstdint>
#include <optional>

#include "bus/rs485/tick_source.h"
#include "engine/run.h"

namespace bushd::commutator {

class PlannedSteps {
 public:
  // From the beginning of tick `start` on. `source` outlives it.
  PlannedSteps(link::TickSource& source, link::McuIndex mcu, std::uint8_t motor,
               std::uint32_t tick_ns, link::Tick start);

  struct Step {
    int direction;           // +1, -1
    std::uint64_t delay_ns;  // after the step before, or the beginning
    std::int64_t at_ns;      // in the plan's time, 0 at tick 0
  };
  // The next one; none: the motor rests there.
  std::optional<Step> take();
  // The plan can change from this tick on.
  link::Tick committed() const;
  // No more of the plan: after the next step it ramps down by its table.
  void leave_plan();
  bool has_left_plan() const { return left_; }
  link::Tick start() const { return start_; }

 private:
  std::optional<Step> made(std::uint64_t delay_ns, std::int64_t at_ns);

  link::TickSource& source_;
  const link::McuIndex mcu_;
  const std::uint8_t motor_;
  const std::int64_t tick_ns_;
  const link::Tick start_;
  link::Tick tick_;     // that of the run
  bool known_ = false;  // the run is
  bushd_run run_{};     // as of run_ns_
  std::int64_t run_ns_ = 0;
  std::int64_t last_ns_;  // of the last step, or the beginning
  bool left_ = false;
};

}  // namespace bushd::commutator
