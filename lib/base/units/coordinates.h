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
#include <optional>
#include <string>

#include "base/result.h"
#include "base/units/ratio.h"

namespace bushd::units {

struct Scale {
  std::string unit = "steps";
  Ratio steps_per_unit = {};
  bool negative = false;             // user positions fall where steps rise
  double offset = 0;                 // user units
  std::optional<int> decimals = {};  // shown to people; none: as many as tell steps apart
  friend bool operator==(const Scale&, const Scale&) = default;
};

// On the dial, both inclusive.
struct SoftLimits {
  double low = 0;
  double high = 0;
  friend bool operator==(const SoftLimits&, const SoftLimits&) = default;
};

// Steps that are not rounded: the nearest whole number, and what is beyond it, in 2^-32 of a step;
// half a step at most.
struct Steps {
  std::int64_t whole = 0;
  std::int64_t parts = 0;
  friend bool operator==(const Steps&, const Steps&) = default;
};
// A whole number of steps moves `whole` by itself. Precondition: no overflow.
Steps operator+(const Steps& a, const Steps& b);

class Coordinates {
 public:
  // MCUs count positions in 32 bits.
  static constexpr std::int64_t kMaxSteps = INT32_MAX;
  static constexpr int kMostDecimals = 12;
  static constexpr const char* kSteps = "steps";  // is no unit of a configuration

  // A motor without a unit: all positions are steps.
  Coordinates() = default;
  // Error: an offset so large that doubles do not tell the steps apart any more.
  static Result<Coordinates> make(Scale scale);

  const Scale& scale() const { return scale_; }
  const std::string& unit() const { return scale_.unit; }
  // A motor without a unit has none but steps.
  bool has_unit() const { return scale_.unit != kSteps; }
  // Decimals that people are shown; without a wish those that tell steps apart, and one more. 0..12
  int precision() const;
  // "12.345 mm", "-7 steps": the user position.
  std::string text(std::int64_t steps) const;

  double dial_of(std::int64_t steps) const;
  double user_of(std::int64_t steps) const;

  // The nearest step, ties away from 0. Errors: not finite, beyond +-kMaxSteps.
  Result<std::int64_t> steps_of_dial(double dial) const;
  Result<std::int64_t> steps_of_user(double user) const;
  // Not rounded to a step.
  Result<Steps> unrounded_of_user(double user) const;
  Result<Steps> unrounded_of_distance(double user_units) const;
  double user_of(const Steps& steps) const;
  // In 2^-32 of a step, the nearest.
  Result<std::int64_t> parts_of_user(double user) const;
  // The steps of a distance on the user's scale, with its sign.
  Result<std::int64_t> steps_of_distance(double user_units) const;

  // The delay of a step at this speed, in time units rounded up: never faster.
  //   user_units_per_s  above 0
  //   unit_ns  of time, >= 1
  // Errors: not a number above 0; slower than a step an hour, with the slowest speed.
  Result<std::uint64_t> delay_at(double user_units_per_s, std::uint32_t unit_ns) const;

  // The first step at or above this dial position, the last at or below it: limits are never
  // rounded outwards. Clamped to +-kMaxSteps. Precondition: finite.
  std::int64_t first_step_from(double dial) const;
  std::int64_t last_step_to(double dial) const;

  // On the user's scale, low below high.
  SoftLimits on_user_scale(const SoftLimits& dial) const;

  // With the offset for which these steps are this user position.
  Result<Coordinates> with_user(double user, std::int64_t steps) const;

 private:
  Scale scale_{};
};

}  // namespace bushd::units
