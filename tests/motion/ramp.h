// A table whose sides differ in length and shape, and the tick that the tests of the axis use.
#pragma once

#include <cstdint>

#include "engine/tables.h"

namespace bushd::test {

inline constexpr std::uint32_t kTickNs = 2'560'000;

inline Law ramp() {
  Law law;
  for (int i = 0; i < 24; ++i) law.accel.push_back(static_cast<std::uint16_t>(250 - 10 * i));
  for (int i = 0; i < 11; ++i) law.decel.push_back(static_cast<std::uint16_t>(180 - 16 * i));
  law.cruise = 20;
  law.unit_ns = 40'000;
  return law;
}

}  // namespace bushd::test
