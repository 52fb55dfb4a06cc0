#include "motion/path_run.h"

#include <algorithm>
#include <cstdlib>
#include <utility>

#include "engine/line.h"

namespace bushd::motion {

PathTrack::PathTrack(std::shared_ptr<const Path> path, std::uint32_t to)
    : path_(std::move(path)), to_(to) {
  if (from() == to_) return;
  if (to_ < path_->steps()) parts_ = path_->parts_to(to_);
  units_ = units_at(to_);
}

std::shared_ptr<const Profile> PathTrack::profile(std::size_t segment) const {
  for (const Kept& kept : kept_) {
    if (kept.profile && kept.segment == segment) return kept.profile;
  }
  const auto part = parts_.find(segment);
  auto made = std::make_shared<const Profile>(part != parts_.end() ? part->second
                                                                   : path_->profile(segment));
  kept_[next_kept_] = {segment, made};
  next_kept_ = (next_kept_ + 1) % kept_.size();
  return made;
}

std::uint64_t PathTrack::units_at(std::uint32_t step) const {
  if (step == from()) return 0;
  const std::size_t last = path_->segment_at(step - 1);
  std::uint64_t units = units_of(part_of(*profile(last), 0, step - path_->first_of(last)));
  if (last == 0) return units;
  // As the path says, with what differs of it in place.
  units += path_->end_units(last - 1);
  for (auto part = parts_.begin(); part != parts_.end() && part->first < last; ++part) {
    const std::size_t i = part->first;
    units += units_of(part->second) + (i == 0 ? 0 : path_->end_units(i - 1));
    units -= path_->end_units(i);
  }
  return units;
}

std::shared_ptr<const PathTrack> PathTrack::ending(const std::shared_ptr<const PathTrack>& self,
                                                   std::uint32_t running, std::uint32_t end) const {
  if (ends_early_) return self;
  if (ending_ && ending_->running == running && ending_->end == end) {
    return ending_->track ? ending_->track : self;
  }
  std::map<std::size_t, Profile> made;
  const std::size_t last = path_->segment_at(running);
  const auto made_of = [&](std::size_t segment) -> const Profile& {
    auto [at, asked] = made.try_emplace(segment);
    if (!asked) return at->second;
    const std::uint32_t steps = segment == last ? running + 1 - path_->first_of(last) : UINT32_MAX;
    return at->second = part_of(*profile(segment), 0, steps);
  };
  const std::uint32_t nearest = std::min(path_->nearest_rest(running, made_of), to_);
  const std::uint32_t chosen = std::clamp(end, nearest, to_);
  ending_ = Ending{running, end, nullptr};
  if (chosen == to_) return self;
  auto track = std::make_shared<PathTrack>(path_, chosen);
  track->ends_early_ = true;
  return ending_->track = std::move(track);
}

PathRun::PathRun(std::shared_ptr<const PathTrack> track)
    : track_(std::move(track)), step_(track_->from()) {
  if (done()) return;
  enter(track_->path().segment_at(step_));
  stands_ = step_ > 0;
}

void PathRun::enter(std::size_t segment) {
  segment_ = segment;
  profile_ = track_->profile(segment);
  part_ = 0;
  std::uint32_t made = step_ - track_->path().first_of(segment);
  while ((*profile_)[part_].steps <= made) made -= (*profile_)[part_++].steps;
  part_left_ = (*profile_)[part_].steps - made;
}

std::uint32_t PathRun::delay() const {
  return done() ? 0 : (*profile_)[part_].delay;
}

std::int64_t PathRun::ns_to(std::uint32_t step) const {
  const std::uint64_t units = track_->units_at(step) - track_->units_at(step_);
  return (static_cast<std::int64_t>(units) - static_cast<std::int64_t>(since_)) *
             track_->path().unit_ns() -
         since_ns_;
}

void PathRun::tick(std::uint32_t tick_ns) {
  if (done() || std::exchange(stands_, false)) return;
  const std::uint32_t unit_ns = track_->path().unit_ns();
  const std::uint64_t ns = std::uint64_t{since_ns_} + tick_ns;
  since_ += ns / unit_ns;
  since_ns_ = static_cast<std::uint32_t>(ns % unit_ns);
  while (since_ >= delay()) {
    const auto made =
        static_cast<std::uint32_t>(std::min<std::uint64_t>(since_ / delay(), part_left_));
    since_ -= std::uint64_t{made} * delay();
    step_ += made;
    part_left_ -= made;
    if (part_left_ > 0) continue;
    if (done()) {
      since_ = since_ns_ = fraction_ = 0;
      return;
    }
    if (++part_ == profile_->size()) {
      enter(segment_ + 1);
    } else {
      part_left_ = (*profile_)[part_].steps;
    }
  }
  fraction_ = static_cast<std::uint8_t>((since_ * unit_ns + since_ns_) * 256 /
                                        (std::uint64_t{delay()} * unit_ns));
}

void PathRun::end_at(std::uint32_t end) {
  auto track = track_->ending(track_, step_, end);
  if (track == track_) return;
  track_ = std::move(track);
  enter(segment_);
}

std::int64_t path_position_256(const Path& path, std::size_t motor, std::uint32_t step,
                               std::uint8_t fraction, std::uint32_t end, std::size_t segment,
                               bool whole_steps) {
  const std::int64_t from = path.point(segment, motor);
  const std::int64_t way = path.point(segment + 1, motor) - from;
  if (way == 0) return from * 256;
  bushd_line line;
  bushd_line_start(&line, static_cast<std::uint32_t>(std::abs(way)), path.length_of(segment));
  // The last whole step of this segment that the run leads to.
  bushd_line_go_to(&line, std::min(end, path.start_of(segment + 1)) - path.start_of(segment));
  const std::int64_t rest_256 = std::int64_t{line.made} * 256;
  bushd_line_go_to(&line, step - path.start_of(segment));
  std::uint64_t at_256 = bushd_line_position(&line, fraction);
  if (whole_steps) at_256 -= at_256 % 256;
  const std::int64_t made_256 = std::min(static_cast<std::int64_t>(at_256), rest_256);
  return from * 256 + (way < 0 ? -made_256 : made_256);
}

}  // namespace bushd::motion
