// An axis on a straight line: what it makes of the line's run, tick by tick, by either law.
#include <algorithm>

#include "engine/run_plan.h"
#include "motion/axis.h"

namespace bushd::motion {

// What bushd_line_position says, tick by tick: the motor's way in 1/256 step is that of the run
// times N / L, each tick from the beginning of the block. The motor comes to rest on a
// whole step, so it goes no farther than that. If a change has made that the step it has begun, it
// goes back by the part of it that it has been told.
void Axis::follow_line(Place& place, std::size_t ticks, std::int16_t* out,
                       std::size_t stride) const {
  if (is_elementary()) return follow_elementary(place, ticks, out, stride);
  const std::int64_t rest_256 = line_rest_256(place);
  const std::uint64_t increment = place.line.increment;
  const std::uint64_t longest = place.line.longest;
  const bool odd = ((longest - increment) & 1u) != 0;
  std::uint64_t way =
      std::uint64_t{place.line.value} * 256 + (odd ? 128 : 0) + increment * place.run.fraction;
  const std::uint64_t before_256 = std::uint64_t{place.line.made} * 256;
  const auto run_ticks = share_->blocks->expand(place.run, tick_ns_, ticks);
  bushd_line_go_to(&place.line, share_->from + place.run.steps_done);
  for (std::size_t i = 0; i < ticks; ++i) {
    way += increment * static_cast<std::uint16_t>(run_ticks[i]);
    std::uint64_t at_256 = before_256 + share_by_.quotient(way);
    if (at_256 < 256) {
      // Before the motor's first step: twice its way from 0, until the rule has more to say.
      const std::uint64_t risen = (way - (longest - increment) * 128) * 2;
      if (risen < way) at_256 = share_by_.quotient(risen);
    }
    if (!fine()) at_256 -= at_256 % 256;
    const std::int64_t moved_256 =
        std::min(static_cast<std::int64_t>(at_256), rest_256) - place.told_256;
    place.told_256 += moved_256;
    out[i * stride] = told_by(moved_256);
  }
}

std::int16_t Axis::told_by(std::int64_t moved_256) const {
  return fine() ? static_cast<std::int16_t>(moved_256 * share_->direction)
                : coarse_of(static_cast<unsigned>(moved_256 / 256));
}

std::int64_t Axis::elementary_256(std::uint64_t run_256) const {
  const auto step = static_cast<std::uint32_t>(run_256 >> 8);
  const auto at_256 = static_cast<std::int64_t>(
      bushd_elementary_position(share_->elementary.get(), share_->coordinate, step,
                                static_cast<std::uint8_t>(run_256 & 0xFF)));
  return fine() ? at_256 : at_256 - at_256 % 256;
}

// As follow_line: the run's way in 1/256 step, tick by tick, and where that puts the motor.
void Axis::follow_elementary(Place& place, std::size_t ticks, std::int16_t* out,
                             std::size_t stride) const {
  const std::int64_t rest_256 = line_rest_256(place);
  std::uint64_t way_256 = run_256(place.run, share_->from);
  const auto run_ticks = share_->blocks->expand(place.run, tick_ns_, ticks);
  for (std::size_t i = 0; i < ticks; ++i) {
    way_256 += static_cast<std::uint16_t>(run_ticks[i]);
    const std::int64_t moved_256 = std::min(elementary_256(way_256), rest_256) - place.told_256;
    place.told_256 += moved_256;
    out[i * stride] = told_by(moved_256);
  }
}

std::int64_t Axis::line_rest_256(const Place& place) const {
  return line_steps(place.run.steps_done + bushd_run_steps_left(&place.run)) * 256;
}

// As follow_line, where nobody asks for each tick.
void Axis::pass_line(Place& place, std::size_t ticks) const {
  const std::int64_t rest_256 = line_rest_256(place);
  share_->blocks->expand(place.run, tick_ns_, ticks);
  if (is_elementary()) {
    const std::int64_t way_256 = elementary_256(run_256(place.run, share_->from));
    place.told_256 = std::min(way_256, rest_256);
    return;
  }
  bushd_line_go_to(&place.line, share_->from + place.run.steps_done);
  auto at_256 = static_cast<std::int64_t>(bushd_line_position(&place.line, place.run.fraction));
  if (!fine()) at_256 -= at_256 % 256;
  place.told_256 = std::min(at_256, rest_256);
}

// An elementary step is made when it is over.
Axis::Crossing Axis::last_crossing(bushd_line line, std::uint32_t made) const {
  if (is_elementary()) {
    const bushd_elementary* elementary = share_->elementary.get();
    return {bushd_elementary_run_step(elementary, share_->coordinate, made), 256};
  }
  const std::uint32_t last = bushd_line_run_step(&line, made);
  bushd_line_go_to(&line, last - 1);
  return {last, bushd_line_crossing(&line)};
}

// The end of a share: the first tick after the motor's last step, before the run's own end if the
// motor makes none of its last ones. The position that follow_line tells reaches the last step in
// the tick in which the run reaches `crossing`/256 of the step `last` of the line.
Tick Axis::own_end_of(const Place& place) const {
  const std::uint32_t left = bushd_run_steps_left(&place.run);
  const std::uint32_t run_end = share_->from + place.run.steps_done + left;
  const auto made = static_cast<std::uint32_t>(line_steps(place.run.steps_done + left));
  const std::int64_t rest_256 = std::int64_t{made} * 256;
  if (place.told_256 >= rest_256) return place.tick + (place.told_256 > rest_256 ? 1 : 0);
  const auto [last, crossing] = last_crossing(place.line, made);
  const std::uint64_t before = bushd_run_units_of_last(&place.run, run_end - last + 1);
  const std::uint64_t after = bushd_run_units_of_last(&place.run, run_end - last);
  const std::int64_t unit_ns = run_table().time_unit_ns;
  const auto delay_ns = static_cast<std::int64_t>(before - after) * unit_ns;
  const auto whole = static_cast<std::int64_t>(bushd_run_units_of_last(&place.run, left) - before) -
                     static_cast<std::int64_t>(place.run.since);
  const std::int64_t ns = whole * unit_ns - place.run.since_ns + (crossing * delay_ns + 255) / 256;
  return place.tick + (ns + tick_ns_ - 1) / tick_ns_;
}

}  // namespace bushd::motion
