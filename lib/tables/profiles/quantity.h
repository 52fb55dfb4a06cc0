// Numbers with units, as people write them: "2.5kHz", "40us", "5000steps/s2", "38 g cm2".
// A number without a unit has the first unit listed; torques and inertias have no usual unit, so
// they need one. Refused: anything else, NaN and infinity.
#pragma once

#include <string>
#include <string_view>

#include "base/result.h"

namespace bushd::tables::profiles {

enum class Quantity {
  kSpeed,         // steps/s, Hz, kHz
  kAcceleration,  // steps/s2, Hz/s, kHz/s
  kJerk,          // steps/s3, Hz/s2, kHz/s2
  kTime,          // s, ms, us, ns
  kTimeUnit,      // ns, us, ms, s; the result is in ns
  kTorque,        // Nm, Ncm, mNm
  kInertia,       // kg m2, g cm2, kg cm2
};

// "kg m2, g cm2, kg cm2"
std::string units_text(Quantity quantity);

// In the quantity's SI unit (steps/s, s, Nm, kg m^2) but for kTimeUnit.
Result<double> parse_quantity(Quantity quantity, std::string_view text);

}  // namespace bushd::tables::profiles
