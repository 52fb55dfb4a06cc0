// Time on a bus, as its master counts it.
#pragma once

#include <cstdint>

namespace bushd::link {

using Tick = std::int64_t;  // absolute, unwrapped from the 32 bits on the bus

// An MCU in tick `now` can change its next tick but one; an earlier one has been begun, or is being
// prepared.
constexpr Tick first_changeable(Tick now) {
  return now + 2;
}
constexpr bool too_late(Tick at, Tick now) {
  return at < first_changeable(now);
}

}  // namespace bushd::link
