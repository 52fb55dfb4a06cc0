#include "motion/path_segment.h"

#include <algorithm>

namespace bushd::motion {
namespace {

__extension__ using Wide = unsigned __int128;

void append(Profile& profile, std::uint32_t steps, std::uint32_t delay) {
  if (steps == 0) return;
  if (!profile.empty() && profile.back().delay == delay) {
    profile.back().steps += steps;
  } else {
    profile.push_back({steps, delay});
  }
}

// The step of the run, counted from 0, before which a motor has made this many more.
std::uint64_t run_step(const PathShare& share, std::uint64_t made) {
  if (share.steps == share.longest) return made;
  return quotient(made * share.longest + share.steps - 1, share.steps);
}

}  // namespace

std::uint32_t PathShare::scaled_widely(bushd_delay own) const {
  return static_cast<std::uint32_t>((Wide{own} * numerator + denominator - 1) / denominator);
}

std::int64_t PathShare::first_at_most(bool decel, std::uint32_t delay) const {
  const bushd_ramp& ramp = decel ? table->decel : table->accel;
  std::uint64_t own = 0;  // the greatest code that asks for no more
  if (__builtin_mul_overflow(std::uint64_t{delay}, denominator, &own)) {
    own = static_cast<std::uint64_t>(
        std::min(Wide{UINT16_MAX}, Wide{delay} * denominator / numerator));
  } else {
    own = numerator == denominator ? delay : quotient(own, numerator);
  }
  if (own < table->cruise) return ramp.count;
  // Mostly near rest: where corners are many, few motors are fast.
  std::int64_t most = 1;
  while (most < ramp.count && ramp.code[most - 1] > own) most *= 2;
  most = std::min<std::int64_t>(most, ramp.count);
  return std::partition_point(ramp.code + most / 2, ramp.code + most,
                              [own](std::uint16_t code) { return code > own; }) -
         ramp.code;
}

std::int64_t PathShare::place(bool decel, std::uint32_t delay, std::int64_t reached) const {
  const std::int64_t first = first_at_most(decel, delay);
  const bushd_ramp& ramp = decel ? table->decel : table->accel;
  const bool equal = first < ramp.count && at(decel, first) == delay;
  if (!equal) return first;
  if (reached < 0) return first + 1;
  return std::clamp(reached, first, first_at_most(decel, delay - 1));
}

void RampMerger::Slowest::start(std::span<const PathRamp> ramps, bool decel, std::uint32_t flat) {
  decel_ = decel;
  flat_ = flat;
  climbs_.clear();
  order_.clear();
  leader_ = 0;
  for (const PathRamp& ramp : ramps) {
    const std::uint32_t delay = ramp.share->at(decel, ramp.place);
    if (delay <= flat) continue;
    // By insertion: mostly there are a few.
    const Place place{delay, static_cast<std::uint32_t>(climbs_.size())};
    std::size_t at = order_.size();
    order_.push_back(place);
    for (; at > 0 && order_[at - 1].delay < delay; --at) order_[at] = order_[at - 1];
    order_[at] = place;
    climbs_.push_back({ramp, 0, run_step(*ramp.share, 1)});
  }
}

void RampMerger::Slowest::go_to(std::uint64_t step) {
  while (leader_ < order_.size()) {
    const std::uint32_t climb = order_[leader_].climb;
    Climb& leader = climbs_[climb];
    if (leader.next > step) return;
    const PathShare& share = *leader.ramp.share;
    // A motor makes one step in a step of the run at most.
    leader.made = leader.next == step            ? leader.made + 1
                  : share.steps == share.longest ? step
                                                 : quotient(step * share.steps, share.longest);
    leader.next = run_step(share, leader.made + 1);
    const std::uint32_t delay =
        share.at(decel_, leader.ramp.place + static_cast<std::int64_t>(leader.made));
    if (delay <= flat_) {
      ++leader_;
      continue;
    }
    // Others may lead now.
    std::size_t at = leader_;
    for (; at + 1 < order_.size() && order_[at + 1].delay > delay; ++at)
      order_[at] = order_[at + 1];
    order_[at] = {delay, climb};
  }
}

bool RampMerger::Slowest::has_codes() const {
  if (leader_ == order_.size()) return true;
  const PathShare& share = *leader().ramp.share;
  return share.steps == share.longest && share.numerator == share.denominator;
}

RampMerger::Slowest::Codes RampMerger::Slowest::codes(std::uint64_t step) const {
  if (leader_ == order_.size()) return {};
  const PathRamp& leader = this->leader().ramp;
  const bushd_ramp& side = decel_ ? leader.share->table->decel : leader.share->table->accel;
  // Behind the codes is the cruise delay, which is not above `flat`.
  const std::uint64_t at = static_cast<std::uint64_t>(leader.place) + step;
  return {side.code + std::min<std::uint64_t>(at, side.count), side.code + side.count};
}

void RampMerger::Slowest::leave_codes(std::uint64_t step) {
  if (leader_ == order_.size() || step == 0) return;
  Climb& leader = climbs_[order_[leader_].climb];
  leader.made = step - 1;  // it makes each step of the run
  leader.next = step;
  go_to(step);
}

// As merge(), step by step, as long as only two motors count, which make all steps.
void RampMerger::merge_codes(Profile& merged) {
  const std::uint32_t least = std::max({flat_, up_.others(), down_.others()});
  auto up = up_.codes(from_first_);
  auto down = down_.codes(from_last_);
  std::uint64_t left = left_;
  const std::uint64_t before = left + from_first_;
  std::uint64_t back = 0;
  while (left > 0) {
    const std::uint32_t in_front = up.now();
    const std::uint32_t behind = down.now();
    if (std::max(in_front, behind) <= least) break;
    --left;
    if (in_front >= behind) {
      append(merged, 1, in_front);
      ++up.at;
    } else {
      append(back_, 1, behind);
      ++down.at;
      ++back;
    }
  }
  left_ = left;
  from_first_ = before - left - back;
  from_last_ += back;
  up_.leave_codes(from_first_);
  down_.leave_codes(from_last_);
}

// Whichever end is slower now is the slower side of the step there, as neither side rises towards
// the other end.
void RampMerger::merge(std::span<const PathRamp> up, std::span<const PathRamp> down,
                       std::uint32_t flat, std::uint32_t steps, Profile& merged) {
  merged.clear();
  back_.clear();
  up_.start(up, false, flat);
  down_.start(down, true, flat);
  flat_ = flat;
  from_first_ = 0;
  from_last_ = 0;
  left_ = steps;
  while (left_ > 0) {
    if (up_.has_codes() && down_.has_codes()) merge_codes(merged);
    const std::uint32_t in_front = up_.delay();
    const std::uint32_t behind = down_.delay();
    if ((in_front == 0 && behind == 0) || left_ == 0) break;
    const bool forward = in_front >= behind;
    Slowest& side = forward ? up_ : down_;
    std::uint64_t& done = forward ? from_first_ : from_last_;
    const std::uint64_t now = std::min(left_, side.until() - done);
    append(forward ? merged : back_, static_cast<std::uint32_t>(now), forward ? in_front : behind);
    left_ -= now;
    done += now;
    side.go_to(done);
  }
  append(merged, static_cast<std::uint32_t>(left_), flat);
  for (auto part = back_.rbegin(); part != back_.rend(); ++part) {
    append(merged, part->steps, part->delay);
  }
}

void raise_first(Profile& profile, std::uint32_t steps, std::uint32_t least) {
  Profile::size_type i = 0;
  while (steps > 0 && i < profile.size()) {
    if (profile[i].delay >= least) {
      steps -= std::min(steps, profile[i].steps);
    } else if (profile[i].steps <= steps) {
      profile[i].delay = least;
      steps -= profile[i].steps;
    } else {
      const Delays rest{profile[i].steps - steps, profile[i].delay};
      profile[i] = {steps, least};
      profile.insert(profile.begin() + static_cast<std::ptrdiff_t>(i) + 1, rest);
      return;
    }
    ++i;
  }
}

void raise_last(Profile& profile, std::uint32_t least) {
  Delays& last = profile.back();
  if (last.delay >= least) return;
  if (last.steps == 1) {
    last.delay = least;
    return;
  }
  --last.steps;
  profile.push_back({1, least});
}

Profile greater_of(const Profile& one, const Profile& other) {
  Profile greater;
  auto a = one.begin();
  auto b = other.begin();
  std::uint32_t a_done = 0;
  std::uint32_t b_done = 0;
  while (a != one.end() && b != other.end()) {
    const std::uint32_t now = std::min(a->steps - a_done, b->steps - b_done);
    append(greater, now, std::max(a->delay, b->delay));
    a_done += now;
    b_done += now;
    if (a_done == a->steps) {
      ++a;
      a_done = 0;
    }
    if (b_done == b->steps) {
      ++b;
      b_done = 0;
    }
  }
  return greater;
}

Profile part_of(const Profile& profile, std::uint32_t first, std::uint32_t steps) {
  Profile part;
  for (const Delays& delays : profile) {
    const std::uint32_t skipped = std::min(first, delays.steps);
    first -= skipped;
    const std::uint32_t taken = std::min(steps, delays.steps - skipped);
    append(part, taken, delays.delay);
    steps -= taken;
  }
  return part;
}

std::uint64_t units_of(const Profile& profile) {
  std::uint64_t units = 0;
  for (const Delays& delays : profile) units += std::uint64_t{delays.steps} * delays.delay;
  return units;
}

}  // namespace bushd::motion
