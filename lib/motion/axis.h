// One motor's motion: the run of its table placed at a tick, ready to be asked for any tick again
// that the MCU has not yet executed, and to be ramped down from a tick on.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>

#include "engine/message.h"
#include "engine/run.h"

namespace bushd::motion {

using Tick = std::int64_t;

// Not copied while a run uses the table: the table outlives the axis.
class Axis {
 public:
  Axis(const bushd_table& table, std::uint32_t tick_ns, bushd_format format)
      : table_(&table), tick_ns_(tick_ns), format_(format) {}

  // How long a move of `steps` takes, in ticks, rounded up; for any number of steps.
  double duration_ticks(std::int64_t steps) const;

  // Longer moves are beyond what tick numbers and times are made for: a month of the shortest
  // ticks, years of the longest.
  static constexpr double kMaxDurationTicks = 1 << 30;

  // From rest at `from_steps`, by `steps` (either sign), time 0 at the beginning of tick `start`.
  // Precondition: !busy(), |steps| < 2^31, duration_ticks(steps) <= kMaxDurationTicks.
  void start(std::int64_t from_steps, std::int64_t steps, Tick start);

  // From the beginning of tick `at` on: the running step goes on, then the fewest steps to rest. At
  // or before the start no step is made. A later call replaces an earlier one, as long as the
  // earlier has not been executed. Returns false if the move is over by then anyway. Precondition:
  // busy(), `at` not yet executed.
  bool ramp_down(Tick at);

  // Displacements of ticks first .. first+count-1 (before the start and after the end: 0) into
  // out[0], out[stride], ... as the format has them (coarse: the byte's value). Returns the delay
  // of the step running at the end of them, 0 at rest for good. Precondition: busy(), first >= the
  // last `executed`.
  std::uint16_t render(Tick first, unsigned count, std::int16_t* out, std::size_t stride);

  // The ticks before `until` are over and will not be asked for again.
  void executed(Tick until);

  // The motor's part is over, for whatever reason.
  void finish() { busy_ = false; }

  bool busy() const { return busy_; }
  bool stopping() const { return stop_at_.has_value(); }
  std::optional<Tick> stop_at() const { return stop_at_; }
  Tick start_tick() const { return start_; }
  // First tick after the last step, as planned now.
  Tick end_tick() const { return end_; }
  std::int64_t from_steps() const { return from_; }
  // Where the motor will stand at the end, as planned now, and where the move was to lead.
  std::int64_t target_steps() const { return target_; }
  std::int64_t wanted_steps() const { return wanted_; }
  // Of the step that runs at the last executed tick; 0 when not moving.
  double velocity_steps_per_s() const;

 private:
  struct Place {
    bushd_run run;
    Tick tick;  // the run's state is that at the beginning of this tick
  };
  bool cancelled() const { return stop_at_ && *stop_at_ <= start_; }
  void take_stop(Place& place) const;
  void advance(Place& place, Tick to) const;
  std::size_t expand(bushd_run& run, std::size_t ticks, std::int16_t* out,
                     std::size_t stride) const;
  Tick end_of(const Place& place) const;
  bool plan_end();

  const bushd_table* table_;
  std::uint32_t tick_ns_;
  bushd_format format_;
  bool busy_ = false;
  Tick start_ = 0;
  Tick end_ = 0;
  std::int64_t from_ = 0;
  std::int64_t target_ = 0;
  std::int64_t wanted_ = 0;
  std::optional<Tick> stop_at_;
  Place base_{};  // executed up to here; a stop at or after base_.tick is not yet in it
  Place head_{};  // where the last render ended, so that the next one need not start from base_
};

}  // namespace bushd::motion
