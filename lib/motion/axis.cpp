#include "motion/axis.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <utility>

namespace bushd::motion {
namespace {

constexpr std::size_t kBlock = 64;

}  // namespace

double Axis::duration_ticks(std::int64_t steps, std::uint16_t floor) const {
  bushd_run run;
  bushd_run_start(&run, table_, static_cast<std::uint32_t>(steps < 0 ? -steps : steps), 1, floor);
  const double ns = static_cast<double>(bushd_run_units_left(&run)) * table_->time_unit_ns;
  return std::ceil(ns / tick_ns_);
}

double Axis::most_steps_per_s(std::uint16_t floor) const {
  const std::uint16_t delay = std::max(bushd_table_fastest(table_), floor);
  return 1e9 / (static_cast<double>(delay) * table_->time_unit_ns);
}

void Axis::start(std::int64_t from_steps, std::int64_t steps, Tick start, std::uint32_t late_ns,
                 std::uint16_t floor) {
  busy_ = true;
  start_ = start;
  late_ns_ = late_ns;
  from_ = from_steps;
  target_ = from_steps + steps;
  floor_ = floor;
  stopping_ = false;
  stale_ = false;
  change_.reset();
  const auto count = static_cast<std::uint32_t>(steps < 0 ? -steps : steps);
  bushd_run_start(&base_.run, table_, count, steps < 0 ? -1 : 1, floor);
  bushd_run_begin_late(&base_.run, late_ns_);
  base_.tick = start;
  head_ = base_;
  plan_end();
}

void Axis::stop() {
  if (stopping_) return;
  stopping_ = true;
  stale_ = true;
}

void Axis::aim(std::int64_t target_steps, std::uint16_t floor) {
  stopping_ = false;
  target_ = target_steps;
  floor_ = floor;
  stale_ = true;
}

bool Axis::change(Tick at) {
  stale_ = false;
  change_.reset();
  head_ = base_;
  if (bushd_run_done(&base_.run)) return false;  // over, but for the report that says so
  plan_end();
  const std::int64_t planned_end = planned_end_;
  if (at >= std::max(end_, start_ + 1)) return false;
  change_ = Change{.at = at, .target_steps = {}, .floor = floor_};
  if (!stopping_) change_->target_steps = target_;
  plan_end();
  const bool same_speed = stopping_ || base_.run.cruise == std::max(table_->cruise, change_->floor);
  if (planned_end_ != planned_end || !same_speed) return true;
  change_.reset();
  plan_end();
  return false;
}

std::size_t Axis::expand(bushd_run& run, std::size_t ticks, std::int16_t* out,
                         std::size_t stride) const {
  if (format_ == BUSHD_FORMAT_FINE) {
    return bushd_run_expand_fine(&run, tick_ns_, ticks, out, stride);
  }
  std::size_t active = 0;
  std::array<std::uint8_t, kBlock> bytes;
  for (std::size_t done = 0; done < ticks; done += kBlock) {
    const std::size_t n = std::min(kBlock, ticks - done);
    active += bushd_run_expand_coarse(&run, tick_ns_, n, bytes.data(), 1);
    for (std::size_t i = 0; i < n; ++i) out[(done + i) * stride] = bytes[i];
  }
  return active;
}

// At the beginning of a place's tick: what the change, if it is due there, makes of the run.
void Axis::take_change(Place& place) const {
  if (!change_ || place.tick != effective()) return;
  bushd_run& run = place.run;
  if (change_->at <= start_) {
    const std::int64_t steps = change_->target_steps.value_or(from_) - from_;
    bushd_run_start(&run, table_, static_cast<std::uint32_t>(std::abs(steps)), steps < 0 ? -1 : 1,
                    change_->floor);
    bushd_run_begin_late(&run, late_ns_);
    return;
  }
  if (change_->target_steps) {
    // What is left of the way after the running step.
    const std::int64_t way = (*change_->target_steps - from_) * run.direction;
    const std::int64_t after = way - static_cast<std::int64_t>(run.steps_done) - 1;
    if (after >= 0 && bushd_run_retarget(&run, static_cast<std::uint32_t>(after), change_->floor)) {
      return;
    }
  }
  bushd_run_ramp_down(&run);
}

// Advances a place, taking the change on the way if it lies at or after the place.
void Axis::advance(Place& place, Tick to) const {
  std::array<std::int16_t, kBlock> unused;
  while (place.tick < to) {
    take_change(place);
    Tick next = to;
    if (change_ && effective() > place.tick) next = std::min(next, effective());
    if (bushd_run_done(&place.run)) {
      place.tick = next;
      continue;
    }
    const auto n = std::min<Tick>(next - place.tick, kBlock);
    expand(place.run, static_cast<std::size_t>(n), unused.data(), 1);
    place.tick += n;
  }
}

// A step exactly at the end of a tick belongs to that tick.
Tick Axis::end_of(const Place& place) const {
  const auto units = static_cast<std::int64_t>(bushd_run_units_left(&place.run));
  const std::int64_t ns = units * table_->time_unit_ns - (units == 0 ? 0 : place.run.since_ns);
  return place.tick + (ns + tick_ns_ - 1) / tick_ns_;
}

void Axis::plan_end() {
  Place place = base_;
  if (change_) {
    advance(place, effective());
    take_change(place);
  }
  planned_end_ = from_ + place.run.direction * (static_cast<std::int64_t>(place.run.steps_done) +
                                                bushd_run_steps_left(&place.run));
  end_ = end_of(place);
}

void Axis::go_to(Tick first) {
  if (first < head_.tick) head_ = base_;
  advance(head_, first);
}

std::optional<Axis::RunSegment> Axis::run_at(Tick first, unsigned max_ticks) {
  if (!busy_ || first < start_) return std::nullopt;
  go_to(first);
  Place place = head_;
  take_change(place);
  if (bushd_run_done(&place.run) || bushd_run_begins_later(&place.run)) return std::nullopt;
  if (place.run.brake_left != 0) return std::nullopt;
  Tick until = std::min(first + max_ticks, end_of(place));
  if (change_ && effective() > first) until = std::min(until, effective());
  return RunSegment{.run = place.run, .ticks = static_cast<unsigned>(until - first)};
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
    expand(head_.run, n, out + done * stride, stride);
    done += static_cast<unsigned>(n);
  }
  head_.tick = std::max(head_.tick, first + count);
  // A change that begins where this ends is already due: the MCU must know the delay it starts
  // from, which the change leaves as it is.
  return bushd_run_delay(&head_.run);
}

std::optional<Change> Axis::executed(Tick until) {
  if (!busy_ || until < base_.tick) return std::nullopt;
  advance(base_, until);
  std::optional<Change> taken;
  // Of a run that makes no step nothing comes after the change.
  if (change_ && (until > effective() || until >= end_)) {
    take_change(base_);
    taken = std::exchange(change_, std::nullopt);
  }
  if (head_.tick <= base_.tick) head_ = base_;
  return taken;
}

std::int64_t Axis::steps_at(Tick tick) const {
  Place place = base_;
  advance(place, tick);
  return from_ + place.run.direction * static_cast<std::int64_t>(place.run.steps_done);
}

double Axis::velocity_steps_per_s() const {
  if (!busy_) return 0.0;
  Place place = base_;
  take_change(place);
  const std::uint16_t delay = bushd_run_delay(&place.run);
  if (delay == 0) return 0.0;
  return place.run.direction * 1e9 / (static_cast<double>(delay) * table_->time_unit_ns);
}

}  // namespace bushd::motion
