// An axis on a trajectory, and off it by a ramp of its table.
#include <algorithm>
#include <cstdlib>
#include <utility>

#include "engine/slots.h"
#include "motion/axis.h"
#include "motion/trajectory_check.h"

namespace bushd::motion {
namespace {

__extension__ using SignedWide = __int128;
using Position = Trajectory::Position;

// To go through this many ticks takes a fraction of a millisecond.
constexpr Tick kNear = 2048;

}  // namespace

void Axis::start_trajectory(TrajectoryShare share, Tick start) {
  busy_ = true;
  start_ = start;
  late_ns_ = 0;
  shortest_delay_ = 0;
  stopping_ = false;
  stale_ = false;
  change_.reset();
  share_.reset();
  followed_ = std::move(share);
  base_ = {};
  restart(base_.run, 0, 1, 0);
  base_.tick = start;
  base_.follows = true;
  base_.follower = Follower(*followed_->trajectory, followed_->motor, tick_ns_,
                            way_to_catch_up(*table_, tick_ns_));
  from_ = base_.left_at = base_.follower.made();
  base_.told_256 = from_ * 256;
  trajectory_grew();
}

void Axis::trajectory_grew() {
  const Trajectory& all = *followed_->trajectory;
  rests_at_end_ = rests_at_end(all, followed_->motor, *table_);
  target_ = nearest_step(all.position(all.rows() - 1, followed_->motor));
  head_ = base_;
  plan_end();
}

bool Axis::runs_out_before(Tick tick) const {
  if (!followed_ || !base_.follows || stopping_) return false;
  if (followed_->trajectory->closed() && rests_at_end_) return false;
  return start_ + followed_->trajectory->known_ns() / tick_ns_ < tick;
}

bool Axis::trajectory_goes_on_after(Tick tick) const {
  if (!followed_ || !base_.follows || base_.follower.rests()) return false;
  return start_ + followed_->trajectory->known_ns() / tick_ns_ > tick + 1;
}

bool Axis::goes(int direction) const {
  if (!followed_) return direction == this->direction();
  if (!base_.follows) return direction == base_.run.direction;
  return direction > 0 ? base_.went_up : base_.went_down;
}

bool Axis::trajectory_over(const Place& place) const {
  if (place.follows) return place.follower.rests();
  return bushd_run_done(&place.run) && place.told_256 == steps_followed(place) * 256;
}

std::int64_t Axis::steps_followed(const Place& place) const {
  if (place.follows) return place.follower.made();
  return place.left_at + place.run.direction * static_cast<std::int64_t>(place.run.steps_done);
}

double Axis::trajectory_velocity(const Place& place) const {
  return static_cast<double>(place.follower.direction() * place.follower.last_way()) /
         static_cast<double>(Trajectory::kStep) * 1e9 / tick_ns_;
}

std::int16_t Axis::as_told(std::int64_t moved_256) const {
  if (format_ == BUSHD_FORMAT_FINE) return static_cast<std::int16_t>(moved_256);
  if (moved_256 == 0) return 0;
  return static_cast<std::int16_t>((std::abs(moved_256) / 256) |
                                   (moved_256 > 0 ? BUSHD_COARSE_DIRECTION : 0));
}

void Axis::follow_trajectory(Place& place, std::size_t ticks, std::int16_t* out,
                             std::size_t stride) const {
  const bool fine = format_ == BUSHD_FORMAT_FINE;
  for (std::size_t i = 0; i < ticks; ++i) {
    if (place.follows && !place.follower.rests() && !place.follower.next(rests_at_end_)) {
      leave_trajectory(place);
    }
    std::int64_t at_256 = 0;
    if (place.follows) {
      at_256 = fine ? place.follower.told_256() : place.follower.made() * 256;
      place.went_up = place.went_up || place.follower.direction() > 0;
      place.went_down = place.went_down || place.follower.direction() < 0;
    } else {
      std::int16_t unused;
      expand_run(place.run, fine, 1, &unused, 1);
      at_256 = steps_followed(place) * 256;
      if (fine && !bushd_run_done(&place.run)) at_256 += place.run.direction * place.run.fraction;
    }
    out[i * stride] = as_told(at_256 - place.told_256);
    place.told_256 = at_256;
  }
}

// The way in a tick at the speed of the running step, as the fastest one of the tick has it, and
// the one after this moment: a ramp-down from it is not too short.
std::int64_t Axis::way_on_trajectory(const Place& place) const {
  const Follower& now = place.follower;
  // One that has all but come to rest since goes no faster than twice as it does.
  Position way = std::min(now.fastest_way(), 2 * now.last_way());
  Follower later = now;
  const bool goes_on = !now.rests() && later.next(rests_at_end_);
  if (goes_on && (now.direction() == 0 || later.direction() == now.direction())) {
    way = std::max(way, later.last_way());
  }
  return way;
}

// By that way, rounded down. 0: it stands, or all but.
std::uint16_t Axis::delay_on_trajectory(const Place& place) const {
  const Position way = way_on_trajectory(place);
  if (way <= 0) return 0;
  // A nanosecond for the rounding of positions.
  const SignedWide time = SignedWide{tick_ns_} * Trajectory::kStep + way;
  const SignedWide units = time / (SignedWide{way} * table_->time_unit_ns);
  if (units > UINT16_MAX) return 0;
  return std::max(static_cast<std::uint16_t>(units), bushd_table_fastest(table_));
}

std::uint16_t Axis::follower_delay(const Place& place) const {
  if (place.follower.rests()) return 0;
  const std::uint16_t delay = delay_on_trajectory(place);
  return delay == 0 ? UINT16_MAX : delay;  // it goes on later
}

// As its MCU would if it heard no more: the running step is completed, then the fewest follow.
void Axis::leave_trajectory(Place& place) const {
  if (!place.follows) return;
  place.follows = false;
  const Follower& follower = place.follower;
  place.left_at = follower.made();
  const int direction = follower.direction() < 0 ? -1 : 1;
  // What is still being caught up was told in half its time.
  const Position aim = follower.at() + direction * (Trajectory::kStep / 2);
  const std::int64_t begun_256 =
      follower.told() == aim ? (follower.told_256() - follower.made() * 256) * direction : 0;
  // Where it has slowed down in the running step, or caught up, less of the step's delay is over
  // than of its way: at least as much as its fastest tick took for that.
  const Position way = std::max<Position>(way_on_trajectory(place), 0);
  const Position fastest = std::max<Position>(follower.fastest_told(), 1);
  const std::int64_t over_256 = begun_256 * std::min(way, fastest) / fastest;
  const auto fraction = static_cast<std::uint8_t>(std::clamp<std::int64_t>(over_256, 0, 255));
  bushd_run_start_ramp_down(&place.run, table_, delay_on_trajectory(place), fraction, direction);
}

void Axis::plan_trajectory_end(Place place) {
  const Tick known = start_ + followed_->trajectory->known_ns() / tick_ns_;
  end_is_near_ = !place.follows || known - place.tick < kNear;
  planned_run_steps_ = 0;
  planned_end_ = target_;
  end_ = run_end_ = known + 1;
  if (!end_is_near_) return;
  while (place.follows && !place.follower.rests()) advance(place, place.tick + 1);
  end_ = place.tick;
  planned_end_ = steps_followed(place);
  if (!place.follows) {
    planned_end_ +=
        place.run.direction * static_cast<std::int64_t>(bushd_run_steps_left(&place.run));
    end_ = std::max(end_of(place), place.tick + (trajectory_over(place) ? 0 : 1));
  }
  end_ = run_end_ = std::max(end_, start_ + 1);
}

}  // namespace bushd::motion
