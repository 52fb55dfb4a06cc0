// Masks that have a bit for each output of an MCU.
#pragma once

#include <cstdint>

#include "base/ids.h"

namespace bushd {

constexpr std::uint16_t bit_of(Output output) {
  return static_cast<std::uint16_t>(1u << output.value);
}

constexpr bool has_bit(unsigned mask, Output output) {
  return (mask & bit_of(output)) != 0;
}

}  // namespace bushd
