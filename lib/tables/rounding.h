// Rounding of delays to codes: never faster than asked.
#pragma once

#include <cmath>
#include <limits>

namespace bushd::tables {

// The least whole number of time units that is not below `units`, the result of a few operations
// on numbers given: only what these few roundings of a double may have added does not count. A
// fixed share of a unit would let delays through that are faster than asked.
inline double rounded_up_units(double units) {
  return std::ceil(units * (1 - 4 * std::numeric_limits<double>::epsilon()));
}

}  // namespace bushd::tables
