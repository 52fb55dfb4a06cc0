// Virtual time, as the simulation has it.
#pragma once

#include "sim/edge.h"

namespace bushfaults {

inline constexpr bushd::sim::TimeNs kMs = 1'000'000;
inline constexpr bushd::sim::TimeNs kSecond = 1'000 * kMs;
inline constexpr bushd::sim::TimeNs kHour = 3600 * kSecond;

}  // namespace bushfaults
