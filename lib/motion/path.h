// A path of several motors: straight segments from point to point, all of one run over its whole
// length, s = sum of the segments' L (engine/line.h). It is planned before it begins.
//
// Every border of two segments is an anchor. With d the delay of the run's step behind it, e that
// of the step before, and what a motor has of each segment's steps as r1 and r2, a corner that is
// passed has for every motor
//
//     |v2^2 - v1^2| <= F^2,  v1^2 + v2^2 <= F^2 where it turns round,   v1 = r1/e, v2 = r2/d,
//
// F = 1 / A(0) of its table. Between two anchors a motor's delays are those of its table by its own
// travel from either of them:
//
//     delay(j) = max of  r A(a + floor(r (j-1))),  r D(b + floor(r (L-j))),  r c,
//
// with a and b the first indices that ask for at most the delay behind the anchor, or the next one
// if they ask for just that (PathShare::place). Nowhere does a motor have made fewer of its own
// steps since it stood or turned round, or has fewer of them to go until then, than its index says.
// In the first half of the interval that goes over a corner, a motor that slows down there is held
// back by (1 + r1) / (1 + r2), because its step falls so much earlier in it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "motion/path_segment.h"

namespace bushd::motion {

class Path {
 public:
  enum class Corners {
    kExact,      // rest at each point
    kContinuous  // pass them
  };
  struct Motor {
    const bushd_table* table;        // outlives the path
    bushd_delay shortest_delay = 0;  // none of its steps has a shorter delay
  };
  // `begin`: where they stand. `points`: as many as are to come, if that is known.
  Path(std::vector<Motor> motors, std::span<const std::int64_t> begin, Corners corners,
       std::size_t points = 0);
  // The next point. `shortest_delays`: as that of a motor, on the way there; empty: no limits.
  // Preconditions: |to - from| < 2^32, steps() < 2^31 before plan() is called, which has not been.
  void add(std::span<const std::int64_t> point, std::span<const bushd_delay> shortest_delays = {});
  Path(const Path&) = delete;
  Path& operator=(const Path&) = delete;

  // The rest of it, for a run from rest at this step, to the end of the segment `last`. Steps keep
  // their numbers. Precondition: begin < steps(), and not behind that segment.
  std::unique_ptr<Path> rest(std::uint32_t begin, std::size_t last) const;
  std::unique_ptr<Path> rest(std::uint32_t begin) const { return rest(begin, segments() - 1); }

  // Goes on with planning by this many segments at each of three passes; returns whether it is
  // done. All below but steps() and what is of points needs that.
  bool plan(std::size_t segments);
  bool is_planned() const { return phase_ == Phase::kDone; }

  // A number for logs.
  void set_number(std::uint64_t number) { number_ = number; }
  std::uint64_t number() const { return number_; }

  const std::vector<Motor>& motors() const { return motors_; }
  // Points that repeat the one before them are left out here. 0: nothing moves.
  std::size_t segments() const { return start_.size() - 1; }
  std::uint32_t unit_ns() const { return unit_ns_; }
  std::uint64_t steps() const { return start_.back(); }
  // The step of the run at which a segment begins; that of segments() is steps(), where it ends.
  std::uint32_t start_of(std::size_t segment) const {
    return static_cast<std::uint32_t>(start_[segment]);
  }
  std::uint32_t length_of(std::size_t segment) const {
    return static_cast<std::uint32_t>(start_[segment + 1] - start_[segment]);
  }
  std::uint32_t first_step() const { return first_step_; }
  // The first one of a segment that the run makes, and how many it makes of it.
  std::uint32_t first_of(std::size_t segment) const {
    return segment == 0 ? first_step_ : start_of(segment);
  }
  std::uint32_t made_of(std::size_t segment) const {
    return start_of(segment + 1) - first_of(segment);
  }
  std::size_t segment_at(std::uint32_t step) const;  // the one that the step after it is of
  std::int64_t point(std::size_t segment, std::size_t motor) const {
    return points_[segment * motors_.size() + motor];
  }
  // Where a motor is when the run has made so many steps.
  std::int64_t position_at(std::size_t motor, std::uint32_t step) const;
  // At the end of the rows of the given points, the first one left out, in units of time.
  std::vector<std::uint64_t> units_at_points() const;
  std::uint64_t units() const { return end_units_.empty() ? 0 : end_units_.back(); }
  std::uint64_t end_units(std::size_t segment) const { return end_units_[segment]; }
  double most_steps_per_s(std::size_t motor) const { return fastest_[motor] * 1e9 / unit_ns_; }

  // Delays of a segment. O(its codes).
  Profile profile(std::size_t segment) const;

  // A run that ends at rest within the path: its delays by segment up to there, back to where
  // they are the path's own.
  using Parts = std::map<std::size_t, Profile>;
  Parts parts_to(std::uint32_t step) const;
  // Where a run that makes its step `running` now, counted from 0, can come to rest at the
  // earliest, so that neither that step nor one before it is faster than the ramps that lead there
  // allow. `made` says what it makes of a segment, up to that step.
  using MadeOf = std::function<const Profile&(std::size_t)>;
  std::uint32_t nearest_rest(std::uint32_t running, const MadeOf& made) const;

 private:
  enum class Phase { kCorners, kBack, kForth, kDone };
  Path(const Path& whole, std::uint32_t begin, std::size_t last);
  void choose_unit();
  void prepare(std::size_t points);

  using Shares = std::vector<PathShare>;     // by motor, as those below
  using Places = std::vector<std::int64_t>;  // on the sides of their tables
  struct Head {
    std::uint32_t steps;
    std::uint32_t delay;
  };

  void load(std::size_t segment, Shares& shares) const;
  bushd_delay own_least(std::size_t segment, std::size_t motor) const;
  std::uint32_t flat(std::size_t segment, const Shares& shares) const;
  bool rests_at(std::size_t segment) const;
  std::uint32_t corner(const Shares& before, const Shares& behind) const;
  std::uint32_t least_behind(const Shares& before, const Shares& behind, std::uint32_t delay) const;
  std::uint32_t least_before(const Shares& before, const Shares& behind, std::uint32_t delay) const;
  std::uint32_t own_made(std::size_t segment, const PathShare& share) const;
  std::int64_t accel_place(const PathShare& now, const PathShare& before, std::uint32_t delay,
                           std::int64_t place, std::uint32_t travel) const;
  std::int64_t decel_place(const PathShare& now, const PathShare& behind, std::uint32_t delay,
                           std::int64_t place, std::uint32_t travel) const;
  Head head(std::size_t segment, std::size_t motor, const PathShare& before, const PathShare& now,
            bushd_delay own) const;
  void raise_heads(std::size_t segment, const Shares& before, const Shares& now, bool decel,
                   const Places& places, std::uint32_t most, Profile& profile) const;
  std::uint32_t first_delay(std::size_t segment, const Shares& before, const Shares& now,
                            const Places& places) const;
  void shape(std::size_t segment, const Shares& before, const Shares& now, const Shares& behind,
             std::uint32_t delay_before, Profile& profile) const;
  // What is carried over a corner, in either direction.
  struct Border {
    std::uint32_t delay = kRest;
    Places places;
    std::vector<std::uint32_t> travel;
  };
  void enter(const Shares& now, const Shares& behind, Border& border) const;
  std::vector<PathRamp> ramps_of(const Shares& now, const Places& places) const;
  std::uint32_t down_at(const Shares& now, const Places& places, std::uint32_t steps) const;
  bool allows(const Profile& made, std::uint32_t steps, const Shares& now, const Places& places,
              std::uint32_t at_last, const std::vector<Head>& heads) const;
  bool can_rest(std::uint32_t end, std::size_t running, const MadeOf& made) const;
  void corners_step(std::size_t segment);
  void back_step(std::size_t segment);
  void forth_step(std::size_t segment);

  std::vector<Motor> motors_;
  std::vector<std::int64_t> points_;
  Corners corners_;
  std::vector<bushd_delay> shortest_delays_;
  std::vector<std::uint32_t> row_segments_;  // of each given point: segments before it
  std::vector<std::uint64_t> start_;
  std::uint32_t first_step_ = 0;
  std::uint32_t unit_ns_ = 1;
  std::vector<std::pair<std::uint64_t, std::uint64_t>> unit_ratio_;  // a motor's by the path's
  std::vector<double> start_units_;                                  // 1 / F
  std::uint64_t number_ = 0;

  // By segment: the least delay of all its steps, and of its first one by the corner; that and by
  // what comes behind; of its last step; when it ends.
  std::vector<std::uint32_t> flat_;
  std::vector<std::uint32_t> corner_;
  std::vector<std::uint32_t> first_;
  std::vector<std::uint32_t> last_;
  std::vector<std::uint64_t> end_units_;
  // By segment and motor: its places on the sides of its table.
  std::vector<std::int32_t> accel_;
  std::vector<std::int32_t> decel_;
  std::vector<double> fastest_;

  // The pass that is under way.
  Phase phase_ = Phase::kDone;  // nothing to do without points
  std::size_t at_ = 0;
  std::uint32_t delay_ = 0;
  std::vector<std::uint32_t> travel_;  // own steps since it stood or turned
  Shares before_;
  Shares now_;
  Shares behind_;
  Profile joined_;
  struct Scratch {
    Places places;
    std::vector<PathRamp> up;
    std::vector<PathRamp> down;
    RampMerger merger;
  };
  mutable Scratch scratch_;
};

}  // namespace bushd::motion
