// What the daemon is configured for: one bus with some MCUs, motors spread evenly over their
// outputs, and the shipped tables dealt out among them.
#pragma once

#include <cstdint>

#include "base/result.h"
#include "config/config.h"

namespace bushfaults {

inline constexpr std::uint32_t kTickUs = 2560;

// Refuses what does not fit: more motors than outputs, or than any line can carry.
bushd::Result<bushd::config::Config> make_installation(std::size_t motors, std::size_t mcus,
                                                       bushd_format format);

}  // namespace bushfaults
