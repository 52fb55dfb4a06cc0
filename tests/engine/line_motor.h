// A motor on a line: few steps, where all borders are near, and as many as there may be.
#pragma once

#include <algorithm>
#include <cstdint>
#include <vector>

#include "engine/properties.h"

namespace bushd::test {

constexpr uint32_t kLongest = 2147483647;

struct LineMotor {
  uint32_t increment;
  uint32_t longest;
};

// With at least so many steps, 0 or 1.
inline LineMotor any_line_motor(uint32_t least) {
  const auto longest =
      between<uint32_t>(1, *rc::gen::element<uint32_t>(1, 2, 5, 40, 1000, 1'000'000, kLongest));
  switch (between(0, 3)) {
    case 0:
      return {*rc::gen::elementOf(
                  std::vector<uint32_t>{least, 1, longest, std::max(least, longest - 1)}),
              longest};
    case 1:
      return {between<uint32_t>(least, std::min<uint32_t>(longest, 7)), longest};
    default:
      return {between<uint32_t>(least, longest), longest};
  }
}

}  // namespace bushd::test
