// One segment of a path, by the steps of its longest motor: what the motors' tables ask of the
// delays between them. A motor with N of its L steps, r = N / L, that is at place i of a side of
// its table where the ramp begins, asks for r A(i + floor(r k)) after k steps of the run, rounded
// up. All delays here are in one time unit, that of the path, and have 32 bits.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "engine/table.h"

namespace bushd::motion {

// So many steps of a run, one like the other.
struct Delays {
  std::uint32_t steps;
  std::uint32_t delay;
  friend bool operator==(const Delays&, const Delays&) = default;
};
using Profile = std::vector<Delays>;

inline constexpr std::uint32_t kRest = UINT32_MAX;  // in place of a delay

// Most numbers are small, and their division takes half the time.
inline std::uint64_t quotient(std::uint64_t dividend, std::uint64_t divisor) {
  if ((dividend | divisor) >> 32 != 0) return dividend / divisor;
  return static_cast<std::uint32_t>(dividend) / static_cast<std::uint32_t>(divisor);
}

// A motor's part of a segment. Without steps it asks for nothing.
struct PathShare {
  const bushd_table* table = nullptr;
  std::uint32_t steps = 0;    // N
  std::uint32_t longest = 0;  // L
  int direction = 0;          // +1, -1; 0: it stands
  // A delay of its own is `numerator` / `denominator` of it to the run, rounded up.
  std::uint64_t numerator = 0;
  std::uint64_t denominator = 1;

  double ratio = 0;  // r

  bool moves() const { return steps != 0; }
  // A delay of its own as one of the run, which is kRest - 1 at most.
  std::uint32_t scaled(bushd_delay own) const {
    if (!bushd_delay_is_code(own)) return scaled_widely(own);
    if (numerator == denominator) return static_cast<std::uint32_t>(own);
    if (numerator >> 47 != 0) return scaled_widely(own);
    return static_cast<std::uint32_t>(quotient(own * numerator + denominator - 1, denominator));
  }
  std::uint32_t scaled_widely(bushd_delay own) const;  // where 64 bits may be too few
  std::uint16_t code(bool decel, std::int64_t index) const {
    const bushd_ramp& ramp = decel ? table->decel : table->accel;
    if (index >= ramp.count) return table->cruise;
    return std::max(ramp.code[std::max<std::int64_t>(index, 0)], table->cruise);
  }
  // What it asks for at an index of its table; one below 0 counts as 0.
  std::uint32_t at(bool decel, std::int64_t index) const { return scaled(code(decel, index)); }
  // First index of a side that asks for at most this delay.
  std::int64_t first_at_most(bool decel, std::uint32_t delay) const;
  // Its place on a side next to a step of this delay: the first that asks for at most as much, or
  // the next one if it asks for just that. `reached`: where its own ramp would go on, if it is that
  // which gives the delay, else -1; of equal codes those behind are not made again.
  std::int64_t place(bool decel, std::uint32_t delay, std::int64_t reached) const;
};

// Over the end of a segment, in its direction.
inline bool goes_on(const PathShare& before, const PathShare& behind) {
  return before.moves() && behind.moves() && before.direction == behind.direction;
}

// One motor's ramp: where it is on its side next to the border of the segment.
struct PathRamp {
  const PathShare* share;
  std::int64_t place;
};

// The delays of `steps` steps: the greatest of `flat`, of ramps up from the first step on, and of
// ramps down to the last one, counted from there. O(codes of the greater side).
class RampMerger {
 public:
  void merge(std::span<const PathRamp> up, std::span<const PathRamp> down, std::uint32_t flat,
             std::uint32_t steps, Profile& merged);

 private:
  // Motors' ramps in one direction, of which the slowest one counts.
  class Slowest {
   public:
    void start(std::span<const PathRamp> ramps, bool decel, std::uint32_t flat);
    std::uint32_t delay() const { return leader_ == order_.size() ? 0 : order_[leader_].delay; }
    // Precondition: delay() is not 0.
    std::uint64_t until() const { return leader().next; }
    void go_to(std::uint64_t step);

    // The codes that come one by one as long as they are above `others`, if the slowest motor makes
    // every step of the run in the run's units; it is to be told how far that was.
    struct Codes {
      const std::uint16_t* at = nullptr;
      const std::uint16_t* end = nullptr;
      std::uint32_t now() const { return at == end ? 0 : *at; }
    };
    bool has_codes() const;
    Codes codes(std::uint64_t step) const;
    std::uint32_t others() const {
      return leader_ + 1 < order_.size() ? order_[leader_ + 1].delay : 0;
    }
    void leave_codes(std::uint64_t step);

   private:
    struct Climb {
      PathRamp ramp;
      std::uint64_t made;  // of the motor's own, from there
      std::uint64_t next;  // step of the run from which on the delay is another one
    };
    struct Place {
      std::uint32_t delay;
      std::uint32_t climb;
    };
    const Climb& leader() const { return climbs_[order_[leader_].climb]; }

    bool decel_ = false;
    std::uint32_t flat_ = 0;
    std::vector<Climb> climbs_;
    // From the leader on, the slowest first; those before it count no more. Delays of all but the
    // leader may be those of an earlier step. As no side rises they are not too short.
    std::vector<Place> order_;
    std::size_t leader_ = 0;
  };

  void merge_codes(Profile& merged);

  Slowest up_;
  Slowest down_;
  std::uint64_t from_first_ = 0;
  std::uint64_t from_last_ = 0;
  std::uint64_t left_ = 0;
  std::uint32_t flat_ = 0;
  Profile back_;
};

// Makes the first, or the last, of a profile's steps at least so long.
void raise_first(Profile& profile, std::uint32_t steps, std::uint32_t least);
void raise_last(Profile& profile, std::uint32_t least);
// The greater one at each step. Of equal length.
Profile greater_of(const Profile& one, const Profile& other);
// Without its first steps, and no longer than `steps` then.
Profile part_of(const Profile& profile, std::uint32_t first, std::uint32_t steps);
std::uint64_t units_of(const Profile& profile);

}  // namespace bushd::motion
