#pragma once

#include <cstddef>
#include <string>

namespace bushd::daemon {

// "1 motor", "3 motors"
inline std::string count_text(std::size_t motors) {
  return std::to_string(motors) + (motors == 1 ? " motor" : " motors");
}

}  // namespace bushd::daemon
