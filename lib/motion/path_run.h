// A run along a path, from rest to rest, and where it is: what engine/run.h is for a single table.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>

#include "motion/path.h"

namespace bushd::motion {

// A path, or the beginning of it, as a run makes it. All motors share one; to ask it for the
// nearest end costs something only once.
class PathTrack {
 public:
  // Precondition: the path is planned, path->first_step() <= to <= path->steps().
  PathTrack(std::shared_ptr<const Path> path, std::uint32_t to);
  PathTrack(const PathTrack&) = delete;
  PathTrack& operator=(const PathTrack&) = delete;

  const Path& path() const { return *path_; }
  const std::shared_ptr<const Path>& shared_path() const { return path_; }
  std::uint32_t from() const { return path_->first_step(); }
  std::uint32_t to() const { return to_; }
  // The delays of the part of a segment that it makes. Precondition: that is some of it.
  std::shared_ptr<const Profile> profile(std::size_t segment) const;
  // Time from its beginning to the end of a step of the path.
  std::uint64_t units_at(std::uint32_t step) const;
  std::uint64_t units() const { return units_; }

  // A copy whose end is as near as it can be for a run that makes this step now; or at `end`, if
  // that is not nearer. Itself if that does not change anything, and always if it was made so: it
  // has not made what it says of steps before that.
  std::shared_ptr<const PathTrack> ending(const std::shared_ptr<const PathTrack>& self,
                                          std::uint32_t running, std::uint32_t end) const;

 private:
  std::shared_ptr<const Path> path_;
  std::uint32_t to_;
  Path::Parts parts_;  // those that are not the path's own
  std::uint64_t units_ = 0;
  struct Kept {
    std::size_t segment;
    std::shared_ptr<const Profile> profile;
  };
  mutable std::array<Kept, 4> kept_{};  // of those that were asked for last
  mutable std::size_t next_kept_ = 0;
  struct Ending {
    std::uint32_t running;
    std::uint32_t end;
    std::shared_ptr<const PathTrack> track;  // none: itself
  };
  mutable std::optional<Ending> ending_;
  bool ends_early_ = false;
};

// Copyable: a copy replays the same ticks.
class PathRun {
 public:
  PathRun() = default;
  explicit PathRun(std::shared_ptr<const PathTrack> track);

  const PathTrack* track() const { return track_.get(); }
  bool done() const { return step_ == track_->to(); }
  std::uint32_t step() const { return step_; }         // of the path, made
  std::uint8_t fraction() const { return fraction_; }  // of the next one, 1/256
  std::size_t segment() const { return segment_; }     // of the next one, or the last
  std::uint32_t delay() const;                         // of the running step; 0: done
  std::int64_t ns_to(std::uint32_t step) const;  // from now, or after its first tick if that is
                                                 // still to come, to the end of that step
  // The first tick of a run that begins within the path tells how far each motor is from its last
  // whole step, and the run goes on a tick later: told together with the first way, a step that is
  // near would be late.
  bool stands() const { return stands_; }
  void tick(std::uint32_t tick_ns);
  // See PathTrack::ending. Precondition: !done().
  void end_at(std::uint32_t end);

 private:
  void enter(std::size_t segment);

  std::shared_ptr<const PathTrack> track_;
  std::shared_ptr<const Profile> profile_;  // of the segment
  std::size_t segment_ = 0;
  std::size_t part_ = 0;         // of the profile
  std::uint32_t part_left_ = 0;  // steps of it
  std::uint32_t step_ = 0;
  std::uint64_t since_ = 0;  // whole units since the last step
  std::uint32_t since_ns_ = 0;
  std::uint8_t fraction_ = 0;
  bool stands_ = false;
};

// Where a motor is on the path when the run has made `step` of its steps and `fraction`/256 of the
// next one, 1/256 step, as bushd_line_position tells it for each segment: on a whole step at every
// point. Not beyond the whole step where it is to come to rest when the run ends at `end`.
// `whole_steps`: rounded down to them.
std::int64_t path_position_256(const Path& path, std::size_t motor, std::uint32_t step,
                               std::uint8_t fraction, std::uint32_t end, std::size_t segment,
                               bool whole_steps);

}  // namespace bushd::motion
