// A motor's steps and its positions in a unit that people use, such as mm:
//
//     dial = steps / steps_per_unit
//     user = dial + offset, or offset - dial where the direction is negative
//
// Steps count, in exact integers. User and dial positions are for people: what one asks for is
// taken as the decimal text that it is, digit for digit, and rounded to the nearest step; what one
// sees is the nearest double. Asking for a position as it is shown means the step that it was
// shown for.
#pragma once

#include <cstdint>
#include <string>

#include "base/result.h"
#include "units/ratio.h"

namespace bushd::units {

struct Scale {
  std::string unit = "steps";
  Ratio steps_per_unit = {};
  bool negative = false;  // user positions fall where steps rise
  double offset = 0;      // user units
  friend bool operator==(const Scale&, const Scale&) = default;
};

class Coordinates {
 public:
  // MCUs count positions in 32 bits.
  static constexpr std::int64_t kMaxSteps = INT32_MAX;

  // Of a motor without a unit: all positions are steps.
  Coordinates() = default;
  // Error: an offset so large that doubles do not tell the steps apart any more.
  static Result<Coordinates> make(Scale scale);

  const Scale& scale() const { return scale_; }
  const std::string& unit() const { return scale_.unit; }
  // Decimals that tell steps apart, and one more; 0..12.
  int precision() const;

  double dial_of(std::int64_t steps) const;
  double user_of(std::int64_t steps) const;

  // The nearest step, ties away from 0. Errors: not finite, beyond +-kMaxSteps.
  Result<std::int64_t> steps_of_dial(double dial) const;
  Result<std::int64_t> steps_of_user(double user) const;
  // Of a distance on the user's scale, with its sign.
  Result<std::int64_t> steps_of_distance(double user_units) const;

  // The first step at or above this dial position, the last at or below it: limits are never
  // rounded outwards. Clamped to +-kMaxSteps. Precondition: finite.
  std::int64_t first_step_from(double dial) const;
  std::int64_t last_step_to(double dial) const;

  // With the offset for which these steps are this user position.
  Result<Coordinates> with_user(double user, std::int64_t steps) const;

 private:
  Scale scale_{};
};

}  // namespace bushd::units
