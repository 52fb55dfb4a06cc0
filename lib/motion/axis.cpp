#include "motion/axis.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "engine/run_plan.h"
#include "engine/run_state.h"
#include "engine/slots.h"

namespace bushd::motion {
namespace {

constexpr std::size_t kBlock = RunBlocks::kMostTicks;

__extension__ using Wide = unsigned __int128;

std::uint16_t at_most_16_bits(Wide units) {
  return units < UINT16_MAX ? static_cast<std::uint16_t>(units) : UINT16_MAX;
}

// It makes nothing but the end of its decelerating side.
bool ramps_down(const bushd_run& run) {
  return run.accel_at >= run.accel_end && run.brake_left == 0 && run.cruise_left == 0;
}

}  // namespace

double Axis::duration_ticks(std::int64_t steps, bushd_delay shortest_delay) const {
  const auto count = static_cast<std::uint32_t>(steps < 0 ? -steps : steps);
  if (!bushd_delay_is_code(
          shortest_delay)) {  // the delay of all, maybe longer than units are counted
    return std::ceil(static_cast<double>(count) * static_cast<double>(shortest_delay) *
                     table_->time_unit_ns / tick_ns_);
  }
  bushd_run run;
  bushd_run_start(&run, table_, count, 1, shortest_delay);
  const double ns = static_cast<double>(bushd_run_units_left(&run)) * table_->time_unit_ns;
  return std::ceil(ns / tick_ns_);
}

double Axis::most_steps_per_s(bushd_delay shortest_delay) const {
  const bushd_delay delay = std::max<bushd_delay>(bushd_table_fastest(table_), shortest_delay);
  return 1e9 / (static_cast<double>(delay) * table_->time_unit_ns);
}

void Axis::start(std::int64_t from_steps, std::int64_t steps, Tick start, std::uint32_t late_ns,
                 bushd_delay shortest_delay) {
  busy_ = true;
  start_ = start;
  late_ns_ = late_ns;
  from_ = from_steps;
  target_ = from_steps + steps;
  shortest_delay_ = shortest_delay;
  stopping_ = false;
  stale_ = false;
  change_.reset();
  share_.reset();
  followed_.reset();
  const auto count = static_cast<std::uint32_t>(steps < 0 ? -steps : steps);
  restart(base_.run, count, steps < 0 ? -1 : 1, shortest_delay);
  base_.tick = start;
  head_ = base_;
  plan_end();
}

void Axis::restart(bushd_run& run, std::uint32_t steps, int direction,
                   bushd_delay shortest_delay) const {
  bushd_run_start(&run, &run_table(), steps, direction, shortest_delay);
  bushd_run_begin_late(&run, late_ns_ + (stands_first() ? tick_ns_ : 0));
}

// As a path does (PathRun::stands).
bool Axis::stands_first() const {
  return share_ && share_->from > 0 && !share_->in_mcus && fine();
}

void Axis::start_line(std::int64_t from_steps, LineShare share, Tick start,
                      bushd_delay shortest_delay, std::uint32_t late_ns) {
  busy_ = true;
  start_ = start;
  late_ns_ = late_ns;
  from_ = from_steps;
  shortest_delay_ = shortest_delay;
  stopping_ = false;
  stale_ = false;
  change_.reset();
  followed_.reset();
  share_ = std::move(share);
  run_target_ = share_->to - share_->from;
  share_from_steps_ = line_steps(0);
  target_ = from_ + share_->direction * (line_steps(run_target_) - share_from_steps_);
  base_.run = {};
  if (!on_path()) restart(base_.run, run_target_, 1, shortest_delay);
  base_.tick = start;
  bushd_line_start(&base_.line, share_->increment, share_->longest);
  bushd_line_go_to(&base_.line, share_->from);
  base_.told_256 = share_from_steps_ * 256;
  if (!on_path()) share_by_ = Divisor(share_->longest);
  base_.path = on_path() ? PathRun(share_->track) : PathRun();
  base_.made = share_from_steps_;
  head_ = base_;
  plan_end();
}

// The motor's steps from the line's beginning, when the run has made so many.
std::int64_t Axis::line_steps(std::uint32_t run_steps) const {
  if (on_path()) {
    const Path& path = share_->track->path();
    return path.position_at(share_->motor, share_->from + run_steps);
  }
  if (is_elementary()) {
    return bushd_elementary_made(share_->elementary.get(), share_->coordinate,
                                 share_->from + run_steps);
  }
  bushd_line line;
  bushd_line_start(&line, share_->increment, share_->longest);
  bushd_line_go_to(&line, share_->from + run_steps);
  return line.made;
}

std::int64_t Axis::steps_of(const Place& place) const {
  if (on_path()) return from_ + place.made - share_from_steps_;
  if (share_) return from_ + share_->direction * (place.told_256 / 256 - share_from_steps_);
  if (followed_) return steps_followed(place);
  return from_ + place.run.direction * static_cast<std::int64_t>(place.run.steps_done);
}

void Axis::stop() {
  if (stopping_) return;
  stopping_ = true;
  stale_ = true;
}

void Axis::aim(std::int64_t target_steps, bushd_delay shortest_delay) {
  stopping_ = false;
  target_ = target_steps;
  shortest_delay_ = shortest_delay;
  stale_ = true;
}

void Axis::aim_on_line(std::uint32_t line_step, bushd_delay shortest_delay) {
  run_target_ = line_step - share_->from;
  aim(from_ + share_->direction * (line_steps(run_target_) - share_from_steps_), shortest_delay);
}

bool Axis::change(Tick at, std::uint32_t least_end) {
  stale_ = false;
  change_.reset();
  head_ = base_;
  if (run_over(base_)) return false;  // over, but for the report that says so
  plan_end();
  const std::int64_t planned_end = planned_end_;
  const std::uint32_t planned_run_steps = planned_run_steps_;
  unchanged_end_ = end_;
  const Tick unchanged_over = over_tick();
  if (at >= std::max(over_tick(), start_ + 1)) return false;
  change_ = Change{
      .at = at, .target_steps = {}, .shortest_delay = shortest_delay_, .run_steps = run_target_};
  if (!stopping_) change_->target_steps = target_;
  if (stopping_ && share_ && !on_path() && least_end > share_->from) {
    change_->run_steps = least_end - share_->from;
    change_->target_steps =
        from_ + share_->direction * (line_steps(change_->run_steps) - share_from_steps_);
  }
  plan_end();
  if (followed_) return true;
  const bool same_end = planned_end_ == planned_end && planned_run_steps_ == planned_run_steps;
  const bool same_speed =
      stopping_ || on_path() ||
      base_.run.cruise == std::max<bushd_delay>(run_table().cruise, change_->shortest_delay);
  if (share_ && at >= unchanged_end_) end_ = unchanged_end_;  // it has made all of its steps
  if (!same_end || !same_speed) {
    // Its MCU makes the run to its end, also when the motor has made its last step.
    if (share_ && share_->in_mcus) return unchanged_end_ > start_ && at < unchanged_over;
    return !(share_ && share_->increment == 0) && at < std::max(unchanged_end_, start_ + 1);
  }
  change_.reset();
  plan_end();
  return false;
}

void Axis::expand_run(bushd_run& run, bool fine, std::size_t ticks, std::int16_t* out,
                      std::size_t stride) const {
  if (fine) {
    bushd_run_expand_fine(&run, tick_ns_, ticks, out, stride);
    return;
  }
  std::array<std::uint8_t, kBlock> bytes;
  for (std::size_t done = 0; done < ticks; done += kBlock) {
    const std::size_t n = std::min(kBlock, ticks - done);
    bushd_run_expand_coarse(&run, tick_ns_, n, bytes.data(), 1);
    for (std::size_t i = 0; i < n; ++i) out[(done + i) * stride] = bytes[i];
  }
}

void Axis::expand(Place& place, std::size_t ticks, std::int16_t* out, std::size_t stride) const {
  if (followed_) return follow_trajectory(place, ticks, out, stride);
  if (!share_) return expand_run(place.run, fine(), ticks, out, stride);
  if (on_path()) return follow_path(place, ticks, out, stride);
  for (std::size_t done = 0; done < ticks; done += kBlock) {
    const std::size_t n = std::min(kBlock, ticks - done);
    follow_line(place, n, out + done * stride, stride);
  }
}

// Up to kBlock ticks whose displacements nobody asks for.
void Axis::pass(Place& place, std::size_t ticks) const {
  if (share_ && !on_path()) return pass_line(place, ticks);
  std::array<std::int16_t, kBlock> unused;
  expand(place, ticks, unused.data(), 1);
}

// The delay of the motor's running step, in units of its own table. Of a share: as the run goes
// now, rounded up; its table lets no motor be faster than its own table at that place.
std::uint16_t Axis::delay_of(const Place& place) const {
  if (followed_ && place.follows) return follower_delay(place);
  const bushd_delay delay = run_delay(place);
  if (!share_ || delay == 0) return at_most_16_bits(delay);
  const bool changes_later = change_ && change_->at > start_ && place.tick <= change_->at;
  if (place.tick >= (changes_later ? unchanged_end_ : end_)) return 0;
  if (on_path()) {
    const double share = share_of_run(place);
    if (share == 0) return UINT16_MAX;  // it only stands on the way
    const double own_ns = static_cast<double>(delay) * run_unit_ns() / share;
    const double own = std::ceil(own_ns / table_->time_unit_ns);
    return static_cast<std::uint16_t>(std::min<double>(own, UINT16_MAX));
  }
  const Wide time = Wide{delay} * run_table().time_unit_ns * share_->longest;
  const Wide units = Wide{table_->time_unit_ns} * share_->increment;
  return at_most_16_bits((time + units - 1) / units);
}

// At the beginning of a place's tick: what the change, if it is due there, makes of the run.
void Axis::take_change(Place& place) const {
  if (!change_ || place.tick != effective()) return;
  if (on_path()) return take_change_on_path(place);
  bushd_run& run = place.run;
  if (followed_ && change_->at > start_) return leave_trajectory(place);
  if (followed_) {
    place.follows = false;  // it never begins
    return;
  }
  if (change_->at <= start_ && share_) {
    return restart(run, change_->target_steps ? change_->run_steps : 0, 1, change_->shortest_delay);
  }
  if (change_->at <= start_) {
    const std::int64_t steps = change_->target_steps.value_or(from_) - from_;
    return restart(run, static_cast<std::uint32_t>(std::abs(steps)), steps < 0 ? -1 : 1,
                   change_->shortest_delay);
  }
  if (change_->target_steps) {
    // What is left of the way after the running step.
    const std::int64_t way = share_ ? std::int64_t{change_->run_steps}
                                    : (*change_->target_steps - from_) * run.direction;
    const std::int64_t after = way - static_cast<std::int64_t>(run.steps_done) - 1;
    // The ramp-down of a line is not shortened (bushd_run_ramp_down_once).
    const bool possible = !share_ || !ramps_down(run) || after + 1 >= bushd_run_steps_left(&run);
    if (possible && after >= 0 &&
        bushd_run_retarget(&run, static_cast<std::uint32_t>(after), change_->shortest_delay)) {
      return;
    }
  }
  if (share_) return bushd_run_ramp_down_once(&run);
  bushd_run_ramp_down(&run);
}

// Advances a place, taking the change on the way if it lies at or after the place.
void Axis::advance(Place& place, Tick to) const {
  while (place.tick < to) {
    take_change(place);
    Tick next = to;
    if (change_ && effective() > place.tick) next = std::min(next, effective());
    if (run_over(place)) {
      place.tick = next;
      continue;
    }
    const auto n = std::min<Tick>(next - place.tick, kBlock);
    pass(place, static_cast<std::size_t>(n));
    place.tick += n;
  }
}

// A step exactly at the end of a tick belongs to that tick.
Tick Axis::end_of(const Place& place) const {
  if (on_path()) {
    const std::int64_t left_ns = place.path.ns_to(place.path.track()->to());
    return place.tick + (place.path.stands() ? 1 : 0) + (left_ns + tick_ns_ - 1) / tick_ns_;
  }
  const auto units = static_cast<std::int64_t>(bushd_run_units_left(&place.run));
  const std::int64_t ns = units * run_table().time_unit_ns - (units == 0 ? 0 : place.run.since_ns);
  return place.tick + (ns + tick_ns_ - 1) / tick_ns_;
}

void Axis::plan_end() {
  Place place = base_;
  if (change_) {
    advance(place, effective());
    take_change(place);
  }
  if (followed_) return plan_trajectory_end(place);
  planned_run_steps_ = run_steps(place) + run_steps_left(place);
  run_end_ = end_of(place);
  if (change_ && effective() > start_ && !on_path() && bushd_run_done(&place.run)) {
    // It rests at once, in the middle of a step: its MCU has to be told of a tick of rest.
    run_end_ = std::max(run_end_, effective() + 1);
  }
  if (share_) {
    planned_end_ = from_ + share_->direction * (line_steps(planned_run_steps_) - share_from_steps_);
    end_ = on_path() ? own_end_on_path(place) : own_end_of(place);
  } else {
    planned_end_ = from_ + place.run.direction * static_cast<std::int64_t>(planned_run_steps_);
    end_ = run_end_;
  }
}

void Axis::go_to(Tick first) {
  if (first < head_.tick) head_ = base_;
  advance(head_, first);
}

std::optional<Axis::RunSegment> Axis::run_at(Tick first, unsigned max_ticks) {
  if (!busy_ || first < start_ || share_ || followed_) return std::nullopt;
  go_to(first);
  Place place = head_;
  take_change(place);
  if (!bushd_run_has_state(&place.run)) return std::nullopt;
  Tick until = std::min(first + max_ticks, end_of(place));
  if (change_ && effective() > first) until = std::min(until, effective());
  return RunSegment{.run = place.run, .ticks = static_cast<unsigned>(until - first)};
}

std::optional<bushd_run> Axis::plan_at(Tick first) {
  if (!busy_ || share_ || followed_) return std::nullopt;
  return run_from(first);
}

std::optional<bushd_run> Axis::line_run_at(Tick first) {
  if (!busy_ || !share_ || on_path()) return std::nullopt;
  return run_from(first);
}

bushd_run Axis::run_from(Tick first) {
  go_to(std::max(first, start_));
  Place place = head_;
  take_change(place);
  return place.run;
}

std::uint16_t Axis::render(Tick first, unsigned count, std::int16_t* out, std::size_t stride) {
  go_to(first);
  // The delay to be told at the end of ticks before the start is that of the changed run.
  if (change_ && change_->at <= start_) take_change(head_);
  unsigned done = 0;
  // Before the start the run stands still.
  while (done < count && first + done < start_) out[done++ * stride] = 0;
  while (done < count) {
    head_.tick = first + done;
    take_change(head_);
    Tick until = first + count;
    if (change_ && effective() > head_.tick) until = std::min(until, effective());
    const auto n = static_cast<std::size_t>(until - head_.tick);
    expand(head_, n, out + done * stride, stride);
    done += static_cast<unsigned>(n);
  }
  head_.tick = std::max(head_.tick, first + count);
  // A change that begins where this ends is already due: the MCU must know the delay it starts
  // from, which the change leaves as it is.
  return delay_of(head_);
}

std::optional<Change> Axis::executed(Tick until) {
  if (!busy_ || until < base_.tick) return std::nullopt;
  base_.went_up = base_.went_down = false;
  advance(base_, until);
  if (followed_ && !end_is_near_) plan_end();
  std::optional<Change> taken;
  // Nothing comes after the change in a run that makes no step.
  if (change_ && (until > effective() || until >= over_tick())) {
    take_change(base_);
    taken = std::exchange(change_, std::nullopt);
  }
  if (head_.tick <= base_.tick) head_ = base_;
  return taken;
}

std::int64_t Axis::steps_at(Tick tick) const {
  Place place = base_;
  advance(place, tick);
  return steps_of(place);
}

double Axis::velocity_steps_per_s() const {
  if (!busy_) return 0.0;
  Place place = base_;
  take_change(place);
  if (followed_ && place.follows) return trajectory_velocity(place);
  const bushd_delay delay = run_delay(place);
  if (delay == 0) return 0.0;
  const double run_steps_per_s = 1e9 / (static_cast<double>(delay) * run_unit_ns());
  if (!share_) return place.run.direction * run_steps_per_s;
  if (place.tick >= end_) return 0.0;
  return direction() * run_steps_per_s * share_of_run(place);
}

}  // namespace bushd::motion
