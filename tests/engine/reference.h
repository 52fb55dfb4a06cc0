// The slow reference: positions straight from the definition, step by step, in exact rational
// numbers.
//
//   delay before step j of N = max(A(j-1), D(N-j), c);  step j falls at the sum of the first j
//   delays; position at time t = steps whose time is <= t, in the fine format plus the elapsed
//   share of the running delay, rounded down to 1/256 step. The run's shortest delay is one more
//   term of the maximum.
//
// Shares no code with lib/engine: sides are plain vectors, times are 128-bit counts of 1/256 ns.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace bushd::test {

__extension__ typedef __int128 Wide;

struct Law {
  std::vector<uint16_t> accel;  // from slow to fast
  std::vector<uint16_t> decel;  // from slow to fast, that is: by steps before the end
  uint16_t cruise = 1;
  uint32_t unit_ns = 1;

  Wide accel_at(size_t i) const { return i < accel.size() ? accel[i] : cruise; }
  Wide decel_at(size_t i) const { return i < decel.size() ? decel[i] : cruise; }
};

// A step's delay and when it ends, both in 1/256 ns (so that 256ths of a step stay whole numbers).
struct Step {
  Wide delay;
  Wide end;
};

class Reference {
 public:
  static Reference move(const Law& law, size_t steps, uint64_t shortest_delay = 0) {
    Reference r(law);
    for (size_t j = 1; j <= steps; ++j) {
      Wide delay = std::max<Wide>(law.cruise, shortest_delay);
      if (law.accel_at(j - 1) > delay) delay = law.accel_at(j - 1);
      if (law.decel_at(steps - j) > delay) delay = law.decel_at(steps - j);
      r.append(delay);
    }
    return r;
  }

  // Taken up in the middle of a step of `delay` units of which fraction/256 is over, to whole ns.
  static Reference ramp_down(const Law& law, uint64_t delay, uint8_t fraction) {
    Reference r(law);
    const Wide over_ns = (Wide{delay} * law.unit_ns * fraction + 255) / 256;
    r.append(delay);
    r.steps_.back().end -= over_ns * 256;
    r.origin_ = -over_ns * 256;
    if (r.waits_too_long(0, 0)) {
      r.steps_.clear();
    } else {
      r.append_ramp_down(delay);
    }
    return r;
  }

  // All of it `ns` later.
  void begin_late(uint64_t ns) {
    origin_ += Wide{ns} * 256;
    for (Step& step : steps_) step.end += Wide{ns} * 256;
  }

  // From `ns` on: the running step, then the fewest steps k with D(k) <= its delay. Rest begins
  // before a step that is more than half a second away; the run of a line completes the running
  // one.
  void ramp_down_at(uint64_t ns, bool of_a_line = false) {
    const size_t made = steps_at(ns);
    if (made == steps_.size()) return;
    if (!of_a_line && waits_too_long(made, ns)) {
      begun_ = steps_[made];
      rest_ns_ = ns;
      return steps_.resize(made);
    }
    steps_.resize(made + 1);
    append_ramp_down(steps_.back().delay / (Wide{law_.unit_ns} * 256));
  }

  // A ramp-down that is under way at `ns` leaves out what it would wait for, but the running step.
  void leave_out_slow(uint64_t ns) {
    size_t end = steps_at(ns) + 1;
    while (end < steps_.size() && steps_[end].delay <= kHalfASecond) ++end;
    if (end < steps_.size()) steps_.resize(end);
  }

  // From `ns` on: the running step, then `after` more, the accelerating side taken up where its
  // delay stands. Returns false if it cannot come to rest within so few steps, or is at rest.
  // The shortest delay is approached along the decelerating side.
  bool retarget_at(uint64_t ns, size_t after, uint64_t shortest_delay = 0) {
    const size_t made = steps_at(ns);
    if (made == steps_.size()) return false;
    const Wide delay = steps_[made].delay / (Wide{law_.unit_ns} * 256);
    size_t k = 0;
    while (law_.decel_at(k) > delay) ++k;
    if (k > after) return false;
    steps_.resize(made + 1);
    size_t a = 0;
    while (law_.accel_at(a) > delay) ++a;
    if (law_.accel_at(a) == delay) ++a;
    for (size_t j = 1; j <= after; ++j) {
      const Wide least =
          j <= k ? std::min(Wide{shortest_delay}, law_.decel_at(k - j)) : Wide{shortest_delay};
      append(
          std::max({law_.accel_at(a + j - 1), law_.decel_at(after - j), Wide{law_.cruise}, least}));
    }
    return true;
  }

  size_t steps() const { return steps_.size(); }
  const Step& step(size_t i) const { return steps_[i]; }

  size_t steps_at(uint64_t ns) const {
    size_t made = 0;
    while (made < steps_.size() && steps_[made].end <= Wide{ns} * 256) ++made;
    return made;
  }

  // When it has come to rest in the middle of a step, whatever it has begun of it.
  std::optional<uint64_t> rest_ns() const {
    return begun_ ? std::optional<uint64_t>(rest_ns_) : std::nullopt;
  }

  // In 1/256 step. What was begun of a step that is not made is gone as soon as it rests.
  int64_t position_at(uint64_t ns) const {
    const size_t made = steps_at(ns);
    int64_t position = static_cast<int64_t>(made) * 256;
    const bool begun = begun_ && ns <= rest_ns_;
    if (made < steps_.size() || begun) {
      const Wide begin = made == 0 ? origin_ : steps_[made - 1].end;
      const Wide delay = made < steps_.size() ? steps_[made].delay : begun_->delay;
      position += static_cast<int64_t>((Wide{ns} * 256 - begin) * 256 / delay);
    }
    return position;
  }

  uint64_t units_left_at(uint64_t ns) const {
    if (steps_.empty() || steps_.back().end <= Wide{ns} * 256) return 0;
    const Wide unit = Wide{law_.unit_ns} * 256;
    return static_cast<uint64_t>((steps_.back().end - Wide{ns} * 256 + unit - 1) / unit);
  }

  // The delay of the step that runs at `ns`, in units; 0 when all are made.
  uint64_t long_delay_at(uint64_t ns) const {
    const size_t made = steps_at(ns);
    if (made == steps_.size() && (!begun_ || ns >= rest_ns_)) return 0;
    const Wide delay = made < steps_.size() ? steps_[made].delay : begun_->delay;
    return static_cast<uint64_t>(delay / (Wide{law_.unit_ns} * 256));
  }
  // A delay that is a code.
  uint16_t delay_at(uint64_t ns) const { return static_cast<uint16_t>(long_delay_at(ns)); }

 private:
  explicit Reference(const Law& law) : law_(law) {}

  void append(Wide units) {
    const Wide delay = units * law_.unit_ns * 256;
    steps_.push_back({delay, (steps_.empty() ? Wide{0} : steps_.back().end) + delay});
  }
  static constexpr Wide kHalfASecond = Wide{500'000'000} * 256;
  bool waits_too_long(size_t step, uint64_t ns) const {
    return steps_[step].end - Wide{ns} * 256 > kHalfASecond;
  }
  void append_ramp_down(Wide delay) {
    size_t k = 0;
    while (k < law_.decel.size() && law_.decel_at(k) > delay) ++k;
    while (k-- > 0) {
      if (law_.decel_at(k) * law_.unit_ns * 256 > kHalfASecond) return;
      append(law_.decel_at(k));
    }
  }

  Law law_;
  std::vector<Step> steps_;
  Wide origin_ = 0;
  std::optional<Step> begun_;  // and not made
  uint64_t rest_ns_ = 0;
};

}  // namespace bushd::test
