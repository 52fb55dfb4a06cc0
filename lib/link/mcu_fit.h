// Whether an MCU can do what is configured for it, and in words why not.
#pragma once

#include <cstdint>
#include <string>

#include "engine/message.h"
#include "link/bus_setup.h"

namespace bushd::link {

// Why the MCU has no room for its tables, or no time for them with its emission; "": it has.
std::string lacks_room(const McuSetup& setup, const bushd_identity& identity,
                       std::uint32_t tick_ns);

// Why the MCU cannot be used as configured; "": it can, as far as that is known without asking.
std::string misfit(const BusSetup& bus, const McuSetup& setup, const bushd_identity& identity);

// What an MCU refused of its configuration, and what can be done about it.
std::string refusal_text(const BusSetup& bus, const McuSetup& setup, const bushd_identity& identity,
                         std::uint8_t type, unsigned status);

}  // namespace bushd::link
