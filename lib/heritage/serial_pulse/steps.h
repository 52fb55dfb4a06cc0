// Steps of one motor, in the order in which it makes them: of a run of its own table, or its part
// of the run of a line (engine/line.h), which goes by the line's table. Delays and times are
// nanoseconds.
//
// On a line step j of the motor falls in step k of the run, at the share f of its delay: with T(k)
// the time of the run after its step k, at
//
//     t(j) = T(k-1) + ceil( f delay(k) ),     f = (2 (j L - value(0)) - p - 2 N (k-1)) / 2N
//
// in whole ns and without a rounding before the last. So delays, t(j) - t(j-1), are not less than
// those between the exact times by a whole ns, and where those are whole, not less at all.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>

#include "bus/rs485/tick_source.h"
#include "engine/run.h"

namespace bushd::serial_pulse {

// A plan by ticks, as the motor's axis makes it: what has been made when so many are over.
class Ticks {
 public:
  explicit Ticks(const link::MotorPlan& plan) : plan_(plan) {}
  std::uint32_t made() const;  // steps of the motor since the run's beginning
  std::uint32_t run_steps() const { return plan_.run.steps_done; }
  bool over() const { return bushd_run_done(&plan_.run); }
  void pass(std::uint32_t tick_ns);
  // The run as it is when it has made `run_steps`, which it has not by now or just has.
  bushd_run after(std::uint32_t run_steps) const;

 private:
  link::MotorPlan plan_;
};

class Steps {
 public:
  // Precondition: of a line's run, it is at its beginning.
  explicit Steps(const link::MotorPlan& plan);
  explicit Steps(const bushd_run& run) : Steps(link::MotorPlan{.run = run, .line = {}}) {}

  // Makes the next step: returns the delay before it; 0: there is none.
  std::uint64_t take_ns();
  std::uint32_t left() const;
  const bushd_table& table() const { return *run_.table; }
  // When the last step taken is due, from the beginning of the run. On a line only.
  std::int64_t time_ns() const { return static_cast<std::int64_t>(last_ns_); }
  // The run's steps in which those of the motor lie that have been taken.
  std::uint32_t run_steps() const { return run_step_; }

  // From where `run` is in its steps it is that one. What has been taken lies before, or in the
  // step that runs there, which both have.
  void become(const bushd_run& run);
  // It ramps down behind what has been taken. `ticks`: the plan that what was taken last is of, at
  // a tick at which no more had been made.
  void ramp_down(const Ticks& ticks);
  // There are no more.
  void end() { ended_ = true; }

 private:
  void be(const bushd_run& run);
  void pass(std::uint32_t run_steps);
  std::uint64_t take_on_line();
  std::uint64_t time_ns(std::uint32_t run_steps) const;
  std::uint32_t run_end() const;

  bushd_run run_;
  std::deque<bushd_run> then_;  // in the order of their steps; of a line there may be several
  std::optional<link::MotorPlan::Line> line_;
  bool ended_ = false;
  // On a line:
  std::uint32_t made_ = 0;      // steps of the motor from the line's beginning
  std::uint64_t run_ns_ = 0;    // time of the run where run_ is, by its steps
  std::uint64_t last_ns_ = 0;   // and of the step taken last
  std::uint32_t run_step_ = 0;  // in this one of the run it lay
};

}  // namespace bushd::serial_pulse
