// An axis on a path: what differs from one run by one table.
#include <algorithm>
#include <cstdlib>

#include "motion/axis.h"

namespace bushd::motion {

bool Axis::run_over(const Place& place) const {
  if (followed_) return trajectory_over(place);
  if (on_path()) return place.path.done();
  // One that has come to rest in the middle of a step goes back to the whole one in the next tick.
  return bushd_run_done(&place.run) && (!fine() || place.run.fraction == 0);
}

std::uint32_t Axis::run_steps(const Place& place) const {
  return on_path() ? place.path.step() - share_->from : place.run.steps_done;
}

std::uint32_t Axis::run_steps_left(const Place& place) const {
  if (!on_path()) return bushd_run_steps_left(&place.run);
  return place.path.track()->to() - place.path.step();
}

bushd_delay Axis::run_delay(const Place& place) const {
  return on_path() ? place.path.delay() : bushd_run_delay(&place.run);
}

std::uint32_t Axis::run_unit_ns() const {
  return on_path() ? share_->track->path().unit_ns() : run_table().time_unit_ns;
}

// Steps of the motor by step of the run, where it is.
double Axis::share_of_run(const Place& place) const {
  if (!on_path()) return static_cast<double>(share_->increment) / share_->longest;
  const Path& path = share_->track->path();
  if (path.segments() == 0) return 0;
  const std::size_t i = place.path.segment();
  const std::int64_t way = path.point(i + 1, share_->motor) - path.point(i, share_->motor);
  return static_cast<double>(std::abs(way)) / path.length_of(i);
}

int Axis::direction() const {
  if (followed_ && base_.follows) return base_.follower.direction() < 0 ? -1 : 1;
  if (!on_path()) return share_ ? share_->direction : base_.run.direction;
  const Path& path = share_->track->path();
  // The direction from which it came, if it stands.
  for (std::size_t i = base_.path.segment() + 1; i-- > 0 && path.segments() > 0;) {
    const std::int64_t way = path.point(i + 1, share_->motor) - path.point(i, share_->motor);
    if (way != 0) return way < 0 ? -1 : 1;
  }
  return 1;
}

void Axis::take_change_on_path(Place& place) const {
  const std::uint32_t end =
      change_->target_steps ? share_->from + change_->run_steps : std::uint32_t{0};
  if (change_->at <= start_) {
    // It has not begun, so that any end will do.
    const std::uint32_t to = std::max(end, share_->from);
    if (to == share_->track->to()) {
      place.path = PathRun(share_->track);
    } else {
      place.path = PathRun(std::make_shared<const PathTrack>(share_->track->shared_path(), to));
    }
    return;
  }
  if (!place.path.done()) place.path.end_at(end);
}

// A tick is told by the way from its beginning to its end. Where a motor turns round in it, that
// way does not lead to the whole step at which it turns, and its MCU would make neither the step
// that leads there, which is the slow one before a rest, nor the one back. So the motor is told to
// go there in this tick, and is where it should be at the end of the next one: it goes no farther
// than F = 1 / A(0) takes it in the rest of a tick. If that is a whole step or more, both are left
// out.
std::int64_t Axis::not_short_of_turn(const Place& place, std::size_t segment_before,
                                     std::int64_t told_256) const {
  const Path& path = place.path.track()->path();
  if (place.path.done()) return told_256;
  for (std::size_t i = segment_before + 1; i <= place.path.segment(); ++i) {
    const std::int64_t point = path.point(i, share_->motor);
    const std::int64_t way = point - place.made;
    const std::int64_t back_256 = told_256 - point * 256;
    const bool turns = (way > 0 && back_256 < 0) || (way < 0 && back_256 > 0);
    if (turns && std::abs(back_256) < 256) return point * 256;
  }
  return told_256;
}

// The motor's MCU takes a step when it has been told a whole one more than it has made.
void Axis::follow_path(Place& place, std::size_t ticks, std::int16_t* out,
                       std::size_t stride) const {
  const bool fine = format_ == BUSHD_FORMAT_FINE;
  const PathTrack& track = *place.path.track();
  for (std::size_t i = 0; i < ticks; ++i) {
    const std::size_t segment = place.path.segment();
    place.path.tick(tick_ns_);
    std::int64_t told_256 =
        path_position_256(track.path(), share_->motor, place.path.step(), place.path.fraction(),
                          track.to(), place.path.segment(), !fine);
    if (place.path.segment() != segment) told_256 = not_short_of_turn(place, segment, told_256);
    const std::int64_t moved_256 = told_256 - place.told_256;
    place.told_256 = told_256;
    const std::int64_t off_256 = told_256 - place.made * 256;
    place.made += off_256 / 256;
    const std::int64_t coarse = std::abs(moved_256) / 256;
    out[i * stride] = static_cast<std::int16_t>(
        fine             ? moved_256
        : moved_256 == 0 ? 0
                         : coarse | (moved_256 > 0 ? BUSHD_COARSE_DIRECTION : 0));
  }
}

// First tick after the motor's last step. Its position is told until it reaches that in the segment
// where it moves last, and stays then.
Tick Axis::own_end_on_path(const Place& place) const {
  const PathTrack& track = *place.path.track();
  const Path& path = track.path();
  const std::size_t motor = share_->motor;
  if (place.path.done() || track.to() == share_->from) return place.tick;
  const std::int64_t rest = path.position_at(motor, track.to());
  for (std::size_t i = path.segment_at(track.to() - 1) + 1; i-- > 0;) {
    const std::int64_t from = path.point(i, motor);
    const std::int64_t way = path.point(i + 1, motor) - from;
    const std::uint32_t begin = path.start_of(i);
    if (way != 0 && rest != from) {
      bushd_line line;
      bushd_line_start(&line, static_cast<std::uint32_t>(std::abs(way)), path.length_of(i));
      const auto made = static_cast<std::uint32_t>(std::abs(rest - from));
      const std::uint32_t last = bushd_line_run_step(&line, made);
      bushd_line_go_to(&line, last - 1);
      const std::int64_t crossing = bushd_line_crossing(&line);
      const std::uint32_t step = begin + last;  // the run's, with or before which that is
      if (step <= place.path.step()) break;
      const std::int64_t after_ns = place.path.ns_to(step);
      const std::int64_t before_ns = place.path.ns_to(step - 1);
      const std::int64_t ns = before_ns + (crossing * (after_ns - before_ns) + 255) / 256;
      if (ns <= 0) break;
      return place.tick + (place.path.stands() ? 1 : 0) + (ns + tick_ns_ - 1) / tick_ns_;
    }
    if (begin <= place.path.step()) break;
  }
  return place.told_256 == rest * 256 ? place.tick : place.tick + 1;
}

}  // namespace bushd::motion
