// Which virtual bus a configuration asks for.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/result.h"

namespace bushsim {

struct Setup {
  std::string bus;
  std::uint32_t baud = 0;
  std::vector<std::uint8_t> addresses;  // at least one
};

// `bus` may be empty if the configuration has one bus only.
bushd::Result<Setup> load_setup(const std::string& config_path, const std::string& bus);

}  // namespace bushsim
