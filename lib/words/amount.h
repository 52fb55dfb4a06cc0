// How far, and how fast: what people and programs ask of a motor.
#pragma once

#include <cstdint>
#include <variant>

namespace bushd::words {

// In the motor's unit, on the user's scale (base/units/coordinates.h). Of a motor without a unit:
// steps.
struct UserUnits {
  double value = 0;
  friend bool operator==(const UserUnits&, const UserUnits&) = default;
};
// A position or a distance, in steps or in the motor's unit: the nearest step counts. Within
// +-(2^31 - 1) steps.
using Amount = std::variant<std::int64_t, UserUnits>;

// A speed not to be exceeded, per second, above 0: in each motor's unit, or in steps.
struct Speed {
  double per_s = 0;
  bool in_steps = false;
  friend bool operator==(const Speed&, const Speed&) = default;
};

}  // namespace bushd::words
