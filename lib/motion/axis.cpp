#include "motion/axis.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace bushd::motion {
namespace {

constexpr std::size_t kBlock = 64;

}  // namespace

double Axis::duration_ticks(std::int64_t steps) const {
  bushd_run run;
  bushd_run_start(&run, table_, static_cast<std::uint32_t>(steps < 0 ? -steps : steps), 1);
  const double ns = static_cast<double>(bushd_run_units_left(&run)) * table_->time_unit_ns;
  return std::ceil(ns / tick_ns_);
}

void Axis::start(std::int64_t from_steps, std::int64_t steps, Tick start) {
  busy_ = true;
  start_ = start;
  from_ = from_steps;
  wanted_ = from_steps + steps;
  stop_at_.reset();
  const auto count = static_cast<std::uint32_t>(steps < 0 ? -steps : steps);
  bushd_run_start(&base_.run, table_, count, steps < 0 ? -1 : 1);
  base_.tick = start;
  head_ = base_;
  plan_end();
}

bool Axis::ramp_down(Tick at) {
  stop_at_ = at;
  head_ = base_;
  return plan_end();
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

// At the beginning of a place's tick: what the stop makes of its run. The place that the axis goes
// back to keeps the run as it was until the MCU has executed the stop, for a stop that the MCU did
// not take is planned again, later.
void Axis::take_stop(Place& place) const {
  if (cancelled()) {
    if (place.tick == start_) bushd_run_start(&place.run, table_, 0, 1);
  } else if (stop_at_ == place.tick) {
    bushd_run_ramp_down(&place.run);
  }
}

// Advances a place, taking the stop on the way if it lies at or after the place.
void Axis::advance(Place& place, Tick to) const {
  std::array<std::int16_t, kBlock> unused;
  while (place.tick < to) {
    take_stop(place);
    Tick next = to;
    if (stop_at_ && *stop_at_ > place.tick) next = std::min(next, *stop_at_);
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

// Returns whether the stop, if there is one, changes anything.
bool Axis::plan_end() {
  if (cancelled()) {
    end_ = start_;
    target_ = from_;
    return true;
  }
  if (bushd_run_done(&base_.run))
    return false;  // over, but for the report that says so: nothing to change
  Place place = base_;
  const bool stops = stop_at_ && *stop_at_ < end_of(base_);
  if (stops) {
    advance(place, *stop_at_);
    bushd_run_ramp_down(&place.run);
  }
  target_ = from_ + place.run.direction * (static_cast<std::int64_t>(place.run.steps_done) +
                                           bushd_run_steps_left(&place.run));
  end_ = end_of(place);
  return stops;
}

std::uint16_t Axis::render(Tick first, unsigned count, std::int16_t* out, std::size_t stride) {
  if (cancelled()) {
    for (unsigned i = 0; i < count; ++i) out[i * stride] = 0;
    return 0;
  }
  if (first != head_.tick) {
    if (first < head_.tick) head_ = base_;
    advance(head_, first);
  }
  unsigned done = 0;
  // Before the start the run stands still.
  while (done < count && first + done < start_) out[done++ * stride] = 0;
  while (done < count) {
    head_.tick = first + done;
    take_stop(head_);
    Tick until = first + count;
    if (stop_at_ && *stop_at_ > head_.tick) until = std::min(until, *stop_at_);
    const auto n = static_cast<std::size_t>(until - head_.tick);
    expand(head_.run, n, out + done * stride, stride);
    done += static_cast<unsigned>(n);
  }
  head_.tick = std::max(head_.tick, first + count);
  // A stop that begins where this ends is already due: the MCU must know the delay it starts from,
  // which the stop does not change.
  return bushd_run_delay(&head_.run);
}

void Axis::executed(Tick until) {
  if (busy_ && until > base_.tick) {
    advance(base_, until);
    if (head_.tick < base_.tick) head_ = base_;
  }
}

double Axis::velocity_steps_per_s() const {
  if (!busy_) return 0.0;
  Place place = base_;
  take_stop(place);
  const std::uint16_t delay = bushd_run_delay(&place.run);
  if (delay == 0) return 0.0;
  return place.run.direction * 1e9 / (static_cast<double>(delay) * table_->time_unit_ns);
}

}  // namespace bushd::motion
