// A configuration to begin with, from what was found on the lines.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "raw_bus_report.h"

namespace bushctl {

struct FoundBus {
  std::string port;
  std::uint32_t baud = 0;
  std::vector<Found> mcus;
};

// Commented bushd.toml for `path`. MCUs that cannot be named there, as they share an address or
// speak another version of the protocol, are in it as comments. Precondition: one of all MCUs can.
std::string configuration_text(const std::vector<FoundBus>& buses, std::uint32_t tick_us,
                               const std::string& path);

// Whether configuration_text() names an MCU of it.
bool has_usable_mcu(const FoundBus& bus);

// For people: what is there, and what somebody has to do about it.
std::vector<std::string> found_lines(const FoundBus& bus);

// What to do where no MCU was found. `ports`: those that were asked.
std::vector<std::string> nothing_found_lines(const std::vector<std::string>& ports);

}  // namespace bushctl
