// Who is meant on the line.
#pragma once

#include <compare>
#include <cstdint>

namespace bushd::fieldbus {

// Of an MCU, as configured and as frames carry it; not its place in a list, so a type of its own.
struct McuAddress {
  std::uint8_t value = 0;  // 1..255
  auto operator<=>(const McuAddress&) const = default;
};

}  // namespace bushd::fieldbus
