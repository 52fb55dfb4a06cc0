#include "motion/path.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numeric>
#include <utility>

#include "engine/line.h"

namespace bushd::motion {
namespace {

// Rounds up a delay that is not known better than to the last digit of a double.
std::uint32_t rounded_up(double delay) {
  if (delay >= kRest - 1.0) return kRest - 1;
  const auto whole = static_cast<std::uint32_t>(delay);
  return delay == whole ? whole : static_cast<std::uint32_t>(delay * (1 + 1e-12)) + 1;
}

bool turns(const PathShare& before, const PathShare& behind) {
  return before.moves() && behind.moves() && before.direction != behind.direction;
}

// The motors ask for squares, by what they have of the steps before and behind a corner: the root
// of the greatest one.
std::uint32_t root_of_greatest(const std::vector<PathShare>& before,
                               const std::vector<PathShare>& behind, const auto& square_of) {
  double most = 1;
  for (std::size_t m = 0; m < behind.size(); ++m) {
    most = std::max(most, square_of(m, before[m].ratio, behind[m].ratio));
  }
  return rounded_up(std::sqrt(most));
}

}  // namespace

Path::Path(std::vector<Motor> motors, std::span<const std::int64_t> begin, Corners corners,
           std::size_t points)
    : motors_(std::move(motors)),
      points_(begin.begin(), begin.end()),
      corners_(corners),
      start_{0} {
  points_.reserve((points + 1) * motors_.size());
  start_.reserve(points + 1);
  row_segments_.reserve(points);
  prepare(points);
}

void Path::add(std::span<const std::int64_t> point, std::span<const bushd_delay> shortest_delays) {
  const std::size_t width = motors_.size();
  const std::int64_t* from = &points_[points_.size() - width];
  std::uint64_t longest = 0;
  for (std::size_t m = 0; m < width; ++m) {
    longest = std::max(longest, static_cast<std::uint64_t>(std::abs(point[m] - from[m])));
  }
  if (longest != 0) {
    points_.insert(points_.end(), point.begin(), point.end());
    start_.push_back(start_.back() + longest);
    shortest_delays_.insert(shortest_delays_.end(), shortest_delays.begin(), shortest_delays.end());
    if (shortest_delays.empty() && !shortest_delays_.empty())
      shortest_delays_.resize(shortest_delays_.size() + width, 0);
    phase_ = Phase::kCorners;
  }
  row_segments_.push_back(static_cast<std::uint32_t>(start_.size() - 1));
}

Path::Path(const Path& whole, std::uint32_t begin, std::size_t last)
    : motors_(whole.motors_), corners_(whole.corners_), first_step_(begin) {
  const auto part = [](const auto& all, std::size_t first, std::size_t end) {
    return std::vector(all.begin() + static_cast<std::ptrdiff_t>(first),
                       all.begin() + static_cast<std::ptrdiff_t>(end));
  };
  const std::size_t width = motors_.size();
  const std::size_t first = whole.segment_at(begin);
  points_ = part(whole.points_, first * width, (last + 2) * width);
  start_ = part(whole.start_, first, last + 2);
  if (!whole.shortest_delays_.empty()) {
    shortest_delays_ = part(whole.shortest_delays_, first * width, (last + 1) * width);
  }
  prepare(segments());
  phase_ = Phase::kCorners;
}

std::unique_ptr<Path> Path::rest(std::uint32_t begin, std::size_t last) const {
  return std::unique_ptr<Path>(new Path(*this, begin, last));
}

// The shortest of the motors', or a longer one if 31 bits of it were too few for the slowest step.
void Path::choose_unit() {
  unit_ns_ = UINT32_MAX;
  std::uint64_t slowest_ns = 0;
  for (std::size_t m = 0; m < motors_.size(); ++m) {
    const std::uint64_t own_ns = motors_[m].table->time_unit_ns;
    unit_ns_ = std::min<std::uint32_t>(unit_ns_, motors_[m].table->time_unit_ns);
    bushd_delay shortest_delay = motors_[m].shortest_delay;
    for (std::size_t i = m; i < shortest_delays_.size(); i += motors_.size()) {
      shortest_delay = std::max(shortest_delay, shortest_delays_[i]);
    }
    slowest_ns = std::max(slowest_ns, shortest_delay * own_ns);
  }
  unit_ns_ = std::max(unit_ns_, static_cast<std::uint32_t>((slowest_ns >> 31) + 1));
  unit_ratio_.clear();
  start_units_.clear();
  for (const Motor& motor : motors_) {
    const std::uint64_t own_ns = motor.table->time_unit_ns;
    const std::uint64_t common = std::gcd(own_ns, std::uint64_t{unit_ns_});
    unit_ratio_.emplace_back(own_ns / common, unit_ns_ / common);
    const std::uint16_t slowest = std::max(motor.table->accel.code[0], motor.table->cruise);
    start_units_.push_back(static_cast<double>(slowest) * static_cast<double>(own_ns) / unit_ns_);
  }
}

// What grows with the points grows while they are looked at.
void Path::prepare(std::size_t points) {
  choose_unit();
  const std::size_t width = motors_.size();
  travel_.assign(width, 0);
  flat_.reserve(points);
  corner_.reserve(points);
  first_.reserve(points);
  last_.reserve(points);
  end_units_.reserve(points);
  accel_.reserve(points * width);
  decel_.reserve(points * width);
  fastest_.assign(width, 0);
  scratch_.places.assign(width, 0);
}

std::size_t Path::segment_at(std::uint32_t step) const {
  const auto after = std::upper_bound(start_.begin(), start_.end() - 1, std::uint64_t{step});
  return static_cast<std::size_t>(after - start_.begin()) - 1;
}

std::int64_t Path::position_at(std::size_t motor, std::uint32_t step) const {
  if (segments() == 0) return point(0, motor);
  const std::size_t segment = std::min(segment_at(step), segments() - 1);
  const std::int64_t way = point(segment + 1, motor) - point(segment, motor);
  bushd_line line;
  bushd_line_start(&line, static_cast<std::uint32_t>(std::abs(way)), length_of(segment));
  bushd_line_go_to(&line, step - start_of(segment));
  return point(segment, motor) + (way < 0 ? -std::int64_t{line.made} : std::int64_t{line.made});
}

std::vector<std::uint64_t> Path::units_at_points() const {
  std::vector<std::uint64_t> units;
  units.reserve(row_segments_.size());
  for (const std::uint32_t before : row_segments_) {
    units.push_back(before == 0 ? 0 : end_units_[before - 1]);
  }
  return units;
}

void Path::load(std::size_t segment, std::vector<PathShare>& shares) const {
  const std::size_t width = motors_.size();
  const std::int64_t* from = &points_[segment * width];
  const std::uint32_t longest = length_of(segment);
  shares.resize(width);
  for (std::size_t m = 0; m < width; ++m) {
    const std::int64_t way = from[width + m] - from[m];
    const auto steps = static_cast<std::uint32_t>(std::abs(way));
    shares[m] = {.table = motors_[m].table,
                 .steps = steps,
                 .longest = longest,
                 .direction = way > 0   ? 1
                              : way < 0 ? -1
                                        : 0,
                 .numerator = steps * unit_ratio_[m].first,
                 .denominator = longest * unit_ratio_[m].second,
                 .ratio = static_cast<double>(steps) / longest};
  }
}

std::uint32_t Path::flat(std::size_t segment, const std::vector<PathShare>& shares) const {
  std::uint32_t least = 1;
  for (std::size_t m = 0; m < shares.size(); ++m) {
    if (shares[m].moves()) least = std::max(least, shares[m].scaled(own_least(segment, m)));
  }
  return least;
}

bushd_delay Path::own_least(std::size_t segment, std::size_t motor) const {
  const bushd_delay least =
      std::max<bushd_delay>(motors_[motor].table->cruise, motors_[motor].shortest_delay);
  return shortest_delays_.empty()
             ? least
             : std::max(least, shortest_delays_[segment * motors_.size() + motor]);
}

bool Path::rests_at(std::size_t segment) const {
  return segment == 0 || segment == segments() || corners_ == Corners::kExact;
}

// The least delay on both sides of the corner.
std::uint32_t Path::corner(const Shares& before, const Shares& behind) const {
  return root_of_greatest(before, behind, [&](std::size_t m, double r1, double r2) {
    const double squares =
        turns(before[m], behind[m]) ? r1 * r1 + r2 * r2 : std::abs(r2 - r1) * (r1 + r2);
    return start_units_[m] * start_units_[m] * squares;
  });
}

// The least delay of the first step behind a border, after one of this delay.
std::uint32_t Path::least_behind(const Shares& before, const Shares& behind,
                                 std::uint32_t delay) const {
  return root_of_greatest(before, behind, [&](std::size_t m, double r1, double r2) {
    if (r2 == 0 || r2 == r1 || turns(before[m], behind[m])) return 0.0;
    const double v1 = r1 * start_units_[m] / delay;
    const double alone = r2 * start_units_[m];
    return alone * alone / (1 + v1 * v1);
  });
}

// The least delay of the last step before a border, with one of this delay behind it.
std::uint32_t Path::least_before(const Shares& before, const Shares& behind,
                                 std::uint32_t delay) const {
  return root_of_greatest(before, behind, [&](std::size_t m, double r1, double r2) {
    const bool turn = turns(before[m], behind[m]);
    if (r1 == 0 || (r1 == r2 && !turn)) return 0.0;
    const double v2 = r2 * start_units_[m] / delay;
    const double left = turn ? 1 - v2 * v2 : 1 + v2 * v2;
    if (left <= 0) return HUGE_VAL;  // the corner's own delay leaves more than nothing
    const double alone = r1 * start_units_[m];
    return alone * alone / left;
  });
}

// Steps of a motor's own in a segment, but for parts of steps.
std::uint32_t Path::own_made(std::size_t segment, const PathShare& share) const {
  const std::uint32_t made = made_of(segment);
  if (made == share.longest) return share.steps;
  return static_cast<std::uint32_t>(quotient(std::uint64_t{share.steps} * made, share.longest));
}

std::int64_t Path::accel_place(const PathShare& now, const PathShare& before, std::uint32_t delay,
                               std::int64_t place, std::uint32_t travel) const {
  if (delay == kRest || !now.moves()) return 0;
  std::int64_t reached = -1;
  if (goes_on(before, now) && before.at(false, place + before.steps - 1) == delay) {
    reached = place + before.steps;
  }
  return std::min<std::int64_t>(now.place(false, delay, reached), travel);
}

// The last step but for r = 1 falls before the border, so that a ramp is one behind there.
std::int64_t Path::decel_place(const PathShare& now, const PathShare& behind, std::uint32_t delay,
                               std::int64_t place, std::uint32_t travel) const {
  const std::int64_t late = now.steps == now.longest ? 0 : 1;
  if (delay == kRest || !now.moves()) return -late;
  std::int64_t reached = -1;
  if (goes_on(now, behind) && behind.at(true, place + behind.steps - 1) == delay) {
    reached = place + behind.steps;
  }
  return std::min(now.place(true, delay, reached), travel - late);
}

// What holds a motor back in the first half of the interval over a corner.
Path::Head Path::head(std::size_t segment, std::size_t motor, const PathShare& before,
                      const PathShare& now, bushd_delay own) const {
  // Behind a rest on the way the first step comes after a whole delay, whatever was before.
  const bool rest = rests_at(segment);
  const double r1 = rest ? 1 : before.ratio;
  const double r2 = now.ratio;
  if (!now.moves() || (!rest && !goes_on(before, now)) || r2 >= r1) return {0, 0};
  const bushd_delay code = std::max(own, own_least(segment, motor));
  const double delay = static_cast<double>(code) * static_cast<double>(now.numerator) /
                       static_cast<double>(now.denominator) * (1 + r1) / (1 + r2);
  const std::uint64_t twice = std::uint64_t{now.longest} + now.steps;
  const std::uint64_t twice_own = 2 * std::uint64_t{now.steps};
  return {static_cast<std::uint32_t>(quotient(twice + twice_own - 1, twice_own)),
          rounded_up(delay)};
}

void Path::raise_heads(std::size_t segment, const Shares& before, const Shares& now, bool decel,
                       const Places& places, std::uint32_t most, Profile& profile) const {
  for (std::size_t m = 0; m < now.size(); ++m) {
    if (now[m].ratio == 1) continue;  // none is held back
    const std::int64_t index = decel ? places[m] + now[m].steps - 1 : places[m];
    const Head held = head(segment, m, before[m], now[m], now[m].code(decel, index));
    if (held.steps != 0) raise_first(profile, held.steps, std::min(held.delay, most));
  }
}

// The delay of the first step of a segment that ends with rest or with the step of `side` behind
// it: `side` becomes that of its own first step.
std::uint32_t Path::first_delay(std::size_t segment, const Shares& before, const Shares& now,
                                const Places& places) const {
  std::uint32_t least = flat_[segment];
  for (std::size_t m = 0; m < now.size(); ++m) {
    if (!now[m].moves()) continue;
    const std::int64_t index = places[m] + now[m].steps - 1;
    least = std::max(least, now[m].at(true, index));
    if (rests_at(segment)) continue;
    least = std::max(least, head(segment, m, before[m], now[m], now[m].code(true, index)).delay);
  }
  return least;
}

void Path::corners_step(std::size_t i) {
  load(i, now_);
  flat_.push_back(flat(i, now_));
  corner_.push_back(rests_at(i) ? 0 : corner(before_, now_));
  first_.push_back(0);
  last_.push_back(0);
  end_units_.push_back(0);
  accel_.resize(accel_.size() + now_.size(), 0);
  decel_.resize(decel_.size() + now_.size(), 0);
  for (std::size_t m = 0; m < now_.size(); ++m) {
    const bool on = !rests_at(i) && goes_on(before_[m], now_[m]);
    travel_[m] = on ? travel_[m] + own_made(i - 1, before_[m]) : 0;
    if (rests_at(i) || !now_[m].moves()) continue;
    corner_[i] = std::max(corner_[i], now_[m].at(false, travel_[m]));
  }
  std::swap(before_, now_);
}

void Path::back_step(std::size_t i) {
  if (i + 1 == segments()) load(i, now_);
  if (i > 0) load(i - 1, before_);
  const bool rest = rests_at(i + 1);
  std::uint32_t& delay = delay_;
  Places& places = scratch_.places;
  for (std::size_t m = 0; m < now_.size(); ++m) {
    const bool on = !rest && goes_on(now_[m], behind_[m]);
    travel_[m] = on ? travel_[m] + behind_[m].steps : 0;
    if (rest || !now_[m].moves()) continue;
    delay = std::max(delay, now_[m].at(true, std::int64_t{travel_[m]} - 1));
  }
  if (rest) {
    delay = kRest;
  } else {
    corner_[i + 1] = first_[i + 1] = delay;
  }
  for (std::size_t m = 0; m < now_.size(); ++m) {
    const std::int64_t behind = rest ? 0 : decel_[(i + 1) * now_.size() + m];
    places[m] = decel_place(now_[m], rest ? now_[m] : behind_[m], delay, behind, travel_[m]);
    decel_[i * now_.size() + m] = static_cast<std::int32_t>(places[m]);
  }
  std::uint32_t first = std::max(corner_[i], first_delay(i, before_, now_, places));
  if (!rest && made_of(i) == 1) first = std::max(first, least_before(now_, behind_, delay));
  first_[i] = delay = first;
  std::swap(behind_, now_);
  std::swap(now_, before_);
}

void Path::forth_step(std::size_t i) {
  if (i == 0) load(0, now_);
  if (i + 1 < segments()) load(i + 1, behind_);
  const std::size_t width = now_.size();
  const std::uint32_t delay = rests_at(i) ? kRest : last_[i - 1];
  for (std::size_t m = 0; m < width; ++m) {
    const bool on = delay != kRest && goes_on(before_[m], now_[m]);
    const std::uint32_t made = i == 0 ? 0 : own_made(i - 1, before_[m]);
    travel_[m] = on ? travel_[m] + made : 0;
    // As if it had come from the beginning of the segment.
    const std::int64_t before =
        delay == kRest ? 0 : accel_[(i - 1) * width + m] + std::int64_t{made} - before_[m].steps;
    accel_[i * width + m] = static_cast<std::int32_t>(
        accel_place(now_[m], delay == kRest ? now_[m] : before_[m], delay, before, travel_[m]));
  }
  shape(i, before_, now_, behind_, delay, joined_);
  last_[i] = joined_.back().delay;
  end_units_[i] = (i == 0 ? 0 : end_units_[i - 1]) + units_of(joined_);
  std::uint32_t least = kRest;
  for (const Delays& delays : joined_) least = std::min(least, delays.delay);
  for (std::size_t m = 0; m < width; ++m) {
    if (now_[m].moves()) fastest_[m] = std::max(fastest_[m], now_[m].ratio / least);
  }
  std::swap(before_, now_);
  std::swap(now_, behind_);
}

bool Path::plan(std::size_t count) {
  const std::size_t n = segments();
  if (phase_ == Phase::kCorners && at_ == 0) choose_unit();
  while (count > 0 && phase_ != Phase::kDone) {
    --count;
    if (phase_ == Phase::kCorners) {
      corners_step(at_++);
    } else if (phase_ == Phase::kBack) {
      back_step(n - 1 - at_++);
    } else {
      forth_step(at_++);
    }
    if (at_ < n) continue;
    at_ = 0;
    phase_ = phase_ == Phase::kCorners ? Phase::kBack
             : phase_ == Phase::kBack  ? Phase::kForth
                                       : Phase::kDone;
  }
  return is_planned();
}

void Path::shape(std::size_t i, const Shares& before, const Shares& now, const Shares& behind,
                 std::uint32_t delay_before, Profile& profile) const {
  const std::size_t width = now.size();
  auto& [places, up, down, merger] = scratch_;
  const auto take = [&](const std::vector<std::int32_t>& from, std::vector<PathRamp>& ramps) {
    ramps.clear();
    for (std::size_t m = 0; m < width; ++m) {
      if (now[m].moves()) ramps.push_back({&now[m], from[i * width + m]});
    }
  };
  take(accel_, up);
  take(decel_, down);
  merger.merge(up, down, flat_[i], made_of(i), profile);
  for (std::size_t m = 0; m < width; ++m) places[m] = accel_[i * width + m];
  if (i > 0) raise_heads(i, before, now, false, places, delay_before, profile);
  if (delay_before != kRest) {
    for (std::size_t m = 0; m < width; ++m) places[m] = decel_[i * width + m];
    raise_heads(i, before, now, true, places, kRest, profile);
    raise_first(profile, 1, std::max(first_[i], least_behind(before, now, delay_before)));
  }
  if (!rests_at(i + 1)) raise_last(profile, least_before(now, behind, first_[i + 1]));
}

Profile Path::profile(std::size_t i) const {
  Shares before;
  Shares now;
  Shares behind;
  if (i > 0) load(i - 1, before);
  load(i, now);
  if (!rests_at(i + 1)) load(i + 1, behind);
  Profile profile;
  shape(i, before, now, behind, rests_at(i) ? kRest : last_[i - 1], profile);
  return profile;
}

}  // namespace bushd::motion
