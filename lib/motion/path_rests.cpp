// Runs that end at rest within a path. As no delay of the path is undercut, its corners stay what
// they are; what comes on top are ramps to the rest, by the same rule.
#include <algorithm>
#include <utility>

#include "motion/path.h"

namespace bushd::motion {
namespace {

// Steps of a motor in so many steps of the run, but for parts of steps.
std::int64_t own_steps(const PathShare& share, std::uint32_t steps) {
  return static_cast<std::int64_t>(std::uint64_t{share.steps} * steps / share.longest);
}

}  // namespace

std::vector<PathRamp> Path::ramps_of(const Shares& now, const Places& places) const {
  std::vector<PathRamp> ramps;
  for (std::size_t m = 0; m < now.size(); ++m) {
    if (now[m].moves()) ramps.push_back({&now[m], places[m]});
  }
  return ramps;
}

// `border`, of the beginning of the segment behind `now`, becomes that of the end of `now`.
void Path::enter(const Shares& now, const Shares& behind, Border& border) const {
  const bool ends = border.delay == kRest;
  for (std::size_t m = 0; m < now.size(); ++m) {
    if (ends || !goes_on(now[m], behind[m])) border.travel[m] = 0;
    if (ends || !now[m].moves()) continue;
    border.delay = std::max(border.delay, now[m].at(true, std::int64_t{border.travel[m]} - 1));
  }
  for (std::size_t m = 0; m < now.size(); ++m) {
    border.places[m] = decel_place(now[m], ends ? now[m] : behind[m], border.delay,
                                   border.places[m], border.travel[m]);
  }
}

Path::Parts Path::parts_to(std::uint32_t step) const {
  Parts parts;
  std::size_t i = segment_at(step - 1);
  Shares before;
  Shares now;
  Shares behind;
  load(i, now);
  const std::size_t width = now.size();
  Border border{kRest, Places(width, 0), std::vector<std::uint32_t>(width, 0)};
  std::uint32_t steps = step - first_of(i);
  while (true) {
    const bool ends = border.delay == kRest;
    enter(now, behind, border);
    if (!ends) raise_first(parts.at(i + 1), 1, border.delay);
    Profile ramp;
    RampMerger merger;
    merger.merge({}, ramps_of(now, border.places), flat(i, now), steps, ramp);
    Profile part = greater_of(part_of(profile(i), 0, steps), ramp);
    if (!ends) raise_last(part, least_before(now, behind, border.delay));
    if (rests_at(i)) {
      parts.emplace(i, std::move(part));
      return parts;
    }
    load(i - 1, before);
    Places at_first = border.places;  // as if from the end of the segment
    for (std::size_t m = 0; m < width; ++m) {
      const std::int64_t own = own_steps(now[m], steps);
      at_first[m] += own - now[m].steps;
      border.travel[m] += static_cast<std::uint32_t>(own);
    }
    raise_heads(i, before, now, true, at_first, kRest, part);
    border.delay = part.front().delay;
    border.places = at_first;
    bool merged = !ends && border.delay == first_[i];
    for (std::size_t m = 0; m < width; ++m) {
      if (!now[m].moves()) continue;
      // Nor will its steps to go say more than the path's.
      merged = merged && border.places[m] >= decel_[i * width + m] &&
               border.travel[m] > now[m].table->decel.count;
    }
    parts.emplace(i, std::move(part));
    if (merged) return parts;
    --i;
    steps = made_of(i);
    std::swap(behind, now);
    std::swap(now, before);
  }
}

// What ramps down ask of the step that has so many behind it in its segment.
std::uint32_t Path::down_at(const Shares& now, const Places& places, std::uint32_t steps) const {
  std::uint32_t delay = 1;
  for (std::size_t m = 0; m < now.size(); ++m) {
    if (!now[m].moves()) continue;
    delay = std::max(delay, now[m].at(true, places[m] + own_steps(now[m], steps)));
  }
  return delay;
}

// Whether what is made of a segment is as slow as this asks for.
bool Path::allows(const Profile& made, std::uint32_t steps, const Shares& now, const Places& places,
                  std::uint32_t at_last, const std::vector<Head>& heads) const {
  std::uint32_t done = 0;
  for (const Delays& part : made) {
    for (const Head& held : heads) {
      if (done < held.steps && held.delay > part.delay) return false;
    }
    done += part.steps;
    if (down_at(now, places, steps - done) > part.delay) return false;
    if (done == steps && at_last > part.delay) return false;
  }
  return true;
}

// Whether a run that is to rest at the step `end` asks nowhere for more than what was made.
bool Path::can_rest(std::uint32_t end, std::size_t running, const MadeOf& made) const {
  std::size_t i = segment_at(end - 1);
  Shares before;
  Shares now;
  Shares behind;
  load(i, now);
  const std::size_t width = now.size();
  Border border{kRest, Places(width, 0), std::vector<std::uint32_t>(width, 0)};
  std::uint32_t steps = end - first_of(i);
  std::vector<Head> heads;
  while (true) {
    const bool ends = border.delay == kRest;
    enter(now, behind, border);
    if (!ends && i < running && border.delay > made(i + 1).front().delay) return false;
    const std::uint32_t at_last = ends ? 1 : least_before(now, behind, border.delay);
    if (i > 0) load(i - 1, before);
    heads.clear();
    std::uint32_t delay = std::max(first_[i], down_at(now, border.places, steps - 1));
    if (steps == 1) delay = std::max(delay, at_last);
    bool over = true;  // with the ramps
    for (std::size_t m = 0; m < width; ++m) {
      if (!now[m].moves()) continue;
      const std::int64_t own = own_steps(now[m], steps);
      const std::uint16_t code = now[m].code(true, border.places[m] + own - 1);
      if (!rests_at(i)) heads.push_back(head(i, m, before[m], now[m], code));
      if (!rests_at(i)) delay = std::max(delay, heads.back().delay);
      border.travel[m] += static_cast<std::uint32_t>(own);
      over = over && std::min<std::int64_t>(border.places[m] + own, border.travel[m]) >
                         now[m].table->decel.count;
    }
    if (i <= running && !allows(made(i), steps, now, border.places, at_last, heads)) return false;
    if (i == 0 || rests_at(i) || (over && i < running)) return true;
    for (std::size_t m = 0; m < width; ++m) {
      border.places[m] += own_steps(now[m], steps) - now[m].steps;
    }
    border.delay = delay;
    --i;
    steps = made_of(i);
    std::swap(behind, now);
    std::swap(now, before);
  }
}

std::uint32_t Path::nearest_rest(std::uint32_t running, const MadeOf& made) const {
  const std::size_t segment = segment_at(running);
  const auto whole = static_cast<std::uint32_t>(steps());
  std::uint32_t near = running;
  std::uint32_t far = 1;
  while (far < whole - near && !can_rest(near + far, segment, made)) {
    near += far;
    far *= 2;
  }
  std::uint32_t end = whole - near < far ? whole : near + far;
  while (end - near > 1) {
    const std::uint32_t middle = near + (end - near) / 2;
    (can_rest(middle, segment, made) ? end : near) = middle;
  }
  return end;
}

}  // namespace bushd::motion
