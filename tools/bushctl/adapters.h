// Serial adapters that are plugged in.
#pragma once

#include <string>
#include <vector>

namespace bushctl {

// One name each, one that stays where there is one: of /dev/serial/by-id, else /dev/bushd, else the
// kernel's (ttyUSB0, ttyACM0, ttyAMA0). Sorted. Built-in ports (ttyS0) are left out: most PCs have
// them without a connector.
std::vector<std::string> serial_adapters();

}  // namespace bushctl
