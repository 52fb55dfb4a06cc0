// Whether an MCU can do what is configured for it, and in words why not.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "base/result.h"
#include "bus/rs485/bus_setup.h"
#include "engine/message.h"

namespace bushd::link {

// In the memory of an MCU: a side that is both is there once.
std::size_t codes_of(const bushd_table& table);

// The MCU has room for its tables, and time for them with its emission; or why not.
Result<void> check_room(const McuSetup& setup, const bushd_identity& identity,
                        std::uint32_t tick_ns);

// The MCU can be used as configured, as far as that is known without asking; or why not.
Result<void> check_fit(const BusSetup& bus, const McuSetup& setup, const bushd_identity& identity);

// What an MCU refused of its configuration, and what can be done about it.
std::string refusal_text(const BusSetup& bus, const McuSetup& setup, const bushd_identity& identity,
                         std::uint8_t type, unsigned status);

}  // namespace bushd::link
