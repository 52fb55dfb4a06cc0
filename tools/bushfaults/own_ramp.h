// How much longer than its plan a ramp of an MCU's own may be.
#pragma once

#include <cstdint>

#include "engine/table.h"

namespace bushfaults {

// In steps, in the coarse format. There an MCU knows of a streamed motion only how many steps each
// tick has: it takes the delay of the running step to be 4 tick / (s + 1), with s the steps of the
// two ticks before and of the two after (docs/protocol.md, EMERGENCY_STOP). On a ramp-down the
// steps behind come faster than those ahead, so that it may take the motor to be faster than it is.
std::int64_t own_ramp_excess(const bushd_table& table, std::int64_t tick_ns);

}  // namespace bushfaults
