// How much longer than its plan a ramp of an MCU's own may be.
#pragma once

#include <cstdint>

#include "engine/message_base.h"
#include "engine/table.h"

namespace bushfaults {

// In steps. Of a streamed motion an MCU knows its displacement in each tick; from that it takes the
// delay of the running step (docs/protocol.md, EMERGENCY): in the fine format from the last tick,
// in the coarse one from the steps of the two ticks before and of the two after. On a ramp-down
// steps become slower, so that it may take the motor to be faster than it is.
std::int64_t own_ramp_excess(const bushd_table& table, std::int64_t tick_ns, bushd_format format);

}  // namespace bushfaults
