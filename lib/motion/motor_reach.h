// What a motor may do now, as far as it depends on the motor alone: where to, how fast, and by
// which legs. A motor that moves may be given another target, and nothing else.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "base/result.h"
#include "base/units/coordinates.h"
#include "engine/table.h"
#include "words/amount.h"

namespace bushd::motion {

class Motor;

// A motion is made of these, with a rest between any two.
struct Leg {
  std::int64_t target;
  bushd_delay shortest_delay;  // of Axis
};

// To be asked at once: the motor outlives it, and what it says is true until that is told more.
class MotorReach {
 public:
  explicit MotorReach(const Motor& motor) : motor_(motor) {}

  Result<void> may_be_used() const;  // for any motion
  // Beyond that.
  Result<void> may_move_to(std::int64_t target, bushd_delay shortest_delay = 0) const;
  // Whether it may be moved by its MCU alone, as much as so many steps to either side.
  Result<void> may_be_moved_within(std::int64_t steps) const;
  // What a distance is counted from: where it stands, or has been told to go, as it was asked for,
  // not rounded to a step; or, if it is being stopped, where it will stand. Error: nobody has said
  // where, or the motion there is paused.
  Result<units::Steps> distance_from() const;
  // How far it may go from here in a direction: to its soft limit, as far as positions are counted,
  // or for as long as a run may take. Where it stands, if that is not in this direction.
  std::int64_t farthest(int direction, bushd_delay shortest_delay) const;
  // The legs of a move there, in place of what it does now. Errors: one of them may not be made.
  Result<std::vector<Leg>> legs_to(std::int64_t target, bushd_delay shortest_delay) const;
  // Error: how far it is from where it may be.
  Result<void> stands_within_soft_limits() const;
  // As MotorScale says, in units of its table.
  Result<bushd_delay> shortest_delay_at(const std::optional<words::Speed>& speed) const;

 private:
  bool forbidden(int direction) const;
  Result<std::int64_t> rounded_distance_from() const;

  const Motor& motor_;
};

}  // namespace bushd::motion
