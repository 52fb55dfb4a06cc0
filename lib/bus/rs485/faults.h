// Faults of MCUs, by who is to clear them.
#pragma once

#include <cstdint>

#include "engine/message.h"

namespace bushd::link {

// Latched until somebody says so: neither a lost link nor a new master clears them.
constexpr std::uint8_t kPeoplesFaults = BUSHD_FAULT_EMERGENCY | BUSHD_FAULT_EMERGENCY_INPUT |
                                        BUSHD_FAULT_OVERCURRENT | BUSHD_FAULT_EEPROM |
                                        BUSHD_FAULT_DISABLED;

}  // namespace bushd::link
