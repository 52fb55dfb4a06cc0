// The continuous profiles as motions, and fitting them to an acceleration, a time or a number of
// codes.
#pragma once

#include "tables/profiles/make.h"

namespace bushd::tables::profiles {

// Precondition: the profile is a continuous one and from_hz < spec.max_hz.
Result<Motion> continuous(const Spec& spec, const SideSpec& side_spec, Side side, double from_hz);

}  // namespace bushd::tables::profiles
