// Private to lib/config: what only shows when all sections are known.
#pragma once

#include <cstdint>
#include <span>

#include "base/result.h"
#include "config/sections.h"

namespace bushd::config {

// The fixed rates that libserial can set, rising.
std::span<const std::uint32_t> baud_rates();

// Every bus has an MCU, every table is slow enough for its bus's tick, fits its MCU's table banks,
// and no line is asked for more than it can carry.
Result<void> check_together(const Loading& loading);

}  // namespace bushd::config
