// One motor's motion: the run of its table placed at a tick, ready to be asked for any tick again
// that the MCU has not yet executed, and to be changed from a tick on: ramped down, or given
// another target. A target that the table cannot lead to in one go (too near, or behind) takes a
// second run, from where the first has come to rest; whoever follows the axis starts it.
//
// The run may be that of a line (engine/line.h, engine/elementary.h), by the table of the line.
// Then every motor of the line has a copy of it, and makes of it what its share says: as long as
// all copies are started, changed and stopped at the same ticks, the motors stay on the line, and
// none need know of another. The same is so of a path (motion/path_run.h), whose run they all
// follow.
//
// In place of a run it may follow a trajectory (motion/trajectory.h), which may become longer
// meanwhile. It ramps down from that by its table when it is stopped, and where the trajectory ends
// in motion.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "engine/elementary.h"
#include "engine/line.h"
#include "engine/message.h"
#include "engine/run.h"
#include "motion/divisor.h"
#include "motion/path_run.h"
#include "motion/run_blocks.h"
#include "motion/trajectory.h"
#include "tables/envelope.h"
#include "tables/table.h"

namespace bushd::motion {

using Tick = std::int64_t;

// At the beginning of tick `at` the running step goes on. Then the run leads to `target_steps` if
// the table allows that; otherwise, or without a target, to rest in the fewest steps. At or before
// the run's start it is a run to `target_steps` from the beginning, or none.
struct Change {
  Tick at;
  std::optional<std::int64_t> target_steps;
  bushd_delay shortest_delay = 0;  // of the run from then on (engine/run.h)
  // Where the run of a line ends, with a target. The line's shortest delay is in the line's
  // time units.
  std::uint32_t run_steps = 0;
};

// What a motor makes of the run of its line, or of its path.
struct LineShare {
  std::uint64_t way = 0;                               // its number, for logs
  std::uint64_t line = 0;                              // the number of its line, for logs
  tables::TablePtr by = {};                            // the motor's own is not what it goes by
  std::shared_ptr<const tables::Envelope> table = {};  // of the run; none: of a path
  std::shared_ptr<RunBlocks> blocks = {};              // of the run of a line, for all its motors
  std::shared_ptr<const PathTrack> track = {};         // of a path, with the motor's place in it
  std::size_t motor = 0;
  // By the elementary law: the line, and which of its coordinates the motor is.
  std::shared_ptr<const bushd_elementary> elementary = {};
  std::uint8_t coordinate = 0;
  // |N|; of 0 the motor only waits for the others. Of a path as far as that.
  std::uint32_t increment = 0;
  std::uint32_t longest = 0;  // L, or S; of a path all its steps
  int direction = 1;
  // This run's part of the line, by its steps.
  std::uint32_t from = 0;
  std::uint32_t to = 0;
  // The MCUs make the run themselves (LINE_RUN), or what stands in for them does.
  bool in_mcus = false;
  bool waits = false;  // the trigger that begins it has not come
};

// The motor's part of a trajectory.
struct TrajectoryShare {
  std::uint64_t number = 0;  // of the trajectory, for logs
  std::shared_ptr<const Trajectory> trajectory;
  std::size_t motor = 0;
};

// Not copied while a run uses the table: the table outlives the axis.
class Axis {
 public:
  Axis(const bushd_table& table, std::uint32_t tick_ns, bushd_format format)
      : table_(&table), tick_ns_(tick_ns), format_(format) {}

  std::uint32_t tick_ns() const { return tick_ns_; }
  std::uint32_t time_unit_ns() const { return table_->time_unit_ns; }

  // `shortest_delay`: no delay of the run is shorter (engine/run.h). 0: only the table counts.

  // How long a move of `steps` takes, in ticks, rounded up; for any number of steps.
  double duration_ticks(std::int64_t steps, bushd_delay shortest_delay = 0) const;

  // What no step of a run is faster than.
  double most_steps_per_s(bushd_delay shortest_delay) const;

  // Longer moves are beyond what tick numbers and times are made for: a month of the shortest
  // ticks, years of the longest.
  static constexpr double kMaxDurationTicks = 1 << 30;

  // From rest at `from_steps`, by `steps` (either sign), time 0 at the beginning of tick `start`,
  // or `late_ns` after it. Precondition: !busy(), |steps| < 2^31, duration_ticks(steps) <=
  // kMaxDurationTicks, late_ns less than a tick.
  void start(std::int64_t from_steps, std::int64_t steps, Tick start, std::uint32_t late_ns = 0,
             bushd_delay shortest_delay = 0);

  // The same for a part of a line; `shortest_delay` in the line's time units.
  // Precondition: !busy(), the run of all of it takes at most kMaxDurationTicks; of a path, and
  // of a line that goes on (share.from > 0), late_ns is 0.
  void start_line(std::int64_t from_steps, LineShare share, Tick start, bushd_delay shortest_delay,
                  std::uint32_t late_ns = 0);

  // Follows a trajectory, whose first row is where it stands.
  // Precondition: !busy(), TrajectoryCheck has nothing against it as far as it is known.
  void start_trajectory(TrajectoryShare share, Tick start);
  // It knows more rows, or has been closed. Precondition: !runs_out_before(the first tick that the
  // MCU may have).
  void trajectory_grew();
  // The trajectory, as far as it is known, ends in motion, or might, and this tick comes after it.
  bool runs_out_before(Tick tick) const;
  // It is on the trajectory, and will be for some ticks more.
  bool trajectory_goes_on_after(Tick tick) const;
  const std::optional<TrajectoryShare>& trajectory() const { return followed_; }
  // It has ramped down because the trajectory ended in motion.
  bool ran_out() const { return followed_ && !base_.follows && !stopping_; }
  // It goes, or has gone since the last executed(), in this direction.
  bool goes(int direction) const;

  // What is wanted of the motor from now on: rest, or another target. The plan follows with
  // change(). Precondition: busy().
  void stop();
  void aim(std::int64_t target_steps, bushd_delay shortest_delay = 0);
  // Another end of its line, by the line's steps.
  void aim_on_line(std::uint32_t line_step, bushd_delay shortest_delay);

  // The plan does not yet do what is wanted, and can be changed: of two changes the first must have
  // been executed (or known to have failed) before the second is planned, for the MCU may have
  // taken it.
  bool needs_change() const { return busy_ && stale_ && !change_; }

  // The plan does what is wanted, as far as the table can.
  bool is_planned() const { return !stale_; }
  // There is one that is not known to have been executed: from this tick on.
  std::optional<Tick> open_change() const {
    return change_ ? std::optional<Tick>(change_->at) : std::nullopt;
  }

  // Plans what is wanted from tick `at` on, in place of a change that was planned before and that
  // the MCU has not taken. Returns false if the plan stays what it was without any change: over by
  // then, or it leads there already. Of a line: if that is so of this motor, which may have made
  // all of its steps before the others have. Precondition: busy(), `at` not yet executed.
  //   least_end  of a line that is to stop: not before this step of it, where others of it, which
  //              a trigger has begun earlier, will stop; a run that ramps down there, if it can
  bool change(Tick at, std::uint32_t least_end = 0);

  // Displacements of ticks first .. first+count-1 (before the start and after the end: 0) into
  // out[0], out[stride], ... as the format has them (coarse: the byte's value). Returns the delay
  // of the step running at the end of them, 0 at rest for good. Precondition: busy(), first >= the
  // last `executed`.
  std::uint16_t render(Tick first, unsigned count, std::int16_t* out, std::size_t stride);

  // The run as it is at the beginning of tick `first`, and for how many ticks (1 .. max_ticks) it
  // gives what render() would: up to the next change or the run's end. Nothing before the start, in
  // a start tick in whose middle it begins, while it slows down to a shortest delay, in a ramp-down
  // that leaves out its slowest steps, and after the end.
  // Preconditions as of render().
  struct RunSegment {
    bushd_run run;
    unsigned ticks;
  };
  std::optional<RunSegment> run_at(Tick first, unsigned max_ticks);

  // The same, whatever it does then: `first` or its start, if that is later. Nothing: no run of the
  // motor's own table.
  std::optional<bushd_run> plan_at(Tick first);
  // As plan_at(), of the run of a line that is no path.
  std::optional<bushd_run> line_run_at(Tick first);

  // The ticks before `until` are over and will not be asked for again. Returns the change that was
  // among them.
  std::optional<Change> executed(Tick until);

  // The motor's part is over, for whatever reason.
  void finish() { busy_ = false; }

  bool busy() const { return busy_; }
  bool stopping() const { return stopping_; }
  Tick start_tick() const { return start_; }
  std::uint32_t late_ns() const { return late_ns_; }  // after its beginning the run begins
  // First tick after the last step, as planned now.
  Tick end_tick() const { return end_; }
  std::int64_t from_steps() const { return from_; }
  // Where it stands when the ticks that are over have been run.
  std::int64_t executed_steps() const { return steps_of(base_); }
  // Where it stands, as planned, when the ticks before `tick` have been run. O(ticks ahead).
  std::int64_t steps_at(Tick tick) const;
  // The direction of this run, +1 or -1; on a path that where it is, as executed.
  int direction() const;
  // Where this run ends, as planned now, and where the motor was last told to go.
  std::int64_t planned_end_steps() const { return planned_end_; }
  std::int64_t target_steps() const { return target_; }
  bushd_delay shortest_delay() const { return shortest_delay_; }
  // Where the motor will stand when all is done: after a second run, if it takes one.
  std::int64_t end_steps() const { return stopping_ ? planned_end_ : target_; }
  // The speed of the step that runs at the last executed tick; 0 when not moving.
  double velocity_steps_per_s() const;

  // On a line, by its steps: where it is, as executed, where its run ends, as planned now, and
  // where it is to end. Its run is over for all motors at over_tick(); this one's last step is made
  // by end_tick(). Without a line that is the same.
  const std::optional<LineShare>& line() const { return share_; }
  std::uint32_t line_step() const { return share_->from + run_steps(base_); }
  std::uint32_t line_planned_end() const { return share_->from + planned_run_steps_; }
  std::uint32_t line_target() const { return share_->from + run_target_; }
  Tick over_tick() const { return std::max(end_, run_end_); }

 private:
  struct Place {
    bushd_run run;
    Tick tick;              // the run's state is that at the beginning of this tick
    bushd_line line;        // that of the share, by the steps that the run has made
    std::int64_t told_256;  // where the share has led by then, 1/256 step from the line's beginning
    PathRun path;           // in place of `run`, `line`
    std::int64_t made;      // steps that this has taken, as its MCU counts them (engine/slots.h)
    // Along a trajectory: on it, or by the run to rest from the step `left_at` on, whose direction
    // is that of the run. told_256 counts from step 0.
    bool follows;
    std::int64_t left_at;
    Follower follower;
    bool went_up;  // since the last executed()
    bool went_down;
  };
  bool on_path() const { return share_ && share_->track != nullptr; }
  bool is_elementary() const { return share_ && share_->elementary != nullptr; }
  // In steps of the run from the line's beginning, and of the motor from there, 1/256 step.
  std::int64_t elementary_256(std::uint64_t run_256) const;
  static std::uint64_t run_256(const bushd_run& run, std::uint32_t from) {
    return (std::uint64_t{from} + run.steps_done) * 256 + run.fraction;
  }
  void follow_elementary(Place& place, std::size_t ticks, std::int16_t* out,
                         std::size_t stride) const;
  // Where this run reaches its last step, and the fraction of it at which it does.
  struct Crossing {
    std::uint32_t step;
    std::int64_t fraction;
  };
  Crossing last_crossing(bushd_line line, std::uint32_t made) const;
  std::int16_t told_by(std::int64_t moved_256) const;
  bool run_over(const Place& place) const;
  std::uint32_t run_steps(const Place& place) const;  // made
  std::uint32_t run_steps_left(const Place& place) const;
  bushd_delay run_delay(const Place& place) const;  // 0: over
  std::uint32_t run_unit_ns() const;
  double share_of_run(const Place& place) const;
  void take_change_on_path(Place& place) const;
  void follow_path(Place& place, std::size_t ticks, std::int16_t* out, std::size_t stride) const;
  std::int64_t not_short_of_turn(const Place& place, std::size_t segment_before,
                                 std::int64_t told_256) const;
  Tick own_end_on_path(const Place& place) const;
  std::int64_t steps_of(const Place& place) const;
  std::int64_t line_steps(std::uint32_t run_steps) const;
  Tick effective() const { return std::max(change_->at, start_); }
  void go_to(Tick first);
  bushd_run run_from(Tick first);
  void take_change(Place& place) const;
  void advance(Place& place, Tick to) const;
  void expand(Place& place, std::size_t ticks, std::int16_t* out, std::size_t stride) const;
  void expand_run(bushd_run& run, bool fine, std::size_t ticks, std::int16_t* out,
                  std::size_t stride) const;
  bool fine() const { return format_ == BUSHD_FORMAT_FINE; }
  void follow_line(Place& place, std::size_t ticks, std::int16_t* out, std::size_t stride) const;
  void pass(Place& place, std::size_t ticks) const;
  void pass_line(Place& place, std::size_t ticks) const;
  std::int64_t line_rest_256(const Place& place) const;
  // As a byte of coarse displacements, of a line's motor.
  std::int16_t coarse_of(unsigned steps) const {
    return static_cast<std::int16_t>(
        steps == 0 ? 0u : steps | (share_->direction > 0 ? BUSHD_COARSE_DIRECTION : 0u));
  }
  // axis_trajectory.cpp
  bool trajectory_over(const Place& place) const;
  std::int64_t steps_followed(const Place& place) const;
  double trajectory_velocity(const Place& place) const;
  void follow_trajectory(Place& place, std::size_t ticks, std::int16_t* out,
                         std::size_t stride) const;
  std::int64_t way_on_trajectory(const Place& place) const;
  std::uint16_t delay_on_trajectory(const Place& place) const;
  std::uint16_t follower_delay(const Place& place) const;
  void leave_trajectory(Place& place) const;
  void plan_trajectory_end(Place place);
  std::int16_t as_told(std::int64_t moved_256) const;
  std::uint16_t delay_of(const Place& place) const;
  Tick end_of(const Place& place) const;
  Tick own_end_of(const Place& place) const;
  void plan_end();
  // The first tick of a streamed line that goes on tells how far each motor is from its last whole
  // step; the run begins a tick later.
  bool stands_first() const;
  void restart(bushd_run& run, std::uint32_t steps, int direction,
               bushd_delay shortest_delay) const;
  const bushd_table& run_table() const { return share_ ? share_->table->view() : *table_; }

  const bushd_table* table_;
  std::uint32_t tick_ns_;
  bushd_format format_;
  bool busy_ = false;
  Tick start_ = 0;
  std::uint32_t late_ns_ = 0;
  Tick end_ = 0;
  std::int64_t from_ = 0;
  std::int64_t planned_end_ = 0;
  std::int64_t target_ = 0;
  bushd_delay shortest_delay_ = 0;
  bool stopping_ = false;
  bool stale_ = false;            // what is wanted has changed since the last change()
  std::optional<Change> change_;  // planned and not yet executed
  std::optional<TrajectoryShare> followed_;
  bool rests_at_end_ = false;  // of the trajectory
  bool end_is_near_ = true;    // and end_ exact, else the earliest that it may be
  std::optional<LineShare> share_;
  Divisor share_by_;                   // its `longest`
  std::int64_t share_from_steps_ = 0;  // steps of the line that the motor has made before this run
  std::uint32_t run_target_ = 0;       // of the share: steps of the run that are wanted,
  std::uint32_t planned_run_steps_ = 0;  // and planned
  Tick run_end_ = 0;
  Tick unchanged_end_ = 0;  // what end_ is without `change_`, of a share
  Place base_{};  // executed up to here; without `change_`, which may be planned again, later
  Place head_{};  // where the last render ended, so that the next one need not start from base_
};

}  // namespace bushd::motion
